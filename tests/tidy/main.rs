//! The architecture page holds: every room stands in it, imports point up its lists and never round in a circle, its
//! picture is that of the code, and files stay small. The page of scene keys is that of the types.
//!
//! `DRAW=1 cargo test --test tidy` writes picture and page anew.

mod crates;
mod imports;
mod pages;
mod picture;
mod quotes;
mod scene_keys;

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use imports::{Crate, Names};
use picture::Column;

/// The crates, in the order in which they import each other.
const CRATES: [&str; 11] = [
    "whole-files",
    "wake-physics",
    "wake-text",
    "wake-nn",
    "wake-dataset",
    "wake-ldm",
    "wake-detector",
    "wake-train",
    "wake-geo",
    "wake-product",
    "wake-map",
];

/// Longest source file [lines]: tests are not counted.
const LONGEST_FILE: usize = 450;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(name: &str) -> Crate {
    Crate::read(&root().join("crates").join(name).join("src"))
}

fn page() -> String {
    fs::read_to_string(root().join("docs/architecture.md")).expect("the page")
}

/// The rooms of a crate in the fenced list of the page, in the order of the data flow: a file, a folder, or the path of
/// one such as `wake_model/sampler`.
fn rooms(page: &str, name: &str) -> Vec<Names> {
    let fence = format!("```text {name}\n");
    let start = page
        .find(&fence)
        .unwrap_or_else(|| panic!("no list of {name}"));
    let body = &page[start + fence.len()..];
    let lines = body[..body.find("```").expect("an end of the list")].lines();
    let names = lines.filter_map(|line| line.split_whitespace().next());
    names
        .map(|room| room.split('/').map(str::to_owned).collect())
        .collect()
}

/// The room that a file lies in.
fn room_of(rooms: &[Names], module: &Names) -> Option<usize> {
    rooms.iter().position(|room| module.starts_with(room))
}

/// The edges between rooms: (importing, imported); files without a room are only folders of rooms.
fn edges(code: &Crate, rooms: &[Names]) -> BTreeSet<(usize, usize)> {
    let mut edges = BTreeSet::new();
    for module in code.files.keys() {
        let Some(here) = room_of(rooms, module) else {
            continue;
        };
        let there = code
            .imports(module)
            .into_iter()
            .filter_map(|other| room_of(rooms, &other));
        edges.extend(
            there
                .filter(|&there| there != here)
                .map(|there| (here, there)),
        );
    }
    edges
}

#[test]
fn every_file_has_its_room_and_every_room_its_files() {
    let page = page();
    let mut wrong = Vec::new();
    for name in CRATES {
        let (code, rooms) = (read(name), rooms(&page, name));
        assert!(code.files.len() > 1, "{name} has no sources");
        for (module, file) in &code.files {
            let holds_rooms = rooms.iter().any(|room| room.starts_with(module));
            if room_of(&rooms, module).is_none() && !holds_rooms {
                wrong.push(format!(
                    "{}: not in the list of {name}",
                    file.path.display()
                ));
            }
        }
        for room in &rooms {
            if !code.files.contains_key(room) {
                wrong.push(format!("{name}: {} is listed but gone", room.join("/")));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn imports_point_up_the_lists() {
    let page = page();
    let mut wrong = Vec::new();
    for name in CRATES {
        let (code, rooms) = (read(name), rooms(&page, name));
        for module in code.files.keys() {
            let Some(here) = room_of(&rooms, module) else {
                continue;
            };
            for other in code.imports(module) {
                if room_of(&rooms, &other).is_some_and(|there| there > here) {
                    wrong.push(format!(
                        "{name}: {} imports {} from below",
                        module.join("/"),
                        other.join("/")
                    ));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let mut wrong = Vec::new();
    for name in CRATES.into_iter().chain(["wake-cli"]) {
        for circle in read(name).circles() {
            let files: Vec<String> = circle.iter().map(|module| module.join("/")).collect();
            wrong.push(format!("{name}: {}", files.join(", ")));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Stable Diffusion and the wake model share rooms, and nothing of each other.
#[test]
fn the_two_models_do_not_import_each_other() {
    let code = read("wake-ldm");
    let mut wrong = Vec::new();
    let models = ["stable_diffusion", "wake_model"];
    for module in code.files.keys().filter(|module| !module.is_empty()) {
        for other in code.imports(module) {
            let two = [&module[0], other.first().unwrap_or(&module[0])];
            if two[0] != two[1] && two.iter().all(|room| models.contains(&room.as_str())) {
                wrong.push(format!("{} imports {}", module.join("/"), other.join("/")));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_picture_is_that_of_the_code() {
    let page = page();
    let columns = CRATES.map(|name| {
        let (code, rooms) = (read(name), rooms(&page, name));
        Column {
            title: name.to_owned(),
            edges: edges(&code, &rooms),
            rooms: rooms.iter().map(|room| room.join("/")).collect(),
        }
    });
    is_drawn("docs/architecture.svg", &picture::draw(&columns));
}

#[test]
fn the_page_of_scene_keys_is_that_of_the_code() {
    let (page, wrong) = scene_keys::page(&root().join("crates/wake-physics/src/scene"));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    is_drawn("docs/scene_keys.md", &page);
}

#[test]
fn links_of_all_pages_lead_somewhere() {
    let mut all = pages::pages(&root().join("docs"));
    all.extend(["README.md", "CHANGELOG.md"].map(|name| root().join(name)));
    all.extend(CRATES.map(|name| root().join("crates").join(name).join("README.md")));
    assert!(all.len() > 40, "only {} pages", all.len());
    let broken: Vec<String> = all
        .iter()
        .flat_map(|page| pages::broken_links(page))
        .collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// Every number that a page quotes from a report is the report's.
#[test]
fn numbers_of_the_pages_are_those_of_the_reports() {
    let mut all = pages::pages(&root().join("docs"));
    all.insert(root().join("README.md"));
    let mut wrong = Vec::new();
    let mut count = 0;
    for page in all {
        let (quotes, differ) = quotes::wrong_quotes(&page);
        count += quotes;
        wrong.extend(differ);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count >= 20, "only {count} numbers quoted");
}

/// Every page is in the book, decisions by way of their own list.
#[test]
fn the_book_has_every_page() {
    let docs = root().join("docs");
    let mut listed = BTreeSet::from([docs.join("SUMMARY.md")]);
    for (folder, list) in [("", "SUMMARY.md"), ("decisions", "decisions/README.md")] {
        let text = fs::read_to_string(docs.join(list)).expect("a list of pages");
        let links = pages::links(&text).into_iter();
        listed.extend(links.map(|link| docs.join(folder).join(link)));
    }
    let there = pages::pages(&docs);
    let apart: Vec<_> = there.symmetric_difference(&listed).collect();
    assert!(apart.is_empty(), "not in the book, or not there: {apart:?}");
}

/// The code of the front page is compiled where it stands a second time, in the documentation tests of the crates.
#[test]
fn code_of_the_front_page_is_compiled() {
    let blocks_of =
        |name: &str| pages::rust_blocks(&fs::read_to_string(root().join(name)).expect(name));
    let tested = [
        "crates/wake-physics/README.md",
        "crates/wake-ldm/README.md",
        "crates/wake-detector/README.md",
    ];
    let tested: Vec<Vec<String>> = tested.iter().flat_map(|name| blocks_of(name)).collect();
    let shown = blocks_of("README.md");
    assert!(shown.len() >= 2, "quickstarts of the front page");
    for block in shown {
        let code: Vec<&String> = block.iter().filter(|line| !line.is_empty()).collect();
        let stands = tested.iter().any(|tested| {
            let tested: Vec<&String> = tested.iter().filter(|line| !line.is_empty()).collect();
            tested.windows(code.len()).any(|lines| lines == code)
        });
        assert!(stands, "in no documentation test:\n{}", block.join("\n"));
    }
}

/// Each page of physics quotes formulas, and each formula stands line for line in the documentation of the module that
/// it is quoted from.
#[test]
fn formulas_of_the_pages_are_those_of_the_code() {
    let physics = root().join("crates/wake-physics/src");
    let mut wrong = Vec::new();
    let pages = pages::pages(&root().join("docs/physics"));
    assert!(pages.len() >= 6, "only {} pages of physics", pages.len());
    for page in pages {
        let quoted = pages::quoted_formulas(&fs::read_to_string(&page).expect("a page"));
        if quoted.is_empty() {
            wrong.push(format!("{}: quotes no formula of a module", page.display()));
        }
        for (module, lines) in quoted {
            let path = physics.join(module.replace("::", "/"));
            let files = [path.with_extension("rs"), path.join("mod.rs")];
            let source = files.iter().find_map(|file| fs::read_to_string(file).ok());
            let blocks = pages::documented_formulas(&source.unwrap_or_default());
            let stands = blocks.iter().any(|block| {
                !lines.is_empty() && block.windows(lines.len()).any(|part| part == lines)
            });
            if !stands {
                let formula = lines.join("\n");
                wrong.push(format!("{}: not in {module}:\n{formula}", page.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The rooms that read `Scene` are those that the page names.
#[test]
fn the_readers_of_the_scene_are_those_of_the_page() {
    let page = page();
    let (code, rooms) = (read("wake-physics"), rooms(&page, "wake-physics"));
    let paths = [&["scene", "Scene"][..], &["Scene"]];
    let readers = code.files.keys().filter(|module| !module.is_empty());
    let readers = readers.filter(|module| paths.iter().any(|path| code.names_item(module, path)));
    let mut readers: BTreeSet<String> = readers.map(|module| module[0].clone()).collect();
    readers.insert("scene".to_owned());
    assert!(rooms.len() > readers.len());
    let named = pages::listed(&page, "`Scene` is read by");
    assert_eq!(named, readers, "page and code name other readers");
}

/// The lists that tests of random numbers go through hold every stream there is.
#[test]
fn lists_of_streams_are_whole() {
    let source = |path: &str| fs::read_to_string(root().join("crates").join(path)).expect(path);
    let physics = source("wake-physics/src/random.rs");
    let train = source("wake-train/src/streams.rs");
    let (_, uses) = train.split_once("mod tests").expect("a test of streams");
    let (streams, rest) = physics
        .split_once("enum Stream {")
        .and_then(|(_, rest)| rest.split_once('}'))
        .expect("streams");
    let (_, list) = rest.split_once("const ALL").expect("a list of streams");
    let list = list.split_once("];").expect("an end of the list").0;
    let variants = streams.lines().filter_map(|line| {
        let name = line.trim().strip_suffix(',')?;
        (!name.starts_with('/')).then(|| (format!("Stream::{name}"), list))
    });
    let mut all: Vec<(String, &str)> = variants.collect();
    for name in ["wake-dataset", "wake-ldm", "wake-train"] {
        for line in source(&format!("{name}/src/streams.rs")).lines() {
            let rest = line.split_once("const ").map_or("", |(_, rest)| rest);
            if let Some((name, _)) = rest.split_once(": u32") {
                all.push((name.to_owned(), uses));
            }
        }
    }
    assert!(all.len() >= 25, "only {} streams", all.len());
    for (name, list) in all {
        let mut words = list.split(|c: char| !(c.is_alphanumeric() || "_:".contains(c)));
        assert!(words.any(|word| word == name), "{name} is in no list");
    }
}

/// Asserts that a file of the documentation is what the code makes of it, or writes it where `DRAW` is set.
fn is_drawn(name: &str, drawn: &str) {
    let path = root().join(name);
    if std::env::var_os("DRAW").is_some() {
        fs::write(&path, drawn).expect("a writable file");
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        kept == drawn,
        "{name} is old: `DRAW=1 cargo test -p wake --no-default-features --features checks --test tidy` writes it"
    );
}

#[test]
fn files_stay_small() {
    let mut wrong = Vec::new();
    for name in CRATES {
        for file in read(name)
            .files
            .values()
            .filter(|file| file.lines > LONGEST_FILE)
        {
            wrong.push(format!("{}: {} lines", file.path.display(), file.lines));
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
    for folder in [folder.join("satellite"), folder] {
        for entry in fs::read_dir(folder).expect("the folder") {
            let path = entry.expect("an entry").path();
            if path.is_file() {
                wake_physics::Scene::read(&path)
                    .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
                count += 1;
            }
        }
    }
    assert!(count >= 11, "only {count} scene files");
}
