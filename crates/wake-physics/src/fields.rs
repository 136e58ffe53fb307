//! The fields of a scene during its computation, and which of them its image needs.

use crate::raster::{Field, Raster};
use crate::scene::Term;
use crate::waves::Quantity;
use crate::workspace::Workspace;
use rayon::prelude::*;

/// The linear fields among the results.
const OUTPUTS: [Quantity; 6] = [
    Quantity::Elevation,
    Quantity::SlopeX,
    Quantity::SlopeY,
    Quantity::VelocityX,
    Quantity::VelocityY,
    Quantity::VelocityZ,
];

/// The results that a caller asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wanted {
    /// The image and what it is computed from.
    Image,
    /// All results.
    Fields,
}

/// The linear fields to compute: those that the image needs, and others that are wanted.
pub(crate) fn quantities(uses: impl Fn(Term) -> bool, wanted: Wanted) -> [Vec<Quantity>; 2] {
    let mut image = vec![Quantity::SlopeX, Quantity::SlopeY];
    if uses(Term::VelocityBunching) {
        image.extend([Quantity::VelocityX, Quantity::VelocityZ]);
    }
    let single = [
        (Term::RangeBunching, Quantity::Elevation),
        (Term::AzimuthSmear, Quantity::RadialAcceleration),
        (Term::Hydrodynamic, Quantity::Hydrodynamic),
    ];
    let single = single.iter().filter(|(term, _)| uses(*term));
    image.extend(single.map(|(_, quantity)| *quantity));
    let mut rest = OUTPUTS.to_vec();
    rest.retain(|quantity| !image.contains(quantity));
    // Two fields share a transform: an odd number leaves room for one more at no cost.
    if image.len() % 2 == 1 && !rest.is_empty() {
        image.push(rest.remove(0));
    }
    if wanted == Wanted::Image {
        rest.clear();
    }
    [image, rest]
}

/// Fields of a scene: on the computed pixels with their margin, or cut to the image. Fields that are not asked for have no
/// pixels.
#[derive(Debug, Default)]
pub(crate) struct Fields {
    /// ζ \[m\].
    pub(crate) elevation: Field,
    /// ∂ζ/∂x \[1\].
    pub(crate) slope_x: Field,
    /// ∂ζ/∂y \[1\].
    pub(crate) slope_y: Field,
    /// Velocity of the water along x [m/s].
    pub(crate) velocity_x: Field,
    /// Velocity of the water along y [m/s].
    pub(crate) velocity_y: Field,
    /// Upward velocity of the water [m/s].
    pub(crate) velocity_z: Field,
    /// Velocity toward the radar [m/s].
    pub(crate) radial_velocity: Field,
    /// Radar cross-section per unit area.
    pub(crate) sigma0: Field,
    /// Intensity of the image before speckle.
    pub(crate) intensity: Field,
    /// Acceleration toward the radar [m/s²].
    pub(crate) radial_acceleration: Field,
    /// Hydrodynamic modulation of the Bragg waves \[1\]; after all waves are added, the factor on their return.
    pub(crate) modulation: Field,
}

impl Fields {
    /// Number of fields that are results besides the image: the first of [`Self::each`].
    pub(crate) const RESULTS: usize = 8;

    /// All fields.
    pub(crate) fn each(&mut self) -> [&mut Field; 11] {
        [
            &mut self.elevation,
            &mut self.slope_x,
            &mut self.slope_y,
            &mut self.velocity_x,
            &mut self.velocity_y,
            &mut self.velocity_z,
            &mut self.radial_velocity,
            &mut self.sigma0,
            &mut self.intensity,
            &mut self.radial_acceleration,
            &mut self.modulation,
        ]
    }

    /// The field of a quantity.
    pub(crate) fn of(&mut self, quantity: Quantity) -> &mut Field {
        match quantity {
            Quantity::Elevation => &mut self.elevation,
            Quantity::SlopeX => &mut self.slope_x,
            Quantity::SlopeY => &mut self.slope_y,
            Quantity::VelocityX => &mut self.velocity_x,
            Quantity::VelocityY => &mut self.velocity_y,
            Quantity::VelocityZ => &mut self.velocity_z,
            Quantity::RadialAcceleration => &mut self.radial_acceleration,
            Quantity::Hydrodynamic => &mut self.modulation,
        }
    }

    /// Returns the buffers of all fields to the workspace.
    pub(crate) fn give_back(mut self, memory: &mut Workspace) {
        for field in self.each() {
            memory.give(std::mem::take(field));
        }
    }

    /// Computes the velocity toward the radar at the incidence θ \[rad\] if the velocities were computed.
    pub(crate) fn project(&mut self, memory: &mut Workspace, raster: &Raster, incidence: f64) {
        let [vx, vz] = [&self.velocity_x, &self.velocity_z];
        if vx.values.is_empty() {
            return;
        }
        let (sin, cos) = (incidence.sin() as f32, incidence.cos() as f32);
        let mut field = memory.field(raster);
        let velocities = vx.values.par_iter().zip(&vz.values);
        let pixels = field.values.par_iter_mut().zip(velocities);
        pixels
            .with_min_len(1 << 14)
            .for_each(|(radial, (x, z))| *radial = z * cos - x * sin);
        self.radial_velocity = field;
    }
}
