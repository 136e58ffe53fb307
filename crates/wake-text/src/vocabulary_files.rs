//! Reads vocabulary files; errors name the broken line.

use crate::error::{Error, Result};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::value::RawValue;
use std::collections::HashMap;
use std::path::Path;
use tokenizers::models::bpe::{Merges, Vocab};

/// Reads a text file.
pub(crate) fn read(path: &Path) -> Result<String> {
    let bytes = whole_files::read_regular(path).map_err(|e| Error::File {
        path: path.to_owned(),
        message: e.to_string(),
    })?;
    String::from_utf8(bytes).map_err(|e| {
        let valid = &e.as_bytes()[..e.utf8_error().valid_up_to()];
        let (line, column) = position(valid);
        broken(path, (line, column), "this is not UTF-8 text".to_owned())
    })
}

/// Parses the token ids of `vocab.json`: an object of token: id.
pub(crate) fn parse_vocab(path: &Path, text: &str) -> Result<Vocab> {
    let entries: HashMap<String, &RawValue> =
        serde_json::from_str(text).map_err(|e| json_error(path, &e))?;
    vocab_from(path, text, entries)
}

/// Parses the merges of `merges.txt`: two tokens a line, most frequent pair first, after a line `#version`.
///
/// With a vocabulary, both tokens and their concatenation must be in it.
pub(crate) fn parse_merges(path: &Path, text: &str, vocab: Option<&Vocab>) -> Result<Merges> {
    let mut merges = Merges::new();
    for (index, line) in text.trim_end().lines().enumerate() {
        if index == 0 && line.starts_with("#version") {
            continue;
        }
        let merge = split_merge(line).and_then(|merge| known(merge, vocab));
        merges.push(merge.map_err(|message| broken(path, (index + 1, 1), message))?);
    }
    Ok(merges)
}

/// Parses vocabulary and merges of `tokenizer.json`.
pub(crate) fn parse_tokenizer(path: &Path, text: &str) -> Result<(Vocab, Merges)> {
    let file: TokenizerFile<'_> = serde_json::from_str(text).map_err(|e| json_error(path, &e))?;
    let mut vocab = vocab_from(path, text, file.model.vocab)?;
    for added in file.added_tokens {
        vocab.entry(added.content).or_insert(added.id);
    }
    let mut merges = Merges::with_capacity(file.model.merges.len());
    for raw in file.model.merges {
        let merge = merge_from(raw).and_then(|merge| known(merge, Some(&vocab)));
        merges.push(merge.map_err(|message| broken(path, place(text, raw), message))?);
    }
    Ok((vocab, merges))
}

/// Parses the padding token of `special_tokens_map.json`, if it names one.
pub(crate) fn parse_pad(path: &Path, text: &str) -> Result<Option<String>> {
    let map: SpecialTokens = serde_json::from_str(text).map_err(|e| json_error(path, &e))?;
    Ok(map.pad_token.map(|token| match token {
        SpecialToken::Text(content) | SpecialToken::Object { content } => content,
    }))
}

#[derive(Deserialize)]
struct TokenizerFile<'a> {
    #[serde(borrow)]
    model: BpeModel<'a>,
    #[serde(default)]
    added_tokens: Vec<AddedToken>,
}

#[derive(Deserialize)]
struct BpeModel<'a> {
    #[serde(borrow)]
    vocab: HashMap<String, &'a RawValue>,
    #[serde(borrow)]
    merges: Vec<&'a RawValue>,
}

#[derive(Deserialize)]
struct AddedToken {
    id: u32,
    content: String,
}

#[derive(Deserialize)]
struct SpecialTokens {
    pad_token: Option<SpecialToken>,
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected a token, or an object with its \"content\""
)]
enum SpecialToken {
    Text(String),
    Object { content: String },
}

/// Converts the ids of the entries, which must be unique whole numbers.
fn vocab_from(path: &Path, text: &str, entries: HashMap<String, &RawValue>) -> Result<Vocab> {
    let mut entries: Vec<_> = entries.into_iter().collect();
    entries.sort_by_key(|(_, raw)| raw.get().as_ptr());
    let mut used = HashMap::with_capacity(entries.len());
    let mut vocab = Vocab::with_capacity(entries.len());
    for (token, raw) in entries {
        let id = value::<u32>(raw)
            .ok_or_else(|| {
                let most = u32::MAX;
                format!("the id of '{token}' is {raw}, expected a whole number from 0 to {most}")
            })
            .and_then(|id| match used.insert(id, token.clone()) {
                Some(other) => Err(format!("'{token}' and '{other}' both have the id {id}")),
                None => Ok(id),
            })
            .map_err(|message| broken(path, place(text, raw), message))?;
        vocab.insert(token, id);
    }
    Ok(vocab)
}

/// Parses a merge of `tokenizer.json`: "left right", or a list of the two.
fn merge_from(raw: &RawValue) -> std::result::Result<(String, String), String> {
    match (value::<(String, String)>(raw), value::<String>(raw)) {
        (Some(merge), _) => Ok(merge),
        (None, Some(line)) => split_merge(&line),
        (None, None) => Err(format!("{raw} is not a merge, expected two tokens")),
    }
}

fn split_merge(line: &str) -> std::result::Result<(String, String), String> {
    match line.split_once(' ') {
        Some((left, right)) if ![left, right].contains(&"") && !right.contains(' ') => {
            Ok((left.to_owned(), right.to_owned()))
        }
        _ => Err(format!(
            "'{line}' is not a merge, expected two tokens with one space between them"
        )),
    }
}

/// Checks that the tokens of a merge and their concatenation are in the vocabulary.
fn known(
    (left, right): (String, String),
    vocab: Option<&Vocab>,
) -> std::result::Result<(String, String), String> {
    let Some(vocab) = vocab else {
        return Ok((left, right));
    };
    let made = format!("{left}{right}");
    match [&left, &right, &made]
        .iter()
        .find(|token| !vocab.contains_key(token.as_str()))
    {
        Some(token) => Err(format!(
            "the merge '{left} {right}' needs the token '{token}', which is not in the vocabulary"
        )),
        None => Ok((left, right)),
    }
}

fn value<T: DeserializeOwned>(raw: &RawValue) -> Option<T> {
    serde_json::from_str(raw.get()).ok()
}

/// Line and column of a value within the text it was borrowed from.
fn place(text: &str, raw: &RawValue) -> (usize, usize) {
    let offset = (raw.get().as_ptr() as usize).saturating_sub(text.as_ptr() as usize);
    position(text.as_bytes().get(..offset).unwrap_or_default())
}

/// Line and column, from 1, right after these bytes.
fn position(before: &[u8]) -> (usize, usize) {
    let line = before.split(|&byte| byte == b'\n').count();
    let start = before
        .iter()
        .rposition(|&byte| byte == b'\n')
        .map_or(0, |at| at + 1);
    (
        line,
        String::from_utf8_lossy(&before[start..]).chars().count() + 1,
    )
}

fn json_error(path: &Path, error: &serde_json::Error) -> Error {
    broken(path, (error.line(), error.column()), error.to_string())
}

fn broken(path: &Path, (line, column): (usize, usize), message: String) -> Error {
    Error::Vocabulary {
        path: path.to_owned(),
        line,
        column,
        message,
    }
}
