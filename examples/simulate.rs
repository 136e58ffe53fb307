//! Scene to SAR image.
fn main() {}
