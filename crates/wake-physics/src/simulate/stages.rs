//! One function a stage: what it takes from the plan, and which method it calls.

use super::Method;
use super::clock::{Clock, Seconds};
use super::label::echo_displacement;
use crate::constants::SEA_WATER_DENSITY;
use crate::kelvin;
use crate::nufft;
use crate::plan::Plan;
use crate::raster::{Field, Raster};
use crate::sar::direct::DirectImage;
use crate::sar::echo::ship_cross_section;
use crate::sar::speckle::speckle;
use crate::sar::{AzimuthResolution, Echo, Imaging, Sources};
use crate::scattering::{BackscatterTable, FacetFields};
use crate::scene::{Scene, Term};
use crate::setup::{Setup, turbulent_wake};
use crate::surface::Surface;
use crate::waves::{Quantity, harmonic_fields};
use rayon::prelude::*;

/// Share of the tolerance for the fields: their largest error is some five times its root mean square, and
/// bunching turns an error of the velocity into a larger one of the image.
const SHARE_OF_FIELDS: f64 = 0.3;

/// Share of the tolerance for the table of σ⁰, whose error is bounded pixel by pixel.
const SHARE_OF_TABLE: f64 = 0.5;

/// Share of the tolerance for the kernels of the imaging.
const SHARE_OF_KERNELS: f64 = 0.4;

/// The fields that are always made, for they are results.
const OUTPUTS: [Quantity; 6] = [
    Quantity::Elevation,
    Quantity::SlopeX,
    Quantity::SlopeY,
    Quantity::VelocityX,
    Quantity::VelocityY,
    Quantity::VelocityZ,
];

/// A scene being simulated.
pub(super) struct Run<'a> {
    scene: &'a Scene,
    setup: &'a Setup,
    method: Method,
    /// The image and its margin.
    raster: Raster,
    quantities: Vec<Quantity>,
}

/// Linear fields of the surface on the raster with its margin.
pub(super) struct SurfaceFields {
    /// ζ \[m\].
    pub(super) elevation: Field,
    /// ∂ζ/∂x \[1\].
    pub(super) slope_x: Field,
    /// ∂ζ/∂y \[1\].
    pub(super) slope_y: Field,
    /// Of the water along x [m/s].
    pub(super) velocity_x: Field,
    /// Of the water along y [m/s].
    pub(super) velocity_y: Field,
    /// Of the water upward [m/s].
    pub(super) velocity_z: Field,
    /// Acceleration toward the radar [m/s²], where coherence counts.
    acceleration: Option<Field>,
    /// Hydrodynamic modulation \[1\], where it counts.
    modulation: Option<Field>,
}

/// What a scene looks like before speckle, on the raster with its margin but for the image.
pub(super) struct Drawn {
    pub(super) fields: SurfaceFields,
    /// Velocity toward the radar [m/s].
    pub(super) radial_velocity: Field,
    pub(super) sigma0: Field,
    /// Intensity of the image.
    pub(super) intensity: Field,
    /// Sizes of the lattice of the sea, and of the table of σ⁰.
    pub(super) sizes: [[usize; 2]; 2],
}

impl<'a> Run<'a> {
    pub(super) fn new(scene: &'a Scene, setup: &'a Setup, plan: &Plan, method: Method) -> Self {
        let mut quantities = OUTPUTS.to_vec();
        if plan.uses(Term::Coherence) {
            quantities.push(Quantity::RadialAcceleration);
        }
        if plan.uses(Term::Hydrodynamic) {
            quantities.push(Quantity::Hydrodynamic);
        }
        Self {
            scene,
            setup,
            method,
            raster: setup
                .image
                .with_margin(plan.sizes.margin[0], plan.sizes.margin[1]),
            quantities,
        }
    }

    /// All stages up to the intensity before speckle, in their order; `clock` runs since the plan was made.
    pub(super) fn draw(&self, plan: &Plan, clock: &mut Clock, seconds: &mut Seconds) -> Drawn {
        let (mut fields, lattice) = self.sea(plan);
        seconds.sea = clock.lap();
        self.add_wake(plan, &mut fields);
        seconds.kelvin = clock.lap();
        let damping = self.damping(plan);
        seconds.turbulent = clock.lap();
        let (sigma0, table) = self.sigma0(plan, &fields, damping.as_ref());
        seconds.backscatter = clock.lap();
        let radial_velocity = fields.radial_velocity(self.setup.incidence);
        let intensity = self.image(plan, &sigma0, &radial_velocity, &fields);
        seconds.imaging = clock.lap();
        Drawn {
            fields,
            radial_velocity,
            sigma0,
            intensity,
            sizes: [lattice, table],
        }
    }

    fn field_tolerance(&self) -> f64 {
        (SHARE_OF_FIELDS * self.scene.model.tolerance).max(1e-6)
    }

    /// The sea, and the size of its lattice.
    fn sea(&self, plan: &Plan) -> (SurfaceFields, [usize; 2]) {
        let flat = || vec![Field::constant(&self.raster, 0.0); self.quantities.len()];
        if !plan.uses(Term::Sea) {
            return (self.collect(flat(), plan), [0, 0]);
        }
        let (seed, time) = (self.scene.seed, self.scene.sea.time);
        let surface = Surface::new(&self.setup.sea, seed, time, &self.raster);
        let transfer = &self.setup.transfer;
        let fields = match self.method {
            Method::Fast => surface.fields(transfer, &self.quantities, self.field_tolerance()),
            Method::Direct => {
                harmonic_fields(&surface.modes(), transfer, &self.quantities, &self.raster)
            }
        };
        (self.collect(fields, plan), surface.lattice_size())
    }

    fn collect(&self, fields: Vec<Field>, plan: &Plan) -> SurfaceFields {
        let mut fields = fields.into_iter();
        let mut next = || {
            fields
                .next()
                .unwrap_or_else(|| Field::constant(&self.raster, 0.0))
        };
        SurfaceFields {
            elevation: next(),
            slope_x: next(),
            slope_y: next(),
            velocity_x: next(),
            velocity_y: next(),
            velocity_z: next(),
            acceleration: plan.uses(Term::Coherence).then(&mut next),
            modulation: plan.uses(Term::Hydrodynamic).then(&mut next),
        }
    }

    /// Adds the Kelvin wake, faded over the hull.
    fn add_wake(&self, plan: &Plan, fields: &mut SurfaceFields) {
        let Some(wake) = self.setup.wake.as_ref().filter(|_| plan.uses(Term::Kelvin)) else {
            return;
        };
        let waves = wake.waves(&plan.wake);
        let transfer = &self.setup.transfer;
        let (quantities, raster) = (&self.quantities, &self.raster);
        let fade = kelvin::fade_field(&wake.track, wake.hull.length(), raster);
        let mut fields: Vec<&mut Field> = fields.all().collect();
        let mut add = |q: usize, wake: &mut Field| fields[q].add_product(wake, &fade);
        match self.method {
            Method::Fast => {
                let tolerance = self.field_tolerance();
                nufft::synthesize_each(&waves, transfer, quantities, raster, tolerance, add);
            }
            Method::Direct => {
                let wake_fields = harmonic_fields(&waves, transfer, quantities, raster);
                for (q, mut field) in wake_fields.into_iter().enumerate() {
                    add(q, &mut field);
                }
            }
        }
    }

    /// What the turbulent wake leaves of the short waves.
    fn damping(&self, plan: &Plan) -> Option<Field> {
        let wake = self
            .setup
            .wake
            .as_ref()
            .filter(|_| plan.uses(Term::Turbulent))?;
        let mut field = turbulent_wake(wake).damping_field(&self.raster);
        field
            .values
            .par_iter_mut()
            .with_min_len(1 << 14)
            .for_each(|damping| *damping = 1.0 - *damping);
        Some(field)
    }

    /// σ⁰, and the size of its table.
    fn sigma0(
        &self,
        plan: &Plan,
        fields: &SurfaceFields,
        damping: Option<&Field>,
    ) -> (Field, [usize; 2]) {
        let backscatter = self
            .setup
            .backscatter(plan.uses(Term::TiltAverage), plan.uses(Term::Specular));
        let facets = FacetFields {
            slope_x: &fields.slope_x,
            slope_y: &fields.slope_y,
            modulation: fields.modulation.as_ref(),
            damping,
        };
        if self.method == Method::Direct {
            return (backscatter.sigma0_field(&facets), [0, 0]);
        }
        let error = SHARE_OF_TABLE * self.scene.model.tolerance * plan.mean_sigma0;
        let table = BackscatterTable::covering(backscatter, facets.slope_x, facets.slope_y, error);
        (table.sigma0_field(&facets), table.size())
    }

    /// Intensity of the image before speckle.
    fn image(
        &self,
        plan: &Plan,
        sigma0: &Field,
        radial_velocity: &Field,
        fields: &SurfaceFields,
    ) -> Field {
        let sources = Sources {
            raster: self.raster,
            sigma0,
            radial_velocity: plan.uses(Term::Bunching).then_some(radial_velocity),
            radial_acceleration: fields.acceleration.as_ref(),
            elevation: plan.uses(Term::RangeBunching).then_some(&fields.elevation),
        };
        let at_rest = AzimuthResolution::at_rest(self.setup.azimuth_resolution, 1);
        let imaging = Imaging {
            range_to_velocity: self.setup.range_to_velocity,
            incidence: self.setup.incidence,
            resolution: if plan.uses(Term::Coherence) {
                self.setup.resolution()
            } else {
                at_rest
            },
        };
        let image = &self.setup.image;
        let tolerance = SHARE_OF_KERNELS * self.scene.model.tolerance;
        let mut intensity = match self.method {
            Method::Fast => imaging.image(&sources, image, tolerance),
            Method::Direct => DirectImage::new(&imaging, &sources, image).image(),
        };
        if let Some(echo) = self.echo() {
            echo.add_to(&mut intensity, image, at_rest.nominal);
        }
        intensity
    }

    /// The ship's own echo, if it is asked for.
    fn echo(&self) -> Option<Echo> {
        let ship = self.scene.ship.as_ref().filter(|ship| ship.echo)?;
        let wake = self.setup.wake.as_ref()?;
        let displacement = SEA_WATER_DENSITY * wake.hull.volume();
        Some(Echo {
            position: wake.track.position,
            heading: ship.heading,
            length: ship.length,
            beam: ship.beam,
            cross_section: ship_cross_section(self.scene.radar.frequency, displacement),
            displacement: echo_displacement(self.scene),
        })
    }

    pub(super) fn speckle(&self, plan: &Plan, intensity: &Field) -> Field {
        let mut speckled = intensity.clone();
        if plan.uses(Term::Speckle) {
            speckle(&mut speckled, self.scene.radar.looks, self.scene.seed);
        }
        speckled
    }

    /// Cuts the image from the middle.
    pub(super) fn crop(&self, field: Field) -> Field {
        let rows = (self.raster.rows - self.setup.image.rows) / 2;
        let columns = (self.raster.columns - self.setup.image.columns) / 2;
        field.crop(rows, columns)
    }
}

impl SurfaceFields {
    /// In the order of a run's quantities.
    fn all(&mut self) -> impl Iterator<Item = &mut Field> {
        let outputs = [
            &mut self.elevation,
            &mut self.slope_x,
            &mut self.slope_y,
            &mut self.velocity_x,
            &mut self.velocity_y,
            &mut self.velocity_z,
        ];
        let more = self.acceleration.iter_mut().chain(&mut self.modulation);
        outputs.into_iter().chain(more)
    }

    /// Velocity toward the radar.
    fn radial_velocity(&self, incidence: f64) -> Field {
        let [vx, vz] = [&self.velocity_x, &self.velocity_z];
        let (sin, cos) = (incidence.sin() as f32, incidence.cos() as f32);
        let values = vx.values.par_iter().zip(&vz.values).with_min_len(1 << 14);
        Field {
            rows: vx.rows,
            columns: vx.columns,
            values: values.map(|(x, z)| z * cos - x * sin).collect(),
        }
    }
}
