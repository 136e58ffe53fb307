//! The linear fields of the surface: which a scene needs, and their values.

use crate::plan::Plan;
use crate::raster::{Field, Raster};
use crate::scene::Term;
use crate::waves::Quantity;
use crate::workspace::Workspace;
use rayon::prelude::*;

/// The fields that are results.
const OUTPUTS: [Quantity; 6] = [
    Quantity::Elevation,
    Quantity::SlopeX,
    Quantity::SlopeY,
    Quantity::VelocityX,
    Quantity::VelocityY,
    Quantity::VelocityZ,
];

/// Which fields a caller asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wanted {
    /// The image, and what it is made of.
    Image,
    /// All results.
    Fields,
}

/// The linear fields to be computed: those that the image needs, and those that are wanted besides.
pub(super) fn quantities(plan: &Plan, wanted: Wanted) -> [Vec<Quantity>; 2] {
    let mut image = vec![Quantity::SlopeX, Quantity::SlopeY];
    if plan.uses(Term::VelocityBunching) {
        image.extend([Quantity::VelocityX, Quantity::VelocityZ]);
    }
    let single = [
        (Term::RangeBunching, Quantity::Elevation),
        (Term::AzimuthSmear, Quantity::RadialAcceleration),
        (Term::Hydrodynamic, Quantity::Hydrodynamic),
    ];
    image.extend(
        single
            .iter()
            .filter(|(term, _)| plan.uses(*term))
            .map(|(_, q)| *q),
    );
    let mut rest = OUTPUTS.to_vec();
    rest.retain(|quantity| !image.contains(quantity));
    // Two fields share a transform: where one would stand alone, one more costs nothing.
    if image.len() % 2 == 1 && !rest.is_empty() {
        image.push(rest.remove(0));
    }
    if wanted == Wanted::Image {
        rest.clear();
    }
    [image, rest]
}

/// Linear fields of the surface on the raster with its margin; those that nobody asks for have no pixel.
#[derive(Debug, Default)]
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
    /// Acceleration toward the radar [m/s²].
    pub(super) radial_acceleration: Field,
    /// Hydrodynamic modulation of the Bragg waves \[1\]; once all waves are in, the factor on their return.
    pub(super) modulation: Field,
}

impl SurfaceFields {
    pub(super) fn of(&mut self, quantity: Quantity) -> &mut Field {
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

    /// Velocity toward the radar at the incidence θ \[rad\]; without pixels where nobody asked for the velocities.
    pub(super) fn radial_velocity(
        &self,
        workspace: &mut Workspace,
        raster: &Raster,
        incidence: f64,
    ) -> Field {
        let [vx, vz] = [&self.velocity_x, &self.velocity_z];
        if vx.values.is_empty() {
            return Field::default();
        }
        let (sin, cos) = (incidence.sin() as f32, incidence.cos() as f32);
        let mut field = workspace.field(raster);
        let velocities = vx.values.par_iter().zip(&vz.values);
        let pixels = field.values.par_iter_mut().zip(velocities);
        pixels
            .with_min_len(1 << 14)
            .for_each(|(radial, (x, z))| *radial = z * cos - x * sin);
        field
    }
}
