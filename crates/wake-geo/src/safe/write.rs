//! Writes products from another product's annotation and new digital numbers.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::Sentinel1;
use super::cut::Part;
use super::tree::Tree;
use crate::error::{Error, Result};
use crate::geolocation::GridPoint;
use crate::geotiff::{Compression, GeoTiffLayout, Placement, write_geotiff};
use crate::window::check_part;

/// Fewest lines and pixels of a part: the geolocation grid has 21 pixels a line, and tables have a value every 40.
const SMALLEST: usize = 64;

impl Sentinel1 {
    /// Writes a product of one polarization into the folder `out`: this product's annotation, cut to the given lines
    /// and pixels, with your digital numbers. Returns the path of the new `.SAFE` folder.
    ///
    /// Times, sizes, geolocation, coordinate conversion, swath bounds, calibration and noise are adapted to the part;
    /// the description of the acquisition (orbit, attitude, Doppler, antenna) stays complete. The manifest lists only
    /// the new files, without checksums. The folder gets its name once it is complete.
    ///
    /// - `fill`: writes the digital numbers of the given lines, called in order, counted from the first line of the
    ///   part; 0 is no data
    ///
    /// # Errors
    ///
    /// A part that leaves the image or has fewer than 64 lines or pixels; an existing folder of that name; files that
    /// cannot be written; any error of `fill`.
    pub fn write_part(
        &self,
        out: &Path,
        lines: Range<usize>,
        pixels: Range<usize>,
        fill: impl FnMut(Range<usize>, &mut [u16]) -> Result<()>,
    ) -> Result<PathBuf> {
        let annotation = self.annotation();
        check_part(
            &lines,
            &pixels,
            (annotation.lines, annotation.pixels),
            SMALLEST,
        )?;
        let part = Part { lines, pixels };
        let target = out.join(format!("{}.SAFE", self.part_name(&part)));
        if target.exists() {
            return Err(Error::Exists { path: target });
        }
        fs::create_dir_all(out).map_err(|e| Error::io(out, e))?;
        let temporary = tempfile::Builder::new()
            .prefix(".product-")
            .tempdir_in(out)
            .map_err(|e| Error::io(out, e))?;
        self.write_files(temporary.path(), &part, fill)?;
        let written = temporary.keep();
        fs::rename(&written, &target).map_err(|e| Error::io(&target, e))?;
        readable(&target)?;
        Ok(target)
    }

    fn write_files(
        &self,
        folder: &Path,
        part: &Part,
        fill: impl FnMut(Range<usize>, &mut [u16]) -> Result<()>,
    ) -> Result<()> {
        let (annotation, stem) = (self.annotation(), self.part_stem(part));
        let write = |name: &str, text: String| -> Result<()> {
            let path = folder.join(name);
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent).map_err(|e| Error::io(parent, e))?;
            }
            fs::write(&path, text).map_err(|e| Error::io(&path, e))
        };
        let read = |name: &str| Tree::parse(name, &self.archive.text(name)?);
        let mut tree = read(&format!("annotation/{}.xml", self.stem))?;
        part.cut_annotation(&mut tree, annotation);
        write(&format!("annotation/{stem}.xml"), tree.to_text())?;
        let mut tree = read(&format!(
            "annotation/calibration/calibration-{}.xml",
            self.stem
        ))?;
        part.cut_calibration(&mut tree, annotation);
        let name = format!("annotation/calibration/calibration-{stem}.xml");
        write(&name, tree.to_text())?;
        let noise = format!("annotation/calibration/noise-{}.xml", self.stem);
        if self.archive.has(&noise) {
            let mut tree = read(&noise)?;
            part.cut_noise(&mut tree, annotation);
            let name = format!("annotation/calibration/noise-{stem}.xml");
            write(&name, tree.to_text())?;
        }
        let measurement = folder.join("measurement");
        fs::create_dir_all(&measurement).map_err(|e| Error::io(&measurement, e))?;
        let layout = GeoTiffLayout {
            lines: part.lines.len(),
            pixels: part.pixels.len(),
            compression: Compression::None,
            placement: Placement::ControlPoints(self.control_points(part)),
            no_data: None,
        };
        write_geotiff(&measurement.join(format!("{stem}.tiff")), &layout, fill)?;
        if self.archive.has("manifest.safe") {
            let mut manifest = read("manifest.safe")?;
            self.cut_manifest(&mut manifest, part, folder, &stem);
            write("manifest.safe", manifest.to_text())?;
        }
        Ok(())
    }

    /// Points of the geolocation grid of the part.
    fn control_points(&self, part: &Part) -> Vec<GridPoint> {
        let along = |range: &Range<usize>, count: usize| -> Vec<usize> {
            let last = range.len() - 1;
            (0..count).map(|n| n * last / (count - 1)).collect()
        };
        let (lines, pixels) = (along(&part.lines, 10), along(&part.pixels, 21));
        let point = |line: usize, pixel: usize| GridPoint {
            line: line as f64,
            pixel: pixel as f64,
            place: self.annotation().grid.place(
                (part.lines.start + line) as f64,
                (part.pixels.start + pixel) as f64,
            ),
        };
        let rows = lines.iter();
        rows.flat_map(|&line| pixels.iter().map(move |&pixel| (line, pixel)))
            .map(|(line, pixel)| point(line, pixel))
            .collect()
    }

    /// Name of a part without its ending: the product's name with the new times.
    fn part_name(&self, part: &Part) -> String {
        let [first, last] = part
            .times(self.annotation())
            .map(|time| compact(&time.to_string()));
        let name = self.archive.folder_name();
        let name = name.strip_suffix(".SAFE").unwrap_or(name);
        let mut words: Vec<&str> = name.split('_').collect();
        match words.len() {
            9.. => {
                let from_end = words.len();
                words[from_end - 5] = &first;
                words[from_end - 4] = &last;
                let single = words[from_end - 6].replace("DV", "SV").replace("DH", "SH");
                words[from_end - 6] = &single;
                words[from_end - 1] = "0000";
                words.join("_")
            }
            _ => format!("{}_{first}", self.stem),
        }
    }

    /// Name of the files of a part, without ending.
    fn part_stem(&self, part: &Part) -> String {
        let [first, last] = part
            .times(self.annotation())
            .map(|time| compact(&time.to_string()));
        let mut words: Vec<&str> = self.stem.split('-').collect();
        let [first, last] = [first.to_lowercase(), last.to_lowercase()];
        if words.len() == 9 {
            words[4] = &first;
            words[5] = &last;
        }
        words.join("-")
    }

    /// Adapts the manifest: only existing files, times and footprint of the part.
    fn cut_manifest(&self, tree: &mut Tree, part: &Part, folder: &Path, stem: &str) {
        let [first, last] = part.times(self.annotation());
        let corners = part.corners(self.annotation());
        let footprint: Vec<String> = corners
            .iter()
            .map(|place| format!("{:.6},{:.6}", place.latitude, place.longitude))
            .collect();
        tree.for_each(&mut |element| match element.name.as_str() {
            "safe:startTime" => element.text = first.to_string(),
            "safe:stopTime" => element.text = last.to_string(),
            "gml:coordinates" => element.text = footprint.join(" "),
            _ => {}
        });
        let mut kept = Vec::new();
        if let Some(section) = tree.find_mut("dataObjectSection") {
            section.children.retain_mut(|object| {
                let Some(stream) = object.find_mut("byteStream") else {
                    return false;
                };
                let Some(location) = stream.find_mut("fileLocation") else {
                    return false;
                };
                let href = location
                    .attribute("href")
                    .unwrap_or("")
                    .replace(&self.stem, stem);
                let Ok(found) = fs::metadata(folder.join(href.trim_start_matches("./"))) else {
                    return false;
                };
                location.set_attribute("href", href);
                stream.set_attribute("size", found.len());
                stream.children.retain(|child| child.name != "checksum");
                true
            });
            let ids = section.children.iter().filter_map(|o| o.attribute("ID"));
            kept.extend(ids.map(str::to_owned));
        }
        let points_nowhere = |element: &Tree| {
            let pointer = element.find("dataObjectPointer");
            let id = pointer.and_then(|pointer| pointer.attribute("dataObjectID"));
            id.is_some_and(|id| !kept.iter().any(|known| known == id))
        };
        tree.for_each(&mut |element| element.children.retain(|child| !points_nowhere(child)));
    }
}

/// A time in the format of product names: `20210119T031653`.
fn compact(time: &str) -> String {
    let digits = time.split('.').next().unwrap_or(time);
    digits.replace(['-', ':'], "")
}

/// Makes a folder readable by others; temporary folders are readable only by their owner.
fn readable(folder: &Path) -> Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let permissions = fs::Permissions::from_mode(0o755);
        fs::set_permissions(folder, permissions).map_err(|e| Error::io(folder, e))?;
    }
    let _ = folder;
    Ok(())
}
