//! Card of a data set: the page shown on a hub, with machine-readable metadata in front.

use super::layout::{Layout, Manifest};
use super::recipe::Draw;
use crate::error::Result;
use std::fmt::Write;
use std::path::Path;
use wake_physics::grey::Mapping;

/// Format of the data set that a card describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CardOf {
    /// A folder made by [`write`](crate::write()), with all images in one split.
    Folder,
    /// Shards made by [`write_webdataset`](crate::write_webdataset).
    WebDataset,
}

/// Columns of the table other than images and file names, with their Hugging Face types.
const COLUMNS: [(&str, &str); 14] = [
    ("image_crc32", "string"),
    ("text", "string"),
    ("ship", "bool"),
    ("ship_speed", "float64"),
    ("ship_heading", "float64"),
    ("ship_x", "float64"),
    ("ship_y", "float64"),
    ("ship_length", "float64"),
    ("wind_speed", "float64"),
    ("wind_toward", "float64"),
    ("fetch", "float64"),
    ("incidence", "float64"),
    ("seed", "int64"),
    ("scene", "string"),
];

/// Writes `README.md` into the folder of a data set, so that the folder can be uploaded as it is.
///
/// - `license`: licence of the images, by its name on Hugging Face, such as `cc0-1.0`
///
/// # Errors
///
/// [`wake_nn::Error::Io`] if the card cannot be written.
pub fn write_card(folder: &Path, manifest: &Manifest, of: CardOf, license: &str) -> Result<()> {
    let text = card(manifest, of, license);
    whole_files::write_atomically(&Layout(folder).card(), text.as_bytes())?;
    Ok(())
}

fn card(manifest: &Manifest, of: CardOf, license: &str) -> String {
    let mut text = front(manifest, of, license);
    let grid = &manifest.recipe.scene.grid;
    let [rows, columns] = [grid.rows, grid.columns];
    let scenes = match &manifest.recipe.draw {
        Draw::PaperGrid => "the 3,456 scenes of Kamirul, Pappas and Achim, in a fixed mixed order",
        Draw::Values(_) => "scenes whose values are drawn at random",
    };
    let speckle = match manifest.recipe.speckle {
        true => "with speckle",
        false => "before speckle",
    };
    let [train, validation] = manifest.split_sizes();
    let files = match of {
        CardOf::Folder => {
            "All images are in the split `train` of `datasets`; `trainset.txt` and `valset.txt` name those to train with and \
             those to validate with."
        }
        CardOf::WebDataset => {
            "A sample is three files: `.png`, the prompt `.txt`, and everything else `.json`."
        }
    };
    let grey = &manifest.grey;
    let mapping = match grey.mapping {
        Mapping::Decibel => "decibel",
        Mapping::Amplitude => "amplitude",
    };
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "\n# Ship wakes in simulated radar images\n\n\
         {count} images of {rows} x {columns} pixels, {speckle}: {scenes}. Each has boxes of its visible wakes (class 0) and ships \
         (class 1), a prompt, and the whole scene. No real image is among them.\n\n\
         {train} images are for training and {validation} for validation. {files}\n\n\
         | field | content |\n| --- | --- |\n\
         | `image` | 8 bits of grey |\n\
         | `text` | the scene as a sentence |\n\
         | `objects.bbox` | x, y, width, height [pixels], from the corner of the first pixel |\n\
         | `objects.oriented` | four corners of the box along the track [pixels] |\n\
         | `objects.categories` | 0: wake, 1: ship |\n\
         | `ship_speed`, `ship_heading`, `ship_x`, `ship_y`, `ship_length` | of the first ship [m/s, degrees, m]; null without one |\n\
         | `wind_speed`, `wind_toward`, `fetch`, `incidence` | [m/s, degrees, m, degrees] |\n\
         | `scene` | the whole scene as JSON in a string |\n\n\
         Directions are degrees clockwise from azimuth, the top of the image, and say where a thing goes to. Grey is linear in \
         {mapping} between {dark} and {bright} dB of the normalized radar cross-section, unless an image has `amplitudes`.\n\n\
         ## How it was made\n\n\
         By the simulator `wake` {version} from a recipe and the seed {seed}; `dataset.json` holds both, and the same bytes follow \
         from it on the same machine. Waves are linear; there is no land and no ice. The contrast and the length of simulated wakes \
         are not calibrated on real ones.\n\n\
         ## Licence\n\n\
         The images are published under `{license}`. The simulator claims no rights in what it makes; it is itself licensed under \
         MIT or Apache-2.0.\n",
        count = manifest.count,
        dark = grey.darkest_db,
        bright = grey.brightest_db,
        version = env!("CARGO_PKG_VERSION"),
        seed = manifest.seed,
    );
    text
}

/// Machine-readable metadata: YAML between two lines of dashes.
fn front(manifest: &Manifest, of: CardOf, license: &str) -> String {
    let size = match manifest.count {
        0..1_000 => "n<1K",
        1_000..10_000 => "1K<n<10K",
        10_000..100_000 => "10K<n<100K",
        100_000..1_000_000 => "100K<n<1M",
        _ => "n>1M",
    };
    let mut text = format!(
        "---\nlicense: {license}\nlanguage:\n- en\npretty_name: Ship wakes in simulated radar images\ntask_categories:\n\
         - object-detection\n- text-to-image\ntags:\n- sar\n- radar\n- ship-wake\n- synthetic\nsize_categories:\n- {size}\n"
    );
    // Name a folder's files: it holds more texts than images, so `datasets` would take it for a set of texts.
    text += "configs:\n- config_name: default\n  data_files:\n  - split: train\n";
    text += match of {
        CardOf::Folder => "    path:\n    - images/*.png\n    - metadata.jsonl\n",
        CardOf::WebDataset => "    path: train-*.tar\n",
    };
    if of == CardOf::WebDataset && manifest.split_sizes()[1] > 0 {
        text += "  - split: validation\n    path: validation-*.tar\n";
    }
    text += "dataset_info:\n  features:\n";
    text += &features(of);
    text += "---\n";
    text
}

/// Columns of the table with their types, as `datasets` writes them.
fn features(of: CardOf) -> String {
    let field = |(name, kind): (&str, &str)| format!("- name: {name}\n  dtype: {kind}\n");
    let mut row: String = COLUMNS.into_iter().map(field).collect();
    row += "- name: objects\n  struct:\n  - name: bbox\n    list:\n      list: float64\n  - name: oriented\n    list:\n      list:\n\
            \x20       list: float64\n  - name: categories\n    list: int64\n";
    row += "- name: amplitudes\n  list: float64\n";
    let indented = |text: &str, by: &str| -> String {
        text.lines().map(|line| format!("{by}{line}\n")).collect()
    };
    match of {
        CardOf::Folder => {
            let checksum = field(("crc32", "string"));
            indented(&(field(("image", "image")) + &row + &checksum), "  ")
        }
        CardOf::WebDataset => {
            let row = field(("file_name", "string")) + &row;
            let outer = [
                ("__key__", "string"),
                ("__url__", "string"),
                ("png", "image"),
                ("txt", "string"),
            ];
            let outer: String = outer.into_iter().map(field).collect();
            indented(&(outer + "- name: json\n  struct:\n"), "  ") + &indented(&row, "    ")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Recipe;

    /// The card gives a type for exactly the keys of a line of `metadata.jsonl`, and states the counts of the set.
    #[test]
    fn a_card_names_every_column() {
        let recipe = Recipe::default().with_assignments(&["draw.quick_look.gain = 0.3"]);
        let manifest = Manifest::new(recipe.unwrap(), 7, 2_000).unwrap();
        let source = manifest.source().unwrap();
        let mut pair = source.pair_without_image(0).unwrap();
        pair.amplitudes = Some([0.0, 1.0]);
        let row = crate::metadata::Row::of(&pair, String::new());
        let row = serde_json::to_value(&row).unwrap();
        let mut keys: Vec<&str> = row
            .as_object()
            .unwrap()
            .keys()
            .map(String::as_str)
            .collect();
        keys.sort_unstable();
        for (of, extra) in [
            (
                CardOf::Folder,
                vec!["image", "crc32", "bbox", "oriented", "categories"],
            ),
            (
                CardOf::WebDataset,
                vec![
                    "__key__",
                    "__url__",
                    "png",
                    "txt",
                    "json",
                    "file_name",
                    "bbox",
                    "oriented",
                    "categories",
                ],
            ),
        ] {
            let text = card(&manifest, of, "cc0-1.0");
            let front = text.split("---\n").nth(1).unwrap();
            let names = front
                .lines()
                .filter_map(|line| line.trim().strip_prefix("- name: "));
            let mut names: Vec<&str> = names.filter(|name| !extra.contains(name)).collect();
            names.sort_unstable();
            let expected = keys.iter().filter(|key| **key != "file_name").copied();
            assert_eq!(names, expected.collect::<Vec<_>>());
            assert!(
                text.contains("\n1800 images are for training and 200 for validation."),
                "{text}"
            );
            assert!(front.contains("license: cc0-1.0\n") && front.contains("1K<n<10K"));
        }
    }
}
