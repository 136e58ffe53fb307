//! Export of a data set as `WebDataset` shards: tar files that trainers read sequentially.

use super::folder::Folder;
use super::layout::{Layout, broken, image_name};
use super::metadata::Row;
use super::pair::Pair;
use crate::error::Result;
use std::io::Write;
use std::path::{Path, PathBuf};
use wake_physics::output;
use whole_files::checksum;

/// Size of the blocks of a tar file \[bytes\].
const BLOCK: usize = 512;
/// The splits, training first.
const SPLITS: [&str; 2] = ["train", "validation"];

/// Writes the pairs of a folder into `train-000000.tar`, …, `validation-000000.tar`, …, and returns the paths of these shards.
///
/// A pair is three files: `000007.png`, its prompt `000007.txt`, and its line of `metadata.jsonl` as `000007.json`. The bytes
/// depend on the set alone: all times are 0 and all owners root, so that equal sets have equal bytes.
///
/// - `out`: folder of the shards, made if absent; must not contain tar files
/// - `each`: largest number of pairs per shard, at least 1
///
/// # Errors
///
/// [`Error::Dataset`](crate::Error::Dataset) for a folder that is not a finished set, a damaged image, or a folder `out` that
/// contains tar files; [`wake_nn::Error::Io`] if a shard cannot be written.
///
/// # References
///
/// POSIX.1-1988, the format `ustar`; the layout of the webdataset library, 1.0.
pub fn write_webdataset(folder: &Path, out: &Path, each: u64) -> Result<Vec<PathBuf>> {
    let set = Folder::open(folder)?;
    let _lock = whole_files::lock_folder(out)?;
    let mut entries = std::fs::read_dir(out).map_err(|e| whole_files::failed("read", out, e))?;
    let is_shard = |name: &std::ffi::OsStr| name.to_string_lossy().ends_with(".tar");
    if entries.any(|entry| entry.is_ok_and(|entry| is_shard(&entry.file_name()))) {
        let message = "this folder already has tar files; choose another folder, or remove them";
        return Err(broken(out, 0, message));
    }
    let mut written = Vec::new();
    for (split, positions) in SPLITS.into_iter().zip([set.trainset(), set.valset()]) {
        for (number, positions) in positions.chunks(each.max(1) as usize).enumerate() {
            let path = out.join(format!("{split}-{number:06}.tar"));
            let mut archive = Vec::new();
            for &position in positions {
                sample(&mut archive, folder, &set, position)?;
            }
            archive.resize(archive.len() + 2 * BLOCK, 0);
            whole_files::write_atomically(&path, &archive)?;
            written.push(path);
        }
    }
    Ok(written)
}

/// Returns the three files of a pair with their extensions, as in [`write_webdataset`]: `json`, `png`, `txt`.
///
/// For programs that make shards pair by pair, such as on a cluster.
///
/// # Errors
///
/// [`Error::Scene`](crate::Error::Scene) for an image that cannot be encoded.
pub fn sample_files(pair: &Pair) -> Result<[(&'static str, Vec<u8>); 3]> {
    let name = image_name(pair.index);
    let name = Path::new(&name);
    let [rows, columns] = [pair.image.rows, pair.image.columns];
    let png = output::encode_png(name, &pair.image.levels(), rows, columns)?;
    let line = serde_json::to_vec(&Row::of(pair, checksum(&png)));
    let line = line.map_err(|e| whole_files::failed("encode", name, e))?;
    let prompt = pair.prompt.clone().into_bytes();
    Ok([("json", line), ("png", png), ("txt", prompt)])
}

/// Appends the three files of a folder's pair to an archive.
fn sample(archive: &mut Vec<u8>, folder: &Path, set: &Folder, position: u64) -> Result<()> {
    let (index, row) = set.row(position)?;
    let line = serde_json::to_vec(row);
    let metadata = Layout(folder).metadata();
    let line = line.map_err(|e| whole_files::failed("encode", &metadata, e))?;
    let image = folder.join(&row.file_name);
    let image = row.image_bytes(&image, position as usize + 1)?;
    let files = [
        ("json", line.as_slice()),
        ("png", image.as_slice()),
        ("txt", row.text.as_bytes()),
    ];
    for (ending, content) in files {
        let name = format!("{index:06}.{ending}");
        append(archive, &name, content).map_err(|e| whole_files::failed("write", folder, e))?;
    }
    Ok(())
}

/// Adds a file to an archive.
///
/// - `name`: at most 100 bytes
fn append(archive: &mut Vec<u8>, name: &str, content: &[u8]) -> std::io::Result<()> {
    let mut header = [0u8; BLOCK];
    let mut put = |at: usize, field: &[u8]| header[at..at + field.len()].copy_from_slice(field);
    put(0, name.as_bytes());
    put(100, b"0000644\0");
    put(108, b"0000000\0");
    put(116, b"0000000\0");
    put(124, format!("{:011o}\0", content.len()).as_bytes());
    put(136, b"00000000000\0");
    // The checksum counts its own field as blanks.
    put(148, b"        ");
    put(156, b"0");
    put(257, b"ustar\x0000");
    put(265, b"root\0");
    put(297, b"root\0");
    let sum: u32 = header.iter().map(|&byte| u32::from(byte)).sum();
    header[148..156].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
    archive.write_all(&header)?;
    archive.write_all(content)?;
    archive.resize(archive.len().next_multiple_of(BLOCK), 0);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Manifest, Recipe, write};

    /// Reads the names and contents of an archive, by the description of the format.
    fn read(archive: &[u8]) -> Vec<(String, Vec<u8>)> {
        assert!(archive.len().is_multiple_of(BLOCK));
        let (mut at, mut files) = (0, Vec::new());
        while archive[at] != 0 {
            let header = &archive[at..at + BLOCK];
            let text = |from: usize, to: usize| {
                let field = &header[from..to];
                let end = field.iter().position(|&b| b == 0).unwrap_or(field.len());
                String::from_utf8(field[..end].to_vec()).unwrap()
            };
            assert_eq!(text(257, 263), "ustar");
            let sum: u32 = (0..BLOCK)
                .map(|n| {
                    if (148..156).contains(&n) {
                        32
                    } else {
                        u32::from(header[n])
                    }
                })
                .sum();
            assert_eq!(u32::from_str_radix(&text(148, 154), 8).unwrap(), sum);
            let size = usize::from_str_radix(&text(124, 135), 8).unwrap();
            at += BLOCK;
            files.push((text(0, 100), archive[at..at + size].to_vec()));
            at += size.next_multiple_of(BLOCK);
        }
        assert_eq!(&archive[at..], [0; 2 * BLOCK]);
        files
    }

    /// Each pair is in one shard of its split, with the bytes of its image and its prompt; writing twice gives the same bytes.
    #[test]
    fn shards_hold_the_set() {
        let changes = [
            "scene.grid.rows = 16",
            "scene.grid.columns = 16",
            "scene.grid.spacing = 20",
        ];
        let recipe = Recipe::default().with_assignments(&changes).unwrap();
        let manifest = Manifest::new(recipe, 3, 5).unwrap();
        let manifest = manifest.with_val_share(0.4).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let set = folder.path().join("set");
        let source = manifest.source().unwrap();
        write(&set, &manifest, &source, 1, |_| ()).unwrap();
        let outs = ["one", "two"].map(|name| folder.path().join(name));
        let [one, two] = outs
            .each_ref()
            .map(|out| write_webdataset(&set, out, 2).unwrap());
        let names = |paths: &[PathBuf]| -> Vec<String> {
            let names = paths.iter().filter_map(|path| path.file_name());
            names
                .map(|name| name.to_string_lossy().into_owned())
                .collect()
        };
        assert_eq!(
            names(&one),
            [
                "train-000000.tar",
                "train-000001.tar",
                "validation-000000.tar"
            ]
        );
        let mut indices = Vec::new();
        for (one, two) in one.iter().zip(&two) {
            let archive = std::fs::read(one).unwrap();
            assert_eq!(archive, std::fs::read(two).unwrap());
            for sample in read(&archive).as_chunks::<3>().0 {
                let [(json, line), (png, image), (txt, prompt)] = sample;
                let stem = png.strip_suffix(".png").unwrap();
                let pair = source.pair(stem.parse().unwrap()).unwrap();
                let files = [("json", line), ("png", image), ("txt", prompt)];
                assert_eq!(
                    sample_files(&pair).unwrap(),
                    files.map(|(ending, content)| (ending, content.clone()))
                );
                assert_eq!(
                    [json, txt],
                    [&format!("{stem}.json"), &format!("{stem}.txt")]
                );
                let file = format!("images/{png}");
                assert_eq!(*image, std::fs::read(set.join(&file)).unwrap());
                let line: serde_json::Value = serde_json::from_slice(line).unwrap();
                assert_eq!(line["file_name"], file.as_str());
                assert_eq!(line["text"], String::from_utf8_lossy(prompt).as_ref());
                let split = one
                    .file_name()
                    .unwrap()
                    .to_string_lossy()
                    .starts_with("val");
                let list = std::fs::read_to_string(set.join("valset.txt")).unwrap();
                assert_eq!(list.contains(&file), split);
                indices.push(stem.to_owned());
            }
        }
        indices.sort();
        assert_eq!(indices, ["000000", "000001", "000002", "000003", "000004"]);
        let again = write_webdataset(&set, &outs[0], 2).unwrap_err();
        assert!(
            again.to_string().contains("already has tar files"),
            "{again}"
        );
    }
}
