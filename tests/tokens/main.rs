//! Token ids against tokenizers that others wrote.

use serde::Deserialize;
use std::path::PathBuf;
use wake_text::Tokenizer;

#[derive(Deserialize)]
struct Fixture {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    prompt: String,
    ids: Vec<u32>,
    n_tokens: usize,
    truncated: bool,
    mask_len: usize,
    all_agree: bool,
}

fn cases() -> Vec<Case> {
    let folder = std::env::var_os("WAKE_FIXTURES").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures")),
        PathBuf::from,
    );
    let path = folder.join("tokenizer/prompts.json");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let fixture: Fixture = serde_json::from_str(&text).unwrap();
    assert!(!fixture.cases.is_empty(), "{} has no case", path.display());
    fixture.cases
}

#[test]
fn all_tokenizers_agree_where_any_clip_tokenizer_must() {
    for case in cases().iter().filter(|case| case.all_agree) {
        let tokens = Tokenizer::clip().encode(&case.prompt);
        assert_eq!(tokens.ids[..], case.ids[..], "{:?}", case.prompt);
    }
}

#[test]
fn others() {
    for case in cases().iter() {
        let tokens = Tokenizer::clip().encode(&case.prompt);
        if tokens.ids[..] != case.ids[..] { println!("DIFF {:?}", case.prompt); }
        else { assert_eq!((tokens.token_count, tokens.truncated(), tokens.mask.iter().filter(|m| **m).count()), (case.n_tokens, case.truncated, case.mask_len)); }
    }
}
