//! Radar stages: σ⁰, and the image before speckle.

use super::record::{Accuracy, Reached};
use super::simulation::Method;
use super::speckling::{halos, points};
use super::stages::{Memory, Roughening, Stages};
use crate::fields::Fields;
use crate::plan::SHARES;
use crate::raster::Field;
use crate::sar::dense::DirectImage;
use crate::sar::echo::add_points;
use crate::sar::{Imaging, Sources};
use crate::scattering::{Backscatter, BackscatterTable, FacetFields};
use crate::scene::Term;
use crate::workspace::Workspace;

/// Share of the expected mean σ⁰ for which the table is built first: chosen, as the actual mean is rarely lower.
const LOWEST_MEAN: f64 = 0.8;

impl Stages<'_> {
    /// σ⁰ as a function of the slope.
    pub(super) fn backscatter(&self) -> Backscatter {
        let models = self.site.models;
        models.backscatter(self.uses(Term::TiltAverage), self.uses(Term::Specular))
    }

    /// The facets at which σ⁰ is evaluated.
    pub(super) fn facets<'f>(
        &self,
        fields: &'f Fields,
        roughening: &'f Roughening,
    ) -> FacetFields<'f> {
        FacetFields {
            slope_x: &fields.slope_x,
            slope_y: &fields.slope_y,
            modulation: self.uses(Term::Hydrodynamic).then_some(&fields.modulation),
            bragg_remaining: roughening.bragg_remaining.as_ref(),
            subpixel_variances: roughening.subpixel_variances.as_ref(),
        }
    }

    /// Computes σ⁰ with all effects that change it.
    pub(super) fn scatter(
        &self,
        memory: &mut Memory,
        fields: &mut Fields,
        roughening: &Roughening,
        accuracy: &mut Accuracy,
    ) {
        let facets = self.facets(fields, roughening);
        let mut sigma0 = match self.run.method {
            Method::Fast => self.tabulated(memory, &facets, accuracy),
            Method::Direct => self.backscatter().sigma0_field(&facets),
        };
        self.change_sigma0(&mut sigma0, roughening);
        fields.sigma0 = sigma0;
    }

    /// Applies the changes of σ⁰ by optional effects.
    pub(super) fn change_sigma0(&self, sigma0: &mut Field, roughening: &Roughening) {
        for effect in self.effects() {
            effect.change_sigma0(&self.site, sigma0, roughening.bragg_remaining.as_ref());
        }
    }

    /// Computes σ⁰ by a table.
    fn tabulated(
        &self,
        memory: &mut Memory,
        facets: &FacetFields<'_>,
        accuracy: &mut Accuracy,
    ) -> Field {
        let backscatter = self.backscatter();
        let asked = SHARES.table * self.site.scene.model.tolerance;
        let table_for = |last, mean: f64| {
            BackscatterTable::covering_or(last, backscatter.clone(), facets, asked * mean)
        };
        let mut sigma0 = memory.workspace.field(&self.site.raster);
        let expected = LOWEST_MEAN * self.run.plan.mean_sigma0;
        let mut table = table_for(memory.table.take(), expected);
        table.fill_sigma0(&mut sigma0, facets);
        // Now the mean is available; without a sea near nadir it differs widely from the expected one.
        let mean = sigma0.mean();
        if mean > 0.0 && table.error() > asked * mean {
            // Frees the old table first, to hold only one in memory.
            drop(table);
            table = table_for(None, mean);
            table.fill_sigma0(&mut sigma0, facets);
        }
        let share = table.error() / mean;
        let reached = if mean > 0.0 { share } else { 0.0 };
        accuracy.table = Some(Reached { asked, reached });
        accuracy.table_nodes = table.size();
        memory.table = Some(table);
        sigma0
    }

    /// Imaging parameters of the radar.
    pub(super) fn imaging(&self) -> Imaging {
        let models = self.site.models;
        Imaging {
            range_to_velocity: models.range_to_velocity,
            incidence: models.incidence,
            resolution: if self.uses(Term::AzimuthSmear) {
                models.resolution()
            } else {
                models.resolution_at_rest()
            },
        }
    }

    /// Fields to be imaged.
    pub(super) fn sources<'f>(&self, fields: &'f Fields) -> Sources<'f> {
        let uses = |term| self.uses(term);
        Sources {
            raster: self.site.raster,
            sigma0: &fields.sigma0,
            radial_velocity: uses(Term::VelocityBunching).then_some(&fields.radial_velocity),
            radial_acceleration: uses(Term::AzimuthSmear).then_some(&fields.radial_acceleration),
            elevation: uses(Term::RangeBunching).then_some(&fields.elevation),
        }
    }

    /// Computes the intensity before speckle.
    pub(super) fn image(&self, workspace: &mut Workspace, fields: &mut Fields) {
        let (imaging, sources) = (self.imaging(), self.sources(fields));
        let tolerance = SHARES.kernels * self.site.scene.model.tolerance;
        let mut intensity = match self.run.method {
            Method::Fast => imaging.image_in(workspace, &sources, &self.computed, tolerance),
            Method::Direct => DirectImage::new(&imaging, &sources, &self.computed).image(),
        };
        self.add_echo_and_noise(&mut intensity);
        fields.intensity = intensity;
    }

    /// Adds the ships' echoes (their points only if no impulse response images them) and the radar's noise.
    pub(super) fn add_echo_and_noise(&self, intensity: &mut Field) {
        let models = self.site.models;
        if models.response.is_none() {
            let resolution = models.resolution_at_rest().nominal;
            let points = points(self.site.scene, models);
            add_points(intensity, &self.computed, &points, resolution);
        }
        for halo in halos(self.site.scene, models) {
            halo.add(intensity, &self.computed);
        }
        for effect in self.effects() {
            effect.add_to_image(intensity);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::LOWEST_MEAN;
    use crate::scene::Scene;
    use crate::simulate::simulate;

    /// Otherwise every table of σ⁰ would be built twice, and none reused. The upper limit allows for the two-digit accuracy
    /// of the mean and for the part of the image that a strong wake darkens.
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
