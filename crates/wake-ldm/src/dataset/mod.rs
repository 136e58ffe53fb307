//! Simulated pairs of image and prompt: endless in memory, or as a folder on disk.
//!
//! A [`Recipe`] says which scenes there are. [`Simulated`] makes pair number `index` of a recipe and a seed: always the
//! same one, whatever was made before and on however many threads. [`Batches`] simulates on other threads while a
//! model trains:
//!
//! ```
//! use burn::tensor::Device;
//! use wake_ldm::dataset::{Batches, Loading, Recipe, Simulated};
//!
//! let recipe = Recipe::default().with_assignments(&["scene.grid.rows = 32", "scene.grid.columns = 32"])?;
//! let source = Simulated::new(recipe, 7)?;
//! let loading = Loading { batch_size: 2, threads: 2, ..Loading::default() };
//! let mut batches = Batches::new(source, loading, &Device::default())?;
//! let batch = batches.next().expect("there is always a next one")?;
//! assert_eq!(batch.images.dims(), [2, 1, 32, 32]);
//! println!("{}", batch.pairs[0].prompt);
//! # Ok::<(), wake_ldm::Error>(())
//! ```

// Which scenes.
mod ranges;
mod recipe;
mod scenes;

// Scene → pair → batch.
mod ordered;
mod pair;
mod prompts;

// Pairs ⇄ folder.
mod annotations;
mod folder;
mod layout;
mod merge;
mod metadata;
mod write;

mod batch;

pub use batch::{Batch, Batches, Finite, Loading, Source, ToBatch};
pub(crate) use folder::shuffled;
pub use folder::{Epochs, Folder};
pub use layout::{Manifest, Shard};
pub use merge::{merge, shard_folder};
pub use pair::{Grey, Pair};
pub use prompts::Prompts;
pub use ranges::{Place, Ranges};
pub use recipe::{Draw, Recipe};
pub use scenes::Simulated;
pub use write::{Progress, write};

#[cfg(test)]
mod tests;
