//! Ablation over kinds of images, from a constant to the simulator's: shape of the sea, and classifier two-sample tests.

use burn::tensor::Device;
use serde::Serialize;
use wake_physics::reference::seams;
use wake_physics::{Field, Scene};

use super::baseline::Baseline;
use super::judge::told_apart;
use super::shape::{SeaShape, crest_variance, sea_shape};
use super::source::{ImageSource, Named, Told, other_sea};
use super::statistics::mean;
use super::view::View;
use super::wake_correlation::wedge;
use crate::TwoSample;
use crate::error::Result;

/// Side of the squares of pixels that the wake model draws by.
const SQUARE: usize = 8;

/// Figures of the sea in one kind of image, means over the scenes.
#[derive(Debug, Clone, Serialize)]
pub struct AblationRow {
    /// Kind of image.
    pub image: &'static str,
    /// Skewness of grey less the expected image; 0 for a Gaussian field.
    pub skewness: Option<f64>,
    /// Excess kurtosis of the same.
    pub kurtosis: Option<f64>,
    /// Skewness of its derivative along range, azimuth, wind.
    pub steepness: [Option<f64>; 3],
    /// Standard deviation over mean of its local energy.
    pub grouping: Option<f64>,
    /// Variance on crests of the wake over that in its troughs.
    pub crest_variance: Option<f64>,
    /// Squared differences of neighbours across the borders of the model's squares over those elsewhere.
    pub seams: Option<f64>,
    /// Slope of grey against the expected image inside the Kelvin wedge: 1 where the wake has the contrast of the physics, 0
    /// without a wake.
    pub wake_contrast: Option<f64>,
    /// Test against simulated images of the same scenes, see [`classifier_two_sample_test`](crate::classifier_two_sample_test).
    pub two_sample: Option<TwoSample>,
}

/// Rows of every kind of image, and last of the simulated images that they are compared with, which have a third sea.
///
/// - `kinds`: names and sources, conditioned on sentence and numbers
/// - `device`: device of the classifier, without autodiff
/// - `step`: called once before the first kind, and after each
///
/// # Errors
///
/// As [`ImageSource::draw`] and [`classifier_two_sample_test`](crate::classifier_two_sample_test).
pub(super) fn ablation(
    scenes: &[Scene],
    kinds: &[Named<'_>],
    view: &View,
    device: &Device,
    mut step: impl FnMut(),
) -> Result<Vec<AblationRow>> {
    let draw = |source: &dyn ImageSource, scenes: &[Scene]| -> Result<Vec<Field>> {
        let images = view.draw_all(source, scenes, Told::Both, |_| {})?;
        Ok(images.iter().map(|image| view.grey(image)).collect())
    };
    // The expected image has no speckle, even where the images do.
    let plain = View {
        speckle: false,
        ..*view
    };
    let expected = plain.draw_all(&Baseline::Expected, scenes, Told::Both, |_| {})?;
    let expected: Vec<Field> = expected.iter().map(|image| view.grey(image)).collect();
    // A sea other than those of the pixel comparison and of the simulator among the kinds.
    let third: Vec<Scene> = scenes.iter().map(|scene| other_sea(scene, 2)).collect();
    let simulated = draw(&Baseline::Simulator, &third)?;
    step();
    let mut rows = Vec::new();
    for (name, source) in kinds {
        let images = draw(*source, scenes)?;
        let told = told_apart(&simulated, &images, device)?;
        rows.push(row(name, scenes, &images, &expected, told));
        step();
    }
    let name = Baseline::Simulator.name();
    rows.push(row(name, scenes, &simulated, &expected, None));
    Ok(rows)
}

fn row(
    image: &'static str,
    scenes: &[Scene],
    images: &[Field],
    expected: &[Field],
    two_sample: Option<TwoSample>,
) -> AblationRow {
    let mut shapes: Vec<SeaShape> = Vec::new();
    let (mut crests, mut borders, mut contrasts) = (Vec::new(), Vec::new(), Vec::new());
    for ((scene, image), expected) in scenes.iter().zip(images).zip(expected) {
        let left = image.values.iter().zip(&expected.values);
        let left = Field {
            values: left.map(|(a, b)| a - b).collect(),
            ..*image
        };
        shapes.extend(sea_shape(&left, scene.sea.wind_toward.to_radians()));
        crests.extend(crest_variance(image, expected));
        borders.extend(seams(&left, SQUARE));
        contrasts.extend(wake_contrast(scene, image, expected));
    }
    let of = |value: &dyn Fn(&SeaShape) -> f64| {
        let values: Vec<f64> = shapes.iter().map(value).collect();
        mean(&values)
    };
    AblationRow {
        image,
        skewness: of(&|s| s.skewness),
        kurtosis: of(&|s| s.kurtosis),
        steepness: std::array::from_fn(|n| of(&|s| s.derivative_skewness[n])),
        grouping: of(&|s| s.grouping),
        crest_variance: mean(&crests),
        seams: mean(&borders),
        wake_contrast: mean(&contrasts),
        two_sample,
    }
}

/// Slope of an image against the expected one inside the Kelvin wedge, by least squares; `None` without a ship or for a flat
/// expected image.
fn wake_contrast(scene: &Scene, image: &Field, expected: &Field) -> Option<f64> {
    let inside = wedge(scene).ok()?;
    let within = |field: &Field| -> Vec<f64> {
        let pixels = field.values.iter().zip(&inside);
        let pixels = pixels.filter(|(_, inside)| **inside);
        pixels.map(|(&v, _)| f64::from(v)).collect()
    };
    let [image, expected] = [image, expected].map(within);
    let [of_image, of_expected] = [mean(&image)?, mean(&expected)?];
    let pairs = || image.iter().zip(&expected);
    let product = |(a, b): (&f64, &f64)| (a - of_image) * (b - of_expected);
    let square: f64 = expected.iter().map(|b| (b - of_expected).powi(2)).sum();
    (square > 0.0).then(|| pairs().map(product).sum::<f64>() / square)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    /// Half the contrast around another mean gives a slope of one half.
    #[test]
    fn the_contrast_of_a_wake_is_a_slope() {
        let keys = ["grid.rows = 64", "grid.columns = 64"];
        let scene = Scene::default().with_assignments(&keys).unwrap();
        let expected = wake_physics::expected_intensity(&scene).unwrap();
        let image = Field {
            values: expected.values.iter().map(|v| 3.0 + 0.5 * v).collect(),
            ..expected
        };
        let slope = wake_contrast(&scene, &image, &expected).unwrap();
        assert!((slope - 0.5).abs() < 1e-4, "{slope}");
        let flat = Field {
            values: vec![1.0; image.values.len()],
            ..image
        };
        assert!(wake_contrast(&scene, &flat, &expected).unwrap().abs() < 1e-12);
        assert_eq!(wake_contrast(&scene, &image, &flat), None);
    }
}
