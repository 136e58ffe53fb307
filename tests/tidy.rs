//! The architecture page holds: every module stands in it, imports point up its lists, files stay small.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Longest source file [lines of code]: tests, comments and blank lines are not counted.
const LONGEST_FILE: usize = 300;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The fenced list of a crate in `docs/architecture.md`: one module a line, in the order of the data flow; modules
/// joined by `+` are one layer.
fn listed_modules(page: &str, name: &str) -> Vec<Vec<String>> {
    let fence = format!("```text {name}\n");
    let start = page
        .find(&fence)
        .unwrap_or_else(|| panic!("no list of {name}"));
    let body = &page[start + fence.len()..];
    body[..body.find("```").expect("an open fence")]
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .map(|layer| layer.split('+').map(str::to_owned).collect())
        .collect()
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") && !is_test(&path) {
            found.push(path);
        }
    }
}

/// Whether a file holds nothing but the tests of its neighbour.
fn is_test(path: &Path) -> bool {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    stem == "tests" || stem.ends_with("_tests")
}

/// The text before the tests, without comments.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("a readable file");
    let end = text.find("\n#[cfg(test)]\n").unwrap_or(text.len());
    text[..end]
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .collect::<Vec<_>>()
        .join("\n")
}

/// Modules named as `crate::NAME` in the code, also in braces.
fn imports(code: &str) -> Vec<String> {
    let mut names = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        let items = match rest.strip_prefix('{') {
            Some(list) => list[..list.find('}').unwrap_or(list.len())].to_owned(),
            None => rest.to_owned(),
        };
        let many = rest.starts_with('{');
        for item in items.split(',').take(if many { usize::MAX } else { 1 }) {
            let name: String = item
                .trim()
                .chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect();
            if name.chars().next().is_some_and(char::is_lowercase) {
                names.push(name);
            }
        }
    }
    names
}

fn module_of(path: &Path, src: &Path) -> String {
    let first = path.strip_prefix(src).expect("below src").iter().next();
    let name = first.expect("a name").to_string_lossy();
    name.trim_end_matches(".rs").to_owned()
}

#[test]
fn imports_point_up_the_lists_of_the_architecture_page() {
    let page = fs::read_to_string(root().join("docs/architecture.md")).expect("the page");
    let mut wrong = Vec::new();
    for name in ["wake-physics", "wake-text", "wake-ldm"] {
        let order: BTreeMap<String, usize> = listed_modules(&page, name)
            .into_iter()
            .enumerate()
            .flat_map(|(place, layer)| layer.into_iter().map(move |module| (module, place)))
            .collect();
        let src = root().join("crates").join(name).join("src");
        let mut files = Vec::new();
        sources(&src, &mut files);
        assert!(files.len() > 1, "{name} has no sources");
        for path in files {
            let module = module_of(&path, &src);
            if module == "lib" {
                continue;
            }
            let Some(&place) = order.get(&module) else {
                wrong.push(format!("{name}: {module} is not in the list"));
                continue;
            };
            for import in imports(&code(&path)) {
                let fault = match order.get(&import) {
                    Some(&other) if other <= place => continue,
                    Some(_) => "imported from below",
                    None => "not in the list",
                };
                wrong.push(format!("{}: {import} is {fault}", path.display()));
            }
        }
        for module in order.keys() {
            let there = src.join(module).is_dir() || src.join(format!("{module}.rs")).is_file();
            if !there {
                wrong.push(format!("{name}: {module} is listed but gone"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Only the files that know the order of things may reach across crates.
#[test]
fn crates_meet_in_few_files() {
    let mut wrong = Vec::new();
    let rules: [(&str, &str, &[&str]); 2] = [
        (
            "wake-ldm",
            "wake_physics",
            &["conditioning", "small", "sampler", "dataset", "error"],
        ),
        (
            "wake-ldm",
            "wake_text",
            &["conditioning", "pipeline", "sampler", "dataset", "error"],
        ),
    ];
    for (name, foreign, allowed) in rules {
        let src = root().join("crates").join(name).join("src");
        let mut files = Vec::new();
        sources(&src, &mut files);
        for path in files {
            let module = module_of(&path, &src);
            if code(&path).contains(foreign)
                && !allowed.contains(&module.as_str())
                && module != "lib"
            {
                wrong.push(format!("{} names {foreign}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn files_stay_small() {
    let mut wrong = Vec::new();
    let mut files = Vec::new();
    sources(&root().join("crates"), &mut files);
    for path in files.iter().filter(|p| p.iter().any(|part| part == "src")) {
        let lines = code(path)
            .lines()
            .filter(|line| !line.trim().is_empty())
            .count();
        if lines > LONGEST_FILE {
            wrong.push(format!("{}: {lines} lines", path.display()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The default scene file is the default scene, and every scene file is valid.
#[test]
fn scene_files_are_valid() {
    let folder = root().join("assets/scenes");
    let default = wake_physics::Scene::read(&folder.join("default.toml")).expect("the default");
    assert_eq!(default, wake_physics::Scene::default());
    let mut count = 0;
    for entry in fs::read_dir(folder).expect("the folder") {
        let path = entry.expect("an entry").path();
        wake_physics::Scene::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        count += 1;
    }
    assert!(count >= 5, "only {count} scene files");
}
