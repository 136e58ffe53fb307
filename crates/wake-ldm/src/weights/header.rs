//! The one check of a safetensors header that its reader leaves out: that no name occurs twice.

use std::collections::BTreeSet;
use std::fmt;

use serde::de::{Deserializer as _, Error as _, IgnoredAny, MapAccess, Visitor};

/// Refuses a header in which a name occurs twice; a reader would take the last one in silence.
///
/// `bytes` is the whole file. A file without a readable header is left to the reader to refuse.
pub(super) fn refuse_duplicates(bytes: &[u8]) -> Result<(), String> {
    let Some(header) = header(bytes) else {
        return Ok(());
    };
    let mut json = serde_json::Deserializer::from_slice(header);
    json.deserialize_map(DistinctNames)
        .map_err(|error| error.to_string())
}

/// The JSON between the length and the data.
fn header(bytes: &[u8]) -> Option<&[u8]> {
    let (length, rest) = bytes.split_first_chunk::<8>()?;
    rest.get(..usize::try_from(u64::from_le_bytes(*length)).ok()?)
}

struct DistinctNames;

impl<'de> Visitor<'de> for DistinctNames {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object of tensors")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let mut names = BTreeSet::new();
        while let Some(name) = map.next_key::<String>()? {
            map.next_value::<IgnoredAny>()?;
            if let Some(name) = names.replace(name) {
                return Err(A::Error::custom(format!("the name {name} occurs twice")));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str) -> Vec<u8> {
        let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
        bytes.extend(header.as_bytes());
        bytes
    }

    #[test]
    fn a_name_that_occurs_twice_is_refused() {
        assert_eq!(refuse_duplicates(&file(r#"{"a": 1, "b": 2}  "#)), Ok(()));
        let refusal = refuse_duplicates(&file(r#"{"a": 1, "b": 2, "a": 3}"#)).unwrap_err();
        assert!(refusal.contains("the name a occurs twice"), "{refusal}");
        // A million open brackets are skipped without recursion, and refused for having no end.
        let deep = file(&format!("{{\"a\": {}", "[".repeat(1 << 20)));
        assert!(refuse_duplicates(&deep).is_err());
    }

    #[test]
    fn what_has_no_header_is_left_to_the_reader() {
        assert_eq!(refuse_duplicates(&[]), Ok(()));
        assert_eq!(refuse_duplicates(&u64::MAX.to_le_bytes()), Ok(()));
    }
}
