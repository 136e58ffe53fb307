//! Limits on sizes and counts in untrusted files.

/// Largest size of one XML file \[bytes\]; the annotation of an extra-wide scene has about 4 MB.
pub const XML_BYTES: u64 = 32 << 20;
/// Most elements of one XML file.
pub const XML_ELEMENTS: usize = 400_000;
/// Deepest nesting of elements in one XML file; annotations use 8 levels.
pub const XML_DEPTH: usize = 32;
/// Most files of a `.SAFE` folder or `.zip`.
pub const ARCHIVE_FILES: usize = 10_000;
/// Most vectors of a calibration or noise file, and most orbit state vectors.
pub const VECTORS: usize = 20_000;
/// Most numbers in one list of a file.
pub const NUMBERS: usize = 200_000;
/// Most points of a geolocation grid or ground control points of an image.
pub const GRID_POINTS: usize = 200_000;
/// Longest side of an image \[pixels\].
pub const IMAGE_SIDE: usize = 1_000_000;
/// Most pixels of an image that is read by windows.
pub const IMAGE_PIXELS: u64 = 1 << 36;
/// Most pixels of one window, 512 MiB of 32-bit values.
pub const WINDOW_PIXELS: u64 = 128 << 20;
/// Largest decoded size of a compressed strip or tile of a TIFF file \[bytes\].
pub const CHUNK_BYTES: usize = 128 << 20;
/// Largest size of the decoded strips and tiles that a TIFF reader keeps for later windows \[bytes\].
pub const CACHE_BYTES: usize = 64 << 20;
/// Most memory for decoding a PNG or JPEG image as a whole \[bytes\].
pub const PICTURE_BYTES: u64 = 1 << 30;
/// Largest size of a measurement in a `.zip` beyond two bytes per pixel \[bytes\].
pub const MEASUREMENT_EXTRA_BYTES: u64 = 64 << 20;
