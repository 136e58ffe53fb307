//! `wake dataset`: simulated images with prompts and labels, as a folder for training scripts.

mod arguments;

pub(crate) use arguments::Arguments;

use serde_json::json;
use std::path::Path;
use std::time::Instant;
use wake_dataset::{
    CardOf, Manifest, PAPER_SCENES, Progress, Recipe, Simulated, merge, shard_folder, write,
    write_card, write_webdataset,
};

use crate::exit::{self, Outcome};
use crate::progress;

/// Writes `images/*.png`, `labels/*.txt` (YOLO), `labels-obb/*.txt` (YOLO with oriented boxes), `labelTxt/*.txt`
/// (DOTA), `metadata.jsonl`, `coco.json`, `data.yaml` with `trainset.txt` and `valset.txt`, and `dataset.json`; see
/// docs/dataset.md. An interrupted run continues where it stopped.
pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    let start = Instant::now();
    let (folder, manifest, made) = if arguments.merge {
        (arguments.out.clone(), joined(&arguments.out)?, 0)
    } else {
        let manifest = manifest(arguments)?;
        let folder = match manifest.shard {
            Some(shard) => shard_folder(&arguments.out, shard),
            None => arguments.out.clone(),
        };
        let source = source(&manifest, arguments)?;
        tell_cost(&manifest)?;
        let made = make(&folder, &manifest, &source, arguments)?;
        (folder, manifest, made)
    };
    for_others(&folder, &manifest, arguments)?;
    let seconds = start.elapsed().as_secs_f64();
    let there = manifest.indices().end - manifest.indices().start;
    let place = folder.display();
    if arguments.json {
        let report = json!({
            "folder": folder, "images": there, "made": made, "seconds": seconds,
            "images_per_second": made as f64 / seconds, "shard": manifest.shard, "dataset": manifest,
        });
        exit::say(&format!("{report:#}"))?;
    } else if arguments.merge {
        exit::say(&format!(
            "{there} images in {place}, merged from its shards"
        ))?;
    } else {
        let text = format!("{there} images in {place}, {made} of them made in {seconds:.1} s");
        exit::say(&text)?;
    }
    Ok(())
}

/// Writes the card and the shards of `WebDataset`, if requested.
fn for_others(folder: &Path, manifest: &Manifest, arguments: &Arguments) -> Outcome<()> {
    let license = &arguments.license;
    if arguments.card {
        write_card(folder, manifest, CardOf::Folder, license)?;
    }
    if let Some(out) = &arguments.webdataset {
        write_webdataset(folder, out, arguments.per_tar)?;
        if arguments.card {
            write_card(out, manifest, CardOf::WebDataset, license)?;
        }
    }
    Ok(())
}

/// Merges the shards of a folder.
fn joined(folder: &Path) -> Outcome<Manifest> {
    merge(folder).map_err(|error| match error {
        wake_dataset::Error::Dataset { .. } => {
            format!("{error}; make shard I of N with `wake dataset --shard I/N`").into()
        }
        error => error.into(),
    })
}

fn manifest(arguments: &Arguments) -> Outcome<Manifest> {
    let default_count = match arguments.grid.as_str() {
        "paper" => PAPER_SCENES,
        _ => 100,
    };
    let count = arguments.count.unwrap_or(default_count);
    let recipe = Recipe::named_or_read(&arguments.grid);
    let recipe = recipe.map_err(|error| format!("--grid: {error}"))?;
    let recipe = recipe.with_assignments(&arguments.set)?;
    #[cfg(feature = "generate")]
    let sea = arguments
        .sea
        .as_deref()
        .map(whole_files::fingerprint)
        .transpose()?;
    #[cfg(not(feature = "generate"))]
    let sea = None;
    Ok(Manifest {
        shard: arguments.shard,
        sea,
        ..Manifest::new(recipe, arguments.seed, count)?.with_val_share(arguments.val_share)?
    })
}

/// The pairs of a set, with the learnt sea if one is given.
#[cfg(feature = "generate")]
fn source(manifest: &Manifest, arguments: &Arguments) -> Outcome<Simulated> {
    let source = manifest.source()?;
    match &arguments.sea {
        None => Ok(source),
        Some(path) => {
            let device = wake_nn::burn::tensor::Device::default();
            let sea = wake_ldm::sea_texture::SeaTexture::load(path, &device)?;
            Ok(source.with_sea(sea)?)
        }
    }
}

/// The pairs of a set.
#[cfg(not(feature = "generate"))]
fn source(manifest: &Manifest, _: &Arguments) -> Outcome<Simulated> {
    Ok(manifest.source()?)
}

/// Cost above which a note is printed first \[core seconds\].
const LONG: f64 = 600.0;

/// Prints the cost of a large set, estimated from the plans of its first scenes.
fn tell_cost(manifest: &Manifest) -> wake_dataset::Result<()> {
    let (each, indices) = (manifest.core_seconds()?, manifest.indices());
    let total = each * (indices.end - indices.start) as f64;
    if total > LONG {
        exit::note(&format!(
            "note: about {each:.2} core-seconds per image, {:.1} core-hours in total; share them among machines with --shard",
            total / 3600.0
        ));
    }
    Ok(())
}

/// Makes the missing images under a progress bar; returns their number.
fn make(
    folder: &Path,
    manifest: &Manifest,
    source: &Simulated,
    arguments: &Arguments,
) -> wake_dataset::Result<u64> {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = arguments.jobs.map_or_else(cores, usize::from);
    let bar = progress::bar(0, "images");
    let mut made = 0;
    write(folder, manifest, source, jobs, |progress: Progress| {
        made = progress.made;
        if made == 0 {
            bar.set_length(progress.total);
            bar.set_position(progress.done);
            bar.reset_eta();
        }
        bar.set_position(progress.done);
    })?;
    bar.finish_and_clear();
    Ok(made)
}
