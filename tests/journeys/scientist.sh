#!/usr/bin/env bash
# A radar scientist: a crate of their own on wake-physics that plots the mean backscatter against the wind for two spectra.
. "$(dirname "$0")/common.sh"
clone
mkdir -p "$scratch/study/src"
cat >"$scratch/study/Cargo.toml" <<END
[package]
name = "study"
version = "0.0.0"
edition = "2024"

[dependencies]
wake-physics = { path = "$scratch/clone/crates/wake-physics" }

[workspace]
END
cat >"$scratch/study/src/main.rs" <<'END'
use wake_physics::{Scene, Simulator};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut simulator = Simulator::default();
    let mut lines = Vec::new();
    for (spectrum, colour) in [("elfouhaily", "navy"), ("jonswap", "crimson")] {
        let mut points = Vec::new();
        for wind in 2..=12 {
            let scene = Scene::default().with_assignments(&[
                "grid.rows=128".to_owned(),
                "grid.columns=128".to_owned(),
                "ship.speed=0".to_owned(),
                format!("sea.spectrum={spectrum}"),
                format!("sea.wind_speed={wind}"),
            ])?;
            let mean = simulator.image(&scene)?.intensity.mean();
            let db = 10.0 * mean.log10();
            println!("{spectrum} {wind} m/s {db:.2} dB");
            points.push(format!("{},{:.1}", 40 * wind, -10.0 * db));
        }
        let points = points.join(" ");
        lines.push(format!("<polyline fill='none' stroke='{colour}' points='{points}'/>"));
    }
    let lines = lines.join("\n");
    std::fs::write(
        "sigma0.svg",
        format!("<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 520 300'>\n{lines}\n</svg>\n"),
    )?;
    Ok(())
}
END
cp "$scratch/clone/Cargo.lock" "$scratch/study"
cd "$scratch/study"
cargo run --quiet --release | tee "$scratch/table"
made "$scratch/study/sigma0.svg"
[ "$(wc -l <"$scratch/table")" = 22 ] || { echo "22 rows were expected" >&2; exit 1; }
echo "scientist: backscatter against the wind for two spectra"
