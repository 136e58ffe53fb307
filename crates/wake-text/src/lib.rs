#![cfg_attr(feature = "scene", doc = include_str!("../README.md"))]
#![cfg_attr(not(feature = "scene"), doc = "CLIP tokens of prompts.")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(unused_crate_dependencies))]

mod error;

// Scene → prompt → stated values.
mod cleaning;
#[cfg(feature = "scene")]
mod numbers;
#[cfg(feature = "scene")]
mod pieces;
#[cfg(feature = "scene")]
mod amounts;
#[cfg(feature = "scene")]
mod compass;
#[cfg(feature = "scene")]
mod filler;
#[cfg(feature = "scene")]
mod subjects;
#[cfg(feature = "scene")]
mod denials;
#[cfg(feature = "scene")]
mod modifiers;
#[cfg(feature = "scene")]
mod statement;
#[cfg(feature = "scene")]
mod wording;
#[cfg(feature = "scene")]
mod leftovers;
#[cfg(feature = "scene")]
mod sentence;
#[cfg(feature = "scene")]
mod reading;

// Prompt → tokens.
mod vocabulary_files;
mod vocabulary;
mod tokenizer;

pub use error::{Error, Result};
#[cfg(feature = "scene")]
pub use reading::{Reading, Unread};
#[cfg(feature = "scene")]
pub use statement::PartialScene;
pub use tokenizer::{TOKENS, Tokenizer, Tokens};
#[cfg(feature = "scene")]
pub use wording::{Wording, prompt};
