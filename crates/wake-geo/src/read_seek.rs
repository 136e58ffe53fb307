//! Sources of pixels.

use std::io::{Read, Seek};

/// File of pixels: on disk, or the part of an archive that holds it.
pub(crate) trait ReadSeek: Read + Seek + Send {}

impl<T: Read + Seek + Send> ReadSeek for T {}
