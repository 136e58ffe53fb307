//! The order of the stages, and one function a stage: what it takes from the plan, and which method it calls.

use super::accuracy::{Accuracy, Reached};
use super::clock::{Clock, Seconds};
use super::simulation::Method;
use super::strip::Strip;
use super::surface_fields::{SurfaceFields, Wanted, quantities};
use crate::kelvin::{self, KelvinWake, WakePlan};
use crate::models::Models;
use crate::nufft;
use crate::plan::{Plan, SHARES};
use crate::raster::{Field, Raster};
use crate::scattering::BackscatterTable;
use crate::scattering::hydrodynamic::to_bragg_factors;
use crate::scene::{Scene, Term};
use crate::surface::Surface;
use crate::turbulent::current::WakeEdge;
use crate::wakes::Wake;
use crate::waves::{Quantity, harmonic_fields};
use crate::workspace::Workspace;
use rayon::prelude::*;
use std::ops::Range;

/// A scene being drawn: what its stages have in common.
pub(super) struct Stages<'a> {
    pub(super) scene: &'a Scene,
    pub(super) models: &'a Models,
    pub(super) plan: &'a Plan,
    pub(super) method: Method,
    /// The computed image and its margin; where strips are computed the rows of one, and how many lie before them.
    pub(super) raster: Raster,
    pub(super) first_row: usize,
    /// Whether no strip comes after this one.
    pub(super) last: bool,
    /// The computed image, or the rows of it.
    pub(super) computed: Raster,
    /// What the image needs, and what is wanted besides. Each group is summed by itself, so that the image has the
    /// same bits with and without the second.
    pub(super) quantities: [Vec<Quantity>; 2],
}

/// What a scene looks like before speckle: as computed, all but the image on the raster with its margin, or as an image, all at
/// the pixels of the image.
#[derive(Default)]
pub(super) struct Drawn {
    pub(super) fields: SurfaceFields,
    /// Velocity toward the radar [m/s].
    pub(super) radial_velocity: Field,
    pub(super) sigma0: Field,
    /// Intensity of the image.
    pub(super) intensity: Field,
    pub(super) accuracy: Accuracy,
}

/// What all strips see, drawn as a whole.
pub(super) struct Backdrop {
    /// The waves of the sea.
    surface: Option<Surface>,
    /// Gusts at every few pixels.
    pub(super) gusts: Option<(Field, usize)>,
}

impl Backdrop {
    pub(super) fn new(
        workspace: &mut Workspace,
        scene: &Scene,
        models: &Models,
        plan: &Plan,
    ) -> Self {
        let [rows, columns] = plan.sizes.margin;
        let whole = models.computed.with_margin(rows, columns);
        let seed_and_time = (scene.seed, scene.sea.time);
        let gusts = models.gusts.filter(|_| plan.uses(Term::Gusts));
        Self {
            surface: plan
                .uses(Term::Sea)
                .then(|| Surface::new_in(workspace, &models.sea, seed_and_time, &whole)),
            gusts: gusts.map(|(gusts, _)| gusts.coarse_field(&whole, scene.seed)),
        }
    }
}

impl Drawn {
    /// The fields that are results, but for the image.
    pub(super) fn outputs(&mut self) -> [&mut Field; 8] {
        let f = &mut self.fields;
        [
            &mut f.elevation,
            &mut f.slope_x,
            &mut f.slope_y,
            &mut f.velocity_x,
            &mut f.velocity_y,
            &mut f.velocity_z,
            &mut self.radial_velocity,
            &mut self.sigma0,
        ]
    }

    /// Puts the blocks of all fields back.
    pub(super) fn give_back(self, workspace: &mut Workspace) {
        let f = self.fields;
        let surface = [
            f.elevation,
            f.slope_x,
            f.slope_y,
            f.velocity_x,
            f.velocity_y,
        ];
        let more = [f.velocity_z, f.radial_acceleration, f.modulation];
        let rest = [self.radial_velocity, self.sigma0, self.intensity];
        let fields = surface.into_iter().chain(more).chain(rest);
        fields.for_each(|field| workspace.give(field));
    }
}

impl<'a> Stages<'a> {
    pub(super) fn new(
        (scene, models, plan): (&'a Scene, &'a Models, &'a Plan),
        (method, wanted): (Method, Wanted),
        strip: &Strip,
    ) -> Self {
        let [rows, columns] = plan.sizes.margin;
        Self {
            scene,
            models,
            plan,
            method,
            raster: models
                .computed
                .with_margin(rows, columns)
                .strip(&strip.raster),
            first_row: strip.raster.start,
            last: strip.image.end == models.image.rows,
            computed: models.computed.strip(&strip.computed),
            quantities: quantities(plan, wanted),
        }
    }

    /// All stages up to the intensity before speckle, in their order; the clock runs since the plan was made.
    pub(super) fn draw(
        &self,
        workspace: &mut Workspace,
        last_table: &mut Option<BackscatterTable>,
        backdrop: &mut Backdrop,
        (clock, seconds): (&mut Clock, &mut Seconds),
    ) -> Drawn {
        let mut accuracy = Accuracy::default();
        let mut fields = self.sea(workspace, backdrop);
        self.add_swell(workspace, &mut fields);
        seconds.sea += clock.lap();
        accuracy.wake = self.add_wake(workspace, &mut fields);
        seconds.kelvin += clock.lap();
        self.add_edge(&mut fields);
        self.turn_into_factors(&mut fields);
        let remaining = self.bragg_remaining(workspace);
        seconds.turbulent += clock.lap();
        let roughness = self.subpixel_wake(workspace, &mut fields);
        let left = remaining.as_ref();
        let mut sigma0 = self.sigma0(
            workspace,
            last_table,
            (&fields, left, roughness.as_ref()),
            &mut accuracy,
        );
        self.modulate(&mut sigma0, left, backdrop);
        let used = remaining.into_iter().chain(roughness.into_iter().flatten());
        used.for_each(|field| workspace.give(field));
        seconds.backscatter += clock.lap();
        let radial_velocity =
            fields.radial_velocity(workspace, &self.raster, self.models.incidence);
        let intensity = self.image(workspace, &sigma0, &radial_velocity, &fields);
        seconds.imaging += clock.lap();
        Drawn {
            fields,
            radial_velocity,
            sigma0,
            intensity,
            accuracy,
        }
    }

    /// Tolerance of sums of waves; single precision is not more exact.
    fn field_tolerance(&self) -> f64 {
        (SHARES.fields * self.scene.model.tolerance).max(1e-6)
    }

    /// The same of each wake, so that all keep it together.
    fn wake_tolerance(&self) -> f64 {
        let share = SHARES.fields / self.models.wakes.len().max(1) as f64;
        (share * self.scene.model.tolerance).max(1e-6)
    }

    /// Rows of the whole computed image with its margin.
    fn rows(&self) -> Range<usize> {
        self.first_row..self.first_row + self.raster.rows
    }

    /// The waves of the sea; the last strip puts their blocks back.
    pub(super) fn sea(&self, workspace: &mut Workspace, backdrop: &mut Backdrop) -> SurfaceFields {
        let mut fields = SurfaceFields::default();
        let Some(surface) = &backdrop.surface else {
            for &quantity in self.quantities.iter().flatten() {
                *fields.of(quantity) = workspace.flat_field(&self.raster);
            }
            return fields;
        };
        let transfer = &self.models.transfer;
        let mut put = |quantities: &[Quantity], made: Vec<Field>| {
            for (&quantity, field) in quantities.iter().zip(made) {
                *fields.of(quantity) = field;
            }
        };
        match self.method {
            Method::Fast => {
                for group in &self.quantities {
                    let tolerance = self.field_tolerance();
                    let sum = (transfer, &group[..], tolerance);
                    put(group, surface.strip_in(workspace, &self.rows(), sum));
                }
            }
            Method::Direct => {
                let all = self.quantities.concat();
                put(
                    &all,
                    harmonic_fields(&surface.modes(), transfer, &all, &self.raster),
                );
            }
        }
        if self.last {
            let last = backdrop.surface.take();
            last.into_iter()
                .for_each(|surface| surface.give_back(workspace));
        }
        fields
    }

    /// Adds the swell.
    pub(super) fn add_swell(&self, workspace: &mut Workspace, fields: &mut SurfaceFields) {
        let swell = self.models.swell.filter(|_| self.plan.uses(Term::Swell));
        let Some(swell) = swell else { return };
        let (seed, transfer) = (
            (self.scene.seed, self.scene.sea.time),
            &self.models.transfer,
        );
        let raster = &self.raster;
        let waves = swell.waves(seed, transfer.depth, raster.nyquist_wavenumber());
        let mut add = |quantity, made: &Field| {
            let sum = fields.of(quantity).values.par_iter_mut().zip(&made.values);
            sum.with_min_len(1 << 14)
                .for_each(|(sum, made)| *sum += made);
        };
        match self.method {
            Method::Fast => {
                for group in &self.quantities {
                    let sum = (&waves, transfer, &group[..], raster);
                    let take = |q: usize, made: &mut Field| add(group[q], made);
                    nufft::synthesize_each(workspace, sum, self.field_tolerance(), take);
                }
            }
            Method::Direct => {
                let all = self.quantities.concat();
                let made = harmonic_fields(&waves, transfer, &all, raster);
                all.iter().zip(&made).for_each(|(q, made)| add(*q, made));
            }
        }
    }

    /// Adds the Kelvin wakes.
    pub(super) fn add_wake(
        &self,
        workspace: &mut Workspace,
        fields: &mut SurfaceFields,
    ) -> Option<Reached> {
        if !self.plan.uses(Term::Kelvin) {
            return None;
        }
        let pairs = self.models.wakes.iter().zip(&self.plan.wakes);
        let reached = pairs
            .filter_map(|(wake, plan)| self.add_wake_of(workspace, fields, &wake.kelvin, plan));
        reached.reduce(|a, b| Reached {
            reached: a.reached.max(b.reached),
            ..a
        })
    }

    /// Adds the Kelvin wake of one ship, faded over its hull.
    fn add_wake_of(
        &self,
        workspace: &mut Workspace,
        fields: &mut SurfaceFields,
        wake: &KelvinWake,
        plan: &WakePlan,
    ) -> Option<Reached> {
        let waves = wake.waves(plan);
        let transfer = &self.models.transfer;
        let raster = &self.raster;
        let mut fade = workspace.field(raster);
        kelvin::fill_fade(&mut fade, &wake.track, wake.hull.length(), raster);
        let mut add = |quantity, wake: &mut Field| fields.of(quantity).add_product(wake, &fade);
        let reached = match self.method {
            Method::Fast => {
                let asked = self.wake_tolerance();
                let mut reached = 0.0f64;
                for group in &self.quantities {
                    let sum = (&waves, transfer, &group[..], raster);
                    let take = |q: usize, wake: &mut Field| add(group[q], wake);
                    reached = reached.max(nufft::synthesize_each(workspace, sum, asked, take));
                }
                Some(Reached { asked, reached })
            }
            Method::Direct => {
                let all = self.quantities.concat();
                let made = harmonic_fields(&waves, transfer, &all, raster);
                for (quantity, mut field) in all.into_iter().zip(made) {
                    add(quantity, &mut field);
                }
                None
            }
        };
        workspace.give(fade);
        reached
    }

    /// Once all waves are in: from the modulation to the factor on the Bragg return.
    pub(super) fn turn_into_factors(&self, fields: &mut SurfaceFields) {
        if self.plan.uses(Term::Hydrodynamic) {
            let sea = self.plan.uses(Term::Sea);
            let variance = if sea {
                self.plan.modulation_variance
            } else {
                0.0
            };
            to_bragg_factors(&mut fields.modulation, variance);
        }
    }

    /// What turbulent wakes and slicks leave of the short waves.
    pub(super) fn bragg_remaining(&self, workspace: &mut Workspace) -> Option<Field> {
        let uses = |term| self.plan.uses(term);
        let slicks = self.models.slicks.filter(|_| uses(Term::Slicks));
        let [rows, columns] = self.plan.sizes.margin;
        let whole = self.models.computed.with_margin(rows, columns);
        let wind_and_seed = (self.scene.sea.wind_speed, self.scene.seed);
        let slicks = slicks.map(|slicks| slicks.strip(&whole, &self.rows(), wind_and_seed));
        let wakes: &[Wake] = if uses(Term::Turbulent) {
            &self.models.wakes
        } else {
            &[]
        };
        let mut left = slicks;
        for wake in wakes {
            let mut field = workspace.field(&self.raster);
            wake.turbulent.fill_damping(&mut field, &self.raster);
            let damping = field.values.par_iter_mut().with_min_len(1 << 14);
            match &mut left {
                None => {
                    damping.for_each(|damping| *damping = 1.0 - *damping);
                    left = Some(field);
                }
                Some(left) => {
                    let pairs = left.values.par_iter_mut().zip(damping);
                    pairs.for_each(|(left, damping)| *left *= 1.0 - *damping);
                    workspace.give(field);
                }
            }
        }
        left
    }

    /// Variances xx, xy and yy of the slopes of the ship's waves that the pixels do not carry. Their velocities smear the
    /// image as an acceleration would that defocuses as much: the mean square of both is that of one.
    pub(super) fn subpixel_wake(
        &self,
        workspace: &mut Workspace,
        fields: &mut SurfaceFields,
    ) -> Option<[Field; 3]> {
        let models = self.models;
        if !self.plan.uses(Term::SubpixelWake) {
            return None;
        }
        let raster = &self.raster;
        let mut variances = [(); 3].map(|()| workspace.flat_field(raster));
        let per_velocity = if self.plan.uses(Term::AzimuthSmear) {
            models.defocus_of_velocity()
        } else {
            0.0
        };
        let columns = raster.columns.max(1);
        let mut unused = Vec::new();
        let acceleration = &mut fields.radial_acceleration.values;
        let acceleration = if per_velocity > 0.0 {
            acceleration
        } else {
            unused.resize(raster.len(), 0.0);
            &mut unused
        };
        let [xx, xy, yy] = variances
            .each_mut()
            .map(|f| f.values.par_chunks_mut(columns));
        let rows = xx.zip(xy).zip(yy).zip(acceleration.par_chunks_mut(columns));
        rows.enumerate()
            .for_each(|(i, (((xx, xy), yy), acceleration))| {
                for (j, acceleration) in acceleration.iter_mut().enumerate() {
                    if let Some(rough) = models.roughness([raster.x(j), raster.y(i)]) {
                        [xx[j], xy[j], yy[j]] = rough.slopes.map(|v| v as f32);
                        let square = rough.radial(models.incidence) * per_velocity * per_velocity;
                        *acceleration = acceleration.hypot(square.sqrt() as f32);
                    }
                }
            });
        Some(variances)
    }

    /// The edges that are drawn.
    pub(super) fn edges(&self) -> impl Iterator<Item = &WakeEdge> {
        let drawn = self.plan.uses(Term::BrightEdge);
        let edges = self
            .models
            .wakes
            .iter()
            .filter_map(|wake| wake.edge.as_ref());
        edges.filter(move |_| drawn)
    }

    /// Adds the currents at the edges of turbulent wakes.
    pub(super) fn add_edge(&self, fields: &mut SurfaceFields) {
        for edge in self.edges() {
            let SurfaceFields {
                velocity_x,
                velocity_y,
                ..
            } = fields;
            edge.add_velocity([velocity_x, velocity_y], &self.raster);
        }
    }
}
