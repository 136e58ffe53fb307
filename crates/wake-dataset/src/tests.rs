//! Data sets on disk: the same bytes however they are made, nothing lost, no foreign files accepted.

use super::*;
use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use wake_nn::noise::NoiseSource;
use wake_physics::{Field, Scene};
use whole_files::{sealed, unsealed};

const COUNT: u64 = 7;

/// A small set: 24 × 20 pixels, with and without ships.
fn manifest() -> Manifest {
    let changes = [
        "scene.grid.rows = 24",
        "scene.grid.columns = 20",
        "scene.grid.spacing = 20",
        "scene.ship.echo = true",
        "draw.count = { one_of = [0, 1], weights = [2, 3] }",
        "speckle = true",
        "draw.ship.length = [20, 300]",
    ];
    let recipe = Recipe::default().with_assignments(&changes).unwrap();
    Manifest::new(recipe, 11, COUNT).unwrap()
}

fn shard(number: u64, of: u64) -> Manifest {
    Manifest {
        shard: Some(Shard { number, of }),
        ..manifest()
    }
}

/// Writes the set of a manifest from the manifest's source.
fn write(
    folder: &Path,
    manifest: &Manifest,
    jobs: usize,
    watch: impl FnMut(Progress),
) -> Result<()> {
    super::write(folder, manifest, &manifest.source()?, jobs, watch)
}

/// Content of every file below a folder, by relative path.
type Tree = BTreeMap<PathBuf, Vec<u8>>;

fn tree(folder: &Path) -> Tree {
    let mut files = Tree::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_owned();
                files.insert(name, fs::read(path).unwrap());
            }
        }
    }
    files
}

fn plant(folder: &Path, files: &Tree) {
    for (name, content) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }
}

/// The whole set, made in one run.
fn whole() -> Tree {
    let folder = TempDir::new().unwrap();
    write(folder.path(), &manifest(), 1, |_| ()).unwrap();
    tree(folder.path())
}

fn made(folder: &Path, manifest: &Manifest) -> u64 {
    let mut made = 0;
    write(folder, manifest, 2, |progress| made = progress.made).unwrap();
    made
}

#[test]
fn the_files_are_those_of_the_documentation() {
    let names: Vec<String> = whole().keys().map(|p| p.display().to_string()).collect();
    let mut expected = vec![
        "coco.json".to_owned(),
        "data.yaml".into(),
        "dataset.json".into(),
    ];
    expected.extend((0..COUNT).map(|i| format!("images/00000{i}.png")));
    for folder in ["labelTxt", "labels", "labels-obb"] {
        expected.extend((0..COUNT).map(|i| format!("{folder}/00000{i}.txt")));
    }
    expected.extend(["metadata.jsonl", "trainset.txt", "valset.txt"].map(String::from));
    assert_eq!(names, expected);
}

#[test]
fn jobs_and_shards_change_no_byte() {
    let whole = whole();
    for jobs in [2, 3, 16] {
        let folder = TempDir::new().unwrap();
        write(folder.path(), &manifest(), jobs, |_| ()).unwrap();
        assert_eq!(tree(folder.path()), whole, "{jobs} jobs");
    }
    // More shards than pairs, too.
    for of in [1, 2, 3, 9] {
        let folder = TempDir::new().unwrap();
        for number in (0..of).rev() {
            let shard = shard(number, of);
            write(
                &shard_folder(folder.path(), shard.shard.unwrap()),
                &shard,
                2,
                |_| (),
            )
            .unwrap();
        }
        assert_eq!(merge(folder.path()).unwrap(), manifest());
        assert_eq!(tree(folder.path()), whole, "{of} shards");
        assert!(!shard_folder(folder.path(), Shard { number: 0, of }).exists());
    }
}

/// Whatever a killed run left, the next run makes only the missing pairs and ends with the same set.
#[test]
fn a_killed_run_continues() {
    let whole = whole();
    let metadata = PathBuf::from("metadata.jsonl");
    let log = whole[&metadata].clone();
    let ends: Vec<usize> = (0..log.len())
        .filter(|&i| log[i] == b'\n')
        .map(|i| i + 1)
        .collect();
    for lines in 0..COUNT as usize {
        let kept = if lines == 0 { 0 } else { ends[lines - 1] };
        // Killed between two lines, within one, and one byte before its end; images are two ahead of the lines.
        for cut in [kept, kept + 40, ends[lines] - 1] {
            let folder = TempDir::new().unwrap();
            let mut left = whole.clone();
            left.retain(|name, _| {
                !matches!(
                    name.to_str(),
                    Some("coco.json" | "trainset.txt" | "valset.txt" | "data.yaml")
                )
            });
            left.insert(metadata.clone(), log[..cut].to_vec());
            let ahead = (lines as u64 + 2).min(COUNT);
            for index in ahead..COUNT {
                left.retain(|name, _| !name.to_string_lossy().contains(&format!("{index:06}")));
            }
            left.insert("images/.000003.png.99.tmp".into(), b"half".to_vec());
            plant(folder.path(), &left);
            assert_eq!(made(folder.path(), &manifest()), COUNT - lines as u64);
            assert_eq!(tree(folder.path()), whole, "{lines} lines, cut at {cut}");
        }
    }
    // Killed while or before writing the manifest.
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join(".dataset.json.1.tmp"), "{").unwrap();
    assert_eq!(made(folder.path(), &manifest()), COUNT);
    assert_eq!(tree(folder.path()), whole);
    // Finished already.
    assert_eq!(made(folder.path(), &manifest()), 0);
    assert_eq!(tree(folder.path()), whole);
}

/// A set continues even if its numbers are ones that a JSON reader may get wrong in the last place.
#[test]
fn a_set_with_awkward_numbers_continues() {
    let changes = [
        "draw.sea.depth = 65.43210987654321",
        "draw.ship.roll = 1.2345678901234567e-23",
    ];
    let recipe = manifest().recipe.with_assignments(&changes).unwrap();
    let manifest = Manifest::new(recipe, 3, 4).unwrap();
    let folder = TempDir::new().unwrap();
    assert_eq!(made(folder.path(), &manifest), 4);
    assert_eq!(made(folder.path(), &manifest), 0);
    let shards = TempDir::new().unwrap();
    for number in 0..2 {
        let shard = Shard { number, of: 2 };
        let part = Manifest {
            shard: Some(shard),
            ..manifest.clone()
        };
        made(&shard_folder(shards.path(), shard), &part);
    }
    merge(shards.path()).unwrap();
    assert_eq!(tree(shards.path()), tree(folder.path()));
}

#[test]
fn lost_files_are_made_again() {
    let whole = whole();
    for lost in [
        "images/000002.png",
        "labels/000005.txt",
        "labels-obb/000001.txt",
        "labelTxt/000000.txt",
    ] {
        let folder = TempDir::new().unwrap();
        plant(folder.path(), &whole);
        fs::remove_file(folder.path().join(lost)).unwrap();
        assert_eq!(made(folder.path(), &manifest()), 1);
        assert_eq!(tree(folder.path()), whole, "{lost}");
    }
    let folder = TempDir::new().unwrap();
    plant(folder.path(), &whole);
    fs::write(folder.path().join("images/000000.png"), "").unwrap();
    assert_eq!(made(folder.path(), &manifest()), 1);
    assert_eq!(tree(folder.path()), whole);
}

/// The files of two shards of the set.
fn two_shards() -> Tree {
    let folder = TempDir::new().unwrap();
    for number in 0..2 {
        let shard = shard(number, 2);
        write(
            &shard_folder(folder.path(), shard.shard.unwrap()),
            &shard,
            2,
            |_| (),
        )
        .unwrap();
    }
    tree(folder.path())
}

/// A merge that was killed after any move, or while removing the shards, ends with the same set when repeated.
#[test]
fn a_killed_merge_continues() {
    let (whole, start) = (whole(), two_shards());
    let check = |left: &Tree, state: &str| {
        let folder = TempDir::new().unwrap();
        plant(folder.path(), left);
        merge(folder.path()).unwrap();
        assert_eq!(tree(folder.path()), whole, "{state}");
        let shard = shard_folder(folder.path(), Shard { number: 1, of: 2 });
        assert!(!shard.exists(), "{state}");
    };
    let movable: Vec<&PathBuf> = start
        .keys()
        .filter(|p| p.components().count() == 3)
        .collect();
    assert_eq!(movable.len(), 4 * COUNT as usize);
    let mut left = start.clone();
    left.insert(
        "dataset.json".into(),
        whole[Path::new("dataset.json")].clone(),
    );
    for name in movable {
        check(&left, &format!("before {}", name.display()));
        let content = left.remove(name).unwrap();
        left.insert(name.iter().skip(1).collect(), content);
    }
    for name in [
        "metadata.jsonl",
        "coco.json",
        "trainset.txt",
        "valset.txt",
        "data.yaml",
    ] {
        check(&left, &format!("before {name}"));
        left.insert(name.into(), whole[Path::new(name)].clone());
    }
    let leftovers: Vec<PathBuf> = left
        .keys()
        .filter(|p| p.starts_with("shard-0"))
        .cloned()
        .collect();
    assert_eq!(leftovers.len(), 7);
    for name in [
        "coco.json",
        "trainset.txt",
        "valset.txt",
        "data.yaml",
        "metadata.jsonl",
        "shard.json",
        "dataset.json",
    ] {
        check(&left, &format!("before removing {name}"));
        left.remove(&Path::new("shard-0").join(name));
    }
    check(&left, "without shard 0");
}

/// Folders that only look like shards of the set are kept.
#[test]
fn a_merge_removes_nothing_foreign() {
    let folder = TempDir::new().unwrap();
    plant(folder.path(), &two_shards());
    let other = Manifest {
        seed: 99,
        ..shard(0, 2)
    };
    let path = folder.path().join("shard-7");
    write(&path, &other, 1, |_| ()).unwrap();
    let before = tree(&path);
    merge(folder.path()).unwrap();
    assert_eq!(tree(&path), before);
    assert_eq!(merge(folder.path()).unwrap(), manifest());
    assert_eq!(tree(&path), before);
}

/// Returns the error's message and asserts that it names the folder.
fn refused<T>(result: Result<T>, folder: &Path) -> String {
    let message = result.err().expect("an error").to_string();
    assert!(message.contains(&folder.display().to_string()), "{message}");
    message
}

#[test]
fn foreign_folders_are_refused_and_left_alone() {
    let folder = TempDir::new().unwrap();
    let path = folder.path();
    fs::write(path.join("thesis.txt"), "years of work").unwrap();
    let message = refused(write(path, &manifest(), 1, |_| ()), path);
    assert!(message.contains("not empty"), "{message}");
    assert_eq!(tree(path).len(), 1);
    assert!(refused(Folder::open(path), path).contains("wake dataset"));
    fs::write(path.join("dataset.json"), "{\n\"info\": 3}").unwrap();
    for message in [
        refused(write(path, &manifest(), 1, |_| ()), path),
        refused(Folder::open(path), path),
    ] {
        assert!(message.contains("dataset.json, line 2"), "{message}");
    }
}

#[test]
fn other_sets_are_refused() {
    let folder = TempDir::new().unwrap();
    plant(folder.path(), &whole());
    let other_recipe = Recipe {
        draw: Draw::Values(Draws::default()),
        ..manifest().recipe
    };
    for other in [
        Manifest {
            seed: 12,
            ..manifest()
        },
        Manifest {
            count: 8,
            ..manifest()
        },
        Manifest {
            recipe: other_recipe,
            ..manifest()
        },
        shard(0, 2),
    ] {
        let message = refused(write(folder.path(), &other, 1, |_| ()), folder.path());
        assert!(
            message.contains("another recipe, seed, count or shard"),
            "{message}"
        );
    }
}

/// Records the kinds of the values at and below a path, and asserts that each path has one kind.
fn kinds(path: &str, value: &serde_json::Value, found: &mut BTreeMap<String, &'static str>) {
    use serde_json::Value;
    let kind = match value {
        Value::Null => return,
        Value::Bool(_) => "truth",
        Value::Number(_) => "number",
        Value::String(_) => "text",
        Value::Array(_) => "list",
        Value::Object(_) => "object",
    };
    let before = *found.entry(path.to_owned()).or_insert(kind);
    assert_eq!(before, kind, "{path} changes");
    if let Value::Array(parts) = value {
        parts
            .iter()
            .for_each(|part| kinds(&format!("{path}[]"), part, found));
    }
    if let Value::Object(parts) = value {
        parts
            .iter()
            .for_each(|(key, part)| kinds(&format!("{path}.{key}"), part, found));
    }
}

/// Each column holds one kind of value, as table readers require, although scenes of several sensors have words and numbers
/// under one key.
#[test]
fn columns_hold_one_kind_of_value() {
    let small = ["scene.grid.rows = 24", "scene.grid.columns = 24"];
    let recipe = Recipe::detector()
        .unwrap()
        .with_assignments(&small)
        .unwrap();
    let manifest = Manifest::new(recipe, 3, 12).unwrap();
    let folder = TempDir::new().unwrap();
    made(folder.path(), &manifest);
    let lines = fs::read_to_string(folder.path().join("metadata.jsonl")).unwrap();
    let mut found = BTreeMap::new();
    for line in lines.lines() {
        kinds("", &serde_json::from_str(line).unwrap(), &mut found);
    }
    assert_eq!((found[".scene"], found[".ship_speed"]), ("text", "number"));
}

#[test]
fn broken_lines_are_named() {
    let mut files = whole();
    let metadata = PathBuf::from("metadata.jsonl");
    let text = String::from_utf8(files[&metadata].clone()).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let spoilt = |at: usize, line: &str| {
        let mut lines = lines.clone();
        lines[at] = line;
        lines.join("\n") + "\n"
    };
    let other_value = lines[4].replace("\"incidence\":", "\"incidence\":1");
    for (at, line) in [
        (2, "{\"file_name\":"),
        (0, ""),
        (6, lines[5]),
        (4, &other_value),
    ] {
        let folder = TempDir::new().unwrap();
        files.insert(metadata.clone(), spoilt(at, line).into_bytes());
        plant(folder.path(), &files);
        let message = refused(write(folder.path(), &manifest(), 1, |_| ()), folder.path());
        assert!(
            message.contains(&format!("metadata.jsonl, line {}:", at + 1)),
            "{message}"
        );
        // Nothing was changed silently.
        assert_eq!(tree(folder.path()), files);
    }
    for (text, line) in [(text.clone() + &text, COUNT + 1), (spoilt(3, "[]"), 4)] {
        let folder = TempDir::new().unwrap();
        files.insert(metadata.clone(), text.into_bytes());
        plant(folder.path(), &files);
        let message = refused(Folder::open(folder.path()), folder.path());
        assert!(
            message.contains(&format!("metadata.jsonl, line {line}:")),
            "{message}"
        );
    }
}

#[test]
fn unfinished_sets_are_neither_read_nor_merged() {
    let folder = TempDir::new().unwrap();
    let path = folder.path();
    assert!(refused(merge(path), path).contains("shard 0 is missing"));
    for number in [0, 2] {
        let shard = shard(number, 3);
        write(&shard_folder(path, shard.shard.unwrap()), &shard, 1, |_| ()).unwrap();
    }
    assert!(refused(merge(path), path).contains("shard 1 is missing"));
    let middle = shard(1, 3);
    let middle_path = shard_folder(path, middle.shard.unwrap());
    write(
        &middle_path,
        &Manifest {
            seed: 1,
            ..middle.clone()
        },
        1,
        |_| (),
    )
    .unwrap();
    assert!(refused(merge(path), path).contains("not shard 1 of the same set"));
    fs::remove_dir_all(&middle_path).unwrap();
    write(&middle_path, &middle, 1, |_| ()).unwrap();
    let before = tree(path);
    let metadata = middle_path.join("metadata.jsonl");
    let text = fs::read_to_string(&metadata).unwrap();
    fs::write(&metadata, text.lines().next().unwrap().to_owned() + "\n").unwrap();
    for message in [
        refused(merge(path), path),
        refused(Folder::open(&middle_path), path),
    ] {
        assert!(message.contains("1 of"), "{message}");
    }
    fs::write(&metadata, text).unwrap();
    fs::remove_file(middle_path.join("images/000003.png")).unwrap();
    assert!(refused(merge(path), path).contains("000003.png is missing"));
    made(&middle_path, &middle);
    assert_eq!(tree(path), before);
}

/// Pairs read back equal the pairs that were made, up to rounding of grey to 8 bits.
#[test]
fn a_folder_is_read_back() {
    let folder = TempDir::new().unwrap();
    plant(folder.path(), &whole());
    let set = Folder::open(folder.path()).unwrap();
    assert_eq!((set.len(), set.manifest()), (COUNT, &manifest()));
    let source: Simulated = manifest().source().unwrap();
    for index in 0..COUNT {
        let (read, made) = (set.pair(index).unwrap(), source.pair(index).unwrap());
        let pixels = read.image.pixels.iter().zip(&made.image.pixels);
        // Half a level, and the rounding of both numbers.
        assert!(pixels.fold(0f32, |max, (a, b)| max.max((a - b).abs())) <= 0.5 / 255.0 + 1e-6);
        let without = |pair: Pair| Pair {
            image: Grey::of_levels(&[], 0, 0),
            ..pair
        };
        assert_eq!(without(read), without(made));
    }
    assert!(refused(set.pair(COUNT), folder.path()).contains("no pair 7; the set has 7 pairs"));
    fs::write(folder.path().join("images/000001.png"), "no picture").unwrap();
    refused(set.pair(1), folder.path());
}

#[test]
fn a_full_disk_is_one_sentence_and_loses_nothing() {
    let whole = whole();
    let folder = TempDir::new().unwrap();
    let path = folder.path();
    plant(path, &whole);
    // A folder in place of a file makes the system refuse the write, as on a full disk.
    fs::remove_file(path.join("images/000004.png")).unwrap();
    fs::create_dir_all(path.join("images/000004.png/x")).unwrap();
    fs::remove_file(path.join("labels/000004.txt")).unwrap();
    let message = refused(write(path, &manifest(), 2, |_| ()), path);
    assert!(
        message.starts_with("cannot write") && message.contains("000004.png"),
        "{message}"
    );
    fs::remove_dir_all(path.join("images/000004.png")).unwrap();
    assert_eq!(made(path, &manifest()), 1);
    assert_eq!(tree(path), whole);
}

/// Every image is in one list, the share is exact to half an image, and other seeds choose other images. Repeated scenes of
/// the paper's grid are in one split.
#[test]
fn training_and_validation_share_no_scene() {
    let split = |manifest: &Manifest| -> Vec<bool> {
        (0..manifest.count).map(|i| manifest.is_val(i)).collect()
    };
    let set = |seed| Manifest {
        seed,
        count: 200,
        ..manifest()
    };
    for share in [0.0, 0.1, 0.333, 1.0] {
        let val = split(&set(1).with_val_share(share).unwrap());
        let count = val.iter().filter(|&&v| v).count() as f64;
        assert!((count - 200.0 * share).abs() <= 0.5, "{share}: {count}");
    }
    assert_ne!(split(&set(1)), split(&set(2)));
    assert!(
        set(1)
            .with_val_share(1.5)
            .unwrap_err()
            .to_string()
            .contains("val_share is 1.5")
    );
    let grid = Manifest::new(Recipe::paper(), 1, 8000).unwrap();
    let val = split(&grid);
    assert!((0..8000).all(|i| val[i] == val[i % 3456]));
    let whole = whole();
    let list = |name: &str| String::from_utf8(whole[Path::new(name)].clone()).unwrap();
    let (train, val) = (list("trainset.txt"), list("valset.txt"));
    let mut all: Vec<&str> = train.lines().chain(val.lines()).collect();
    all.sort_unstable();
    let images: Vec<String> = (0..COUNT)
        .map(|i| format!("./images/00000{i}.png"))
        .collect();
    assert_eq!(all, images);
    assert_eq!(val.lines().count(), 1);
    let folder = tempfile::tempdir().unwrap();
    made(folder.path(), &manifest());
    let learnt = Folder::open(folder.path()).unwrap().trainset();
    let learnt = learnt.iter().map(|i| format!("./images/00000{i}.png"));
    assert!(learnt.eq(train.lines()));
}

#[test]
fn shards_cover_every_index_once() {
    for (count, of) in [(10, 3), (3, 10), (1, 1), (1000, 7), (u64::MAX, 3)] {
        let mut next = 0;
        for number in 0..of {
            let part = Manifest {
                count,
                shard: Some(Shard { number, of }),
                ..manifest()
            };
            let indices = part.indices();
            assert_eq!(indices.start, next);
            assert!((indices.end - indices.start).abs_diff(count / of) <= 1);
            next = indices.end;
        }
        assert_eq!(next, count);
    }
    assert_eq!("2/16".parse(), Ok(Shard { number: 2, of: 16 }));
    for text in ["", "3", "4/4", "-1/4", "1/0", "a/b", "1/2/3"] {
        assert!(text.parse::<Shard>().is_err(), "{text}");
    }
}

/// σ⁰ can be recovered from a quick-look and its line, to half a level where grey is not saturated; an existing set is
/// accepted.
#[test]
fn quick_looks_can_be_undone() {
    let changes = [
        "draw.quick_look.gain = [0.1, 0.4]",
        "draw.quick_look.offset = [-0.05, 0.05]",
        "draw.count = 1",
        "speckle = false",
    ];
    let manifest = Manifest {
        recipe: manifest().recipe.with_assignments(&changes).unwrap(),
        count: 2,
        ..manifest()
    };
    let folder = TempDir::new().unwrap();
    assert_eq!(made(folder.path(), &manifest), 2);
    assert_eq!(made(folder.path(), &manifest), 0);
    let set = Folder::open(folder.path()).unwrap();
    let mut compared = 0;
    for index in 0..2 {
        let pair = set.pair(index).unwrap();
        let [dark, bright] = pair.amplitudes.expect("a quick-look");
        let power = wake_physics::simulate(&pair.scene)
            .unwrap()
            .intensity
            .values;
        for (grey, power) in pair.image.pixels.iter().zip(power) {
            if (0.01..0.99).contains(grey) {
                let found = dark + f64::from(*grey) * (bright - dark);
                let apart = (found - f64::from(power).sqrt()).abs();
                assert!(apart <= 0.501 / 255.0 * (bright - dark), "{apart}");
                compared += 1;
            }
        }
    }
    assert!(compared > 400, "{compared}");
}

/// With one amplitude mapping for a whole set, σ⁰ can be recovered from any image and the manifest, to half a level where grey
/// is not saturated.
#[test]
fn grey_in_amplitude_can_be_undone() {
    let scale = wake_physics::grey::GreyScale::amplitude_around(0.05);
    let changes = [
        format!("grey.darkest_db = {}", scale.darkest_db),
        format!("grey.brightest_db = {}", scale.brightest_db),
        "grey.mapping = \"amplitude\"".to_owned(),
        "draw.count = 1".to_owned(),
        "speckle = false".to_owned(),
    ];
    let recipe = manifest().recipe.with_assignments(&changes).unwrap();
    let manifest = Manifest::new(recipe, 11, 2).unwrap();
    assert_eq!(manifest.grey, scale);
    let folder = TempDir::new().unwrap();
    assert_eq!(made(folder.path(), &manifest), 2);
    let set = Folder::open(folder.path()).unwrap();
    let mut compared = 0;
    for index in 0..2 {
        let pair = set.pair(index).unwrap();
        assert_eq!(pair.amplitudes, None);
        let image = wake_physics::simulate(&pair.scene).unwrap().intensity;
        for (&grey, &power) in pair.image.pixels.iter().zip(&image.values) {
            if (0.01..0.99).contains(&grey) {
                let found = set.manifest().grey.sigma0(f64::from(grey)).sqrt();
                let white = 10f64.powf(0.05 * scale.brightest_db);
                let apart = (found - f64::from(power).sqrt()).abs();
                assert!(apart <= 0.501 / 255.0 * white, "{apart}");
                compared += 1;
            }
        }
    }
    assert!(compared > 400, "{compared}");

    // A manifest with two different mappings is refused.
    let path = folder.path().join("dataset.json");
    let text = fs::read_to_string(&path).unwrap();
    let object = unsealed(text.trim_end()).unwrap();
    let differs = sealed(&object.replacen("-60.0", "-50.0", 1)) + "\n";
    fs::write(&path, differs).unwrap();
    let error = Folder::open(folder.path()).unwrap_err().to_string();
    assert!(error.contains("grey and recipe.grey differ"), "{error}");
}

/// A sea of white noise.
#[derive(Debug)]
struct NoisySea {
    seed: u64,
    spacing: Option<f64>,
}

impl Sea for NoisySea {
    fn check_spacing(&self, spacing: f64) -> Result<()> {
        match self.spacing {
            Some(own) if own.to_bits() != spacing.to_bits() => {
                let message = format!("pixels of {spacing} m, the sea has {own} m");
                Err(Error::Recipe { message })
            }
            _ => Ok(()),
        }
    }

    fn image(&self, scene: &Scene) -> Result<Field> {
        let [rows, columns] = [scene.grid.rows, scene.grid.columns];
        let noise = NoiseSource::new(scene.seed ^ self.seed).normal(0, rows * columns);
        Ok(Field {
            rows,
            columns,
            values: noise.into_iter().map(|n| (1.0 + 0.1 * n).powi(2)).collect(),
        })
    }
}

fn white_sea(spacing: Option<f64>) -> NoisySea {
    noisy_sea(2, spacing)
}

/// White noise with another seed.
fn noisy_sea(seed: u64, spacing: Option<f64>) -> NoisySea {
    NoisySea { seed, spacing }
}

/// A learnt sea changes only the images; the manifest names the sea, and a run with another sea, or without one, is refused.
#[test]
fn a_learnt_sea_changes_images_alone() {
    let recipe = manifest().recipe;
    let source = || manifest().source().unwrap();
    let on_sea = source().with_sea(white_sea(Some(20.0))).unwrap();
    let of_sea = |name: &str| Manifest {
        sea: Some(name.to_owned()),
        ..manifest()
    };
    let folder = TempDir::new().unwrap();
    super::write(folder.path(), &of_sea("one"), &on_sea, 2, |_| ()).unwrap();
    let (plain, drawn) = (whole(), tree(folder.path()));
    // Lines differ only in the checksums of their images.
    let lines = |tree: &Tree| -> Vec<serde_json::Value> {
        let text = String::from_utf8_lossy(&tree[Path::new("metadata.jsonl")]).into_owned();
        let mut lines: Vec<serde_json::Value> = text
            .lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect();
        for line in &mut lines {
            (line["image_crc32"], line["crc32"]) = Default::default();
        }
        lines
    };
    assert_eq!(lines(&plain), lines(&drawn));
    for (path, content) in &plain {
        if path.ends_with("metadata.jsonl") {
            continue;
        }
        let differs = path.starts_with("images") || path.ends_with("dataset.json");
        assert_eq!(drawn[path] != *content, differs, "{}", path.display());
    }
    assert_eq!(plain.len(), drawn.len());
    let read = Folder::open(folder.path()).unwrap();
    assert_eq!(read.manifest().sea.as_deref(), Some("one"));
    let pair = on_sea.pair(3).unwrap();
    assert_eq!(pair.image.levels(), read.pair(3).unwrap().image.levels());
    let refused = |manifest: &Manifest, source: &Simulated| {
        let refused = super::write(folder.path(), manifest, source, 1, |_| ());
        refused.unwrap_err().to_string()
    };
    assert!(refused(&of_sea("two"), &on_sea).contains("another recipe"));
    assert!(refused(&of_sea("one"), &source()).contains("without a learnt sea"));
    assert!(refused(&manifest(), &on_sea).contains("on a learnt sea"));
    let other = Simulated::new(recipe, 12).unwrap();
    assert!(refused(&manifest(), &other).contains("another recipe or seed"));
    assert_eq!(tree(folder.path()), drawn);
    let fine = source()
        .with_sea(white_sea(Some(4.0)))
        .unwrap_err()
        .to_string();
    assert!(fine.contains("20 m") && fine.contains("4 m"), "{fine}");
}

mod damage;
mod numbers;
mod recipes;
