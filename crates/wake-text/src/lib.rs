//! wake-text
