//! Figures of one simulated or real image, for comparison with others: sea texture, and profiles across wakes.

use serde::Serialize;

use super::profile::{Streak, WakeAxis, WakeProfile, wake_arms, wake_profile};
use wake_physics::measure::{Texture, amplitude_correlation, texture};
use wake_physics::window::Window;
use wake_physics::{Field, Scene, Simulation};

/// Side of the windows of open sea \[pixels\].
const SIDE: usize = 256;
/// Distances from the tip of a wake over which profiles are averaged \[pixels\].
const STRETCHES: [[f64; 2]; 3] = [[25.0, 85.0], [85.0, 170.0], [170.0, 300.0]];

/// Measurements of one amplitude image.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct ImageFigures {
    /// Name of the image.
    pub(crate) name: String,
    /// Speckle statistics that window, resolution and looks imply, for a simulated image.
    pub(crate) stated: Option<StatedSpeckle>,
    /// Texture of its open sea, in windows of 256 pixels a side; `None` if no window contains only sea.
    pub(crate) texture: Option<Texture>,
    /// Profiles across its wakes.
    pub(crate) wakes: Vec<WakeFigures>,
}

/// Speckle in closed form, see [`amplitude_correlation`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct StatedSpeckle {
    /// Equivalent number of independent looks.
    pub(crate) looks: f64,
    /// Correlation of amplitudes one, two and three pixels apart in a row.
    pub(crate) along_rows: [f64; 3],
    /// Correlation of amplitudes one, two and three pixels apart in a column.
    pub(crate) along_columns: [f64; 3],
}

/// Profiles across one wake, 25 to 85, 85 to 170 and 170 to 300 pixels from its tip.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct WakeFigures {
    /// Names of the image and the wake.
    pub(crate) name: String,
    /// Dark line and bright streak of each stretch.
    pub(crate) stretches: [Option<WakeProfile>; 3],
    /// Arms in each stretch, on either side of the axis.
    pub(crate) arms: [[Option<Streak>; 2]; 3],
}

impl ImageFigures {
    /// Figures of a simulated image with speckle; its wakes are named by letters.
    pub(crate) fn of_simulation(name: &str, simulation: &Simulation) -> Self {
        let mut amplitude = simulation.speckled.clone();
        amplitude.values.iter_mut().for_each(|v| *v = v.sqrt());
        let wakes = simulation.labels.ships.iter().map(|ship| &ship.wake);
        let axes = wakes.filter_map(|wake| {
            Some(WakeAxis {
                tip: wake.tip_px?,
                direction: wake.axis_deg?,
            })
        });
        let axes = axes.enumerate().map(|(n, axis)| (letter(n), axis));
        Self {
            stated: Some(StatedSpeckle::of(
                &simulation.scene,
                simulation.raster.spacing,
            )),
            ..Self::of_amplitude(name, &amplitude, axes)
        }
    }

    /// Figures of an image that is linear in amplitude.
    ///
    /// - `wakes`: names and axes of its wakes
    pub(crate) fn of_amplitude(
        name: &str,
        amplitude: &Field,
        wakes: impl IntoIterator<Item = (String, WakeAxis)>,
    ) -> Self {
        let wakes = wakes.into_iter().map(|(letter, axis)| WakeFigures {
            name: format!("{name} {letter}"),
            stretches: STRETCHES.map(|stretch| wake_profile(amplitude, &axis, stretch)),
            arms: STRETCHES.map(|stretch| wake_arms(amplitude, &axis, stretch)),
        });
        Self {
            name: name.to_owned(),
            stated: None,
            wakes: wakes.collect(),
            texture: texture(amplitude, SIDE),
        }
    }
}

impl StatedSpeckle {
    /// Speckle statistics of a scene's radar.
    ///
    /// - `spacing`: pixel spacing \[m\]
    pub(crate) fn of(scene: &Scene, spacing: f64) -> Self {
        let radar = &scene.radar;
        let window = radar.window.unwrap_or(Window::Uniform);
        let overlap = radar.look_overlap.unwrap_or(0.0);
        let looks = window.overlapping_looks(radar.looks, overlap);
        let lags = |resolution: Option<f64>, window: Window| {
            [1.0, 2.0, 3.0].map(|lag| match resolution {
                None => 0.0,
                Some(resolution) => {
                    let x = lag * spacing / resolution * window.width();
                    amplitude_correlation(looks, window.correlation(x))
                }
            })
        };
        let azimuth = radar.range_resolution.map(|_| radar.azimuth_resolution);
        Self {
            looks,
            along_rows: lags(radar.range_resolution, window),
            along_columns: lags(azimuth, radar.azimuth_window.unwrap_or(window)),
        }
    }
}

fn letter(n: usize) -> String {
    char::from(b'a' + (n % 26) as u8).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A uniform window has a correlation of sinc²: zero at whole resolution cells, (2/π)² of the intensity at half a
    /// cell.
    #[test]
    fn speckle_is_correlated_as_the_window_says() {
        let mut scene = Scene::default();
        let white = StatedSpeckle::of(&scene, 1.0);
        assert!(white.along_rows.iter().all(|lag| lag.abs() < 1e-15));
        (scene.radar.window, scene.radar.azimuth_window) = (Some(Window::Uniform), None);
        (scene.radar.looks, scene.radar.look_overlap) = (1, None);
        (scene.radar.range_resolution, scene.radar.azimuth_resolution) = (Some(4.0), 8.0);
        let cell = Window::Uniform.width();
        let stated = StatedSpeckle::of(&scene, 4.0 / cell);
        let half = amplitude_correlation(1.0, (2.0 / std::f64::consts::PI).powi(2));
        assert!(stated.along_rows.iter().all(|lag| lag.abs() < 1e-12));
        assert!((stated.along_columns[0] - half).abs() < 1e-12, "{stated:?}");
        assert!(stated.along_columns[1].abs() < 1e-12);
        assert!((stated.looks - 1.0).abs() < 1e-12);
    }
}
