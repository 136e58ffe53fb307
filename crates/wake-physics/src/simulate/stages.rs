//! One function a stage: what it takes from the plan, and which method it calls.

use super::Method;
use crate::constants::SEA_WATER_DENSITY;
use crate::kelvin;
use crate::labels::{Labels, Track as LabelTrack};
use crate::nufft;
use crate::plan::Plan;
use crate::raster::{Field, Raster};
use crate::sar::direct::DirectImage;
use crate::sar::echo::ship_cross_section;
use crate::sar::geometry::{azimuth_displacement, ship_radial_velocity};
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
    /// In the order of [`OUTPUTS`].
    pub(super) outputs: [Field; 6],
    /// Acceleration toward the radar, where coherence counts.
    acceleration: Option<Field>,
    /// Hydrodynamic modulation, where it counts.
    modulation: Option<Field>,
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

    fn field_tolerance(&self) -> f64 {
        (SHARE_OF_FIELDS * self.scene.model.tolerance).max(1e-6)
    }

    /// The sea, and the size of its lattice.
    pub(super) fn sea(&self, plan: &Plan) -> (SurfaceFields, [usize; 2]) {
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
            outputs: std::array::from_fn(|_| next()),
            acceleration: plan.uses(Term::Coherence).then(&mut next),
            modulation: plan.uses(Term::Hydrodynamic).then(&mut next),
        }
    }

    /// Adds the Kelvin wake, faded over the hull.
    pub(super) fn add_wake(&self, plan: &Plan, fields: &mut SurfaceFields) {
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
    pub(super) fn damping(&self, plan: &Plan) -> Option<Field> {
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
    pub(super) fn sigma0(
        &self,
        plan: &Plan,
        fields: &SurfaceFields,
        damping: Option<&Field>,
    ) -> (Field, [usize; 2]) {
        let backscatter = self
            .setup
            .backscatter(plan.uses(Term::TiltAverage), plan.uses(Term::Specular));
        let facets = FacetFields {
            slope_x: &fields.outputs[1],
            slope_y: &fields.outputs[2],
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
    pub(super) fn image(
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
            elevation: plan.uses(Term::RangeBunching).then_some(&fields.outputs[0]),
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
            displacement: self.displacement(),
        })
    }

    /// Azimuth displacement of the ship's echo \[m\].
    fn displacement(&self) -> f64 {
        let Some(ship) = &self.scene.ship else {
            return 0.0;
        };
        let velocity = ship_radial_velocity(ship.speed, ship.heading, self.setup.incidence);
        azimuth_displacement(self.setup.range_to_velocity, velocity)
    }

    pub(super) fn labels(&self) -> Labels {
        let ship = self.scene.ship.as_ref().zip(self.setup.wake.as_ref());
        let track = ship.map(|(ship, wake)| LabelTrack {
            position: wake.track.position,
            heading: ship.heading,
            speed: ship.speed,
            length: ship.length,
            beam: ship.beam,
            azimuth_displacement: self.displacement(),
        });
        Labels::new(track.as_ref(), &self.setup.image)
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
    fn all(&mut self) -> impl Iterator<Item = &mut Field> {
        let more = self
            .acceleration
            .iter_mut()
            .chain(self.modulation.iter_mut());
        self.outputs.iter_mut().chain(more)
    }

    /// Velocity toward the radar.
    pub(super) fn radial_velocity(&self, incidence: f64) -> Field {
        let [vx, vz] = [&self.outputs[3], &self.outputs[5]];
        let (sin, cos) = (incidence.sin() as f32, incidence.cos() as f32);
        let values = vx.values.par_iter().zip(&vz.values).with_min_len(1 << 14);
        Field {
            rows: vx.rows,
            columns: vx.columns,
            values: values.map(|(x, z)| z * cos - x * sin).collect(),
        }
    }
}
