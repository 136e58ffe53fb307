//! The program as a user starts it: bad input ends with exit code 2, one sentence, and nothing written; every subcommand
//! runs once on little.

#[cfg(feature = "bench")]
mod bench;
#[cfg(feature = "dataset")]
mod dataset;
#[cfg(feature = "train")]
mod detector;
#[cfg(feature = "simulate")]
mod estimate;
#[cfg(feature = "train")]
mod evaluate;
#[cfg(feature = "export")]
mod export;
#[cfg(feature = "simulate")]
mod faults;
#[cfg(feature = "generate")]
mod generate;
#[cfg(feature = "locate")]
mod locate;
#[cfg(all(unix, feature = "train"))]
mod paper;
#[cfg(all(feature = "simulate", feature = "detect"))]
mod product;
#[cfg(feature = "train")]
mod sea;
mod shell;
#[cfg(feature = "simulate")]
mod simulate;
#[cfg(feature = "train")]
mod text_to_image;
#[cfg(feature = "train")]
mod train;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program at a subcommand, such as `train sea`, in the root of the repository.
fn program(subcommand: &str) -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_wake"));
    program
        .args(subcommand.split_whitespace())
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    program
}

fn run(name: &str, arguments: &[&str]) -> Output {
    program(name)
        .args(arguments)
        .output()
        .expect("a program that starts")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path in Unicode")
}

/// Runs a subcommand that must go well; gives what it printed.
fn done(name: &str, arguments: &[&str], out: &Path) -> String {
    let output = run(name, &[arguments, &["--out", text(out)]].concat());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name} {arguments:?}: {message}");
    String::from_utf8(output.stdout).expect("Unicode")
}

/// Runs a subcommand that must refuse with exit code 2 and one sentence that says all of `words`, print no result, and
/// leave `out` as it is.
fn refused_into(name: &str, arguments: &[&str], words: &[&str], out: &Path) {
    let before = out.exists().then(|| files(out));
    let output = run(name, &[arguments, &["--out", text(out)]].concat());
    let message = String::from_utf8(output.stderr).expect("Unicode");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
    // What the parser of the command line refuses has a hint below its sentence.
    let (sentence, hint) = message.split_once("\n\n").unwrap_or((&message, "For"));
    assert_eq!(sentence.trim_end().lines().count(), 1, "{message}");
    assert!(
        hint.starts_with("For") || hint.starts_with("Usage"),
        "{message}"
    );
    for word in words {
        assert!(sentence.contains(word), "no '{word}' in: {message}");
    }
    let after = out.exists().then(|| files(out));
    assert!(before == after, "{arguments:?} changed the folder");
}

/// The same into a folder that does not exist, and must not afterwards.
fn refused_by(name: &str, arguments: &[&str], words: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    refused_into(name, arguments, words, &folder.path().join("out"));
}

/// Every file below a folder, and its content; a folder has none.
fn files(folder: &Path) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            let below = files(&path).into_iter();
            let name = PathBuf::from(path.file_name().expect("a name"));
            found.extend(below.map(|(path, content)| (name.join(path), content)));
            found.insert(name, None);
        } else {
            let content = std::fs::read(&path).expect("a file");
            found.insert(path.file_name().expect("a name").into(), Some(content));
        }
    }
    found
}

/// A folder inside a file can be made by nobody, root included.
fn cannot_write(name: &str, arguments: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "kept").expect("a file");
    refused_into(name, arguments, &["file/out"], &file.join("out"));
    assert_eq!(std::fs::read_to_string(&file).expect("the file"), "kept");
}

/// Names of all files below a folder, in order.
fn names(folder: &Path) -> Vec<String> {
    let names = files(folder).into_keys();
    names.map(|name| text(&name).to_owned()).collect()
}
