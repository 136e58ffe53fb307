//! `wake bench` and `wake gallery`: every part runs once.

use serde_json::Value;

use super::{done, names};

fn rows(arguments: &[&str], files: &[&str]) -> Vec<Value> {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let printed = done("bench", &[&["--json"], arguments].concat(), &out);
    let written = names(&out);
    for file in files {
        assert!(
            written.iter().any(|name| name == file),
            "{file}: {written:?}"
        );
    }
    let report: Value = serde_json::from_str(&printed).expect("JSON and nothing else");
    report["rows"].as_array().expect("rows").clone()
}

#[test]
fn a_stage_is_measured_against_its_oracle() {
    let arguments = ["--stage", "bunching", "--largest", "128"];
    let files = [
        "report.json",
        "simulator.md",
        "simulator.csv",
        "frontier.svg",
    ];
    let rows = rows(&arguments, &files);
    assert!(rows.len() > 1);
    for row in rows {
        assert_eq!(row["stage"], "bunching");
        assert!(row["rms_error"].as_f64().is_some_and(|e| e < 0.1), "{row}");
    }
}

#[test]
fn the_model_is_measured() {
    let rows = rows(
        &["--part", "model"],
        &["report.json", "model.md", "model.svg"],
    );
    assert!(rows.iter().all(|row| row["stage"] == "model"));
}

#[test]
fn the_loader_is_measured() {
    let rows = rows(&["--part", "loader"], &["report.json", "loader.md"]);
    let rate = |row: &Value| row["images_per_second"].as_f64();
    assert!(rows.iter().all(|row| rate(row).is_some_and(|r| r > 0.0)));
}

/// Every method draws nearer to the known answer with more steps, up to its last step.
#[test]
fn schedulers_are_measured() {
    let rows = rows(&["--part", "schedulers"], &["report.json", "schedulers.md"]);
    let error = |steps: u64| {
        let of = rows.iter().filter(move |row| row["steps"] == steps);
        let errors = of.filter_map(|row| row["rms_error"].as_f64());
        errors.fold(0.0, f64::max)
    };
    assert!(error(5) < 0.5 && error(100) < 0.1 * error(5), "{rows:?}");
}

/// flex against itself differs by nothing.
#[test]
fn blocks_are_measured_on_a_device() {
    let arguments = ["--part", "device", "--block", "half the size"];
    let files = ["report.json", "device.json", "device.md"];
    let rows = rows(&arguments, &files);
    let of = |stage| rows.iter().filter(move |row| row["stage"] == stage);
    let plain: Vec<_> = of("device").filter(|r| r["precision"] == "f32").collect();
    assert_eq!(plain.len(), 1);
    assert!(plain[0]["max_error"] == 0.0 && plain[0]["seconds"].as_f64() > Some(0.0));
    assert!(of("self-check").all(|row| row["failure"].is_null()));
    assert!(of("self-check").count() >= 3);
}

#[test]
fn the_pictures_of_the_documentation_are_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    done("gallery", &[], folder.path());
    let drawn = names(folder.path());
    assert_eq!(
        drawn,
        ["gallery.png", "sigma0.svg", "stages.png", "wake.gif"]
    );
}
