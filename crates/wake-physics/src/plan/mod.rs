//! What a scene needs, decided before anything is computed.

mod bounds;
mod choose;
mod linear;
mod sample;

pub use choose::PlannedTerm;
