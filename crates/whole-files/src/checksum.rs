//! Checksums to detect changed bytes.

use std::io::{self, Read};
use std::path::Path;

use crate::read::open_regular;

/// CRC-32 of bytes (the variant of PNG and ZIP), as eight hexadecimal digits.
///
/// Detects every change within 32 neighbouring bits, and any other change with probability 1 − 2⁻³².
#[must_use]
pub fn checksum(bytes: &[u8]) -> String {
    format!("{:08x}", crc32fast::hash(bytes))
}

/// [`checksum`] of a file, which is read in pieces.
///
/// # Errors
///
/// If the path is not a regular file or cannot be read.
pub fn file_checksum(path: &Path) -> io::Result<String> {
    let mut file = open_regular(path)?;
    let mut piece = vec![0; 1 << 20];
    let mut hash = crc32fast::Hasher::new();
    loop {
        match file.read(&mut piece)? {
            0 => return Ok(format!("{:08x}", hash.finalize())),
            length => hash.update(&piece[..length]),
        }
    }
}

/// Appends an entry `crc32`, the [`checksum`] of all text before it, to a JSON object.
///
/// - `object`: as written by `serde_json`, on one line or several, with at least one entry
#[must_use]
pub fn sealed(object: &str) -> String {
    let entries = object.trim_end();
    let entries = entries.strip_suffix('}').unwrap_or(entries).trim_end();
    let crc32 = checksum(entries.as_bytes());
    match entries.contains('\n') {
        true => format!("{entries},\n  \"crc32\": \"{crc32}\"\n}}"),
        false => format!("{entries},\"crc32\":\"{crc32}\"}}"),
    }
}

/// Removes the entry appended by [`sealed`]; `None` if the text was changed since, or never sealed.
#[must_use]
pub fn unsealed(text: &str) -> Option<String> {
    let (entries, _) = text.rsplit_once(',')?;
    let end = if entries.contains('\n') { "\n}" } else { "}" };
    let object = format!("{entries}{end}");
    (sealed(&object) == text).then_some(object)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// The check value of CRC-32/ISO-HDLC in the catalogue of parametrised CRC algorithms (Cook).
    #[test]
    fn checksums_are_those_of_png() {
        assert_eq!(checksum(b"123456789"), "cbf43926");
        assert_eq!(checksum(b""), "00000000");
        let file = tempfile::NamedTempFile::new().unwrap();
        let long = vec![7; (1 << 20) + 5];
        std::fs::write(file.path(), &long).unwrap();
        assert_eq!(file_checksum(file.path()).unwrap(), checksum(&long));
    }

    #[test]
    fn an_object_is_sealed_on_one_line_or_several_and_no_byte_may_change() {
        let object = json!({"name": "a, b}", "list": [1.5, {"c": null}]});
        for text in [object.to_string(), format!("{object:#}")] {
            let whole = sealed(&text);
            assert_eq!(unsealed(&whole).as_ref(), Some(&text));
            let read: serde_json::Value = serde_json::from_str(&whole).unwrap();
            assert_eq!(
                (&read["name"], &read["list"]),
                (&object["name"], &object["list"])
            );
            assert_eq!(read["crc32"].as_str().map(str::len), Some(8));
            assert_eq!(unsealed(&text), None);
            for at in 0..whole.len() {
                let mut bytes = whole.clone().into_bytes();
                bytes[at] ^= 1;
                let changed = String::from_utf8(bytes).unwrap();
                assert_eq!(unsealed(&changed), None, "{changed}");
                assert_eq!(unsealed(&whole[..at]), None);
            }
            assert_eq!(unsealed(&format!("{whole}\n")), None);
        }
    }
}
