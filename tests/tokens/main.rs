//! Token ids against tokenizers that others wrote.
//!
//! `WAKE_FIXTURES` names the folder of the reference files; by default it is `tests/fixtures`.

use proptest::prelude::*;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use wake_text::{TOKENS, Tokenizer, Tokens};

#[derive(Deserialize)]
struct Fixture {
    cases: Vec<Case>,
}

/// A prompt and its ids by several tokenizers, as far as they differ from `ids`.
#[derive(Deserialize)]
struct Case {
    prompt: String,
    /// By Stable Diffusion's tokenizer with `ftfy`.
    ids: Vec<u32>,
    n_tokens: usize,
    truncated: bool,
    mask_len: usize,
    all_agree: bool,
    hf_fast_ids: Option<Vec<u32>>,
    hf_slow_without_ftfy_ids: Option<Vec<u32>>,
}

fn fixtures() -> PathBuf {
    std::env::var_os("WAKE_FIXTURES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures"),
        PathBuf::from,
    )
}

fn cases() -> Vec<Case> {
    let path = fixtures().join("tokenizer/prompts.json");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let fixture: Fixture = serde_json::from_str(&text).expect("the layout of prompts.json");
    assert!(!fixture.cases.is_empty(), "{} has no case", path.display());
    fixture.cases
}

fn encode(prompt: &str) -> Tokens {
    Tokenizer::clip().encode(prompt)
}

fn assert_same(tokens: &Tokens, case: &Case) {
    let Case {
        prompt,
        n_tokens,
        truncated,
        mask_len,
        ..
    } = case;
    assert_eq!(tokens.ids[..], case.ids[..], "{prompt:?}");
    assert_eq!(
        (tokens.token_count, tokens.truncated()),
        (*n_tokens, *truncated),
        "{prompt:?}"
    );
    let mask = tokens.mask.iter().filter(|&&kept| kept).count();
    assert_eq!(mask, *mask_len, "{prompt:?}");
}

#[test]
fn ids_where_any_clip_tokenizer_must_agree() {
    let mut count = 0;
    for case in cases().iter().filter(|case| case.all_agree) {
        assert_same(&encode(&case.prompt), case);
        count += 1;
    }
    assert!(count > 0, "no case says that all agree");
}

/// Whether a text holds what looks like UTF-8 read in a one-byte encoding (`Ã©` for `é`): the first byte of
/// a sequence, then what the second byte (0x80 to 0xBF) is in Windows-1252.
fn looks_misdecoded(text: &str) -> bool {
    let continues = |c: char| {
        matches!(c, '\u{80}'..='\u{BF}' | '\u{152}' | '\u{153}' | '\u{160}' | '\u{161}' | '\u{178}' | '\u{17D}'
            | '\u{17E}' | '\u{192}' | '\u{2C6}' | '\u{2DC}' | '\u{2013}'..='\u{203A}' | '\u{20AC}' | '\u{2122}')
    };
    let mut pairs = text.chars().zip(text.chars().skip(1));
    pairs.any(|(first, second)| matches!(first, '\u{C2}'..='\u{F4}') && continues(second))
}

/// Where the tokenizers part, ours follows Stable Diffusion's with `ftfy`. The listed exception is text
/// decoded with the wrong encoding, which is left as it is (table "not done" of `cleaning.md`).
#[test]
fn ids_where_tokenizers_part_follow_the_stated_cleaning() {
    for case in cases().iter().filter(|case| !case.all_agree) {
        let tokens = encode(&case.prompt);
        if !looks_misdecoded(&case.prompt) {
            assert_same(&tokens, case);
            continue;
        }
        let known = [
            Some(&case.ids),
            case.hf_fast_ids.as_ref(),
            case.hf_slow_without_ftfy_ids.as_ref(),
        ];
        let agrees = known.iter().flatten().any(|ids| ids[..] == tokens.ids[..]);
        assert!(
            agrees,
            "{:?}: {:?} is none of {known:?}",
            case.prompt, tokens.ids
        );
    }
}

/// `ftfy.json` holds prompts and what `ftfy` 6.3.1 makes of them, written by `generate_ftfy.py`.
#[test]
fn cleaning_does_what_ftfy_does() {
    let cases: Vec<(String, String)> = serde_json::from_str(include_str!("ftfy.json")).unwrap();
    assert_eq!(cases.len(), 400);
    for (prompt, fixed) in cases {
        // That tokenizer cleans nothing.
        let expected = instant(&fixed);
        let tokens = encode(&prompt);
        assert_eq!(
            tokens.ids[1..=expected.len()],
            expected,
            "{prompt:?} {fixed:?}"
        );
        assert_eq!(tokens.token_count, expected.len() + 2, "{prompt:?}");
    }
}

/// The vocabulary in the crate against the files of a Stable Diffusion folder, where there is one.
#[test]
fn a_stable_diffusion_folder_gives_the_same_ids() {
    let model = fixtures().join("pipeline_a");
    if !model.join("tokenizer/merges.txt").is_file() {
        println!("skipped: {} has no tokenizer", model.display());
        return;
    }
    let tokenizer = Tokenizer::from_folder(&model).unwrap();
    for case in cases() {
        assert_eq!(
            tokenizer.encode(&case.prompt),
            encode(&case.prompt),
            "{:?}",
            case.prompt
        );
    }
}

static INSTANT: LazyLock<instant_clip_tokenizer::Tokenizer> =
    LazyLock::new(instant_clip_tokenizer::Tokenizer::new);

/// Ids of all words, without marks.
fn instant(prompt: &str) -> Vec<u32> {
    let mut tokens = Vec::new();
    INSTANT.encode(prompt, &mut tokens);
    tokens
        .into_iter()
        .map(|token| u32::from(token.to_u16()))
        .collect()
}

fn assert_agrees_with_instant(prompt: &str) {
    let expected = instant(prompt);
    let tokens = encode(prompt);
    assert_eq!(tokens.token_count, expected.len() + 2, "{prompt:?}");
    let kept = expected.len().min(TOKENS - 2);
    assert_eq!(tokens.ids[1..=kept], expected[..kept], "{prompt:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Printable ASCII and white space; `&` and `<`, which may start an entity or a mark, apart below.
    #[test]
    fn random_ascii_has_the_ids_of_instant_clip_tokenizer(prompt in "[ -%'-;=-~\t\n\r]{0,120}") {
        assert_agrees_with_instant(&prompt);
    }

    #[test]
    fn random_words_have_the_ids_of_instant_clip_tokenizer(
        prompt in "(([a-zA-Z]{1,14}|[0-9.]{1,6}|'(s|ll|T)|[!-%(-/:-;=-@]{1,3}|& |< )[ ]?){0,30}"
    ) {
        assert_agrees_with_instant(&prompt);
    }
}

/// The table of rules of `Tokenizer::encode`, with `\u{…}` and `\t` as in Rust.
#[test]
fn the_documented_rules_of_cleaning_are_true() {
    let rules = include_str!("../../crates/wake-text/src/cleaning.md");
    let mut count = 0;
    for line in rules.lines().filter(|line| line.starts_with("| ")) {
        let cells: Vec<&str> = line.trim_matches('|').split(" | ").collect();
        let [.., prompt, same] = cells[..] else {
            panic!("{line}")
        };
        let code = |cell: &str| {
            cell.trim()
                .strip_prefix('`')?
                .strip_suffix('`')
                .map(unescape)
        };
        if let (Some(prompt), Some(same)) = (code(prompt), code(same)) {
            assert_eq!(encode(&prompt).ids, encode(&same).ids, "{line}");
            assert_ne!(prompt, same, "{line}");
            count += 1;
        }
    }
    assert_eq!(count, 11, "rules with an example");
    assert_eq!(
        encode("ship \t\u{a0}\u{3000} wake").ids,
        encode("ship wake").ids
    );
}

fn unescape(text: &str) -> String {
    let mut parts = text.split("\\u{");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (code, rest) = part.split_once('}').expect("a closing brace");
        let code = u32::from_str_radix(code, 16).expect("a hexadecimal number");
        out.push(char::from_u32(code).expect("a character"));
        out.push_str(rest);
    }
    out
}
