//! What random scenes over all keys cost, beside what their plans say.
//!
//! ```text
//! cargo test --release -p wake-physics --test cost                                         # memory of some scenes
//! SCENES=300 cargo test --release -p wake-physics --test cost report -- --ignored --nocapture   # a table of all, times too
//! ```
//!
//! Each scene is simulated by a process of its own on one thread; only Linux says what a process used.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
#![cfg(target_os = "linux")]

#[path = "../physics/any_scene.rs"]
mod any_scene;

use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use std::process::Command;
use wake_physics::{Cost, Plan, Scene, simulate};

/// Memory below which a plan only says that it is little \[bytes\]; time likewise \[s\].
const LITTLE_MEMORY: u64 = 64 << 20;
const LITTLE_TIME: f64 = 0.1;

/// Above the floor a scene takes at least this share of what is told.
const FACTOR: f64 = 3.0;

/// The same scenes each time.
fn scenes(count: usize, most: usize) -> impl Iterator<Item = Scene> {
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]);
    let mut runner = TestRunner::new_with_rng(Config::default(), rng);
    let strategy = any_scene::scene(most);
    (0..count).map(move |_| strategy.new_tree(&mut runner).unwrap().current())
}

/// What a simulation used.
struct Used {
    core_seconds: f64,
    bytes: u64,
    /// Nodes of the table of σ⁰.
    table: u64,
}

/// Simulates a scene in another process.
fn used(scene: &Scene) -> Used {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene.to_toml().unwrap()).unwrap();
    let child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "child", "--ignored", "--nocapture"])
        .env("COST_OF_SCENE", &path)
        .env("RAYON_NUM_THREADS", "1")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&child.stdout);
    let told = text.lines().find_map(|line| line.split_once("used: "));
    let Some((_, numbers)) = told else {
        panic!("{}{text}", String::from_utf8_lossy(&child.stderr))
    };
    let mut numbers = numbers.split(' ').map(|n| n.parse::<u64>().unwrap());
    let mut next = || numbers.next().unwrap();
    Used {
        core_seconds: 1e-9 * next() as f64,
        bytes: next(),
        table: next(),
    }
}

/// Not a test: simulates one scene and says what it used.
#[test]
#[ignore = "run by the other tests, each in a process of its own"]
fn child() {
    let Some(path) = std::env::var_os("COST_OF_SCENE") else {
        return;
    };
    let scene = Scene::from_toml(&std::fs::read_to_string(path).unwrap()).unwrap();
    let [seconds, bytes] = [core_nanoseconds(), resident("VmRSS")];
    let simulation = simulate(&scene).unwrap();
    let nodes = simulation.accuracy.table_nodes;
    println!(
        "\nused: {} {} {}",
        core_nanoseconds() - seconds,
        resident("VmHWM").saturating_sub(bytes),
        nodes[0] * nodes[1]
    );
}

/// Memory of this process by a line of its status \[bytes\].
fn resident(key: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with(key)).unwrap();
    let kib: u64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
    kib * 1024
}

/// Time of all threads of this process on a core \[ns\].
fn core_nanoseconds() -> u64 {
    let tasks = std::fs::read_dir("/proc/self/task").unwrap();
    let of = |path: std::path::PathBuf| -> u64 {
        let text = std::fs::read_to_string(path.join("schedstat")).unwrap_or_default();
        let first = text.split_whitespace().next();
        first.and_then(|time| time.parse().ok()).unwrap_or(0)
    };
    tasks.map(|task| of(task.unwrap().path())).sum()
}

/// Told over used, where what is little counts as the floor.
fn ratio(told: f64, used: f64, floor: f64) -> f64 {
    told.max(floor) / used.max(floor)
}

fn memory_ratio(cost: &Cost, used: &Used) -> f64 {
    ratio(cost.bytes as f64, used.bytes as f64, LITTLE_MEMORY as f64)
}

/// Memory is at most what is told, and no less than a third of it; scenes of some seconds at most, as told.
#[test]
fn memory_is_what_is_told() {
    let mut large = 0;
    for (n, scene) in scenes(150, 1500).enumerate() {
        let Ok(plan) = Plan::new(&scene) else {
            continue;
        };
        let cost = plan.cost();
        if cost.core_seconds > 1.0 || cost.bytes < LITTLE_MEMORY {
            continue;
        }
        let used = used(&scene);
        let ratio = memory_ratio(&cost, &used);
        assert!(
            (1.0..=FACTOR).contains(&ratio),
            "scene {n}: told {} bytes, used {}\n{}",
            cost.bytes,
            used.bytes,
            scene.to_toml().unwrap()
        );
        large += usize::from(used.bytes > LITTLE_MEMORY);
    }
    assert!(
        large >= 5,
        "only {large} scenes of more than a little memory"
    );
}

/// Scenes that were found: most of their memory or time is not for pixels.
#[test]
fn what_is_not_for_pixels_is_told_as_well() {
    let scene = |keys: &[&str]| Scene::default().with_assignments(keys).unwrap();
    let small = ["grid.rows=8", "grid.columns=8", "model.tolerance=1e-6"];
    let turn = ["grid.rows=64", "grid.columns=64", "ship.turn_rate=0.3"];
    for keys in [
        &[&small[..], &["radar.sensor=terrasar-x-sm"]].concat()[..],
        &small,
        &turn,
    ] {
        let scene = scene(keys);
        let cost = Plan::new(&scene).unwrap().cost();
        let used = used(&scene);
        let ratio = memory_ratio(&cost, &used);
        assert!(
            (1.0..=FACTOR).contains(&ratio),
            "{keys:?}: told {} bytes, used {}",
            cost.bytes,
            used.bytes
        );
        // 32 MiB of nodes of 8 bytes.
        assert!(used.table <= 1 << 22, "{keys:?}: {} nodes", used.table);
    }
}

/// Told and used of many scenes, and the worst of them.
#[test]
#[ignore = "a report of minutes"]
fn report() {
    let number = |key: &str, default: f64| {
        let value = std::env::var(key).ok();
        value.map_or(default, |value| value.parse().unwrap())
    };
    let (count, longest) = (number("SCENES", 300.0) as usize, number("SECONDS", 10.0));
    let (mut refused, mut longer) = (0, 0);
    let mut ratios = Vec::new();
    println!("scene  seconds told  used  ratio    MB told  used  ratio");
    for (n, scene) in scenes(count, 1500).enumerate() {
        let Ok(plan) = Plan::new(&scene) else {
            refused += 1;
            continue;
        };
        let cost = plan.cost();
        if cost.core_seconds > longest {
            longer += 1;
            continue;
        }
        let used = used(&scene);
        let time = ratio(cost.core_seconds, used.core_seconds, LITTLE_TIME);
        let memory = memory_ratio(&cost, &used);
        println!(
            "{n:5} {:13.2} {:5.2} {time:6.2} {:10.0} {:5.0} {memory:6.2}",
            cost.core_seconds,
            used.core_seconds,
            1e-6 * cost.bytes as f64,
            1e-6 * used.bytes as f64
        );
        ratios.push([time, memory]);
    }
    println!("{count} scenes, {refused} refused, {longer} told to take more than {longest} s");
    for (what, axis, least) in [("time", 0, 1.0 / FACTOR), ("memory", 1, 1.0)] {
        let mut all: Vec<f64> = ratios.iter().map(|pair| pair[axis]).collect();
        all.sort_by(f64::total_cmp);
        let outside = all
            .iter()
            .filter(|r| !(least..=FACTOR).contains(*r))
            .count();
        let [first, last] = [all.first(), all.last()].map(|r| r.copied().unwrap_or(f64::NAN));
        println!(
            "{what}: told over used {first:.2} to {last:.2}, {outside} of {} outside {least:.2} to {FACTOR}",
            all.len()
        );
    }
}
