//! The command line itself: help, completions and manual pages.

use super::{names, program, text};

fn printed(subcommand: &str) -> String {
    let output = program(subcommand).output().expect("a program that starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{subcommand}: {message}");
    String::from_utf8(output.stdout).expect("Unicode")
}

#[test]
fn help_fits_on_a_screen_of_24_lines() {
    let help = printed("--help");
    assert!(help.lines().count() <= 24, "{help}");
    assert!(
        help.lines().all(|line| line.chars().count() <= 100),
        "{help}"
    );
    for line in help.lines().filter(|line| line.starts_with("  ")) {
        let words = line.split_whitespace().count();
        assert!(words > 2, "a subcommand without a description: {line}");
    }
}

#[test]
fn every_subcommand_has_help_and_the_version() {
    let help = printed("--help");
    let list = help
        .split("Commands:")
        .nth(1)
        .expect("a list of subcommands");
    let lines = list.lines().take_while(|line| !line.starts_with("Options"));
    let names: Vec<&str> = lines
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert!(names.contains(&"completions") && names.contains(&"man"));
    for name in names {
        assert!(
            printed(&format!("{name} --help")).contains("Usage"),
            "{name}"
        );
        let version = printed(&format!("{name} --version"));
        assert!(version.contains(env!("CARGO_PKG_VERSION")), "{version}");
    }
}

#[test]
fn shells_complete_the_subcommands() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = printed(&format!("completions {shell}"));
        assert!(script.contains("completions"), "{shell}: {script}");
    }
    let other = program("completions tcsh").output().expect("an answer");
    assert_eq!(other.status.code(), Some(2));
}

#[test]
fn the_program_and_its_subcommands_have_manual_pages() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("man");
    let output = program("man").arg(&out).output().expect("an answer");
    assert!(output.status.success());
    let pages = names(&out);
    assert!(pages.contains(&"wake.1".to_owned()), "{pages:?}");
    assert!(pages.contains(&"wake-man.1".to_owned()), "{pages:?}");
    #[cfg(feature = "train")]
    assert!(pages.contains(&"wake-train-sea.1".to_owned()), "{pages:?}");
    let file = folder.path().join("file");
    std::fs::write(&file, "").expect("a file");
    let refused = program("man")
        .arg(file.join("man"))
        .output()
        .expect("an answer");
    let message = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{message}");
    assert!(
        message.contains("file/man") && text(&file).len() > 1,
        "{message}"
    );
}

#[test]
fn what_is_no_subcommand_is_named() {
    let output = program("simulat").output().expect("an answer");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(message.contains("simulat"), "{message}");
}
