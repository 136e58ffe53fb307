#![doc = include_str!("../README.md")]
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(unused_crate_dependencies))]

mod error;

// Scene → prompt.
mod statement;
mod wording;

// Prompt → stated values.
mod pieces;
mod quantities;
mod reading;
mod subjects;

// Prompt → tokens.
mod cleaning;
mod tokenizer;
mod vocabulary;
mod vocabulary_files;
mod words;

pub use error::{Error, Result};
pub use statement::PartialScene;
pub use tokenizer::{TOKENS, Tokenizer, Tokens};
pub use wording::{Wording, prompt};
