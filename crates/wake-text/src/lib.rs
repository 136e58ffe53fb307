#![doc = include_str!("../README.md")]
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(unused_crate_dependencies))]

mod error;

// Scene → prompt → what it states.
mod cleaning;
mod numbers;
mod pieces;
mod amounts;
mod compass;
mod filler;
mod subjects;
mod denials;
mod modifiers;
mod statement;
mod wording;
mod leftovers;
mod sentence;
mod reading;

// Prompt → tokens.
mod vocabulary_files;
mod vocabulary;
mod tokenizer;

pub use error::{Error, Result};
pub use reading::{Reading, Unread};
pub use statement::PartialScene;
pub use tokenizer::{TOKENS, Tokenizer, Tokens};
pub use wording::{Wording, prompt};
