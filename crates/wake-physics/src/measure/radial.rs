//! Spectrum of an image over rings of wavenumbers.

use super::spectrum::signed;
use crate::fft::Synthesis;
use crate::raster::Field;
use num_complex::Complex64;

/// Assignment of wavenumbers to rings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Binning {
    /// The whole number below.
    Floor,
    /// The nearest whole number, halves to even.
    Round,
}

/// Means over rings, from wavenumber 0 to the corner.
///
/// Ring n holds the waves with about n periods in the image. Rings up to half the smaller side are complete.
#[derive(Debug, Clone, PartialEq)]
pub struct RadialSpectrum {
    /// Number of wavenumbers in the ring.
    pub count: Vec<u64>,
    /// Mean of ln(1 + |F|).
    pub log_magnitude: Vec<f64>,
    /// Mean of |F|.
    pub magnitude: Vec<f64>,
    /// Mean of |F|².
    pub power: Vec<f64>,
}

/// Radial spectrum of an image.
///
/// ```text
/// F(u, v) = Σ image·e^{−2πi(u i/rows + v j/columns)},    ring = √(u² + v²)
/// ```
///
/// The radius counts periods in the image, whatever its shape; F is not normalised.
#[must_use]
pub fn radial_spectrum(image: &Field, binning: Binning) -> RadialSpectrum {
    let (rows, columns) = (image.rows, image.columns);
    let magnitudes = magnitudes(image);
    let ring = |n: usize| {
        let radius = signed(n / columns, rows).hypot(signed(n % columns, columns));
        match binning {
            Binning::Floor => radius.floor() as usize,
            Binning::Round => radius.round_ties_even() as usize,
        }
    };
    let rings = (0..magnitudes.len()).map(ring).max().map_or(0, |r| r + 1);
    let mut spectrum = RadialSpectrum {
        count: vec![0; rings],
        log_magnitude: vec![0.0; rings],
        magnitude: vec![0.0; rings],
        power: vec![0.0; rings],
    };
    for (n, &magnitude) in magnitudes.iter().enumerate() {
        let ring = ring(n);
        spectrum.count[ring] += 1;
        spectrum.log_magnitude[ring] += magnitude.ln_1p();
        spectrum.magnitude[ring] += magnitude;
        spectrum.power[ring] += magnitude * magnitude;
    }
    for ring in 0..rings {
        let count = spectrum.count[ring].max(1) as f64;
        spectrum.log_magnitude[ring] /= count;
        spectrum.magnitude[ring] /= count;
        spectrum.power[ring] /= count;
    }
    spectrum
}

/// |F| in the order of an FFT, row after row.
fn magnitudes(image: &Field) -> Vec<f64> {
    let (rows, columns) = (image.rows, image.columns);
    let mut lines = vec![Complex64::new(0.0, 0.0); rows * columns];
    for (n, &v) in image.values.iter().enumerate() {
        lines[(n % columns) * rows + n / columns].re = f64::from(v);
    }
    let (mut re, mut im) = (vec![0.0f32; rows * columns], vec![0.0f32; rows * columns]);
    let synthesis = Synthesis::<f64>::new(rows, columns);
    synthesis.run(&mut lines, [rows, columns], [&mut re, &mut im], |_, _| ());
    let parts = re.iter().zip(&im);
    parts
        .map(|(&a, &b)| f64::from(a).hypot(f64::from(b)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Raster;

    /// A point has the same power everywhere; a wave of n periods has all of its power in ring n.
    #[test]
    fn a_point_is_white_and_a_wave_is_one_ring() {
        let raster = Raster::image(32, 32, 1.0);
        let point = Field::from_fn(&raster, |i, j| f32::from(u8::from(i == 5 && j == 9)));
        let spectrum = radial_spectrum(&point, Binning::Floor);
        assert!(spectrum.power.iter().all(|p| (p - 1.0).abs() < 1e-6));
        assert_eq!(spectrum.count.iter().sum::<u64>(), 32 * 32);
        let wave = Field::from_fn(&raster, |_, j| {
            (std::f64::consts::TAU * 6.0 * j as f64 / 32.0).cos() as f32
        });
        let spectrum = radial_spectrum(&wave, Binning::Round);
        for (ring, power) in spectrum.power.iter().enumerate() {
            let total = power * spectrum.count[ring] as f64;
            // Two lines of (32·32/2)² each.
            let expected = if ring == 6 {
                2.0 * 512.0f64.powi(2)
            } else {
                0.0
            };
            assert!(
                (total - expected).abs() < 1e-3 * 512.0f64.powi(2),
                "{ring}: {total}"
            );
        }
    }
}
