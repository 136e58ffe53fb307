//! `wake train text-to-image`, and what reads the model that it writes.

use super::{done, files, refused_by, refused_into, text};

const SHORT: [&str; 8] = [
    "--text-steps",
    "1",
    "--steps",
    "2",
    "--batch",
    "2",
    "--every",
    "1",
];

/// Stopped and resumed, a run writes the model that one in one go does, and `generate` draws with it.
#[test]
fn a_model_is_learnt_resumed_and_drawn_with() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = |name: &str| folder.path().join(name);
    let set = out("set");
    let size = ["scene.grid.rows=64", "scene.grid.columns=64"];
    let mut arguments = vec!["--count", "3"];
    arguments.extend(size.iter().flat_map(|change| ["--set", *change]));
    done("dataset", &arguments, &set);
    let common = [&["text-to-image", "--data", text(&set)], &SHORT[..]].concat();
    done("train", &common, &out("whole"));

    let scheduler = out("whole").join("scheduler/scheduler_config.json");
    let scheduler = std::fs::read_to_string(scheduler).expect("a scheduler");
    assert!(scheduler.contains("\"v_prediction\""), "{scheduler}");

    let killed = out("killed");
    done("train", &common, &killed);
    let last = killed.join("checkpoints/text-to-image/step-00000002");
    std::fs::remove_dir_all(last).expect("a checkpoint");
    std::fs::remove_file(killed.join("model_index.json")).expect("an index");
    done("train", &[&common[..], &["--resume"]].concat(), &killed);
    let model = |name: &str| -> Vec<_> {
        ["unet", "vae", "text_encoder", "scheduler"]
            .map(|part| files(&out(name).join(part)))
            .into()
    };
    assert!(model("killed") == model("whole"));
    refused_into(
        "train",
        &common,
        &["stage text-encoder has made 1 steps", "resume this one"],
        &killed,
    );

    let arguments = [
        "--weights",
        text(&killed),
        "--steps",
        "2",
        "--guidance",
        "1",
    ];
    done("generate", &arguments, &out("drawn"));
    let drawn = image::open(out("drawn").join("image.png")).expect("an image");
    assert_eq!((drawn.width(), drawn.height()), (64, 64));
}

#[test]
fn what_no_model_can_be_made_of_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let set = folder.path().join("set");
    let size = ["scene.grid.rows=96", "scene.grid.columns=64"];
    let mut arguments = vec!["--count", "2"];
    arguments.extend(size.iter().flat_map(|change| ["--set", *change]));
    done("dataset", &arguments, &set);
    let data = ["text-to-image", "--data", text(&set)];
    refused_by("train", &data, &["96 x 64 pixels", "multiple of 64"]);
    refused_by(
        "train",
        &["text-to-image", "--rate", "0"],
        &["rate is 0", "outside"],
    );
    refused_by(
        "train",
        &["text-to-image", "--downsampling", "4", "--latents", "17"],
        &["latents is 17", "16"],
    );
    refused_by("train", &["text-to-image", "--resume"], &["resume"]);
}
