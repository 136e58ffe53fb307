//! Attack on the readers of recipes, vocabularies and pictures, which need no burn; as `main.rs`.
//!
//! ```text
//! cargo test -p wake --no-default-features --features checks,dataset --test fuzz_files
//! ```

mod attack;
mod mutation;

use std::path::Path;

use attack::{attack, said, said_harmlessly, with_file};
use wake_dataset::{Recipe, Simulated};
use wake_geo::Product;
use wake_text::{TOKENS, Tokenizer};

/// A recipe that is read is also written, read again, and draws a scene or says why not.
#[test]
fn recipes() {
    attack("recipe", |input| {
        let text = String::from_utf8_lossy(input);
        let Some(recipe) = said_harmlessly(Recipe::from_toml(&text)) else {
            return;
        };
        let json = serde_json::to_string(&recipe).expect("JSON");
        let again: Recipe = serde_json::from_str(&json).expect("its own form");
        assert_eq!(again, recipe);
        if let Some(source) = said_harmlessly(Simulated::new(recipe, 7)) {
            said_harmlessly(source.scene(0));
        }
    });
}

/// Folders of a vocabulary, of which the input is one file or the other.
#[test]
fn vocabularies() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/vocabulary");
    let encode = |tokenizer: Tokenizer| {
        assert_eq!(tokenizer.encode("abba, 10 mps").ids.len(), TOKENS);
    };
    let layouts = [
        &["vocab.json", "merges.txt", "special_tokens_map.json"][..],
        &["tokenizer.json", "special_tokens_map.json"],
    ];
    let folders = layouts.map(|names| {
        let folder = tempfile::tempdir().expect("a folder");
        for name in names {
            std::fs::copy(corpus.join(name), folder.path().join(name)).expect("a file");
        }
        encode(Tokenizer::from_folder(folder.path()).expect("a vocabulary"));
        (folder, names)
    });
    attack("vocabulary", |input| {
        for (folder, names) in &folders {
            for name in *names {
                with_file(folder.path(), name, input, |path| {
                    if let Some(tokenizer) = said(Tokenizer::from_folder(folder.path())) {
                        encode(tokenizer);
                    }
                    std::fs::copy(corpus.join(name), path).expect("a file of the corpus");
                });
            }
        }
    });
}

/// Pictures that are decoded as a whole; the content decides on the format.
#[test]
fn pictures() {
    let folder = tempfile::tempdir().expect("a folder");
    attack("picture", |input| {
        with_file(folder.path(), "image", input, |path| {
            let Some(product) = said_harmlessly(Product::open(path)) else {
                return;
            };
            let (lines, pixels) = product.size();
            said_harmlessly(product.read_window(0..lines, 0..pixels));
        });
    });
}
