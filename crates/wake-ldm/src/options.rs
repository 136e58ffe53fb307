//! Reading the options of a `config.json` one by one, so that none is overlooked.
//!
//! Every option is either taken (it shapes the model), required to have the one value that is
//! implemented, or known not to change the result. Any other option that is neither `null` nor
//! `false` might change the result, and is rejected by name.

use std::path::Path;

use serde_json::{Map, Value};

use wake_nn::{Error, Result};

/// Options of one component that have not been read yet.
#[derive(Debug)]
pub(crate) struct Options {
    component: &'static str,
    left: Map<String, Value>,
}

impl Options {
    /// Parses the text of a configuration file; `path` is used only in messages.
    pub(crate) fn parse(component: &'static str, text: &str, path: &Path) -> Result<Self> {
        let left = serde_json::from_str(text).map_err(|source| Error::Json {
            path: path.to_owned(),
            source,
        })?;
        Ok(Self { component, left })
    }

    /// Takes a value; `null` counts as absent.
    pub(crate) fn take(&mut self, key: &str) -> Option<Value> {
        self.left.remove(key).filter(|value| !value.is_null())
    }

    /// Takes an optional value that `read` accepts.
    pub(crate) fn read<T>(
        &mut self,
        key: &str,
        expected: &str,
        read: impl Fn(&Value) -> Option<T>,
    ) -> Result<Option<T>> {
        let value = self.take(key);
        let found =
            value.map(|value| read(&value).ok_or_else(|| self.invalid(key, &value, expected)));
        found.transpose()
    }

    /// Takes a whole number, or the default if it is absent.
    pub(crate) fn usize(&mut self, key: &str, default: usize) -> Result<usize> {
        Ok(self.read(key, "a whole number", count)?.unwrap_or(default))
    }

    /// Takes a number, or the default if it is absent.
    pub(crate) fn f64(&mut self, key: &str, default: f64) -> Result<f64> {
        Ok(self.optional_f64(key)?.unwrap_or(default))
    }

    /// Takes a number that may be absent.
    pub(crate) fn optional_f64(&mut self, key: &str) -> Result<Option<f64>> {
        self.read(key, "a number", Value::as_f64)
    }

    /// Takes a boolean, or the default if it is absent.
    pub(crate) fn bool(&mut self, key: &str, default: bool) -> Result<bool> {
        let found = self.read(key, "true or false", Value::as_bool)?;
        Ok(found.unwrap_or(default))
    }

    /// Takes one of some names, or the default if it is absent, and returns the value paired with it.
    pub(crate) fn choice<T: Clone>(
        &mut self,
        key: &str,
        default: &str,
        known: &[(&str, T)],
    ) -> Result<T> {
        let name = self.read(key, "a string", text)?;
        let name = name.unwrap_or_else(|| default.to_owned());
        let found = known.iter().find(|(known, _)| *known == name);
        found.map(|(_, value)| value.clone()).ok_or_else(|| {
            let known: Vec<&str> = known.iter().map(|(known, _)| *known).collect();
            self.unsupported(key, &name.into(), &known.join(", "))
        })
    }

    /// Takes a list of counts; a single count stands for `length` equal ones.
    pub(crate) fn usizes(
        &mut self,
        key: &str,
        length: usize,
        default: usize,
    ) -> Result<Vec<usize>> {
        let counts = |value: &Value| match count(value) {
            Some(count) => Some(vec![count; length]),
            None => list(value, count),
        };
        let found = self.read(key, "a whole number or a list of them", counts)?;
        Ok(found.unwrap_or_else(|| vec![default; length]))
    }

    /// Takes a required list of counts.
    pub(crate) fn required_usizes(&mut self, key: &str) -> Result<Vec<usize>> {
        self.required(key, "a list of whole numbers", |value| list(value, count))
    }

    /// Takes a required list of strings.
    pub(crate) fn required_strings(&mut self, key: &str) -> Result<Vec<String>> {
        self.required(key, "a list of strings", |value| list(value, text))
    }

    fn required<T>(
        &mut self,
        key: &str,
        expected: &str,
        read: impl Fn(&Value) -> Option<T>,
    ) -> Result<T> {
        let found = self.read(key, expected, read)?;
        found.ok_or_else(|| self.invalid(key, &Value::Null, expected))
    }

    /// Takes an option that must be absent or have one of the implemented values.
    pub(crate) fn only<V: Into<Value> + Clone>(
        &mut self,
        key: &str,
        supported: &[V],
    ) -> Result<()> {
        let Some(value) = self.take(key) else {
            return Ok(());
        };
        let supported: Vec<Value> = supported.iter().cloned().map(Into::into).collect();
        if supported.iter().any(|good| same(good, &value)) {
            return Ok(());
        }
        let names: Vec<String> = supported.iter().map(ToString::to_string).collect();
        Err(self.unsupported(key, &value, &names.join(", ")))
    }

    /// Discards options that do not change the result.
    pub(crate) fn ignore(&mut self, keys: &[&str]) {
        for key in keys {
            self.left.remove(*key);
        }
    }

    /// Rejects remaining options, except private notes (a leading underscore), `null` and `false`.
    pub(crate) fn finish(self) -> Result<()> {
        let harmless = |key: &str, value: &Value| {
            key.starts_with('_') || value.is_null() || value == &Value::Bool(false)
        };
        match self.left.iter().find(|(key, value)| !harmless(key, value)) {
            None => Ok(()),
            Some((key, value)) => Err(self.unsupported(key, value, "absent or null")),
        }
    }

    /// Returns the error for a value that is not implemented.
    pub(crate) fn unsupported(&self, key: &str, value: &Value, supported: &str) -> Error {
        Error::Unsupported {
            option: self.named(key),
            value: value.to_string(),
            supported: supported.to_owned(),
        }
    }

    fn invalid(&self, key: &str, value: &Value, expected: &str) -> Error {
        Error::InvalidOption {
            option: self.named(key),
            value: value.to_string(),
            expected: expected.to_owned(),
        }
    }

    fn named(&self, key: &str) -> String {
        format!("{} {key}", self.component)
    }
}

pub(crate) fn count(value: &Value) -> Option<usize> {
    value.as_u64().and_then(|count| usize::try_from(count).ok())
}

fn text(value: &Value) -> Option<String> {
    value.as_str().map(str::to_owned)
}

/// Reads a list whose entries `read` accepts.
pub(crate) fn list<T>(value: &Value, read: impl Fn(&Value) -> Option<T>) -> Option<Vec<T>> {
    value.as_array()?.iter().map(read).collect()
}

/// Equality that treats 0 and 0.0 as the same number.
fn same(a: &Value, b: &Value) -> bool {
    match (a.as_f64(), b.as_f64()) {
        (Some(a), Some(b)) => a.total_cmp(&b).is_eq(),
        _ => a == b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(text: &str) -> Options {
        Options::parse("test", text, Path::new("config.json")).unwrap()
    }

    #[test]
    fn a_left_over_option_is_refused_by_name() {
        let mut taken = options(r#"{"a": 1, "b": "x", "_note": 3, "c": null, "d": false}"#);
        assert_eq!(taken.usize("a", 7).unwrap(), 1);
        let error = taken.finish().unwrap_err();
        assert!(matches!(&error, Error::Unsupported { option, .. } if option == "test b"));
        assert_eq!(
            error.to_string(),
            "test b = \"x\" is not supported; supported: absent or null"
        );
    }

    #[test]
    fn an_option_with_one_value_accepts_it_in_either_spelling() {
        assert!(options(r#"{"dropout": 0}"#).only("dropout", &[0.0]).is_ok());
        assert!(options("{}").only("dropout", &[0.0]).is_ok());
        assert!(
            options(r#"{"dropout": 0.1}"#)
                .only("dropout", &[0.0])
                .is_err()
        );
    }

    #[test]
    fn wrong_kinds_are_errors_not_panics() {
        let text = r#"{"a": -1, "b": 1.5, "c": "x", "d": [1, "x"], "e": {}}"#;
        assert!(options(text).usize("a", 0).is_err());
        assert!(options(text).usize("b", 0).is_err());
        assert!(options(text).f64("c", 0.0).is_err());
        assert!(options(text).usizes("d", 2, 0).is_err());
        assert!(options(text).bool("e", true).is_err());
        assert!(options(text).choice("e", "", &[("", ())]).is_err());
        assert!(options(text).required_strings("d").is_err());
        assert!(options(text).required_usizes("absent").is_err());
        let deep = "[".repeat(100_000);
        assert!(matches!(
            Options::parse("t", &deep, Path::new("x")),
            Err(Error::Json { .. })
        ));
    }

    #[test]
    fn a_single_count_stands_for_all_levels() {
        assert_eq!(options(r#"{"h": 8}"#).usizes("h", 3, 1).unwrap(), [8, 8, 8]);
        assert_eq!(
            options(r#"{"h": [5, 10]}"#).usizes("h", 2, 1).unwrap(),
            [5, 10]
        );
    }
}
