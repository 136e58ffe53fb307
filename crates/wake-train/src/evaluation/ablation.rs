//! From the dumbest image to the simulator's, rung by rung: what of a sea each has that a judge can see.

use burn::tensor::Device;
use serde::Serialize;
use wake_physics::reference::seams;
use wake_physics::{Field, Scene};

use super::baseline::Baseline;
use super::judge::told_apart;
use super::pixels::grey;
use super::shape::{SeaShape, crest_variance, sea_shape};
use super::source::{ImageSource, Told, draw_all, other_sea};
use super::statistics::mean;
use crate::TwoSample;
use crate::error::Result;

/// Side of the squares of pixels that the wake model draws by.
const SQUARE: usize = 8;

/// What one kind of image has of a sea, means over the scenes.
#[derive(Debug, Clone, Serialize)]
pub struct AblationRow {
    /// Kind of image.
    pub image: &'static str,
    /// Skewness of the grey that is left when the expected image is subtracted; 0 of a Gaussian field.
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
    /// Against simulated images of the same scenes, see [`classifier_two_sample_test`](crate::classifier_two_sample_test).
    pub two_sample: Option<TwoSample>,
}

/// The figures of every rung, and last of the simulated images that they stand against, which have a third sea.
///
/// - `kinds`: names and sources, told sentence and numbers
/// - `device`: of the judge, one that holds no gradients
/// - `step`: called once before the first rung, and after each
///
/// # Errors
///
/// As [`ImageSource::draw`] and [`classifier_two_sample_test`](crate::classifier_two_sample_test).
pub(super) fn ablation(
    scenes: &[Scene],
    kinds: &[(&'static str, &dyn ImageSource)],
    device: &Device,
    mut step: impl FnMut(),
) -> Result<Vec<AblationRow>> {
    let draw = |source: &dyn ImageSource, scenes: &[Scene]| -> Result<Vec<Field>> {
        let images = draw_all(source, scenes, Told::Both, |_| {})?;
        Ok(images.iter().map(grey).collect())
    };
    let expected = draw(&Baseline::Expected, scenes)?;
    // Neither the sea that pixels are compared with nor that of the rung of the simulator.
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
    let (mut crests, mut borders) = (Vec::new(), Vec::new());
    for ((scene, image), expected) in scenes.iter().zip(images).zip(expected) {
        let left = image.values.iter().zip(&expected.values);
        let left = Field {
            values: left.map(|(a, b)| a - b).collect(),
            ..*image
        };
        shapes.extend(sea_shape(&left, scene.sea.wind_toward.to_radians()));
        crests.extend(crest_variance(image, expected));
        borders.extend(seams(&left, SQUARE));
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
        two_sample,
    }
}
