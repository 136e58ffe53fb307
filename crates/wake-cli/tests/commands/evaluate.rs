//! `wake evaluate`: what it refuses.

use super::{cannot_write, refused_by};

#[test]
fn wrong_options_are_named() {
    for (arguments, words) in [
        (["--count", "0"], ["--count", "'0'", "1..=65536"]),
        (["--steps", "0"], ["steps", "is 0", "[1, 1000]"]),
        (["--device", "tpu"], ["'tpu'", "flex", "features"]),
        (
            ["--weights", "no/such/folder"],
            ["cannot read", "no/such/folder", "config.json"],
        ),
    ] {
        refused_by("evaluate", &arguments, &words);
    }
    let lpips = [
        "--lpips-backbone",
        "no/backbone",
        "--lpips-linear",
        "no/linear",
    ];
    refused_by("evaluate", &lpips, &["no/backbone"]);
    cannot_write("evaluate", &["--count", "1"]);
}
