//! wake-physics
