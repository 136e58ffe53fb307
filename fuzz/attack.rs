//! Inputs of a corpus and near it, and what may be said of them.

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::time::Duration;

use arbitrary::Unstructured;
use arbtest::arbtest;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

use crate::mutation;

/// No sentence about an input is longer [characters].
const LONGEST: usize = 4000;

/// Replays the corpus of a target, then mutates it: for the seconds of `FUZZ_SECONDS`, by default 1, or so many times as
/// `FUZZ_EXECUTIONS` says, from the seeds 0, 1, 2, ….
pub(crate) fn attack(target: &str, check: impl Fn(&[u8])) {
    let corpus = corpus(target);
    assert!(!corpus.is_empty(), "no corpus for {target}");
    corpus.iter().for_each(|input| check(input));
    if let Some(count) = variable::<u64>("FUZZ_EXECUTIONS") {
        for seed in 0..count {
            let entropy = entropy(seed);
            let _named = Named { target, seed };
            if let Ok(input) = mutation::mutated(&mut Unstructured::new(&entropy), &corpus) {
                check(&input);
            }
        }
        println!("{target}: {count} executions");
        return;
    }
    let seconds = variable("FUZZ_SECONDS").unwrap_or(1.0);
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

/// A number from the environment.
fn variable<T: std::str::FromStr<Err: std::fmt::Debug>>(name: &str) -> Option<T> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().expect("a number"))
}

/// Bytes that a mutation is drawn from.
fn entropy(seed: u64) -> Vec<u8> {
    let mut bytes = vec![0; 512];
    Xoshiro256PlusPlus::seed_from_u64(seed).fill_bytes(&mut bytes);
    bytes
}

/// Names the seed of an input that broke something.
struct Named<'a> {
    target: &'a str,
    seed: u64,
}

impl Drop for Named<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("{}: FUZZ_EXECUTIONS seed {}", self.target, self.seed);
        }
    }
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
