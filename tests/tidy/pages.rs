//! The pages of the documentation: links, the book's table of contents, code in the front page.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Every Markdown page below a folder.
pub(crate) fn pages(folder: &Path) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    for entry in fs::read_dir(folder).expect("a folder of pages") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(pages(&path));
        } else if path.extension().is_some_and(|end| end == "md") {
            found.insert(path);
        }
    }
    found
}

/// Links of a page that lead nowhere: no file there, or no heading of that name.
pub(crate) fn broken_links(page: &Path) -> Vec<String> {
    let text = fs::read_to_string(page).expect("a page");
    let folder = page.parent().expect("a folder");
    let mut broken = Vec::new();
    for target in links(&text) {
        if target.contains("://") {
            continue;
        }
        let (file, heading) = target.split_once('#').unwrap_or((&target, ""));
        let file = match file {
            "" => page.to_owned(),
            file => folder.join(file),
        };
        let is_heading = |text: &str| {
            text.lines()
                .any(|line| anchor(line) == Some(heading.to_owned()))
        };
        let there = match fs::read_to_string(&file) {
            Ok(text) => heading.is_empty() || is_heading(&text),
            Err(_) => heading.is_empty() && file.exists(),
        };
        if !there {
            broken.push(format!("{}: {target}", page.display()));
        }
    }
    broken
}

/// Targets of the links and pictures of a page, code excepted.
pub(crate) fn links(text: &str) -> Vec<String> {
    let links = titled_links(text).into_iter();
    links.map(|(_, target, _)| target).collect()
}

/// Text, target and title of the links and pictures of a page, code excepted: `[text](target "title")`.
pub(crate) fn titled_links(text: &str) -> Vec<(String, String, String)> {
    let mut fenced = false;
    let lines = text.lines().filter(|line| {
        let fence = line.trim_start().starts_with("```");
        fenced ^= fence;
        !fenced && !fence && !line.starts_with("    ")
    });
    let lines: Vec<&str> = lines.collect();
    let text = lines.join(" ");
    // Every second piece between backticks is code.
    let prose: String = text.split('`').step_by(2).collect();
    let ends = prose.match_indices("](").filter_map(|(at, _)| {
        let label = &prose[prose[..at].rfind('[')? + 1..at];
        let rest = &prose[at + 2..];
        let (target, rest) = rest.split_at(rest.find([' ', ')'])?);
        let title = rest
            .strip_prefix(" \"")
            .and_then(|title| title.split_once("\")"));
        let title = title.map_or("", |(title, _)| title);
        Some((label.to_owned(), target.to_owned(), title.to_owned()))
    });
    ends.collect()
}

/// The name under which a heading is linked.
fn anchor(line: &str) -> Option<String> {
    let title = line.strip_prefix('#')?.trim_start_matches('#').trim();
    let letters = title.to_lowercase();
    let kept = letters
        .chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    Some(kept.map(|c| if c == ' ' { '-' } else { c }).collect())
}

/// Blocks of Rust in a page: their lines, without those that documentation hides.
pub(crate) fn rust_blocks(text: &str) -> Vec<Vec<String>> {
    let mut blocks = Vec::new();
    let mut block: Option<Vec<String>> = None;
    for line in text.lines() {
        let line = line
            .strip_prefix("//!")
            .map_or(line, |rest| rest.strip_prefix(' ').unwrap_or(rest));
        match (&mut block, line.strip_prefix("```")) {
            (None, Some(kind)) => {
                block = ["", "rust", "no_run"].contains(&kind).then(Vec::new);
                if block.is_none() {
                    // Another language: collected and dropped.
                    block = Some(vec!["not Rust".to_owned()]);
                }
            }
            (Some(lines), Some(_)) => {
                if lines.first().is_none_or(|line| line != "not Rust") {
                    blocks.push(std::mem::take(lines));
                }
                block = None;
            }
            (Some(lines), None) if !(line == "#" || line.starts_with("# ")) => {
                lines.push(line.to_owned());
            }
            _ => {}
        }
    }
    blocks
}

/// Formulas that a page quotes from a module: blocks fenced as `text` with the path of a module, as (path, lines).
pub(crate) fn quoted_formulas(text: &str) -> Vec<(String, Vec<String>)> {
    let mut found = Vec::new();
    let mut block: Option<(String, Vec<String>)> = None;
    for line in text.lines() {
        match (&mut block, line.strip_prefix("```")) {
            (None, Some(kind)) => {
                let path = kind.strip_prefix("text ").unwrap_or_default();
                block = Some((path.trim().to_owned(), Vec::new()));
            }
            (Some(_), Some(_)) => found.extend(block.take().filter(|(path, _)| !path.is_empty())),
            (Some((_, lines)), None) => lines.extend(words(line)),
            (None, None) => {}
        }
    }
    found
}

/// Formulas in the documentation of a module: the lines of each of its blocks of text.
pub(crate) fn documented_formulas(source: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    let mut block: Option<Vec<String>> = None;
    for line in source.lines() {
        let line = line.trim_start();
        let comment = line.strip_prefix("//!").or(line.strip_prefix("///"));
        match (&mut block, comment.map(str::trim)) {
            (None, Some("```text")) => block = Some(Vec::new()),
            (Some(_), Some("```")) => found.extend(block.take()),
            (Some(lines), Some(line)) => lines.extend(words(line)),
            (_, None) => block = None,
            _ => {}
        }
    }
    found
}

/// A line with single spaces between its words; none of an empty one.
fn words(line: &str) -> Option<String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    (!words.is_empty()).then(|| words.join(" "))
}

/// The words in backticks of the sentence that begins so.
pub(crate) fn listed(text: &str, beginning: &str) -> BTreeSet<String> {
    let start = text.find(beginning).expect(beginning) + beginning.len();
    let sentence = text[start..].split([';', '.']).next().unwrap_or_default();
    let names = sentence.split('`').skip(1).step_by(2);
    names.map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_are_found_outside_code() {
        let text = "[a](b.md) and `[c](d.md)` ![e](f.png)\n```text\n[g](h.md)\n```\n[i](#j)";
        assert_eq!(links(text), ["b.md", "f.png", "#j"]);
        assert_eq!(
            anchor("## How far the arms open").as_deref(),
            Some("how-far-the-arms-open")
        );
    }

    #[test]
    fn formulas_are_quoted_with_their_module() {
        let page = "```text sar::geometry\na =  b\n\nc = d\n```\n```text\nno\n```\n```rust\nlet a = b;\n```";
        let lines = ["a = b", "c = d"].map(str::to_owned).to_vec();
        assert_eq!(
            quoted_formulas(page),
            [("sar::geometry".to_owned(), lines.clone())]
        );
        let source = "//! ```text\n//! a = b\n//!  c = d\n//! ```\n    /// ```\n    /// a();\n    /// ```\nfn a() {}";
        assert_eq!(documented_formulas(source), [lines]);
        let list = listed(
            "So `a` is read by `b`, `c` and `d`; `e` is not.",
            "`a` is read by",
        );
        assert_eq!(list, ["b", "c", "d"].map(str::to_owned).into());
    }

    #[test]
    fn blocks_are_those_of_rust_without_hidden_lines() {
        let text = "//! ```\n//! let a = 1;\n//! # hidden();\n//! ```\n```text\nno\n```\n```rust\n# fn main() {\nb();\n```";
        assert_eq!(rust_blocks(text), [["let a = 1;"], ["b();"]]);
    }
}
