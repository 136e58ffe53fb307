//! Kinds of sea that are compared with a real one.

use rayon::prelude::*;
use wake_physics::measure::{median, texture};
use wake_physics::sar::speckle::speckle;
use wake_physics::{Field, Scene, Simulator, expected_intensity};

use super::pair::{SeaPair, window};
use crate::error::Result;
use crate::evaluation::baseline::gaussian_sea;
use wake_dataset::{Grey, Recipe, Simulated};
use wake_ldm::sea_texture::{SeaStyle, SeaTexture, WINDOW};
use wake_nn::noise::NoiseSource;

/// The open sea of a recipe.
const OPEN_SEA: [&str; 4] = [
    "scene.grid.rows = 128",
    "scene.grid.columns = 128",
    "draw.count = 0",
    "draw.sea.slick_damping = 0",
];
/// Median grey of linear seas, a level that is black in no quick-look of the recipe.
const LINEAR_GREY: f64 = 0.3;

/// Windows of every kind of sea by name, one for each pair, in levels of 8 bits.
///
/// The kinds are the left windows themselves, the learnt sea of their styles and of its own, Gaussian noise of their
/// correlations, white speckle of their looks, the simulated open sea of the recipe `satellites`, and a linear sea under that
/// recipe's speckle. Windows drawn after a left window have its median.
///
/// - `seed`: of the first window of each kind
///
/// # Errors
///
/// As [`SeaTexture::amplitude`] and [`Simulated::scene`].
pub fn kinds(
    pairs: &[SeaPair],
    learnt: &SeaTexture,
    seed: u64,
) -> Result<Vec<(&'static str, Vec<Field>)>> {
    let draw = |work: &dyn Fn(&SeaPair, u64) -> Result<Field>| -> Result<Vec<Field>> {
        let numbered = pairs.iter().zip(seed..);
        numbered
            .map(|(pair, seed)| Ok(levels(work(pair, seed)?, pair)))
            .collect()
    };
    let own = draw(&|_, seed| Ok(amplitude(&learnt.sample(seed, WINDOW, WINDOW)?)))?;
    let told = draw(&|pair, seed| Ok(learnt.amplitude(&pair.style, seed, WINDOW, WINDOW)?))?;
    let gaussian = draw(&|pair, seed| Ok(gaussian_amplitude(&pair.style, seed)))?;
    let white = draw(&|pair, seed| Ok(white_speckle(&pair.left, seed)))?;
    let recipe = Recipe::satellites()?;
    let simulated = simulated_seas(&recipe, pairs.len(), seed)?;
    let source = Simulated::new(recipe.with_assignments(&OPEN_SEA)?, seed)?;
    let linear = (0..pairs.len() as u64)
        .into_par_iter()
        .map(|index| linear(&source.scene(index)?));
    let linear: Vec<Field> = linear.collect::<Result<_>>()?;
    let left = pairs.iter().map(|pair| pair.left.clone()).collect();
    Ok(vec![
        ("real, left halves", left),
        ("learnt, styles of the left windows", told),
        ("learnt, its own styles", own),
        ("Gaussian noise, correlations of the left windows", gaussian),
        ("white speckle, looks of the left windows", white),
        ("simulated (recipe satellites)", simulated),
        ("linear sea and the sensor's speckle", linear),
    ])
}

/// Windows of the open sea of a recipe, without ships and slicks, in levels of 8 bits as its images have them.
///
/// # Errors
///
/// As [`Simulated::pair`].
pub fn simulated_seas(recipe: &Recipe, count: usize, seed: u64) -> Result<Vec<Field>> {
    let source = Simulated::new(recipe.with_assignments(&OPEN_SEA)?, seed)?;
    let window = |index| Ok(levels_of(&source.pair(index)?.image));
    (0..count as u64).into_par_iter().map(window).collect()
}

/// Gaussian amplitude over its median, with the mean, the spread and the correlations of a style, cut at 0:
/// `[WINDOW, WINDOW]`.
#[must_use]
pub fn gaussian_amplitude(style: &SeaStyle, seed: u64) -> Field {
    let mut field = style.noise(NoiseSource::new(seed), WINDOW, WINDOW);
    for value in &mut field.values {
        *value = (style.mean() + style.spread() * *value).max(0.0);
    }
    field
}

fn amplitude(intensity: &Field) -> Field {
    Field {
        values: intensity.values.iter().map(|v| v.max(0.0).sqrt()).collect(),
        ..*intensity
    }
}

/// Uncorrelated speckle of the window's equivalent number of looks, rounded to a whole number.
fn white_speckle(like: &Field, seed: u64) -> Field {
    let looks = texture(like, WINDOW).map_or(1.0, |texture| texture.looks);
    let mut field = window(vec![1.0; WINDOW * WINDOW]);
    speckle(&mut field, looks.round().max(1.0) as u32, seed);
    amplitude(&field)
}

/// Scales amplitudes to the median of the pair's left window, and rounds them to levels of a quick-look.
fn levels(mut amplitude: Field, pair: &SeaPair) -> Field {
    let factor = pair.median as f32 / median(&amplitude.values).max(f32::MIN_POSITIVE);
    for value in &mut amplitude.values {
        *value = (factor * *value).round().clamp(0.0, 255.0);
    }
    amplitude
}

/// Levels of grey as a window.
fn levels_of(grey: &Grey) -> Field {
    window(grey.levels().into_iter().map(f32::from).collect())
}

/// A Gaussian sea with the linear spectrum of the image, under the speckle of a simulated image of the scene.
fn linear(scene: &Scene) -> Result<Field> {
    let mut power = expected_intensity(scene)?;
    let sea = gaussian_sea(scene)?;
    let image = Simulator::default().image(scene)?;
    let mean = image.intensity.clone();
    let speckled = image.speckled();
    let speckle = speckled.values.iter().zip(&mean.values);
    for ((value, sea), (with, without)) in power.values.iter_mut().zip(&sea.values).zip(speckle) {
        let speckle = if *without > 0.0 { with / without } else { 0.0 };
        *value *= sea * speckle;
    }
    let (grey, _) = Grey::quick_look(&power, LINEAR_GREY, 0.0);
    Ok(levels_of(&grey))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    /// White speckle drawn after a window of four looks has its looks and its median.
    #[test]
    fn white_speckle_has_the_looks_and_the_median_of_its_window() {
        let left = {
            let mut field = window(vec![2500.0; WINDOW * WINDOW]);
            speckle(&mut field, 4, 1);
            amplitude(&field)
        };
        let style = SeaStyle::of(&left).unwrap();
        let pair = SeaPair {
            right: left.clone(),
            median: f64::from(median(&left.values)),
            style,
            left,
        };
        let drawn = levels(white_speckle(&pair.left, 2), &pair);
        assert!((f64::from(median(&drawn.values)) - pair.median).abs() <= 0.5);
        let looks = texture(&drawn, WINDOW).unwrap().looks;
        // A variance of 128² pixels has an error of 1.1 %; rounding to levels adds less.
        assert!((looks - 4.0).abs() < 0.3, "{looks}");
        let noise = gaussian_amplitude(&pair.style, 3);
        assert!((noise.mean() - f64::from(pair.style.mean())).abs() < 0.02);
    }
}
