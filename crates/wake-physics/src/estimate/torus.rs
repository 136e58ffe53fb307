//! Fourier sums of real fields on a torus that is larger than the image.

use crate::fft::Synthesis;
use crate::raster::Field;
use num_complex::Complex32;

/// Square torus of pixels. A spectrum is its half plane, `[size/2 + 1, size]`; the other half is its conjugate.
#[derive(Debug)]
pub(super) struct Torus {
    pub(super) size: usize,
    synthesis: Synthesis<f32>,
}

/// Half of the spectrum of a real field.
pub(super) type Spectrum = Vec<Complex32>;

impl Torus {
    pub(super) fn new(size: usize) -> Self {
        Self {
            size,
            synthesis: Synthesis::new(size, size),
        }
    }

    /// Number of wavenumbers in the half plane.
    pub(super) fn half(&self) -> usize {
        (self.size / 2 + 1) * self.size
    }

    /// Number of wavenumbers of the whole plane that one of the half plane represents.
    pub(super) fn weight(&self, n: usize) -> f64 {
        let line = n / self.size;
        if (2 * line).is_multiple_of(self.size) {
            1.0
        } else {
            2.0
        }
    }

    /// Spectra of two real fields that fill the torus from its first row and column.
    pub(super) fn spectra(&self, [a, b]: [&Field; 2]) -> [Spectrum; 2] {
        let size = self.size;
        let mut lines = vec![Complex32::default(); size * size];
        for i in 0..a.rows {
            let row = i * a.columns;
            for j in 0..a.columns {
                lines[j * size + i] = Complex32::new(a.values[row + j], b.values[row + j]);
            }
        }
        let [re, im] = self.sum(&mut lines);
        let at = |i: usize, j: usize| {
            let n = (i % size) * size + j % size;
            Complex32::new(re[n], im[n])
        };
        let mut out = [(); 2].map(|()| Vec::with_capacity(self.half()));
        for n in 0..self.half() {
            let (i, j) = (n / size, n % size);
            let (here, there) = (at(i, j), at(size - i, size - j).conj());
            out[0].push(0.5 * (here + there));
            out[1].push((here - there) * Complex32::new(0.0, -0.5));
        }
        out
    }

    /// Spectrum of one real field.
    pub(super) fn spectrum(&self, field: &Field) -> Spectrum {
        let [spectrum, _] = self.spectra([field, field]);
        spectrum
    }

    /// Real fields of two spectra, cropped to the first rows and columns.
    pub(super) fn fields(&self, [a, b]: [&Spectrum; 2], keep: [usize; 2]) -> [Field; 2] {
        let size = self.size;
        let mut lines = vec![Complex32::default(); size * size];
        let i_unit = Complex32::new(0.0, 1.0);
        for i in 0..size {
            for j in 0..size {
                let value = if i <= size / 2 {
                    let n = i * size + j;
                    a[n] + i_unit * b[n]
                } else {
                    let n = (size - i) * size + (size - j) % size;
                    a[n].conj() + i_unit * b[n].conj()
                };
                lines[j * size + i] = value.conj();
            }
        }
        let [re, im] = self.sum(&mut lines);
        let scale = 1.0 / (size * size) as f32;
        let cut = |values: &[f32], sign: f32| Field {
            rows: keep[0],
            columns: keep[1],
            values: (0..keep[0] * keep[1])
                .map(|n| sign * scale * values[(n / keep[1]) * size + n % keep[1]])
                .collect(),
        };
        [cut(&re, 1.0), cut(&im, -1.0)]
    }

    fn sum(&self, lines: &mut [Complex32]) -> [Vec<f32>; 2] {
        let size = self.size;
        let [mut re, mut im] = [(); 2].map(|()| vec![0.0; size * size]);
        let keep = [size, size];
        self.synthesis
            .run(lines, keep, [&mut re, &mut im], |_, _| {});
        [re, im]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(rows: usize, columns: usize, seed: u32) -> Field {
        let value = |n: usize| {
            let mixed = (n as u32 + 1)
                .wrapping_mul(2_654_435_761)
                .wrapping_add(seed);
            (mixed >> 8) as f32 / (1u32 << 24) as f32 - 0.5
        };
        Field {
            rows,
            columns,
            values: (0..rows * columns).map(value).collect(),
        }
    }

    /// Parseval's theorem and the inverse transform, on an even and an odd torus.
    #[test]
    fn spectra_are_those_of_both_fields() {
        for size in [20, 21] {
            let torus = Torus::new(size);
            let [a, b] = [field(15, 12, 1), field(15, 12, 9)];
            let [one, two] = torus.spectra([&a, &b]);
            let product: f64 = (0..torus.half())
                .map(|n| torus.weight(n) * f64::from((one[n].conj() * two[n]).re))
                .sum();
            let direct: f64 = a
                .values
                .iter()
                .zip(&b.values)
                .map(|(x, y)| f64::from(x * y))
                .sum();
            assert!((product / (size * size) as f64 - direct).abs() < 1e-4);
            let [back, again] = torus.fields([&one, &two], [15, 12]);
            for (from, to) in [(&a, &back), (&b, &again)] {
                assert!(from.difference(to).0 < 1e-5);
            }
        }
    }
}
