//! View of images: their mapping to grey, and whether they have speckle.

use wake_physics::grey::GreyScale;
use wake_physics::sar::speckle::speckle;
use wake_physics::{Field, Scene};

use super::reading::Reading;
use super::source::{BATCH, ImageSource, Told, drawn};
use crate::error::Result;

/// Mapping to grey of all compared images, and whether they are compared with speckle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct View {
    /// Mapping from σ⁰ to grey, as in the model's training data.
    pub grey: GreyScale,
    /// Images with speckle: the source's own, otherwise speckle of the scene's radar.
    pub speckle: bool,
}

impl View {
    /// Draws images of a source, one of each scene.
    ///
    /// # Errors
    ///
    /// As [`ImageSource::draw`], and [`wake_nn::Error::InvalidOption`] for images of a wrong number or size.
    pub fn draw(
        &self,
        source: &dyn ImageSource,
        scenes: &[Scene],
        told: Told,
    ) -> Result<Vec<Field>> {
        let mut images = drawn(source, scenes, told)?;
        if self.speckle && !source.has_speckle() {
            for (image, scene) in images.iter_mut().zip(scenes) {
                speckle(image, scene.radar.looks, scene.seed);
            }
        }
        Ok(images)
    }

    /// Draws all images of a source, batch by batch.
    ///
    /// - `step`: called with the number of images after each batch
    pub(super) fn draw_all(
        &self,
        source: &dyn ImageSource,
        scenes: &[Scene],
        told: Told,
        mut step: impl FnMut(u64),
    ) -> Result<Vec<Field>> {
        let mut images = Vec::with_capacity(scenes.len());
        for batch in scenes.chunks(BATCH) {
            images.extend(self.draw(source, batch, told)?);
            step(batch.len() as u64);
        }
        Ok(images)
    }

    /// Grey 0 to 1 of intensity.
    #[must_use]
    pub fn grey(&self, intensity: &Field) -> Field {
        let grey = |&v: &f32| self.grey.grey(f64::from(v)) as f32;
        Field {
            values: intensity.values.iter().map(grey).collect(),
            ..*intensity
        }
    }

    /// Measures the values in an image.
    pub(super) fn read(&self, image: &Field, scene: &Scene) -> Result<Reading> {
        match self.speckle {
            true => Reading::of_speckled(image, scene),
            false => Reading::of(image, scene),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::super::baseline::Baseline;
    use super::*;

    /// A source that draws a constant of σ⁰ 0.05, and says whether it has speckle.
    #[derive(Debug)]
    struct Flat(bool);

    impl ImageSource for Flat {
        fn draw(&self, scenes: &[Scene], _: Told) -> Result<Vec<Field>> {
            let field = |scene: &Scene| Field {
                rows: scene.grid.rows,
                columns: scene.grid.columns,
                values: vec![0.05; scene.grid.rows * scene.grid.columns],
            };
            Ok(scenes.iter().map(field).collect())
        }
        fn has_speckle(&self) -> bool {
            self.0
        }
    }

    /// A batch has a bounded size, and images keep the order of their scenes.
    #[test]
    fn scenes_are_drawn_some_at_a_time() {
        let mut scene = Scene::default();
        (scene.grid.rows, scene.grid.columns) = (1, 1);
        let scenes = vec![scene; BATCH + 3];
        let mut steps = Vec::new();
        let view = View::default();
        let images = view
            .draw_all(&Flat(false), &scenes, Told::Both, |n| steps.push(n))
            .unwrap();
        assert_eq!((images.len(), steps), (BATCH + 3, vec![BATCH as u64, 3]));
    }

    /// Speckle is applied once: to sources without it, if it is requested.
    #[test]
    fn speckle_comes_once() {
        let keys = ["grid.rows = 32", "grid.columns = 32"];
        let scenes = [Scene::default().with_assignments(&keys).unwrap()];
        let draw = |speckle, source: &dyn ImageSource| {
            let view = View {
                speckle,
                ..View::default()
            };
            view.draw(source, &scenes, Told::Both).unwrap().remove(0)
        };
        let plain = draw(false, &Flat(false));
        assert_eq!(plain, draw(true, &Flat(true)));
        let mut expected = plain.clone();
        speckle(&mut expected, scenes[0].radar.looks, scenes[0].seed);
        assert_eq!(draw(true, &Flat(false)), expected);
        assert_ne!(plain, expected);
    }

    #[test]
    fn grey_is_that_of_the_mapping() {
        let keys = ["grid.rows = 16", "grid.columns = 16"];
        let scenes = [Scene::default().with_assignments(&keys).unwrap()];
        let view = View {
            grey: GreyScale {
                darkest_db: -40.0,
                ..GreyScale::default()
            },
            speckle: false,
        };
        let image = view
            .draw(&Baseline::Simulator, &scenes, Told::Both)
            .unwrap();
        let grey = view.grey(&image[0]);
        let expected = (10.0 * f64::from(image[0].values[7]).log10() + 40.0) / 50.0;
        assert!((f64::from(grey.values[7]) - expected).abs() < 1e-5);
    }
}
