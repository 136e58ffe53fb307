//! Simulated pairs of image and prompt: endless in memory, or as a folder on disk.
//!
//! A [`Recipe`] says which scenes there are. A [`Source`] is a function of a position: [`Simulated`] makes pair number
//! `index` of a recipe and a seed, always the same one, whatever was made before and on however many threads;
//! [`Sampled`] has the wake model draw it, [`Folder`] and [`Epochs`] read it, [`Mixture`] takes several in turn. A
//! [`Loader`] makes batches on other threads while a model trains:
//!
//! ```
//! use burn::tensor::Device;
//! use wake_ldm::dataset::{Loader, Recipe, Simulated};
//!
//! let recipe = Recipe::default().with_assignments(&["scene.grid.rows = 32", "scene.grid.columns = 32"])?;
//! let source = Simulated::new(recipe, 7)?;
//! let mut batches = Loader::new(source).batch(2).threads(2).on(&Device::default())?;
//! let batch = batches.next().expect("there is always a next one")?;
//! assert_eq!(batch.images.dims(), [2, 1, 32, 32]);
//! println!("{:?}, {:?}", batch.scenes[0].ships, batch.objects[0]);
//! # Ok::<(), wake_ldm::Error>(())
//! ```

// Which scenes.
mod distribution;
mod draws;
mod recipe;
mod scenes;

// Scene → pair → batch.
mod ordered;
mod pair;
mod prompts;
mod shuffle;

// Pairs, position by position.
mod mixture;
mod sampled;
mod source;

// Pairs ⇄ folder.
mod annotations;
mod folder;
mod layout;
mod merge;
mod metadata;
mod write;

// Batches, as tensors.
mod loader;

pub use draws::Draws;
pub use folder::{Epochs, Folder};
pub use layout::{Manifest, Shard};
pub use loader::{Batch, Batches, Loader, ToBatch};
pub use merge::{merge, shard_folder};
pub use mixture::Mixture;
pub use pair::{Grey, Pair};
pub use prompts::Prompts;
pub use recipe::{Draw, Recipe};
pub use sampled::Sampled;
pub use scenes::{PAPER_SCENES, Simulated};
#[cfg(feature = "train")]
pub(crate) use shuffle::shuffled;
pub use source::{Finite, Source};
pub use write::{Progress, write};

#[cfg(test)]
mod tests;
