//! `metadata.jsonl`: one line per pair, in order, appended as pairs are made.

use super::annotations::{Objects, dota, yolo, yolo_oriented};
use super::layout::{Layout, Manifest, broken, image_name};
use super::pair::Pair;
use crate::error::Result;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use wake_physics::Scene;
use wake_physics::scene::Ship;
use whole_files::{checksum, failed, sealed, unsealed};

/// One pair as a line of `metadata.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    /// Path of the image, relative to the folder.
    pub(super) file_name: String,
    /// [Checksum](checksum) of the image's file.
    image_crc32: String,
    /// The prompt.
    pub(super) text: String,
    #[serde(flatten)]
    columns: Columns,
    /// The scene of the image, as JSON in a string: some of its keys hold words in one scene and numbers in another, which
    /// columns of a table cannot.
    #[serde(with = "in_a_string")]
    pub(super) scene: Scene,
    /// Labelled boxes.
    pub(super) objects: Objects,
    /// Amplitudes of grey 0 and 1, for a quick-look.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) amplitudes: Option<[f64; 2]>,
}

impl Row {
    /// Makes the row of a pair.
    ///
    /// - `image_crc32`: [checksum] of the image file
    pub(super) fn of(pair: &Pair, image_crc32: String) -> Self {
        Self {
            file_name: image_name(pair.index),
            image_crc32,
            text: pair.prompt.clone(),
            columns: Columns::of(&pair.scene),
            scene: pair.scene.clone(),
            objects: Objects::of(&pair.labels),
            amplitudes: pair.amplitudes,
        }
    }

    /// Reads the image file and checks its checksum.
    ///
    /// - `line`: number of this row in `metadata.jsonl`, from 1
    ///
    /// # Errors
    ///
    /// [`Error::Dataset`](crate::Error::Dataset) if the file is not the one that was written with this row.
    pub(super) fn image_bytes(&self, path: &Path, line: usize) -> Result<Vec<u8>> {
        let bytes = whole_files::read_bytes(path)?;
        let found = checksum(&bytes);
        if found == self.image_crc32 {
            return Ok(bytes);
        }
        let message = format!(
            "the image is damaged or was replaced: its CRC-32 is {found}, but line {line} of metadata.jsonl has {}; remove the \
             file and run `wake dataset` again",
            self.image_crc32
        );
        Err(broken(path, 0, message))
    }

    /// Contents of the label files of an image of `[rows, columns]` pixels, in the order of [`Layout::files_of`].
    pub(super) fn labels(&self, size: [usize; 2]) -> [String; 3] {
        let objects = &self.objects;
        [
            yolo(objects, size),
            yolo_oriented(objects, size),
            dota(objects),
        ]
    }

    /// Checks that the image and label files are the ones that were written with this row.
    ///
    /// - `files`: as given by [`Layout::files_of`]; all must exist
    ///
    /// # Errors
    ///
    /// [`Error::Dataset`](crate::Error::Dataset) for the first file that differs.
    pub(super) fn check_files(
        &self,
        [image, labels @ ..]: &[PathBuf; 4],
        line: usize,
        size: [usize; 2],
    ) -> Result<()> {
        self.image_bytes(image, line)?;
        for (path, text) in labels.iter().zip(self.labels(size)) {
            if whole_files::read_bytes(path)? != text.as_bytes() {
                let message = format!(
                    "the labels differ from line {line} of metadata.jsonl; remove the file and run `wake dataset` again"
                );
                return Err(broken(path, 0, message));
            }
        }
        Ok(())
    }
}

/// Serialization of a scene as JSON in a string.
mod in_a_string {
    use serde::de::{Deserialize, Deserializer, Error as _};
    use serde::ser::{Error as _, Serializer};
    use wake_physics::Scene;

    pub(super) fn serialize<S: Serializer>(scene: &Scene, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&serde_json::to_string(scene).map_err(S::Error::custom)?)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Scene, D::Error> {
        serde_json::from_str(&String::deserialize(from)?).map_err(D::Error::custom)
    }
}

/// Main values of a scene as columns of the table, so that readers need not parse scenes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Columns {
    /// Whether there is a ship. The ship's values are `None` without a ship, and belong to the first of several.
    ship: bool,
    ship_speed: Option<f64>,
    ship_heading: Option<f64>,
    ship_x: Option<f64>,
    ship_y: Option<f64>,
    ship_length: Option<f64>,
    wind_speed: f64,
    wind_toward: f64,
    fetch: f64,
    incidence: f64,
    seed: u64,
}

impl Columns {
    fn of(scene: &Scene) -> Self {
        let ship = |value: fn(&Ship) -> f64| scene.ships.first().map(value);
        Self {
            ship: !scene.ships.is_empty(),
            ship_speed: ship(|s| s.speed),
            ship_heading: ship(|s| s.heading),
            ship_x: ship(|s| s.position[0]),
            ship_y: ship(|s| s.position[1]),
            ship_length: ship(|s| s.length),
            wind_speed: scene.sea.wind_speed,
            wind_toward: scene.sea.wind_toward,
            fetch: scene.sea.fetch,
            incidence: scene.radar.incidence,
            seed: scene.seed,
        }
    }
}

/// Rows of a folder with their indices, in order.
pub(super) type Rows = Vec<(u64, Row)>;

/// The growing `metadata.jsonl` of a folder.
pub(super) struct Log {
    path: PathBuf,
    file: File,
    /// Bytes up to the end of the last complete line.
    length: u64,
    pub(super) rows: Rows,
}

impl Log {
    /// Opens the log of a folder, cuts off an incomplete line left by a killed run, and checks all others.
    ///
    /// # Errors
    ///
    /// [`Error::Dataset`](crate::Error::Dataset) with the number of the first line that does not belong to the set.
    pub(super) fn open(folder: &Path, manifest: &Manifest) -> Result<Self> {
        let path = Layout(folder).metadata();
        let fail = |e| failed("open", &path, e);
        let mut options = OpenOptions::new();
        let open = options.read(true).write(true).create(true).truncate(false);
        let mut file = open.open(&path).map_err(fail)?;
        let text = whole_files::read_regular(&path).map_err(fail)?;
        let whole = text.iter().rposition(|&b| b == b'\n').map_or(0, |n| n + 1);
        let rows = parse(&path, &text[..whole], manifest)?;
        check(&path, &text[..whole], &rows, manifest)?;
        let length = whole as u64;
        file.set_len(length).map_err(fail)?;
        file.seek(SeekFrom::Start(length)).map_err(fail)?;
        Ok(Self {
            path,
            file,
            length,
            rows,
        })
    }

    /// Appends a line; if writing fails, no part of the line remains.
    pub(super) fn push(&mut self, index: u64, row: Row) -> Result<()> {
        let line = line(&row)?;
        if let Err(e) = self.file.write_all(line.as_bytes()) {
            // If this fails too, the next run cuts the line off.
            let _ = self.file.set_len(self.length);
            return Err(failed("write", &self.path, e).into());
        }
        self.length += line.len() as u64;
        self.rows.push((index, row));
        Ok(())
    }

    /// Waits until all lines are on disk, and returns the rows.
    pub(super) fn finish(self) -> Result<Rows> {
        let synced = self.file.sync_all();
        synced.map_err(|e| failed("write", &self.path, e))?;
        Ok(self.rows)
    }
}

/// Line of a row.
pub(super) fn line(row: &Row) -> Result<String> {
    let text = serde_json::to_string(row);
    let text = text.map_err(|e| failed("encode", Path::new(&row.file_name), e))?;
    Ok(sealed(&text) + "\n")
}

/// Parses complete lines, checking the checksum and the pair of each.
pub(super) fn parse(path: &Path, text: &[u8], manifest: &Manifest) -> Result<Rows> {
    let lines = text.split_inclusive(|&b| b == b'\n').enumerate();
    let mut indices = manifest.indices();
    let parse = |(at, line): (usize, &[u8])| -> Result<(u64, Row)> {
        let fail = |message: String| broken(path, at + 1, message);
        let row: Row = serde_json::from_slice(line).map_err(|e| {
            fail(format!(
                "this is not a line of a data set ({e}); restore it"
            ))
        })?;
        let text = std::str::from_utf8(line).ok();
        let text = text.and_then(|line| line.strip_suffix('\n'));
        if text.and_then(unsealed).is_none() {
            let message = "the line was changed: its checksum crc32 does not match; restore it, or remove it and all lines \
                           below it and run `wake dataset` again";
            return Err(fail(message.to_owned()));
        }
        let index = indices
            .next()
            .ok_or_else(|| fail("the set has no more pairs; remove this line".to_owned()))?;
        if row.file_name != image_name(index) {
            let found = &row.file_name;
            return Err(fail(format!(
                "this line is of {found}, expected that of pair {index}; restore the order of the lines"
            )));
        }
        Ok((index, row))
    };
    lines.map(parse).collect()
}

/// Checks that the lines belong to this set, byte for byte except for values that depend on the images: their checksums and
/// the amplitudes of quick-looks.
fn check(path: &Path, text: &[u8], rows: &Rows, manifest: &Manifest) -> Result<()> {
    let source = manifest.source()?;
    let lines = text.split_inclusive(|&b| b == b'\n');
    for (at, (found, (index, kept))) in lines.zip(rows).enumerate() {
        let row = Row {
            amplitudes: kept
                .amplitudes
                .filter(|_| source.quick_look(*index).is_some()),
            ..Row::of(
                &source.pair_without_image(*index)?,
                kept.image_crc32.clone(),
            )
        };
        if found != line(&row)?.as_bytes() {
            let message = format!(
                "this is not the line of pair {index} of this recipe and seed; restore the line, or use another folder"
            );
            return Err(broken(path, at + 1, message));
        }
    }
    Ok(())
}
