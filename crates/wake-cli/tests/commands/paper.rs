//! The paper's experiment from end to end, with a toy of Stable Diffusion: data, fine-tuning, a resumed training, a merged
//! low-rank adaptation, images, evaluation.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

#[test]
fn the_experiment_runs_from_end_to_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path();
    let done = Command::new("bash")
        .args([".ci/paper", "tests/fixtures/pipeline_a"])
        .arg(out)
        .env("TINY", "1")
        .env("WAKE", env!("CARGO_BIN_EXE_wake"))
        .current_dir(ROOT)
        .output()
        .expect("bash");
    let message = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{message}");
    let text = std::fs::read_to_string(out.join("report/report.json")).expect("a report");
    let report: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(report["pixels_along"], 32);
    assert_eq!(report["speckle"], true);
    has_table_ii(&report);
    has_table_iii(&report);
    let row = &report["measurements"][5];
    assert_eq!(row["quantity"], "fetch");
    let changed = report["controllability"].as_array().expect("rows");
    assert!(changed.iter().any(|row| row["quantity"] == "fetch"));
    // DDIM with fewer steps than the reference's differs from it; all rows have their seconds.
    let schedulers = report["schedulers"].as_array().expect("rows");
    let names: Vec<&str> = schedulers
        .iter()
        .filter_map(|r| r["scheduler"].as_str())
        .collect();
    assert_eq!(names, ["ddim", "ddim", "dpm++", "dpm++"]);
    for row in schedulers {
        assert!(
            row["error"].as_f64() > Some(0.0) && row["seconds"].as_f64() > Some(0.0),
            "{row}"
        );
    }
    for name in [
        "effects.png",
        "radial.svg",
        "spectrum.svg",
        "ablation.png",
        "report.md",
    ] {
        assert!(out.join("report").join(name).is_file(), "{name}");
    }
    let curve = std::fs::read_to_string(out.join("curve.jsonl")).expect("a curve");
    let point: Value = serde_json::from_str(curve.trim_end()).expect("a line of JSON");
    assert_eq!(point["samples"], 24);
    assert!(
        point["spectrum_db"].is_f64() && point["wake_contrast"].is_f64(),
        "{point}"
    );
}

/// SSIM and PSNR of the model beside SSIM and PSNR of a second simulated image, and the spectrum in three bands.
fn has_table_ii(report: &Value) {
    let rows = report["pixels"].as_array().expect("rows");
    let names: Vec<&str> = rows
        .iter()
        .filter_map(|row| row["image"].as_str())
        .collect();
    assert_eq!(names[..2], ["text to image", "simulator, other sea"]);
    for row in rows {
        let [ssim, psnr] = ["ssim", "psnr_db"].map(|key| row[key].as_f64().expect("a number"));
        assert!((-1.0..=1.0).contains(&ssim) && psnr > 0.0, "{row}");
        assert_eq!(row["bands_db"].as_array().map(Vec::len), Some(3));
    }
}

/// Seconds of simulator and harmonic sum at every size, of the model where its size allows.
fn has_table_iii(report: &Value) {
    let rows = report["seconds"].as_array().expect("rows");
    for (row, size) in rows.iter().zip([128, 256, 512]) {
        assert_eq!(row["size"], size);
        assert!(row["simulator_fast"].is_f64() && row["simulator_harmonic_sum"].is_f64());
        assert_eq!(row["text_to_image"].is_f64(), size == 128, "{row}");
    }
}

/// What does not fit is refused before anything is drawn.
#[test]
fn data_of_another_size_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let set = folder.path().join("set");
    let size = [
        "--set",
        "scene.grid.rows=48",
        "--set",
        "scene.grid.columns=48",
    ];
    super::done("dataset", &[&size[..], &["--count", "2"]].concat(), &set);
    let weights = Path::new(ROOT).join("tests/fixtures/pipeline_a");
    let arguments = [
        "--weights",
        super::text(&weights),
        "--data",
        super::text(&set),
    ];
    super::refused_by("evaluate pipeline", &arguments, &["48 x 48", "32 x 32"]);
    let nowhere = ["--weights", "no/such/folder"];
    super::refused_by(
        "evaluate pipeline",
        &nowhere,
        &["cannot read", "no/such/folder"],
    );
}
