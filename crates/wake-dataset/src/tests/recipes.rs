//! Sets of every recipe, interrupted and continued.

use super::*;

/// Number of pairs in a set, some with a ship and some without.
const PAIRS: u64 = 6;

/// Small sets of every built-in recipe, and of `ranges` and `paper` with other kinds of grey.
fn sets() -> Vec<(String, Manifest)> {
    let quick_look = [
        "draw.quick_look.gain = [0.1, 0.4]",
        "draw.quick_look.offset = [-0.05, 0.05]",
    ];
    let small = ["scene.grid.rows = 24", "scene.grid.columns = 20"];
    let named =
        ["paper", "ranges", "satellites", "detector", "model"].map(|name| (name, Vec::new()));
    let more = [
        ("ranges", quick_look.to_vec()),
        (
            "ranges",
            vec![
                "grey.mapping = \"amplitude\"",
                "grey.brightest_db = -5.013497650000001",
            ],
        ),
        ("paper", quick_look[..1].to_vec()),
    ];
    let all = named.into_iter().chain(more);
    all.map(|(name, changes)| {
        let changes = [&small[..], &changes].concat();
        let recipe = Recipe::named(name).and_then(|r| r.with_assignments(&changes));
        let manifest = Manifest::new(recipe.unwrap(), 7, PAIRS).unwrap();
        (format!("{name} {changes:?}"), manifest)
    })
    .collect()
}

/// Interrupts a set at several places and asserts that the next run makes only the missing pairs and ends with the same bytes;
/// a run of a complete set changes nothing.
fn check(what: &str, manifest: &Manifest, source: &Simulated) {
    let folder = TempDir::new().unwrap();
    let run = |folder: &Path| -> Result<u64> {
        let mut made = 0;
        super::super::write(folder, manifest, source, 2, |progress| made = progress.made)?;
        Ok(made)
    };
    run(folder.path()).unwrap();
    let whole = tree(folder.path());
    let again = run(folder.path()).map_err(|error| error.to_string());
    assert_eq!(again, Ok(0), "{what}");
    assert_eq!(tree(folder.path()), whole, "{what}");
    let log = &whole[Path::new("metadata.jsonl")];
    let ends = log.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
    let ends: Vec<usize> = ends.map(|(at, _)| at + 1).collect();
    for lines in 1..PAIRS {
        let mut left = whole.clone();
        left.remove(Path::new("coco.json"));
        let cut = ends[lines as usize - 1] + 30;
        left.insert("metadata.jsonl".into(), log[..cut].to_vec());
        left.retain(|name, _| {
            !name
                .to_string_lossy()
                .contains(&format!("{:06}", PAIRS - 1))
        });
        // The image of a pair with a line is lost, too.
        left.remove(Path::new("images/000000.png"));
        let folder = TempDir::new().unwrap();
        plant(folder.path(), &left);
        let made = run(folder.path()).map_err(|error| error.to_string());
        assert_eq!(made, Ok(PAIRS - lines + 1), "{what}");
        assert_eq!(tree(folder.path()), whole, "{what}, {lines} lines");
    }
}

#[test]
fn sets_of_every_recipe_continue() {
    for (what, manifest) in sets() {
        check(&what, &manifest, &manifest.source().unwrap());
    }
}

/// A manifest and its lines are read back unchanged, and shards join to the bytes of the whole set.
#[test]
fn sets_of_every_recipe_are_read_and_joined() {
    for (what, manifest) in sets() {
        let folder = TempDir::new().unwrap();
        made(folder.path(), &manifest);
        let set = Folder::open(folder.path()).unwrap();
        assert_eq!(set.manifest(), &manifest, "{what}");
        let source = manifest.source().unwrap();
        for index in 0..PAIRS {
            let (read, made) = (set.pair(index).unwrap(), source.pair(index).unwrap());
            assert_eq!(read.scene, made.scene, "{what}");
            let bits = |pair: &Pair| pair.amplitudes.map(|ends| ends.map(f64::to_bits));
            assert_eq!(bits(&read), bits(&made), "{what}");
        }
        let shards = TempDir::new().unwrap();
        for number in 0..2 {
            let shard = Shard { number, of: 2 };
            let part = Manifest {
                shard: Some(shard),
                ..manifest.clone()
            };
            let path = shard_folder(shards.path(), shard);
            made_in_two(&path, &part);
        }
        merge(shards.path()).unwrap();
        assert_eq!(tree(shards.path()), tree(folder.path()), "{what}");
    }
}

/// Makes a shard, removes an image, and makes it again.
fn made_in_two(path: &Path, part: &Manifest) {
    made(path, part);
    let first = part.indices().start;
    fs::remove_file(path.join(format!("images/{first:06}.png"))).unwrap();
    assert_eq!(made(path, part), 1);
}

#[test]
fn sets_on_a_learnt_sea_continue() {
    for (what, manifest) in sets() {
        let on_sea = Manifest {
            sea: Some("white".to_owned()),
            ..manifest
        };
        let source = on_sea.source().unwrap().with_sea(white_sea(None)).unwrap();
        check(&what, &on_sea, &source);
    }
}
