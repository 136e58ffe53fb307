#![doc = include_str!("../README.md")]
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(unused_crate_dependencies))]

mod error;
mod statement;
mod wording;
mod cleaning;
mod vocabulary_files;
mod vocabulary;
mod words;
mod tokenizer;

pub use error::{Error, Result};
pub use statement::PartialScene;
pub use tokenizer::{TOKENS, Tokenizer, Tokens};
pub use wording::{Wording, prompt};
