//! Inputs of a corpus and near it, and what may be said of them.

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::time::Duration;

use arbtest::arbtest;

use crate::mutation;

/// No sentence about an input is longer [characters].
const LONGEST: usize = 4000;

/// Replays the corpus of a target, then mutates it for a while.
pub(crate) fn attack(target: &str, check: impl Fn(&[u8])) {
    let corpus = corpus(target);
    assert!(!corpus.is_empty(), "no corpus for {target}");
    corpus.iter().for_each(|input| check(input));
    let seconds = std::env::var("FUZZ_SECONDS").ok();
    let seconds = seconds.map_or(1.0, |text| text.parse().expect("FUZZ_SECONDS is a number"));
    let executions = Cell::new(corpus.len());
    arbtest(|u| {
        let input = mutation::mutated(u, &corpus)?;
        check(&input);
        executions.set(executions.get() + 1);
        Ok(())
    })
    .budget(Duration::from_secs_f64(seconds));
    println!("{target}: {} executions", executions.get());
}

fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fuzz/corpus")
        .join(target);
    let entries = std::fs::read_dir(&folder).expect("a corpus");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    paths
        .iter()
        .map(|path| std::fs::read(path).expect("a file"))
        .collect()
}

/// The value, or nothing after a look at the sentence.
pub(crate) fn said<T, E: std::fmt::Display>(result: Result<T, E>) -> Option<T> {
    match result {
        Ok(value) => Some(value),
        Err(error) => {
            let sentence = error.to_string();
            let length = sentence.chars().count();
            assert!(length > 0 && length < LONGEST, "{length} characters");
            None
        }
    }
}

/// As [`said`], of an error that no foreign control character may be in.
pub(crate) fn said_harmlessly<T, E: std::fmt::Display>(result: Result<T, E>) -> Option<T> {
    if let Err(error) = &result {
        let sentence = error.to_string();
        assert!(!sentence.contains(char::is_control), "{sentence:?}");
    }
    said(result)
}

/// A folder with one file, whose content is the input.
pub(crate) fn with_file<T>(
    folder: &Path,
    name: &str,
    input: &[u8],
    work: impl FnOnce(&Path) -> T,
) -> T {
    let path = folder.join(name);
    std::fs::write(&path, input).expect("a file");
    work(&path)
}
