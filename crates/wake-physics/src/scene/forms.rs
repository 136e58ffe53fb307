//! Values with a form of their own in files: JSON has no infinity, TOML has no whole number above 2⁶³ − 1, and some lists
//! must have exactly two numbers.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serializer};

/// A depth as a number, or "infinite".
pub(super) mod depth {
    use super::{Deserialize, Deserializer, Serializer};

    #[derive(Deserialize)]
    #[serde(
        untagged,
        expecting = "expected a depth in metres, inf or \"infinite\""
    )]
    enum Depth {
        Metres(f64),
        Word(Word),
    }

    #[derive(Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Word {
        Infinite,
    }

    pub(in crate::scene) fn serialize<S: Serializer>(
        depth: &f64,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        if depth.is_finite() {
            serializer.serialize_f64(*depth)
        } else {
            serializer.serialize_str("infinite")
        }
    }

    pub(in crate::scene) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<f64, D::Error> {
        Ok(match Depth::deserialize(deserializer)? {
            Depth::Metres(metres) => metres,
            Depth::Word(Word::Infinite) => f64::INFINITY,
        })
    }
}

/// A seed as a number, or as a string of digits if it is too large for TOML.
pub(super) mod seed {
    use super::{Deserialize, Deserializer, Serializer};

    #[derive(Deserialize)]
    #[serde(
        untagged,
        expecting = "expected a whole number from 0 to 18446744073709551615"
    )]
    enum Seed {
        Number(u64),
        Digits(String),
    }

    pub(in crate::scene) fn serialize<S: Serializer>(
        seed: &u64,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        match i64::try_from(*seed) {
            Ok(_) => serializer.serialize_u64(*seed),
            Err(_) => serializer.collect_str(seed),
        }
    }

    pub(in crate::scene) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<u64, D::Error> {
        use serde::de::Error as _;
        match Seed::deserialize(deserializer)? {
            Seed::Number(seed) => Ok(seed),
            Seed::Digits(digits) => digits.parse().map_err(|_| {
                D::Error::custom(format!(
                    "'{}' is not a whole number from 0 to {}",
                    whole_files::quoted(&digits),
                    u64::MAX
                ))
            }),
        }
    }
}

/// Ships: one as a table, several as a list of tables; without ships the key is absent.
pub(super) mod ships {
    use super::super::Ship;
    use super::{Deserialize, Deserializer};
    use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
    use serde::de::{MapAccess, SeqAccess, Visitor};
    use serde::{Serialize, Serializer};

    pub(in crate::scene) fn serialize<S: Serializer>(
        ships: &[Ship],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        match ships {
            [one] => one.serialize(serializer),
            several => several.serialize(serializer),
        }
    }

    pub(in crate::scene) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<Ship>, D::Error> {
        deserializer.deserialize_any(OneOrSeveral)
    }

    /// Deserializes from the map or list directly, so that errors name the key and its line.
    struct OneOrSeveral;

    impl<'de> Visitor<'de> for OneOrSeveral {
        type Value = Vec<Ship>;

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("a ship as a table, or a list of them")
        }

        fn visit_unit<E>(self) -> Result<Self::Value, E> {
            Ok(Vec::new())
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
            Ship::deserialize(MapAccessDeserializer::new(map)).map(|ship| vec![ship])
        }

        fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Self::Value, A::Error> {
            Vec::deserialize(SeqAccessDeserializer::new(list))
        }
    }
}

/// Deserializes exactly two numbers.
pub(super) fn two<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 2], D::Error> {
    let numbers = Vec::<f64>::deserialize(deserializer)?;
    let count = numbers.len();
    numbers
        .try_into()
        .map_err(|_| D::Error::custom(format!("{count} numbers, expected 2")))
}
