//! Which crate may depend on which, as cargo resolves it.

use std::collections::BTreeSet;
use std::process::Command;

/// Normal dependencies of a crate with some features, all the way down, by `cargo tree`.
fn dependencies(name: &str, features: &str) -> BTreeSet<String> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let arguments = ["tree", "--offline", "--edges", "normal", "--prefix", "none"];
    let output = Command::new(cargo)
        .args(arguments)
        .args(["--format", "{p}", "--package", name])
        .args(["--no-default-features", "--features", features])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs");
    assert!(
        output.status.success(),
        "{name}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8(output.stdout).expect("Unicode");
    let names = text.lines().filter_map(|line| line.split(' ').next());
    let mut names: BTreeSet<String> = names.map(str::to_owned).collect();
    assert!(names.remove(name), "{name} is not in its own tree");
    names
}

/// The crates of the architecture page depend on nothing that they may not know.
#[test]
fn crates_do_not_know_what_they_may_not() {
    let cases: [(&str, &str, &[&str]); 14] = [
        ("whole-files", "", &["burn", "wake-"]),
        ("wake-nn", "flex", &["wake-"]),
        ("wake-nn", "", &["burn", "wake-"]),
        ("wake-physics", "", &["burn", "wake-"]),
        ("wake-geo", "", &["burn", "wake-"]),
        ("wake-product", "", &["burn", "wake-text", "wake-dataset"]),
        (
            "wake-map",
            "",
            &["wake-physics", "wake-text", "wake-dataset", "wake-ldm"],
        ),
        ("wake-text", "scene", &["burn"]),
        ("wake-text", "", &["burn", "wake-"]),
        ("wake-dataset", "", &["burn", "wake-ldm", "wake-train"]),
        ("wake-dataset", "burn", &["wake-ldm", "wake-train"]),
        ("wake-ldm", "flex,wake-model,dataset", &["wake-train"]),
        ("wake-ldm", "flex", &["wake-physics", "wake-dataset"]),
        (
            "wake-detector",
            "flex",
            &[
                "wake-physics",
                "wake-text",
                "wake-dataset",
                "wake-ldm",
                "tokenizers",
            ],
        ),
    ];
    for (name, features, forbidden) in cases {
        let found = dependencies(name, features);
        let wrong: Vec<&String> = found
            .iter()
            .filter(|other| {
                forbidden
                    .iter()
                    .any(|f| other.as_str() == *f || (f.ends_with('-') && other.starts_with(f)))
            })
            .collect();
        assert!(
            wrong.is_empty(),
            "{name} with '{features}' depends on {wrong:?}"
        );
    }
}
