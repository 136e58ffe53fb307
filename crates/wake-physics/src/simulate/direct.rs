//! Slow reference methods of all stages at some pixels of an image that is too large for them as a whole.

use super::record::{Clock, Seconds};
use super::simulation::Method;
use super::stages::{Run, Stages, sea_of};
use super::strips::Strip;
use crate::error::{Error, Result};
use crate::fields::{Fields, Wanted};
use crate::kelvin::fade_at;
use crate::pixels::Parts;
use crate::plan::Plan;
use crate::prepared::Prepared;
use crate::raster::Field;
use crate::sar::dense::{DirectImage, reaching};
use crate::scene::{Scene, Term};
use crate::surface::Surface;
use crate::waves::{PlaneWaves, harmonic_sum};
use crate::workspace::Workspace;
use rayon::prelude::*;

/// Some pixels of an image before speckle, by the reference methods.
#[derive(Debug, Clone)]
pub struct DirectPixels {
    /// Intensity, linear, in units of σ⁰, one value per pixel.
    pub intensity: Vec<f64>,
    /// Number of source pixels that reach them, at which the waves were summed and σ⁰ was integrated.
    pub sources: usize,
    /// Seconds of the reference methods alone: sea, wake and σ⁰ at the source pixels; imaging of the pixels from all
    /// sources.
    pub seconds: Seconds,
}

/// Image before speckle at some pixels (row, column), by the methods of [`Method::Direct`].
///
/// The fast fields determine which sources reach a pixel, with a margin; their values are not used. The cost thus grows
/// with waves × requested pixels, not with waves × pixels of the image.
///
/// # Errors
///
/// If a value of the scene is out of range, the grid does not fit in memory, a pixel lies outside the image, or the scene
/// has an impulse response, with which no pixel can be computed alone.
pub fn direct_intensity(scene: &Scene, pixels: &[[usize; 2]]) -> Result<DirectPixels> {
    scene.validate()?;
    for pixel in pixels {
        for (name, at, count) in [
            ("pixel row", pixel[0], scene.grid.rows),
            ("pixel column", pixel[1], scene.grid.columns),
        ] {
            if at >= count {
                return Err(Error::OutOfRange {
                    name: name.to_owned(),
                    value: at as f64,
                    min: 0.0,
                    max: (count - 1) as f64,
                    unit: "pixels",
                });
            }
        }
    }
    let prepared = Prepared::new(scene);
    let models = &prepared.models;
    if models.response.is_some() {
        return Err(Error::Conflict {
            name: "radar".to_owned(),
            value: "one with an impulse response".to_owned(),
            requirement: "so no pixel can be computed alone; simulate the whole scene with Method::Direct, or remove radar.range_resolution".to_owned(),
        });
    }
    let plan = Plan::of(&prepared)?;
    let run = Run {
        prepared: &prepared,
        plan: &plan,
        method: Method::Fast,
        wanted: Wanted::Image,
    };
    let stages = Stages::new(run, &Strip::whole(&models.pixels, &plan.sizes));
    if !models.pixels.are_refined() {
        return Ok(stages.direct_intensity(pixels));
    }
    let parts = Parts::new(&models.pixels.computed, &models.pixels.image);
    let fine: Vec<[usize; 2]> = pixels.iter().flat_map(|&pixel| parts.of(pixel)).collect();
    let mut direct = stages.direct_intensity(&fine);
    let pixels = direct.intensity.chunks(parts.count());
    direct.intensity = pixels.map(|values| parts.mean(values)).collect();
    Ok(direct)
}

impl Stages<'_> {
    fn direct_intensity(&self, pixels: &[[usize; 2]]) -> DirectPixels {
        let workspace = &mut Workspace::default();
        let raster = &self.site.raster;
        let sources = self.reaching(workspace, pixels);
        let at = |&[i, j]: &[usize; 2]| i * raster.columns + j;

        let mut clock = Clock::start();
        let mut fields = self.harmonic_fields(workspace, &sources, &mut clock);
        let roughening = self.finish_surface(workspace, &mut fields);
        clock.skip();
        let facets = self.facets(&fields, &roughening);
        let exact = self.backscatter().sigma0_pixels(&facets, &sources);
        clock.lap(|seconds| &mut seconds.backscatter);
        let mut all = workspace.flat_field(raster);
        for (source, value) in sources.iter().zip(exact) {
            all.values[at(source)] = value;
        }
        self.change_sigma0(&mut all, &roughening);
        // Where no wave was summed there is no source.
        fields.sigma0 = workspace.flat_field(raster);
        for source in &sources {
            fields.sigma0.values[at(source)] = all.values[at(source)];
        }

        fields.project(workspace, raster, self.site.models.incidence);
        let (imaging, lit) = (self.imaging(), self.sources(&fields));
        let direct = DirectImage::new(&imaging, &lit, &self.computed);
        clock.skip();
        let mut intensity: Vec<f64> = pixels.par_iter().map(|&[i, j]| direct.at(i, j)).collect();
        clock.lap(|seconds| &mut seconds.imaging);
        let mut rest = workspace.flat_field(&self.computed);
        self.add_echo_and_noise(&mut rest);
        for (value, &[i, j]) in intensity.iter_mut().zip(pixels) {
            *value += f64::from(rest.at(i, j));
        }
        let seconds = clock.stop();
        let total = seconds.sea + seconds.kelvin + seconds.backscatter + seconds.imaging;
        DirectPixels {
            intensity,
            sources: sources.len(),
            seconds: Seconds { total, ..seconds },
        }
    }

    /// The source pixels that reach the given pixels, from the fast fields.
    fn reaching(&self, workspace: &mut Workspace, pixels: &[[usize; 2]]) -> Vec<[usize; 2]> {
        let mut sea = sea_of(&self.run, workspace);
        let mut fields = self.sea(workspace, &mut sea);
        self.add_waves_of_effects(workspace, &mut fields);
        self.add_wakes(workspace, &mut fields);
        self.finish_surface(workspace, &mut fields);
        let raster = &self.site.raster;
        fields.project(workspace, raster, self.site.models.incidence);
        fields.sigma0 = Field::constant(raster, 1.0);
        let (imaging, sources) = (self.imaging(), self.sources(&fields));
        reaching(&imaging, &sources, &self.computed, pixels)
    }

    /// Sea, waves of effects and wakes by harmonic sums at some pixels; 0 elsewhere.
    fn harmonic_fields(
        &self,
        workspace: &mut Workspace,
        pixels: &[[usize; 2]],
        clock: &mut Clock,
    ) -> Fields {
        let (models, raster) = (self.site.models, &self.site.raster);
        let scene = self.site.scene;
        let quantities = self.quantities.concat();
        let mut sums = vec![vec![0.0; pixels.len()]; quantities.len()];
        let mut add = |waves: &PlaneWaves, weights: &[f64]| {
            let more = harmonic_sum(waves, &models.transfer, &quantities, raster, pixels);
            for (sums, more) in sums.iter_mut().zip(&more) {
                for ((sum, wave), weight) in sums.iter_mut().zip(more).zip(weights) {
                    *sum += weight * wave;
                }
            }
        };
        let everywhere = vec![1.0; pixels.len()];
        if self.uses(Term::Sea) {
            let sea = Surface::new(&models.sea, scene.seed, scene.sea.time, raster);
            let waves = sea.modes();
            clock.skip();
            add(&waves, &everywhere);
        }
        for waves in self.effects().filter_map(|effect| effect.waves(&self.site)) {
            add(&waves, &everywhere);
        }
        clock.lap(|seconds| &mut seconds.sea);
        let drawn = self.uses(Term::Kelvin);
        let pairs = models.wakes.iter().zip(&self.run.plan.wakes);
        for (wake, plan) in pairs.filter(|_| drawn) {
            let faded = |&[i, j]: &[usize; 2]| {
                let place = [raster.x(j), raster.y(i)];
                fade_at(&wake.track, wake.hull.length(), place)
            };
            let fades: Vec<f64> = pixels.iter().map(faded).collect();
            let waves = wake.waves(plan);
            clock.skip();
            add(&waves, &fades);
            clock.lap(|seconds| &mut seconds.kelvin);
        }
        let mut fields = Fields::default();
        for (&quantity, sums) in quantities.iter().zip(&sums) {
            let mut field = workspace.flat_field(raster);
            for (&[i, j], &sum) in pixels.iter().zip(sums) {
                field.values[i * raster.columns + j] = sum as f32;
            }
            *fields.of(quantity) = field;
        }
        fields
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::simulate_with;

    fn scene(assignments: &[&str]) -> Scene {
        let size = [
            "grid.rows=12",
            "grid.columns=10",
            "radar.range_to_velocity=20",
            "model.tolerance=1e-4",
        ];
        Scene::default()
            .with_assignments(&[&size, assignments].concat())
            .unwrap()
    }

    /// A few pixels alone equal the same pixels of the whole reference image, for a plain scene and one with all extras.
    #[test]
    fn pixels_are_those_of_the_direct_image() {
        let plain = ["ship.position=[60, 60]", "ship.echo=true"];
        let extras = [
            "ship.edge=true",
            "sea.gust_strength=0.05",
            "sea.breaking=true",
            "radar.nesz=-20",
            "sea.swell_height=1",
        ];
        let pixels = [[0, 0], [11, 9], [5, 4], [6, 4], [3, 8]];
        for scene in [scene(&plain), scene(&[&plain[..], &extras].concat())] {
            let alone = direct_intensity(&scene, &pixels).unwrap();
            let whole = simulate_with(&scene, Method::Direct).unwrap();
            let [rows, columns] = whole.plan.sizes.computed;
            assert!(alone.sources > 0 && alone.sources < rows * columns);
            for (&[i, j], value) in pixels.iter().zip(&alone.intensity) {
                // The whole image rounds sea, wake and intensity to f32 (6e-8 each): a source at most some 20 rows away is
                // displaced by 4e-6 rows, which changes a weight near the middle by at most twice that.
                let error = value / f64::from(whole.intensity.at(i, j)) - 1.0;
                assert!(error.abs() < 1e-5, "[{i}, {j}] {error:e}");
            }
        }
    }

    #[test]
    fn what_cannot_be_had_alone_is_refused() {
        let error = direct_intensity(&scene(&[]), &[[0, 10]]).unwrap_err();
        assert!(error.to_string().contains("pixel column is 10"), "{error}");
        let satellite = scene(&["radar.sensor=sentinel-1-iw"]);
        let error = direct_intensity(&satellite, &[[0, 0]]).unwrap_err();
        assert!(error.to_string().contains("impulse response"), "{error}");
    }
}
