//! What a machine does to a program: closed pipes, full disks, kills, no home, folders that cannot be written, two
//! processes at once, devices for files.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use std::process::Stdio;

use super::{done, files, program, refused_into, text};

/// A scene that takes a moment.
const TINY: [&str; 4] = ["--set", "grid.rows=8", "--set", "grid.columns=8"];

/// The program with its standard output somewhere else: exit code and standard error.
fn into(name: &str, arguments: &[&str], stdout: Stdio) -> (Option<i32>, String) {
    let child = program(name)
        .args(arguments)
        .stdout(stdout)
        .stderr(Stdio::piped())
        .spawn()
        .expect("a program that starts");
    let output = child.wait_with_output().expect("an end");
    let message = String::from_utf8(output.stderr).expect("Unicode");
    (output.status.code(), message)
}

/// Every subcommand that prints without --out, and one that writes first.
fn printing(out: &Path) -> Vec<(&'static str, Vec<String>)> {
    let simulate = [&["--json", "--out", text(out)][..], &TINY].concat();
    let simulate = simulate.iter().map(ToString::to_string).collect();
    vec![
        ("prompt", vec!["--json".to_owned()]),
        ("simulate", simulate),
    ]
}

#[test]
fn a_reader_that_has_left_is_no_error() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, arguments) in printing(&folder.path().join("out")) {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let (code, message) = into(name, &arguments, writer.into());
        assert_eq!((code, message.as_str()), (Some(0), ""), "{name}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_of_one_sentence() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, arguments) in printing(&folder.path().join("out")) {
        let full = File::options()
            .write(true)
            .open("/dev/full")
            .expect("a full device");
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let (code, message) = into(name, &arguments, full.into());
        assert_eq!(code, Some(1), "{name}: {message}");
        assert!(
            message.contains("standard output") && message.lines().count() == 1,
            "{message}"
        );
    }
}

#[test]
fn nobody_to_hear_an_error_changes_nothing_else() {
    for stderr in [closed(), Stdio::null()] {
        let status = program("simulate")
            .args(["--set", "grid.rows=0"])
            .stderr(stderr)
            .status()
            .expect("a program that starts");
        assert_eq!(status.code(), Some(2));
    }
}

/// A pipe without a reader.
fn closed() -> Stdio {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    writer.into()
}

#[test]
fn no_home_and_no_variables_are_needed() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = program("simulate")
        .args(TINY)
        .args(["--out", text(&folder.path().join("out"))])
        .env_clear()
        .output()
        .expect("a program that starts");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn threads_that_no_machine_has_are_refused() {
    let output = program("prompt")
        .env("RAYON_NUM_THREADS", "100000")
        .output()
        .expect("a program that starts");
    let message = String::from_utf8(output.stderr).expect("Unicode");
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(
        message.contains("RAYON_NUM_THREADS is 100000, outside 0 to 1024"),
        "{message}"
    );
}

/// Fine pixels and a high platform need a margin much larger than the image: that is said first.
#[test]
fn a_costly_scene_says_so_first() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let scene = [
        "grid.rows=1",
        "grid.columns=2000",
        "grid.spacing=0.5",
        "radar.range_to_velocity=120",
    ];
    let mut arguments: Vec<&str> = scene.iter().flat_map(|set| ["--set", *set]).collect();
    arguments.extend(["--out", text(&out)]);
    let (code, message) = into("simulate", &arguments, Stdio::null());
    assert_eq!(code, Some(0), "{message}");
    assert!(
        message.contains("per pixel of the image") && message.contains("grid.spacing"),
        "{message}"
    );
    let (_, message) = into(
        "simulate",
        &[&TINY[..], &["--out", text(&out)]].concat(),
        Stdio::null(),
    );
    assert_eq!(message, "");
}

/// Text of files and of the command line is quoted short, and without what moves a terminal.
#[test]
fn foreign_text_reaches_no_terminal() {
    let folder = tempfile::tempdir().expect("a folder");
    let long = "\u{1b}[31m\u{7}".repeat(30_000);
    let path = folder.path().join("scene.toml");
    for content in [
        long.clone(),
        format!("[sea]\nspectrum = \"{}\"", "x".repeat(900_000)),
    ] {
        std::fs::write(&path, content).expect("a file");
        let set = format!("ship.speed={}", &long[..100_000]);
        for arguments in [["--scene", text(&path)], ["--set", &set]] {
            let (code, message) = into("simulate", &arguments, Stdio::null());
            assert_eq!(code, Some(2), "{message}");
            assert!(message.len() < 4000, "{} bytes", message.len());
            assert!(
                !message.trim_end().contains(char::is_control),
                "{message:?}"
            );
        }
    }
}

#[cfg(unix)]
#[test]
fn devices_are_read_to_a_limit_and_pipes_are_no_weights() {
    if Path::new("/dev/zero").exists() {
        let out = tempfile::tempdir().expect("a folder").path().join("out");
        refused_into(
            "simulate",
            &["--scene", "/dev/zero"],
            &["/dev/zero", "1 MiB"],
            &out,
        );
    }
}

/// A folder that nobody may write to; root may, so there the system is asked first.
#[cfg(unix)]
#[test]
fn a_folder_without_leave_to_write_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("a folder");
    let locked = folder.path().join("locked");
    std::fs::create_dir(&locked).expect("a folder");
    std::fs::set_permissions(&locked, std::fs::Permissions::from_mode(0o555)).expect("a mode");
    if std::fs::write(locked.join("probe"), "").is_ok() {
        return;
    }
    refused_into("simulate", &TINY, &["cannot write", "locked"], &locked);
}

/// Kills at many moments leave whole files, and a run after them the files of one that nobody killed.
#[test]
fn killed_simulations_leave_whole_files_and_the_next_run_sweeps() {
    let folder = tempfile::tempdir().expect("a folder");
    let [whole, killed] = ["whole", "killed"].map(|name| folder.path().join(name));
    let size = ["--set", "grid.rows=96", "--set", "grid.columns=96"];
    done("simulate", &size, &whole);
    for k in 0..20 {
        let mut child = program("simulate")
            .args(size)
            .args(["--out", text(&killed)])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("a program that starts");
        std::thread::sleep(std::time::Duration::from_millis(k * 5));
        // It may have ended.
        let _ = child.kill();
        child.wait().expect("an end");
        let expected = files(&whole);
        let left = if killed.exists() {
            files(&killed)
        } else {
            BTreeMap::new()
        };
        for (name, content) in left {
            let temporary = text(&name).starts_with('.');
            // The report tells seconds, which differ.
            let same = name == Path::new("report.json") || Some(&content) == expected.get(&name);
            assert!(temporary || same, "{} is not whole", name.display());
        }
    }
    done("simulate", &size, &killed);
    let names = |folder: &Path| files(folder).into_keys().collect::<Vec<_>>();
    assert_eq!(names(&killed), names(&whole));
}
