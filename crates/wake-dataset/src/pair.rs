//! One image with its prompt, scene and labels.

use super::grey::Grey;
use super::scenes::Simulated;
use crate::error::Result;
use std::sync::{Mutex, MutexGuard, PoisonError};
use wake_physics::labels::Labels;
use wake_physics::{Field, Scene, Simulator, labels_of};

/// An image with its prompt, scene and labels.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Index in the data set.
    pub index: u64,
    /// The image, in grey levels by the recipe's mapping or as a quick-look.
    pub image: Grey,
    /// The scene as a sentence.
    pub prompt: String,
    /// The scene from which the image was made.
    pub scene: Scene,
    /// Places of ships and wakes.
    pub labels: Labels,
    /// For a quick-look, the amplitudes √σ⁰ of grey 0 and grey 1, linear between; the first may be negative.
    pub amplitudes: Option<[f64; 2]>,
}

/// Idle simulators with their memory, kept for the next pair; at most as many as have worked at once.
fn idle() -> MutexGuard<'static, Vec<Simulator>> {
    static IDLE: Mutex<Vec<Simulator>> = Mutex::new(Vec::new());
    IDLE.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Simulated {
    /// Simulates pair number `index`.
    ///
    /// # Errors
    ///
    /// [`Error::Scene`](crate::Error::Scene) if the grid does not fit in memory; the errors of [`Sea::image`] with another sea.
    ///
    /// [`Sea::image`]: crate::Sea::image
    pub fn pair(&self, index: u64) -> Result<Pair> {
        let scene = self.scene(index)?;
        let (image, amplitudes) = match self.delivery(index) {
            None => self.grey(&self.power(&scene)?, index),
            Some(delivery) => {
                let power = self.power(&delivery.product(&scene))?;
                let (product, amplitudes) = self.grey(&power, index);
                let size = [scene.grid.rows, scene.grid.columns];
                (delivery.deliver(&product, size)?, amplitudes)
            }
        };
        Ok(Pair {
            image,
            amplitudes,
            ..self.pair_without_image(index)?
        })
    }

    /// Intensities of a scene, with or without speckle as the recipe states, or on another sea.
    fn power(&self, scene: &Scene) -> Result<Field> {
        if let Some(sea) = self.sea() {
            return sea.image(scene);
        }
        let mut simulator = idle().pop().unwrap_or_default();
        let image = simulator.image(scene);
        idle().push(simulator);
        let image = image?;
        Ok(if self.recipe().speckle {
            image.speckled()
        } else {
            image.intensity
        })
    }

    /// Converts the intensities of image number `index` to grey by the recipe; also returns a quick-look's amplitudes of grey 0
    /// and 1.
    pub fn grey(&self, power: &Field, index: u64) -> (Grey, Option<[f64; 2]>) {
        match self.quick_look(index) {
            Some([gain, offset]) => Grey::quick_look(power, gain, offset),
            None => (Grey::of_power(power, &self.recipe().grey), None),
        }
    }

    /// Makes pair number `index` with an empty image, without simulation.
    ///
    /// # Errors
    ///
    /// [`Error::Text`](crate::Error::Text) if the scene is not valid.
    pub fn pair_without_image(&self, index: u64) -> Result<Pair> {
        let scene = self.scene(index)?;
        Ok(Pair {
            index,
            image: Grey {
                rows: 0,
                columns: 0,
                pixels: Vec::new(),
            },
            prompt: self.wording(index).prompt(&scene)?,
            labels: labels_of(&scene),
            scene,
            amplitudes: None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Recipe;

    /// In a delivered image, the echo of a ship at rest is brightest at its label, within half the ship's length and 3 pixels.
    /// The image has the size of its scene and differs from the product.
    #[test]
    fn labels_follow_a_delivered_image() {
        let changes = [
            "scene.grid.rows = 72",
            "scene.grid.columns = 61",
            "scene.ship.echo = true",
            "draw.count = 1",
            "draw.ship.speed = 0",
            "draw.ship.length = 120",
            "draw.radar.sensor = \"sentinel-1-iw\"",
            "draw.quick_look.gain = 0.1",
            "draw.delivery.pixels = 2",
            "draw.delivery.resize = [0.8, 1.6]",
            "draw.delivery.quality = [80, 95]",
        ];
        let recipe = Recipe::default().with_assignments(&changes).unwrap();
        let plain =
            recipe.with_assignments(&["draw.delivery.resize = 1", "draw.delivery.quality = 0"]);
        let (source, plain) = (
            Simulated::new(recipe, 5).unwrap(),
            Simulated::new(plain.unwrap(), 5).unwrap(),
        );
        for index in 0..6 {
            let pair = source.pair(index).unwrap();
            // Two pixels along the geometric mean of 20.3 and 18.4 m, to the centimetre.
            assert!((pair.scene.grid.spacing - 9.66).abs() < 1e-9);
            assert_eq!(pair.scene, plain.scene(index).unwrap());
            let (image, other) = (&pair.image, plain.pair(index).unwrap().image);
            assert_eq!((image.rows, image.columns), (72, 61));
            assert_ne!(*image, other);
            let brightest =
                (0..72 * 61).max_by(|&a, &b| image.pixels[a].total_cmp(&image.pixels[b]));
            let brightest = brightest.unwrap();
            let [column, row] = pair.labels.ships[0].ship.echo_px.unwrap();
            let off = (column - (brightest % 61) as f64).hypot(row - (brightest / 61) as f64);
            assert!(off < 60.0 / 9.66 + 3.0, "{index}: {off}");
        }
    }

    /// If a recipe draws a gain, the median of each image lies in the gain's range, and the medians differ.
    #[test]
    fn the_gain_is_drawn() {
        let changes = [
            "scene.grid.rows = 24",
            "scene.grid.columns = 24",
            "draw.quick_look.gain = [0.2, 0.6]",
        ];
        let recipe = Recipe::default().with_assignments(&changes).unwrap();
        let source = Simulated::new(recipe, 2).unwrap();
        let medians = (0..6).map(|index| {
            let mut pixels = source.pair(index).unwrap().image.pixels;
            let middle = pixels.len() / 2;
            *pixels.select_nth_unstable_by(middle, f32::total_cmp).1
        });
        let medians: Vec<f32> = medians.collect();
        assert!(
            medians.iter().all(|m| (0.198..=0.602).contains(m)),
            "{medians:?}"
        );
        let apart = medians.iter().any(|m| (m - medians[0]).abs() > 0.05);
        assert!(apart, "{medians:?}");
    }
}
