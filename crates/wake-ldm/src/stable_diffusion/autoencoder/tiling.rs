//! Processing of large images in overlapping tiles, so that memory grows with the tile and not with the image.

use burn::tensor::{Device, Tensor};

/// Size and overlap of the tiles of an image.
///
/// Neighbouring tiles overlap and are blended linearly. Normalisation and attention act on one tile at
/// a time, so the result differs slightly from the whole image's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tiling {
    /// Rows and columns of a tile in pixels; a multiple of the downsampling.
    pub tile: usize,
    /// Fraction of a tile that overlaps the next, 0…0.5.
    pub overlap: f64,
}

/// Tile size and overlap along an axis, in pixels of the image or of the latent image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    pub(super) tile: usize,
    pub(super) overlap: usize,
}

impl Tiling {
    /// Returns the cuts of the image and of the latent image. The overlap is a whole number of latent pixels, so
    /// that the tiles of both coincide.
    pub(super) fn cuts(self, downsampling: usize) -> [Cut; 2] {
        let Self { tile, overlap } = self;
        assert!(
            tile > 0 && tile.is_multiple_of(downsampling),
            "the tile side is {tile} pixels, expected a multiple of {downsampling}"
        );
        assert!(
            (0.0..=0.5).contains(&overlap),
            "the overlap is {overlap} of the tile side, expected 0 to 0.5"
        );
        let latent = tile / downsampling;
        let overlap = share(latent, overlap);
        let cut = |scale: usize| Cut {
            tile: latent * scale,
            overlap: overlap * scale,
        };
        [cut(downsampling), cut(1)]
    }
}

impl Default for Tiling {
    /// Tiles of 512 × 512 pixels that overlap by a quarter.
    fn default() -> Self {
        Self {
            tile: 512,
            overlap: 0.25,
        }
    }
}

/// Applies `run` to tiles cut as `from`, each of which becomes a tile of `to`, and joins the results.
pub(super) fn in_tiles(
    x: Tensor<4>,
    from: Cut,
    to: Cut,
    run: impl Fn(Tensor<4>) -> Tensor<4>,
) -> Tensor<4> {
    let [_, _, rows, columns] = x.dims();
    let stride = from.tile - from.overlap;
    let mut above: Vec<Tensor<4>> = Vec::new();
    let mut joined = Vec::new();
    for top in (0..rows).step_by(stride) {
        let mut row: Vec<Tensor<4>> = Vec::new();
        for left in (0..columns).step_by(stride) {
            let (height, width) = (from.tile.min(rows - top), from.tile.min(columns - left));
            let mut tile = run(x.clone().narrow(2, top, height).narrow(3, left, width));
            if let Some(neighbour) = above.get(row.len()) {
                tile = fade(neighbour, tile, to.overlap, 2);
            }
            if let Some(neighbour) = row.last() {
                tile = fade(neighbour, tile, to.overlap, 3);
            }
            row.push(tile);
        }
        joined.push(Tensor::cat(
            row.iter()
                .map(|tile| crop(tile, to.tile - to.overlap))
                .collect(),
            3,
        ));
        above = row;
    }
    Tensor::cat(joined, 2)
}

/// Blends the end of `before` into the start of `after` along an axis.
///
/// ```text
/// after[i] ← before[n − e + i] (1 − i/e) + after[i] i/e,   0 ≤ i < e
/// ```
fn fade(before: &Tensor<4>, after: Tensor<4>, extent: usize, axis: usize) -> Tensor<4> {
    let (length, available) = (before.dims()[axis], after.dims()[axis]);
    let extent = extent.min(length).min(available);
    if extent == 0 {
        return after;
    }
    let weight = ramp(extent, axis, &after.device());
    let tail = before.clone().narrow(axis, length - extent, extent);
    let head = after.clone().narrow(axis, 0, extent);
    let faded = tail * (-weight.clone() + 1.0) + head * weight;
    if extent == available {
        return faded;
    }
    Tensor::cat(
        vec![faded, after.narrow(axis, extent, available - extent)],
        axis,
    )
}

/// 0, 1/e, …, (e − 1)/e along an axis.
#[expect(
    clippy::cast_precision_loss,
    reason = "a tile has far fewer than 2²⁴ pixels"
)]
fn ramp(extent: usize, axis: usize, device: &Device) -> Tensor<4> {
    let weights: Vec<f32> = (0..extent).map(|i| i as f32 / extent as f32).collect();
    let mut shape = [1; 4];
    shape[axis] = extent;
    Tensor::<1>::from_floats(weights.as_slice(), device).reshape(shape)
}

fn crop(tile: &Tensor<4>, size: usize) -> Tensor<4> {
    let [_, _, rows, columns] = tile.dims();
    tile.clone()
        .narrow(2, 0, size.min(rows))
        .narrow(3, 0, size.min(columns))
}

#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the whole part of a share of a small positive number"
)]
fn share(size: usize, part: f64) -> usize {
    (size as f64 * part) as usize
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use burn::tensor::{Int, TensorData, Tolerance};

    use super::*;

    const CUT: Cut = Cut {
        tile: 8,
        overlap: 2,
    };

    fn image(rows: i64, columns: i64) -> Tensor<4> {
        Tensor::<1, Int>::arange(0..rows * columns, &Device::flex())
            .float()
            .reshape([1, 1, rows, columns])
    }

    /// If every tile is the image itself, blending mixes equal pixels, so the joined tiles must be the
    /// image, for sizes that do and do not fit the tiles.
    #[test]
    fn joined_tiles_of_an_image_are_the_image() {
        for (rows, columns) in [(8, 8), (16, 8), (13, 29), (7, 40), (1, 9)] {
            let x = image(rows, columns);
            let joined = in_tiles(x.clone(), CUT, CUT, |tile| tile);
            let tolerance = Tolerance::<f32>::absolute(1e-4);
            joined
                .into_data()
                .assert_approx_eq::<f32>(&x.into_data(), tolerance);
        }
    }

    /// For any overlap, tiles and overlaps of the image and the latent image are in the same proportion.
    #[test]
    fn cuts_are_whole_latent_pixels() {
        for (tile, overlap) in [(512, 0.25), (520, 0.25), (8, 0.5), (72, 0.3), (8, 0.0)] {
            let [image, latent] = Tiling { tile, overlap }.cuts(8);
            assert_eq!((image.tile, latent.tile * 8), (tile, tile));
            assert_eq!(image.overlap, latent.overlap * 8);
            assert!(latent.tile > latent.overlap);
        }
    }

    /// Tiles filled with their own number are blended linearly: from 0 to 1 over the two overlapping pixels.
    #[test]
    fn neighbours_fade_linearly() {
        let calls = std::cell::Cell::new(0.0_f32);
        let joined = in_tiles(image(8, 14), CUT, CUT, |tile| {
            let value = calls.replace(calls.get() + 1.0);
            tile * 0.0 + value
        });
        let row = joined.narrow(2, 0, 1).reshape([14]).into_data();
        let expected = [0., 0., 0., 0., 0., 0., 0., 0.5, 1., 1., 1., 1., 1.5, 2.];
        let _: &TensorData = &row;
        let values: Vec<f32> = row.iter::<f32>().collect();
        assert_eq!(values[..12], expected[..12]);
    }
}
