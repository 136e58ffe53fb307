//! The header of a safetensors file: read without the data, and checked before anything is trusted.

use std::collections::BTreeSet;
use std::fmt;
use std::io::Read;
use std::path::Path;

use safetensors::tensor::Metadata;
use serde::de::{Deserializer as _, Error as _, IgnoredAny, MapAccess, Visitor};

use crate::error::{Error, Result};
use whole_files::failed;

/// The format's own limit on the length of a header.
const LONGEST: u64 = 100_000_000;

/// Bytes of the field that holds the header's length.
const LENGTH: u64 = 8;

/// Description of a file's tensors.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) metadata: Metadata,
    /// Position of the data in the file.
    pub(super) data_start: u64,
}

/// Reads and checks the header of a file.
///
/// Tensors must be contiguous from the header to the end of the file, as long as their shapes imply,
/// each under a name of its own. No more is allocated than the file holds.
///
/// - `file`: positioned at its first byte
/// - `size`: its length in bytes
pub(super) fn read(path: &Path, mut file: impl Read, size: u64) -> Result<Header> {
    let io = |source| failed("read", path, source);
    let invalid = |reason: Box<dyn std::error::Error + Send + Sync>| Error::InvalidSafetensors {
        path: path.to_owned(),
        reason,
    };
    let Some(rest) = size.checked_sub(LENGTH) else {
        return Err(invalid(
            format!("it has {size} bytes, expected at least {LENGTH}").into(),
        ));
    };
    let mut length = [0; LENGTH as usize];
    file.read_exact(&mut length).map_err(io)?;
    let length = u64::from_le_bytes(length);
    if length > rest.min(LONGEST) {
        let most = rest.min(LONGEST);
        return Err(invalid(
            format!("its header has {length} bytes, expected at most {most}").into(),
        ));
    }
    let mut text = vec![0; length as usize];
    file.read_exact(&mut text).map_err(io)?;
    let metadata = parse(&text).map_err(|error| invalid(error.into()))?;
    let found = rest - length;
    if metadata.data_len() as u64 != found {
        let told = metadata.data_len();
        return Err(invalid(
            format!("its header describes {told} bytes of data, but it has {found}").into(),
        ));
    }
    Ok(Header {
        metadata,
        data_start: LENGTH + length,
    })
}

/// Parses the tensors of a header and rejects duplicate names, of which a reader would silently take the last.
fn parse(text: &[u8]) -> Result<Metadata, serde_json::Error> {
    let mut json = serde_json::Deserializer::from_slice(text);
    json.deserialize_map(DistinctNames)?;
    serde_json::from_slice(text)
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

    #[test]
    fn a_name_that_occurs_twice_is_refused() {
        let entry = |from: usize| {
            format!(
                r#"{{"dtype": "F32", "shape": [1], "data_offsets": [{from}, {}]}}"#,
                from + 4
            )
        };
        let [first, second, third] = [0, 4, 8].map(entry);
        let good = format!(r#"{{"a": {first}, "b": {second}}}  "#);
        assert_eq!(parse(good.as_bytes()).unwrap().data_len(), 8);
        let twice = format!(r#"{{"a": {first}, "b": {second}, "a": {third}}}"#);
        let refusal = parse(twice.as_bytes()).unwrap_err();
        assert!(
            refusal.to_string().contains("the name a occurs twice"),
            "{refusal}"
        );
    }

    /// A million open brackets are skipped without recursion, and rejected because they never close.
    #[test]
    fn deep_nesting_is_refused() {
        let deep = format!("{{\"a\": {}", "[".repeat(1 << 20));
        assert!(parse(deep.as_bytes()).is_err());
    }
}
