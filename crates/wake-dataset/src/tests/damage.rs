//! Damage to a set is refused wherever the set is read, with the name of the file and the next step.

use super::*;

/// A set of quick-looks, whose grey levels depend on each image.
fn manifest() -> Manifest {
    let quick_look = "draw.quick_look.gain = [0.1, 0.4]";
    let recipe = super::manifest().recipe.with_assignments(&[quick_look]);
    Manifest::new(recipe.unwrap(), 11, COUNT).unwrap()
}

fn whole() -> Tree {
    let folder = TempDir::new().unwrap();
    made(folder.path(), &manifest());
    tree(folder.path())
}

/// Results of a run that continues the set, and of reading all its pairs.
fn told(files: &Tree) -> [Result<(), String>; 2] {
    let folder = TempDir::new().unwrap();
    plant(folder.path(), files);
    let continued = write(folder.path(), &manifest(), 2, |_| ());
    if continued.is_err() {
        assert!(tree(folder.path()) == *files, "something was changed");
    }
    let read = || -> Result<()> {
        let set = Folder::open(folder.path())?;
        (0..COUNT).try_for_each(|index| set.pair(index).map(drop))
    };
    plant(folder.path(), files);
    [continued, read()].map(|told| told.map_err(|error| error.to_string()))
}

/// A pipe in place of a file is refused, because opening it would block until something writes to it.
#[test]
fn pipes_are_no_files_of_a_set() {
    let whole = whole();
    for name in ["metadata.jsonl", "images/000001.png"] {
        let folder = TempDir::new().unwrap();
        plant(folder.path(), &whole);
        let file = folder.path().join(name);
        fs::remove_file(&file).unwrap();
        let made = std::process::Command::new("mkfifo").arg(&file).status();
        assert!(made.unwrap().success());
        let read = || -> Result<()> {
            let set = Folder::open(folder.path())?;
            (0..COUNT).try_for_each(|index| set.pair(index).map(drop))
        };
        let refused = read().unwrap_err().to_string();
        assert!(
            refused.contains("not a regular file") && refused.contains(name),
            "{refused}"
        );
    }
}

fn changed(files: &Tree, name: &str, change: impl FnOnce(&mut Vec<u8>)) -> Tree {
    let mut files = files.clone();
    change(files.get_mut(Path::new(name)).unwrap());
    files
}

#[test]
fn another_image_over_one_of_the_set_is_refused() {
    let whole = whole();
    let other = whole[Path::new("images/000003.png")].clone();
    let swapped = changed(&whole, "images/000001.png", |image| *image = other);
    for told in told(&swapped) {
        let told = told.unwrap_err();
        assert!(
            told.contains("000001.png") && told.contains("line 2"),
            "{told}"
        );
        assert!(told.contains("remove the file"), "{told}");
    }
    assert_eq!(told(&whole), [Ok(()), Ok(())]);
}

/// One flipped bit of an image, a line or the manifest is refused.
#[test]
fn one_bit_is_enough() {
    let whole = whole();
    let random = NoiseSource::new(3);
    let places = ["images/000002.png", "metadata.jsonl", "dataset.json"];
    for (stream, name) in places.into_iter().enumerate() {
        let length = whole[Path::new(name)].len();
        for k in 0..60_u64 {
            let draw = |n: u64| random.uniform(stream as u32, 2 * k + n);
            let (at, bit) = ((draw(0) * length as f64) as usize, (draw(1) * 8.0) as u32);
            let damaged = changed(&whole, name, |bytes| bytes[at] ^= 1 << bit);
            for (who, told) in ["run", "training"].iter().zip(told(&damaged)) {
                // An incomplete last line looks like a killed run, so a run makes it again.
                let cut = name == "metadata.jsonl" && at + 1 == length && *who == "run";
                let is_refused = told.as_ref().is_err_and(|told| told.contains(name));
                assert!(
                    cut || is_refused,
                    "{who}, {name}, byte {at}, bit {bit}: {told:?}"
                );
            }
        }
    }
}

/// Changed amplitudes, prompts, labels and lines of other pairs are refused.
#[test]
fn changed_texts_are_refused() {
    let whole = whole();
    let log = String::from_utf8(whole[Path::new("metadata.jsonl")].clone()).unwrap();
    let lines: Vec<&str> = log.lines().collect();
    let second_amplitude = lines[2].replacen("\"amplitudes\":[", "\"amplitudes\":[1", 1);
    let caption = lines[2].replacen("Simulated", "simulated", 1);
    for line in [&second_amplitude, &caption, lines[4]] {
        assert_ne!(line, lines[2]);
        let text = log.replacen(lines[2], line, 1);
        let damaged = changed(&whole, "metadata.jsonl", |log| *log = text.into_bytes());
        for told in told(&damaged) {
            let told = told.unwrap_err();
            assert!(told.contains("metadata.jsonl, line 3: "), "{told}");
        }
    }
    for folder in ["labels", "labels-obb", "labelTxt"] {
        let name = format!("{folder}/000004.txt");
        let damaged = changed(&whole, &name, |text| text.extend(b"0 0.5 0.5 0.1 0.1\n"));
        let [continued, _] = told(&damaged);
        let told = continued.unwrap_err();
        assert!(
            told.contains(&name) && told.contains("remove the file"),
            "{told}"
        );
    }
}

/// A damaged shard is not joined.
#[test]
fn damaged_shards_are_not_joined() {
    let start = two_shards();
    for name in ["shard-1/images/000005.png", "shard-1/metadata.jsonl"] {
        let damaged = changed(&start, name, |bytes| bytes[40] ^= 1);
        let folder = TempDir::new().unwrap();
        plant(folder.path(), &damaged);
        let told = refused(merge(folder.path()), folder.path());
        assert!(told.contains(name), "{told}");
        assert_eq!(tree(folder.path()), damaged);
    }
}

/// Another shard number would assign the lines to other pairs.
#[test]
fn a_changed_note_of_a_shard_is_refused() {
    let folder = TempDir::new().unwrap();
    let part = shard(1, 7);
    made(folder.path(), &part);
    let note = folder.path().join("shard.json");
    let text = fs::read_to_string(&note).unwrap();
    fs::write(&note, text.replacen('1', "2", 1)).unwrap();
    let told = refused(Folder::open(folder.path()), folder.path());
    assert!(told.contains("metadata.jsonl, line 1"), "{told}");
}

/// An image that comes out differently, as with another processor or version, is refused because it does not match its line.
#[test]
fn a_lost_image_that_comes_out_otherwise_is_refused() {
    let folder = TempDir::new().unwrap();
    let on_sea = Manifest {
        sea: Some("one".to_owned()),
        ..manifest()
    };
    let write = |seed: u64| {
        let source = on_sea.source()?.with_sea(noisy_sea(seed, None))?;
        super::super::write(folder.path(), &on_sea, &source, 1, |_| ())
    };
    write(2).unwrap();
    fs::remove_file(folder.path().join("images/000003.png")).unwrap();
    let before = tree(folder.path());
    let told = refused(write(3), folder.path());
    assert!(told.contains("metadata.jsonl, line 4"), "{told}");
    assert_eq!(tree(folder.path()), before);
}

/// Sets of earlier versions have no checksums and are refused.
#[test]
fn sets_of_earlier_formats_are_refused_in_a_sentence() {
    let folder = TempDir::new().unwrap();
    let old = Manifest {
        format: 4,
        ..manifest()
    };
    let text = serde_json::to_string_pretty(&old).unwrap();
    fs::write(folder.path().join("dataset.json"), text).unwrap();
    for told in [
        refused(Folder::open(folder.path()), folder.path()),
        refused(write(folder.path(), &manifest(), 1, |_| ()), folder.path()),
    ] {
        assert!(
            told.contains("format is 4, expected 5; make the set again"),
            "{told}"
        );
    }
}
