//! A whole scene by size, from numbers to speckle and labels: the second and later scenes of a simulator, all fields and
//! the image alone, and one call on fresh memory; the satellite scenes of 1,000 × 1,000 pixels; and the peak memory of a process that simulates it:
//! `cargo bench --no-default-features --bench simulate`.

use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput};
use std::env;
use std::path::Path;
use std::process::Command;
use wake_physics::{Scene, Simulator, simulate};

/// Pixels along a side.
const SIZES: [usize; 6] = [128, 256, 512, 1024, 2048, 4096];
/// Scene files.
const SATELLITES: [&str; 6] = [
    "alos_2",
    "cosmo_skymed",
    "ers_2",
    "novasar_1",
    "sentinel_1",
    "terrasar_x",
];
/// Set to a size, this program simulates once and prints its peak memory \[KiB\].
const PEAK_OF: &str = "WAKE_PEAK_OF";

fn scene(size: usize) -> Scene {
    let mut scene = Scene::default();
    (scene.grid.rows, scene.grid.columns) = (size, size);
    scene
}

fn seconds(c: &mut Criterion) {
    let mut group = c.benchmark_group("simulate");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    for size in SIZES {
        group.throughput(Throughput::Elements((size * size) as u64));
        let scene = scene(size);
        let mut simulator = Simulator::default();
        group.bench_with_input(BenchmarkId::new("fields", size), &scene, |b, scene| {
            b.iter(|| {
                let simulation = simulator.simulate(scene).expect("a valid scene");
                simulator.reclaim(simulation);
            });
        });
        group.bench_with_input(BenchmarkId::new("image", size), &scene, |b, scene| {
            b.iter(|| simulator.image(scene).expect("a valid scene"));
        });
        group.bench_with_input(BenchmarkId::new("once", size), &scene, |b, scene| {
            b.iter(|| simulate(scene).expect("a valid scene"));
        });
    }
    group.finish();
}

/// The scenes of `assets/scenes/satellite`, all fields on fresh memory and the image alone.
fn satellites(c: &mut Criterion) {
    let mut group = c.benchmark_group("satellite");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    for name in SATELLITES {
        let path = format!("assets/scenes/satellite/{name}.toml");
        let scene = Scene::read(Path::new(&path)).expect("a scene file");
        let mut simulator = Simulator::default();
        group.bench_with_input(BenchmarkId::new("image", name), &scene, |b, scene| {
            b.iter(|| simulator.image(scene).expect("a valid scene").speckled());
        });
        group.bench_with_input(BenchmarkId::new("once", name), &scene, |b, scene| {
            b.iter(|| simulate(scene).expect("a valid scene"));
        });
    }
    group.finish();
}

/// Peak memory of this process so far \[KiB\], where the system tells.
fn peak_kib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// Peak memory of a new process that simulates one scene \[KiB\].
fn peak_of(size: usize) -> Option<u64> {
    let child = Command::new(env::current_exe().ok()?)
        .env(PEAK_OF, size.to_string())
        .output()
        .ok()?;
    String::from_utf8(child.stdout).ok()?.trim().parse().ok()
}

fn main() {
    if let Some(size) = env::var(PEAK_OF).ok().and_then(|size| size.parse().ok()) {
        simulate(&scene(size)).expect("a valid scene");
        println!("{}", peak_kib().unwrap_or_default());
        return;
    }
    let mut criterion = Criterion::default().configure_from_args();
    seconds(&mut criterion);
    satellites(&mut criterion);
    criterion.final_summary();
    if !env::args().any(|argument| argument == "--list") {
        for size in SIZES {
            // Not every system tells.
            let Some(kib) = peak_of(size).filter(|&kib| kib > 0) else {
                break;
            };
            let fields = 1024.0 * kib as f64 / (4 * size * size) as f64;
            println!(
                "simulate/{size}: peak {:.1} MB, {fields:.0} fields of the image",
                kib as f64 * 1.024e-3
            );
        }
    }
}
