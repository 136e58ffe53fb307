#![doc = include_str!("../README.md")]
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod error;
mod text;
mod write;

mod folder;
mod read;

mod checksum;

pub use checksum::{checksum, file_checksum, sealed, unsealed};
pub use error::{Error, Result, failed};
pub use folder::{FolderLock, entries, lock_folder, make_folder, sweep};
pub use read::{fingerprint, open_regular, read_bytes, read_regular, read_text};
pub use text::{quoted, sentence};
pub use write::{is_temporary, write_atomically, write_json, write_synced, write_with};
