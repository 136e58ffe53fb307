//! The byte-pair vocabulary, embedded or read from files.
//!
//! CLIP's vocabulary follows from its merges alone: the symbols of the 256 bytes; the same symbols with the
//! end-of-word mark `</w>`; the results of the 48,894 merges, in order; start mark; end mark. The crate therefore
//! stores only the merges (`assets/clip_merges.txt.gz`, MIT licence beside it).

use crate::error::{Error, Result};
use crate::vocabulary_files::{parse_merges, parse_pad, parse_tokenizer, parse_vocab, read};
use serde_json::{Value, json};
use std::borrow::Cow;
use std::io::Read;
use std::path::Path;
use tokenizers::Model;
use tokenizers::models::bpe::{BPE, Merges, Vocab};

/// Marks the start of every prompt.
pub(crate) const START_MARK: &str = "<|startoftext|>";
/// Marks the end of every prompt.
pub(crate) const END_MARK: &str = "<|endoftext|>";
/// Marks the last symbol of a word.
const WORD_END: &str = "</w>";

const CLIP_NAME: &str = "assets/clip_merges.txt.gz";
const CLIP_MERGES: &[u8] = include_bytes!("../assets/clip_merges.txt.gz");

/// Merges, token ids and special tokens.
#[derive(Debug, Clone)]
pub(crate) struct Vocabulary {
    bpe: BPE,
    pub(crate) start: u32,
    pub(crate) end: u32,
    pub(crate) pad: u32,
}

impl Vocabulary {
    /// CLIP's vocabulary, unpacked from the crate.
    pub(crate) fn embedded() -> Result<Self> {
        let (vocab, merges) = Self::clip_parts()?;
        Self::build(Path::new(CLIP_NAME), vocab, merges)
    }

    /// Token ids and merges of CLIP.
    pub(crate) fn clip_parts() -> Result<(Vocab, Merges)> {
        let merges = parse_merges(Path::new(CLIP_NAME), &embedded_merges()?, None)?;
        Ok((clip_vocab(&merges), merges))
    }

    fn from_files(vocab_path: &Path, merges_path: &Path) -> Result<Self> {
        let vocab = parse_vocab(vocab_path, &read(vocab_path)?)?;
        let merges = parse_merges(merges_path, &read(merges_path)?, Some(&vocab))?;
        Self::build(vocab_path, vocab, merges)
    }

    fn from_tokenizer_json(path: &Path) -> Result<Self> {
        let (vocab, merges) = parse_tokenizer(path, &read(path)?)?;
        Self::build(path, vocab, merges)
    }

    pub(crate) fn from_folder(folder: &Path) -> Result<Self> {
        let inner = folder.join("tokenizer");
        let folder = if inner.is_dir() { &inner } else { folder };
        let [vocab, merges, whole, special] = [
            "vocab.json",
            "merges.txt",
            "tokenizer.json",
            "special_tokens_map.json",
        ]
        .map(|name| folder.join(name));
        let mut vocabulary = if vocab.is_file() && merges.is_file() {
            Self::from_files(&vocab, &merges)?
        } else if whole.is_file() {
            Self::from_tokenizer_json(&whole)?
        } else {
            return Err(Error::NoVocabulary {
                path: folder.to_owned(),
            });
        };
        if special.is_file()
            && let Some(pad) = parse_pad(&special, &read(&special)?)?
        {
            vocabulary.pad = id(&vocabulary.bpe, &special, &pad)?;
        }
        Ok(vocabulary)
    }

    /// Writes vocabulary, merges, marks and prompt length into a folder, which is created if absent.
    pub(crate) fn save(&self, folder: &Path, tokens: usize) -> Result<()> {
        let failed = |message: String| Error::Write {
            path: folder.to_owned(),
            message,
        };
        std::fs::create_dir_all(folder).map_err(|e| failed(e.to_string()))?;
        self.bpe
            .save(folder, None)
            .map_err(|e| failed(e.to_string()))?;
        let marks = marks_json(&self.bpe.id_to_token(self.pad).unwrap_or_default());
        let mut config = marks.clone();
        config["tokenizer_class"] = "CLIPTokenizer".into();
        config["model_max_length"] = tokens.into();
        config["add_prefix_space"] = false.into();
        config["do_lower_case"] = true.into();
        config["errors"] = "replace".into();
        [
            ("special_tokens_map.json", marks),
            ("tokenizer_config.json", config),
        ]
        .into_iter()
        .try_for_each(|(name, json)| std::fs::write(folder.join(name), format!("{json:#}\n")))
        .map_err(|e| failed(e.to_string()))
    }

    fn build(path: &Path, vocab: Vocab, merges: Merges) -> Result<Self> {
        let bpe = BPE::builder()
            .vocab_and_merges(vocab, merges)
            .unk_token(END_MARK.to_owned())
            .end_of_word_suffix(WORD_END.to_owned())
            .build()
            .map_err(|e| Error::File {
                path: path.to_owned(),
                message: e.to_string(),
            })?;
        let start = id(&bpe, path, START_MARK)?;
        let end = id(&bpe, path, END_MARK)?;
        Ok(Self {
            bpe,
            start,
            end,
            pad: end,
        })
    }

    /// Calls `each` with the id of every token of a word spelt in symbols, and its first byte in the symbols.
    pub(crate) fn for_tokens(&self, word: &str, mut each: impl FnMut(u32, usize)) {
        // Cannot fail: an unknown symbol becomes the end mark, which every vocabulary has.
        for token in self.bpe.tokenize(word).unwrap_or_default() {
            each(token.id, token.offsets.0);
        }
    }
}

/// The id of a required token.
fn id(bpe: &BPE, path: &Path, token: &str) -> Result<u32> {
    bpe.token_to_id(token).ok_or_else(|| Error::File {
        path: path.to_owned(),
        message: format!("the vocabulary has no token '{token}'"),
    })
}

/// The marks in the format of transformers.
fn marks_json(pad: &str) -> Value {
    json!({
        "bos_token": START_MARK, "eos_token": END_MARK, "unk_token": END_MARK, "pad_token": pad,
    })
}

fn embedded_merges() -> Result<String> {
    let mut text = String::new();
    flate2::read::GzDecoder::new(CLIP_MERGES)
        .read_to_string(&mut text)
        .map_err(|e| Error::File {
            path: CLIP_NAME.into(),
            message: e.to_string(),
        })?;
    Ok(text)
}

/// CLIP's tokens in the order of their ids.
fn clip_vocab(merges: &Merges) -> Vocab {
    let symbols: Vec<String> = bytes_in_order()
        .map(|byte| byte_symbol(byte).to_string())
        .collect();
    let word_ends = symbols.iter().map(|symbol| format!("{symbol}{WORD_END}"));
    let merged = merges.iter().map(|(left, right)| format!("{left}{right}"));
    let marks = [START_MARK, END_MARK].map(str::to_owned);
    let tokens = symbols.iter().cloned().chain(word_ends).chain(merged);
    tokens.chain(marks).zip(0..).collect()
}

/// Bytes with a printable Latin-1 character, then the others.
fn bytes_in_order() -> impl Iterator<Item = u8> {
    let has_own = |byte: &u8| has_own_symbol(*byte);
    let own = (0..=u8::MAX).filter(has_own);
    own.chain((0..=u8::MAX).filter(move |byte| !has_own(byte)))
}

fn has_own_symbol(byte: u8) -> bool {
    matches!(byte, b'!'..=b'~' | 0xA1..=0xAC | 0xAE..=0xFF)
}

/// The character that stands for a byte in the vocabulary: its own Latin-1 character if that is printable, else one
/// from U+0100 on.
fn byte_symbol(byte: u8) -> char {
    if has_own_symbol(byte) {
        return char::from(byte);
    }
    // The 68 others, in order: 0 to 32, 127 to 160, and 173.
    let rank = match byte {
        0..=32 => u32::from(byte),
        127..=160 => u32::from(byte) - 127 + 33,
        _ => 67,
    };
    char::from_u32(256 + rank).unwrap_or(char::REPLACEMENT_CHARACTER)
}

/// Spells a word in the vocabulary's symbols, one for each byte.
pub(crate) fn to_symbols(word: &str) -> Cow<'_, str> {
    if word.bytes().all(|byte| byte.is_ascii_graphic()) {
        Cow::Borrowed(word)
    } else {
        word.bytes().map(byte_symbol).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Tokenizer;
    use proptest::prelude::*;
    use std::fs::write;
    use std::path::PathBuf;
    use tempfile::TempDir;

    fn embedded() -> Vocabulary {
        Vocabulary::embedded().unwrap()
    }

    /// CLIP's vocabulary as JSON, one token a line, in the order of the ids.
    fn vocab_json() -> String {
        let vocabulary = embedded();
        let token = |id| serde_json::to_string(&vocabulary.bpe.id_to_token(id).unwrap()).unwrap();
        let entries: Vec<String> = (0..49_408)
            .map(|id| format!("{}: {id}", token(id)))
            .collect();
        format!("{{\n{}\n}}", entries.join(",\n"))
    }

    fn folder(files: &[(&str, &str)]) -> TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            write(folder.path().join(name), text).unwrap();
        }
        folder
    }

    fn merges_txt() -> String {
        format!("#version: 0.2\n{}", embedded_merges().unwrap())
    }

    /// Path, line and message of the error that a broken folder causes.
    fn broken_at(files: &[(&str, &str)]) -> (PathBuf, usize, String) {
        let folder = folder(files);
        match Tokenizer::from_folder(folder.path()).unwrap_err() {
            Error::Vocabulary {
                path,
                line,
                message,
                ..
            } => {
                let name = path.strip_prefix(folder.path()).unwrap();
                (name.to_owned(), line, message)
            }
            other => panic!("{other}"),
        }
    }

    #[test]
    fn bytes_have_different_symbols_in_the_order_of_clip() {
        let symbols: Vec<char> = bytes_in_order().map(byte_symbol).collect();
        let expected = ('!'..='~')
            .chain('\u{A1}'..='\u{AC}')
            .chain('\u{AE}'..='\u{FF}');
        let expected: Vec<char> = expected.chain('\u{100}'..='\u{143}').collect();
        assert_eq!(symbols, expected);
        assert_eq!(symbols.len(), 256);
        assert_eq!(byte_symbol(b' '), 'Ġ');
        assert_eq!(to_symbols("é"), "Ã©");
    }

    #[test]
    fn the_embedded_vocabulary_is_that_of_clip() {
        let vocabulary = embedded();
        assert_eq!(vocabulary.bpe.get_vocab_size(), 49_408);
        // Radford et al. (2021): the marks are the last two ids.
        assert_eq!(
            (vocabulary.start, vocabulary.end, vocabulary.pad),
            (49_406, 49_407, 49_407)
        );
        let id = |token| vocabulary.bpe.token_to_id(token);
        assert_eq!(
            [id("!"), id("ship</w>"), id("jekyll</w>")],
            [Some(0), Some(1158), Some(49_405)]
        );
    }

    #[test]
    fn the_same_vocabulary_from_files_gives_the_same_tokens() {
        let (vocab, merges) = (vocab_json(), merges_txt());
        let list: Vec<&str> = merges.lines().skip(1).collect();
        let pairs: Vec<(&str, &str)> = list
            .iter()
            .map(|line| line.split_once(' ').unwrap())
            .collect();
        let whole = |merges: String| {
            format!(
                "{{\"version\": \"1.0\", \"model\": {{\"type\": \"BPE\", \"vocab\": {vocab}, \"merges\": {merges}}}}}"
            )
        };
        let files = folder(&[("vocab.json", &vocab), ("merges.txt", &merges)]);
        let old = folder(&[(
            "tokenizer.json",
            &whole(serde_json::to_string(&list).unwrap()),
        )]);
        let new = folder(&[(
            "tokenizer.json",
            &whole(serde_json::to_string(&pairs).unwrap()),
        )]);
        for folder in [files, old, new] {
            let tokenizer = Tokenizer::from_folder(folder.path()).unwrap();
            for prompt in [
                "",
                "A ship's wake, 19.5 deg!",
                "schön 海 🚢 antidisestablishmentarianism",
            ] {
                assert_eq!(
                    tokenizer.encode(prompt),
                    Tokenizer::clip().encode(prompt),
                    "{prompt}"
                );
            }
        }
    }

    const SMALL: &str =
        "{\"a\": 0,\n\"b</w>\": 1,\n\"ab</w>\": 2,\n\"<|startoftext|>\": 3,\n\"<|endoftext|>\": 4}";

    #[test]
    fn a_small_vocabulary_works_and_its_unknown_bytes_become_the_end_mark() {
        let special = "{\"pad_token\": {\"content\": \"a\"}}";
        let files = [
            ("vocab.json", SMALL),
            ("merges.txt", "a b</w>"),
            ("special_tokens_map.json", special),
        ];
        let model = tempfile::tempdir().unwrap();
        std::fs::create_dir(model.path().join("tokenizer")).unwrap();
        for (name, text) in files {
            write(model.path().join("tokenizer").join(name), text).unwrap();
        }
        let tokens = Tokenizer::from_folder(model.path())
            .unwrap()
            .encode("AB zb");
        assert_eq!(tokens.ids[..6], [3, 2, 4, 1, 4, 0]);
        assert_eq!(tokens.ids[76], 0);
    }

    #[test]
    fn broken_files_are_named_with_the_line() {
        let vocab = ("vocab.json", SMALL);
        let bad_vocab = |text| broken_at(&[("vocab.json", text), ("merges.txt", "a b</w>")]);
        let bad_merges = |text| broken_at(&[vocab, ("merges.txt", text)]);
        let bad_whole = |text| broken_at(&[("tokenizer.json", text)]);
        let cases = [
            (
                bad_merges("#version: 0.2\na b</w>\nab\n"),
                "merges.txt",
                3,
                "'ab' is not a merge",
            ),
            (
                bad_merges("a b</w>\n\na b</w>"),
                "merges.txt",
                2,
                "'' is not a merge",
            ),
            (bad_merges("a  b</w>"), "merges.txt", 1, "one space"),
            (
                bad_merges("a b</w>\na c"),
                "merges.txt",
                2,
                "needs the token 'c'",
            ),
            (bad_merges("a a"), "merges.txt", 1, "needs the token 'aa'"),
            (
                bad_vocab("{\"a\": 0,\n\"b\": }"),
                "vocab.json",
                2,
                "expected value",
            ),
            (
                bad_vocab("{\"a\": 0,\n\"b\": -1}"),
                "vocab.json",
                2,
                "the id of 'b' is -1",
            ),
            (
                bad_vocab("{\"a\": 0,\n\"b\": 1,\n\"c\": 1}"),
                "vocab.json",
                3,
                "'c' and 'b' both have",
            ),
            (bad_vocab("{\"a\": 0,\n"), "vocab.json", 2, "EOF"),
            (
                bad_whole(
                    "{\"model\": {\"vocab\": {\"a\": 0, \"aa\": 1},\n\"merges\": [\"a a\",\n\"a\"]}}",
                ),
                "tokenizer.json",
                3,
                "'a' is not a merge",
            ),
            (
                bad_whole("{\"model\": {\"vocab\": {\"a\": 0},\n\"merges\": [\n7]}}"),
                "tokenizer.json",
                3,
                "7 is not a merge",
            ),
            (
                bad_whole("{\n\"version\": 1}"),
                "tokenizer.json",
                2,
                "missing field `model`",
            ),
        ];
        for ((path, line, message), expected_path, expected_line, words) in cases {
            assert_eq!(
                (path.to_str(), line),
                (Some(expected_path), expected_line),
                "{message}"
            );
            assert!(message.contains(words), "{message}");
        }
    }

    /// A saved vocabulary is read back with the same ids, words and padding.
    #[test]
    fn a_saved_vocabulary_comes_back() {
        let saved = TempDir::new().unwrap();
        let inner = saved.path().join("tokenizer");
        let mut vocabulary = embedded();
        vocabulary.pad = 0;
        vocabulary.save(&inner, 77).unwrap();
        let again = Vocabulary::from_folder(saved.path()).unwrap();
        let clip = embedded();
        assert_eq!(again.bpe.get_vocab(), clip.bpe.get_vocab());
        assert_eq!(
            (again.start, again.end, again.pad),
            (clip.start, clip.end, 0)
        );
        let blocked = inner.join("vocab.json");
        let refused = Tokenizer::clip().save(&blocked).unwrap_err();
        assert!(matches!(refused, Error::Write { .. }), "{refused}");
    }

    #[test]
    fn other_faults_of_a_folder_are_named_too() {
        let error = |files: &[(&str, &str)]| {
            Tokenizer::from_folder(folder(files).path())
                .unwrap_err()
                .to_string()
        };
        assert!(error(&[]).contains("needs vocab.json and merges.txt, or tokenizer.json"));
        let no_marks = error(&[("vocab.json", "{\"a\": 0}"), ("merges.txt", "")]);
        assert!(
            no_marks.contains("no token '<|startoftext|>'"),
            "{no_marks}"
        );
        let pad = ("special_tokens_map.json", "{\"pad_token\": \"!\"}");
        let no_pad = error(&[("vocab.json", SMALL), ("merges.txt", ""), pad]);
        assert!(no_pad.contains("no token '!'"), "{no_pad}");
        let folder = folder(&[("merges.txt", "")]);
        write(folder.path().join("vocab.json"), b"{\n\"\xFF\": 0}").unwrap();
        let not_utf8 = Tokenizer::from_folder(folder.path())
            .unwrap_err()
            .to_string();
        assert!(
            not_utf8.contains("vocab.json, line 2, column 2: this is not UTF-8"),
            "{not_utf8}"
        );
        let missing = Vocabulary::from_tokenizer_json(Path::new("nowhere.json")).unwrap_err();
        assert!(matches!(missing, Error::File { .. }));
    }

    proptest! {
        /// A file cut short, or with one byte changed, is read or refused without a panic; the line named in the
        /// error exists in the file.
        #[test]
        fn damaged_files_are_refused_with_a_line_of_theirs(
            cut in 0..SMALL.len(), byte in 0..128_u8, shorten in any::<bool>()
        ) {
            let mut text = SMALL.as_bytes().to_vec();
            text[cut] = byte;
            text.truncate(if shorten { cut } else { text.len() });
            let text = String::from_utf8(text).unwrap();
            let lines = text.split('\n').count();
            let whole = format!("{{\"model\": {{\"merges\": [], \"vocab\": {text}");
            let results = [
                parse_vocab(Path::new(""), &text).map(|_| ()),
                parse_merges(Path::new(""), &text, Some(&Vocab::new())).map(|_| ()),
                parse_tokenizer(Path::new(""), &whole).map(|_| ()),
            ];
            prop_assert!(!shorten || results[0].is_err());
            for result in results {
                if let Err(Error::Vocabulary { line, .. }) = result {
                    prop_assert!((1..=lines).contains(&line), "line {} of {}", line, lines);
                }
            }
        }
    }
}
