//! What the radar makes of the surface: σ⁰, and the image before speckle.

use super::accuracy::{Accuracy, Reached};
use super::simulation::Method;
use super::speckling::points;
use super::stages::{Backdrop, Stages};
use super::surface_fields::SurfaceFields;
use crate::plan::SHARES;
use crate::raster::Field;
use crate::sar::direct::DirectImage;
use crate::sar::echo::add_points;
use crate::sar::{Imaging, Sources};
use crate::scattering::{Backscatter, BackscatterTable, FacetFields};
use crate::scene::Term;
use crate::workspace::Workspace;
use rayon::prelude::*;

/// Share of the expected mean σ⁰ for which the table is made at first: chosen, the mean that is there is rarely lower.
const LOWEST_MEAN: f64 = 0.8;

impl Stages<'_> {
    /// What breaking waves, the wake's edges and gusts do to σ⁰.
    pub(super) fn modulate(
        &self,
        sigma0: &mut Field,
        bragg_remaining: Option<&Field>,
        backdrop: &Backdrop,
    ) {
        self.add_breaking(sigma0, bragg_remaining);
        for edge in self.edges() {
            edge.modulate(sigma0, &self.raster);
        }
        if let (Some((gusts, exponent)), Some(drawn)) = (self.models.gusts, &backdrop.gusts) {
            gusts.modulate_strip(sigma0, self.first_row, drawn, exponent);
        }
    }

    /// Adds the return of breaking waves, damped like the short ones.
    fn add_breaking(&self, sigma0: &mut Field, bragg_remaining: Option<&Field>) {
        if !self.plan.uses(Term::Breaking) {
            return;
        }
        let breaking = self.models.breaking as f32;
        let pixels = sigma0.values.par_iter_mut().with_min_len(1 << 14);
        match bragg_remaining {
            None => pixels.for_each(|s| *s += breaking),
            Some(left) => pixels
                .zip(&left.values)
                .for_each(|(s, left)| *s += breaking * left),
        }
    }

    /// σ⁰ as a function of the slope, and the facets it is taken at.
    pub(super) fn facets<'f>(
        &self,
        fields: &'f SurfaceFields,
        bragg_remaining: Option<&'f Field>,
        subpixel_variances: Option<&'f [Field; 3]>,
    ) -> (Backscatter, FacetFields<'f>) {
        let uses = |term| self.plan.uses(term);
        let backscatter = self
            .models
            .backscatter(uses(Term::TiltAverage), uses(Term::Specular));
        let facets = FacetFields {
            slope_x: &fields.slope_x,
            slope_y: &fields.slope_y,
            modulation: uses(Term::Hydrodynamic).then_some(&fields.modulation),
            bragg_remaining,
            subpixel_variances,
        };
        (backscatter, facets)
    }

    pub(super) fn sigma0(
        &self,
        workspace: &mut Workspace,
        last_table: &mut Option<BackscatterTable>,
        (fields, remaining, subpixel): (&SurfaceFields, Option<&Field>, Option<&[Field; 3]>),
        accuracy: &mut Accuracy,
    ) -> Field {
        let (backscatter, facets) = self.facets(fields, remaining, subpixel);
        if self.method == Method::Direct {
            return backscatter.sigma0_field(&facets);
        }
        let asked = SHARES.table * self.scene.model.tolerance;
        let table_for = |last, mean: f64| {
            BackscatterTable::covering_or(last, backscatter.clone(), &facets, asked * mean)
        };
        let mut sigma0 = workspace.field(&self.raster);
        let mut table = table_for(last_table.take(), LOWEST_MEAN * self.plan.mean_sigma0);
        table.fill_sigma0(&mut sigma0, &facets);
        // The mean is known now; without a sea near nadir it is far from the one that was expected.
        let mean = sigma0.mean();
        if mean > 0.0 && table.error() > asked * mean {
            // One table in memory, not two.
            drop(table);
            table = table_for(None, mean);
            table.fill_sigma0(&mut sigma0, &facets);
        }
        let share = table.error() / mean;
        let reached = if mean > 0.0 { share } else { 0.0 };
        accuracy.table = Some(Reached { asked, reached });
        accuracy.table_nodes = table.size();
        *last_table = Some(table);
        sigma0
    }

    /// What the radar does, and what it looks at.
    pub(super) fn imaging<'f>(
        &self,
        sigma0: &'f Field,
        radial_velocity: &'f Field,
        fields: &'f SurfaceFields,
    ) -> (Imaging, Sources<'f>) {
        let uses = |term| self.plan.uses(term);
        let sources = Sources {
            raster: self.raster,
            sigma0,
            radial_velocity: uses(Term::VelocityBunching).then_some(radial_velocity),
            radial_acceleration: uses(Term::AzimuthSmear).then_some(&fields.radial_acceleration),
            elevation: uses(Term::RangeBunching).then_some(&fields.elevation),
        };
        let imaging = Imaging {
            range_to_velocity: self.models.range_to_velocity,
            incidence: self.models.incidence,
            resolution: if uses(Term::AzimuthSmear) {
                self.models.resolution()
            } else {
                self.models.resolution_at_rest()
            },
        };
        (imaging, sources)
    }

    /// Intensity of the image before speckle.
    pub(super) fn image(
        &self,
        workspace: &mut Workspace,
        sigma0: &Field,
        radial_velocity: &Field,
        fields: &SurfaceFields,
    ) -> Field {
        let (imaging, sources) = self.imaging(sigma0, radial_velocity, fields);
        let image = &self.computed;
        let tolerance = SHARES.kernels * self.scene.model.tolerance;
        let mut intensity = match self.method {
            Method::Fast => imaging.image_in(workspace, &sources, image, tolerance),
            Method::Direct => DirectImage::new(&imaging, &sources, image).image(),
        };
        self.add_echo_and_noise(&mut intensity);
        intensity
    }

    /// Adds the ships' own echoes, unless an impulse response is to image it, and the radar's noise.
    pub(super) fn add_echo_and_noise(&self, intensity: &mut Field) {
        if self.models.response.is_none() {
            let resolution = self.models.resolution_at_rest().nominal;
            let points = points(self.scene, self.models);
            add_points(intensity, &self.computed, &points, resolution);
        }
        if self.plan.uses(Term::Noise) {
            let noise = self.models.noise as f32;
            let pixels = intensity.values.par_iter_mut().with_min_len(1 << 14);
            pixels.for_each(|value| *value += noise);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::LOWEST_MEAN;
    use crate::scene::Scene;
    use crate::simulate::simulate;

    /// Otherwise every table of σ⁰ is made twice, and none can be used again. The upper limit is the mean's two digits,
    /// and the part of the image that a strong wake darkens.
    #[test]
    fn the_expected_mean_is_that_of_the_image() {
        for changes in [
            &[][..],
            &["sea.wind_speed=3"],
            &["sea.wind_speed=7", "radar.polarization=HH"],
            &["radar.incidence=20"],
            &["ship.speed=6", "radar.frequency=1.27e9"],
        ] {
            let scene = Scene::default().with_assignments(changes).unwrap();
            let simulation = simulate(&scene).unwrap();
            let ratio = simulation.sigma0.mean() / simulation.plan.mean_sigma0;
            assert!((LOWEST_MEAN..1.25).contains(&ratio), "{changes:?}: {ratio}");
        }
    }
}
