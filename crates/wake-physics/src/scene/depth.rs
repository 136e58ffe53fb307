//! Depth as a number, or "infinite": JSON has no infinity.

use serde::{Deserialize, Deserializer, Serializer};

#[derive(Deserialize)]
#[serde(untagged, expecting = "a depth in metres, inf or \"infinite\"")]
enum Depth {
    Metres(f64),
    Word(Word),
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Word {
    Infinite,
}

pub(super) fn serialize<S: Serializer>(depth: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    if depth.is_finite() {
        serializer.serialize_f64(*depth)
    } else {
        serializer.serialize_str("infinite")
    }
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(match Depth::deserialize(deserializer)? {
        Depth::Metres(metres) => metres,
        Depth::Word(Word::Infinite) => f64::INFINITY,
    })
}
