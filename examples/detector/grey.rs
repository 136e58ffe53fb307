//! Grey images at other scales.

pub(crate) use super::grey_file::Grey;
use super::grey_file::Levels;

impl Grey {
    /// Levels from 0 to 255, rounded to eight bits.
    ///
    /// # Panics
    ///
    /// When there are not `rows · columns` of them.
    pub(crate) fn from_levels(rows: usize, columns: usize, levels: &[f32]) -> Self {
        assert_eq!(levels.len(), rows * columns, "pixels of an image");
        let levels = levels.iter().map(|x| x.round().clamp(0.0, 255.0) as u8);
        Self {
            rows,
            columns,
            levels: Levels::Eight(levels.collect()),
        }
    }

    /// The image rotated by a quarter clockwise.
    #[cfg(test)]
    pub(crate) fn turned(&self) -> Self {
        let turn = |value: &dyn Fn(usize, usize) -> f32| -> Vec<f32> {
            let places = (0..self.columns).flat_map(|r| (0..self.rows).map(move |c| (r, c)));
            places.map(|(r, c)| value(self.rows - 1 - c, r)).collect()
        };
        let window = self.window(0, 0, self.rows, self.columns);
        let levels = turn(&|row, column| window[row * self.columns + column]);
        Self::from_levels(self.columns, self.rows, &levels)
    }
}

/// An image at another scale: every pixel is a mean under a triangle as wide as the coarser pixels of both.
///
/// The middle of the first pixel goes to ½ · factor − ½; result: rows, columns and pixels.
pub(crate) fn rescaled(
    pixels: &[f32],
    rows: usize,
    columns: usize,
    factor: f32,
) -> (usize, usize, Vec<f32>) {
    if (factor - 1.0).abs() < 1e-6 {
        return (rows, columns, pixels.to_vec());
    }
    let size = |n: usize| ((n as f32 * factor).round() as usize).max(1);
    let (new_rows, new_columns) = (size(rows), size(columns));
    let across = weights(columns, new_columns, factor);
    let mut narrow = vec![0.0; rows * new_columns];
    for (to, from) in narrow
        .chunks_exact_mut(new_columns)
        .zip(pixels.chunks_exact(columns))
    {
        for (x, (first, weights)) in to.iter_mut().zip(&across) {
            *x = weights
                .iter()
                .zip(&from[*first..])
                .map(|(w, x)| w * x)
                .sum();
        }
    }
    let mut scaled = vec![0.0; new_rows * new_columns];
    for (to, (first, weights)) in scaled
        .chunks_exact_mut(new_columns)
        .zip(weights(rows, new_rows, factor))
    {
        for (k, w) in weights.iter().enumerate() {
            let from = &narrow[(first + k) * new_columns..][..new_columns];
            to.iter_mut().zip(from).for_each(|(to, x)| *to += w * x);
        }
    }
    (new_rows, new_columns, scaled)
}

/// For every new pixel the first old one under its triangle, and the weights, with sum 1.
fn weights(old: usize, new: usize, factor: f32) -> Vec<(usize, Vec<f32>)> {
    let reach = (1.0 / factor).max(1.0);
    let one = |i: usize| {
        let centre = (i as f32 + 0.5) / factor - 0.5;
        let first = (centre - reach).ceil().clamp(0.0, (old - 1) as f32) as usize;
        let last = (centre + reach).floor().clamp(0.0, (old - 1) as f32) as usize;
        let weight = |k: usize| (1.0 - (k as f32 - centre).abs() / reach).max(0.0);
        let mut weights: Vec<f32> = (first..=last).map(weight).collect();
        let sum: f32 = weights.iter().sum();
        match sum > 0.0 {
            true => weights.iter_mut().for_each(|w| *w /= sum),
            false => weights[0] = 1.0,
        }
        (first, weights)
    };
    (0..new).map(one).collect()
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use super::*;
    use crate::grey_file::LONGEST_FILE;

    /// A constant stays, and a ramp keeps its slope: pixel i of the new image lies at (i + ½)/factor − ½ of the old.
    #[test]
    fn scaling_keeps_constants_and_ramps() {
        let (rows, columns) = (40, 60);
        let ramp: Vec<f32> = (0..rows * columns)
            .map(|i| (i % columns) as f32 + 2.0 * (i / columns) as f32)
            .collect();
        for factor in [0.35f32, 0.5, 0.7, 1.0, 1.4] {
            let (r, c, scaled) = rescaled(&ramp, rows, columns, factor);
            let at = |i: usize| (i as f32 + 0.5) / factor - 0.5;
            for row in r / 4..3 * r / 4 {
                for column in c / 4..3 * c / 4 {
                    let expected = at(column) + 2.0 * at(row);
                    // A triangle sampled at whole pixels has its centre of mass off by less than a tenth of one.
                    let error = (scaled[row * c + column] - expected).abs();
                    assert!(error < 0.3, "{factor} {row} {column}: {error}");
                }
            }
            let (.., flat) = rescaled(&vec![5.0; rows * columns], rows, columns, factor);
            assert!(flat.iter().all(|x| (x - 5.0).abs() < 1e-4));
        }
    }

    #[test]
    fn sixteen_bits_keep_their_levels() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let image = image::ImageBuffer::<image::Luma<u16>, _>::from_fn(5, 3, |x, y| {
            image::Luma([(1000 * x + y) as u16])
        });
        image.save(&path).expect("a file");
        let grey = Grey::read(&path).expect("an image");
        assert_eq!((grey.rows, grey.columns), (3, 5));
        assert_eq!(
            grey.window(1, 2, 2, 3),
            [2001.0, 3001.0, 4001.0, 2002.0, 3002.0, 4002.0]
        );
        // A quarter clockwise: the first column becomes the first row, its last pixel first.
        let turned = Grey::from_levels(2, 3, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).turned();
        assert_eq!(turned.window(0, 0, 3, 2), [4.0, 1.0, 5.0, 2.0, 6.0, 3.0]);
    }

    #[test]
    fn what_is_no_image_is_refused_in_one_sentence() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let refusal = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("a file");
            Grey::read(&path).expect_err("no image").to_string()
        };
        let mut good = Vec::new();
        image::GrayImage::new(40, 40)
            .write_to(
                &mut std::io::Cursor::new(&mut good),
                image::ImageFormat::Png,
            )
            .expect("a PNG");
        for bytes in [
            &b""[..],
            b"not an image",
            &good[..good.len() / 2],
            &good[..20],
        ] {
            let sentence = refusal(bytes);
            assert!(
                sentence.contains("a.png") && sentence.contains("PNG") && !sentence.contains('\n'),
                "{sentence}"
            );
        }
        // A header that claims 30,000 x 30,000 pixels; the sum over it is that of the claim.
        let mut claims = good.clone();
        claims[16..20].copy_from_slice(&30_000u32.to_be_bytes());
        claims[20..24].copy_from_slice(&30_000u32.to_be_bytes());
        let sum = crc(&claims[12..29]);
        claims[29..33].copy_from_slice(&sum.to_be_bytes());
        let sentence = refusal(&claims);
        assert!(
            sentence.contains("30000 x 30000") && sentence.contains("20000"),
            "{sentence}"
        );
        // A file of more than two billion bytes, without a byte on the disk.
        File::create(&path)
            .and_then(|file| file.set_len(LONGEST_FILE + 1))
            .expect("a file");
        let sentence = Grey::read(&path).expect_err("too long").to_string();
        assert!(sentence.contains("2000000001 bytes"), "{sentence}");
    }

    /// The cyclic redundancy check of PNG, bit by bit.
    fn crc(bytes: &[u8]) -> u32 {
        let step = |crc: u32, _| {
            if crc & 1 == 1 {
                (crc >> 1) ^ 0xEDB8_8320
            } else {
                crc >> 1
            }
        };
        !bytes.iter().fold(u32::MAX, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), step)
        })
    }
}
