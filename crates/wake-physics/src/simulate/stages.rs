//! Order of the stages up to the intensity before speckle, and the stages of the surface; the radar's stages are in
//! `radar`.

use super::record::{Accuracy, Clock, Reached};
use super::simulation::Method;
use super::speckling::Exposure;
use super::strips::{Strip, means, put};
use crate::effects::{Effect, Site};
use crate::fields::{Fields, Wanted, quantities};
use crate::kelvin::{self, KelvinWake, WakePlan};
use crate::nufft::{Summands, synthesize_each};
use crate::plan::{Plan, SHARES};
use crate::prepared::Prepared;
use crate::raster::{Field, Raster};
use crate::scattering::BackscatterTable;
use crate::scattering::hydrodynamic::to_bragg_factors;
use crate::scene::Term;
use crate::surface::Surface;
use crate::waves::{PlaneWaves, Quantity, harmonic_fields};
use crate::workspace::Workspace;
use rayon::prelude::*;

/// One simulation: a prepared scene, its plan, the method, and the wanted fields.
#[derive(Clone, Copy)]
pub(super) struct Run<'a> {
    pub(super) prepared: &'a Prepared<'a>,
    pub(super) plan: &'a Plan,
    pub(super) method: Method,
    pub(super) wanted: Wanted,
}

/// State shared by the stages of a scene.
pub(super) struct Stages<'a> {
    pub(super) run: Run<'a>,
    /// The rows computed at once.
    pub(super) site: Site<'a>,
    /// Whether this is the last strip.
    last: bool,
    /// The computed pixels of the image, without margin.
    pub(super) computed: Raster,
    /// Fields that the image needs, and others that are wanted. Each group is summed separately, so that the image is
    /// bit-identical with and without the second.
    pub(super) quantities: [Vec<Quantity>; 2],
}

/// Fields of the surface on which σ⁰ depends besides slopes and modulation.
#[derive(Default)]
pub(super) struct Roughening {
    /// Share of the Bragg waves that remains.
    pub(super) bragg_remaining: Option<Field>,
    /// Slope variances of ship waves too short for the pixels.
    pub(super) subpixel_variances: Option<[Field; 3]>,
}

/// Buffers and tables that one simulation leaves to the next.
#[derive(Debug, Default)]
pub(super) struct Memory {
    pub(super) workspace: Workspace,
    /// The last table of σ⁰.
    pub(super) table: Option<BackscatterTable>,
}

/// The waves of the sea, drawn once for all strips; `None` without a sea, and after the last strip.
pub(super) type Sea = Option<Surface>;

/// Draws the waves of a sea.
pub(super) fn sea_of(run: &Run<'_>, workspace: &mut Workspace) -> Sea {
    let (scene, models) = (run.prepared.scene, &run.prepared.models);
    let draw = || {
        let raster = run.plan.with_margin(&models.pixels.computed);
        Surface::new_in(workspace, &models.sea, scene.seed, scene.sea.time, &raster)
    };
    run.plan.uses(Term::Sea).then(draw)
}

/// A scene before speckle, on the pixels of the image.
#[derive(Default)]
pub(super) struct Drawn {
    /// All fields except the linear fields that only the image needs.
    pub(super) fields: Fields,
    pub(super) accuracy: Accuracy,
    /// Sources of the impulse response, if the image has one.
    pub(super) exposure: Option<Exposure>,
}

/// Runs all stages up to the intensity before speckle. The clock has been running since the plan was made.
pub(super) fn draw(run: Run<'_>, memory: &mut Memory, clock: &mut Clock) -> Drawn {
    let models = &run.prepared.models;
    let mut sea = sea_of(&run, &mut memory.workspace);
    let mut out = Drawn::default();
    for strip in &Strip::all(&models.pixels, &run.plan.sizes) {
        let stages = Stages::new(run, strip);
        let (mut fields, accuracy) = stages.draw(memory, &mut sea, clock);
        let workspace = &mut memory.workspace;
        out.accuracy = out.accuracy.and(&accuracy);
        let pixels = models.pixels.image.strip(&strip.image);
        let intensity = std::mem::take(&mut fields.intensity);
        if models.response.is_some() {
            let rows = [strip.own.clone(), 0..models.pixels.computed.rows];
            put(workspace, &mut out.fields.intensity, rows, intensity);
        } else {
            let rows = [strip.image.clone(), 0..models.pixels.image.rows];
            let intensity = means(workspace, intensity, &stages.computed, &pixels);
            put(workspace, &mut out.fields.intensity, rows, intensity);
        }
        if run.wanted == Wanted::Fields {
            let pairs = out.fields.each().into_iter().zip(fields.each());
            for (to, from) in pairs.take(Fields::RESULTS) {
                let rows = [strip.image.clone(), 0..models.pixels.image.rows];
                let from = std::mem::take(from);
                let part = means(workspace, from, &stages.site.raster, &pixels);
                put(workspace, to, rows, part);
            }
        }
        fields.give_back(workspace);
    }
    if let Some(response) = models.response {
        let sources = std::mem::take(&mut out.fields.intensity);
        let exposure = Exposure::of(run.prepared.scene, models, response, sources);
        out.fields.intensity = exposure.mean();
        out.exposure = Some(exposure);
        clock.lap(|seconds| &mut seconds.imaging);
    }
    out
}

impl<'a> Stages<'a> {
    pub(super) fn new(run: Run<'a>, strip: &Strip) -> Self {
        let models = &run.prepared.models;
        let whole = run.plan.with_margin(&models.pixels.computed);
        Self {
            run,
            site: Site {
                scene: run.prepared.scene,
                models,
                raster: whole.strip(&strip.raster),
                whole,
                first_row: strip.raster.start,
            },
            last: strip.image.end == models.pixels.image.rows,
            computed: models.pixels.computed.strip(&strip.computed),
            quantities: quantities(|term| run.plan.uses(term), run.wanted),
        }
    }

    pub(super) fn uses(&self, term: Term) -> bool {
        self.run.plan.uses(term)
    }

    /// The optional effects in use.
    pub(super) fn effects(&self) -> impl Iterator<Item = &dyn Effect> {
        let all = self.run.prepared.effects.each();
        all.filter(|effect| self.uses(effect.term()))
    }

    /// Runs all stages up to the intensity before speckle in order; the clock has been running since the plan was made.
    pub(super) fn draw(
        &self,
        memory: &mut Memory,
        sea: &mut Sea,
        clock: &mut Clock,
    ) -> (Fields, Accuracy) {
        let workspace = &mut memory.workspace;
        let mut fields = self.sea(workspace, sea);
        self.add_waves_of_effects(workspace, &mut fields);
        clock.lap(|seconds| &mut seconds.sea);
        let mut accuracy = Accuracy {
            wake: self.add_wakes(workspace, &mut fields),
            ..Accuracy::default()
        };
        clock.lap(|seconds| &mut seconds.kelvin);
        let roughening = self.finish_surface(workspace, &mut fields);
        clock.lap(|seconds| &mut seconds.turbulent);
        self.scatter(memory, &mut fields, &roughening, &mut accuracy);
        let workspace = &mut memory.workspace;
        roughening.give_back(workspace);
        clock.lap(|seconds| &mut seconds.backscatter);
        fields.project(workspace, &self.site.raster, self.site.models.incidence);
        self.image(workspace, &mut fields);
        clock.lap(|seconds| &mut seconds.imaging);
        (fields, accuracy)
    }

    /// Applied after all waves are added: currents, factors on the Bragg return, roughening and smoothing of the surface.
    pub(super) fn finish_surface(
        &self,
        workspace: &mut Workspace,
        fields: &mut Fields,
    ) -> Roughening {
        let site = &self.site;
        let mut roughening = Roughening::default();
        for effect in self.effects() {
            effect.add_velocity(site, fields);
        }
        if self.uses(Term::Hydrodynamic) {
            let variance = match self.uses(Term::Sea) {
                true => self.run.plan.modulation_variance,
                false => 0.0,
            };
            to_bragg_factors(&mut fields.modulation, variance);
        }
        for effect in self.effects() {
            effect.damp(site, workspace, &mut roughening.bragg_remaining);
        }
        if self.uses(Term::SubpixelWake) {
            let smears = self.uses(Term::AzimuthSmear);
            let wakes = &self.run.prepared.effects.subpixel_wake;
            let variances = wakes.variances(site, workspace, fields, smears);
            roughening.subpixel_variances = Some(variances);
        }
        roughening
    }

    /// Tolerance for sums of waves, limited by single precision.
    fn field_tolerance(&self) -> f64 {
        (SHARES.fields * self.site.scene.model.tolerance).max(1e-6)
    }

    /// Tolerance for each wake, so that all wakes together keep it.
    fn wake_tolerance(&self) -> f64 {
        let share = SHARES.fields / self.site.models.wakes.len().max(1) as f64;
        (share * self.site.scene.model.tolerance).max(1e-6)
    }

    /// Fields of the sea; the last strip returns the buffers of its waves.
    pub(super) fn sea(&self, workspace: &mut Workspace, sea: &mut Sea) -> Fields {
        let mut fields = Fields::default();
        let (raster, transfer) = (&self.site.raster, &self.site.models.transfer);
        let Some(surface) = sea else {
            for &quantity in self.quantities.iter().flatten() {
                *fields.of(quantity) = workspace.flat_field(raster);
            }
            return fields;
        };
        let mut put = |quantities: &[Quantity], made: Vec<Field>| {
            for (&quantity, field) in quantities.iter().zip(made) {
                *fields.of(quantity) = field;
            }
        };
        match self.run.method {
            Method::Fast => {
                for group in &self.quantities {
                    let (rows, tolerance) = (self.site.rows(), self.field_tolerance());
                    let made = surface.strip_in(workspace, &rows, transfer, group, tolerance);
                    put(group, made);
                }
            }
            Method::Direct => {
                let all = self.quantities.concat();
                put(
                    &all,
                    harmonic_fields(&surface.modes(), transfer, &all, raster),
                );
            }
        }
        if self.last
            && let Some(surface) = sea.take()
        {
            surface.give_back(workspace);
        }
        fields
    }

    /// Adds the waves of optional effects.
    pub(super) fn add_waves_of_effects(&self, workspace: &mut Workspace, fields: &mut Fields) {
        let tolerance = self.field_tolerance();
        for waves in self.effects().filter_map(|effect| effect.waves(&self.site)) {
            self.sum(workspace, &waves, tolerance, |quantity, made| {
                let sum = fields.of(quantity).values.par_iter_mut();
                sum.zip(&made.values)
                    .with_min_len(1 << 14)
                    .for_each(|(sum, made)| *sum += made);
            });
        }
    }

    /// Adds the Kelvin wakes.
    pub(super) fn add_wakes(
        &self,
        workspace: &mut Workspace,
        fields: &mut Fields,
    ) -> Option<Reached> {
        if !self.uses(Term::Kelvin) {
            return None;
        }
        let pairs = self.site.models.wakes.iter().zip(&self.run.plan.wakes);
        let reached = pairs.filter_map(|(wake, plan)| self.add_wake(workspace, fields, wake, plan));
        reached.reduce(|a, b| Reached {
            reached: a.reached.max(b.reached),
            ..a
        })
    }

    /// Adds the Kelvin wake of one ship, faded over its hull.
    fn add_wake(
        &self,
        workspace: &mut Workspace,
        fields: &mut Fields,
        wake: &KelvinWake,
        plan: &WakePlan,
    ) -> Option<Reached> {
        let mut fade = workspace.field(&self.site.raster);
        kelvin::fill_fade(
            &mut fade,
            &wake.track,
            wake.hull.length(),
            &self.site.raster,
        );
        let asked = self.wake_tolerance();
        let reached = self.sum(workspace, &wake.waves(plan), asked, |quantity, wake| {
            fields.of(quantity).add_product(wake, &fade);
        });
        workspace.give(fade);
        reached.map(|reached| Reached { asked, reached })
    }

    /// Sums waves by the method in use, passes each field on, and returns the error stated by the method.
    fn sum(
        &self,
        workspace: &mut Workspace,
        waves: &PlaneWaves,
        tolerance: f64,
        mut add: impl FnMut(Quantity, &mut Field),
    ) -> Option<f64> {
        let (raster, transfer) = (&self.site.raster, &self.site.models.transfer);
        match self.run.method {
            Method::Fast => {
                let mut reached = 0.0f64;
                for group in &self.quantities {
                    let summands = Summands {
                        waves,
                        transfer,
                        quantities: group,
                        raster,
                    };
                    let take = |q: usize, made: &mut Field| add(group[q], made);
                    let error = synthesize_each(workspace, summands, tolerance, take);
                    reached = reached.max(error);
                }
                Some(reached)
            }
            Method::Direct => {
                let all = self.quantities.concat();
                let made = harmonic_fields(waves, transfer, &all, raster);
                for (quantity, mut field) in all.into_iter().zip(made) {
                    add(quantity, &mut field);
                }
                None
            }
        }
    }
}

impl Roughening {
    fn give_back(self, workspace: &mut Workspace) {
        let fields = self.subpixel_variances.into_iter().flatten();
        for field in fields.chain(self.bragg_remaining) {
            workspace.give(field);
        }
    }
}
