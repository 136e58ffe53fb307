//! wake-ldm
