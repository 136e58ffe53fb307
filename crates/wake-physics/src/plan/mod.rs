//! What a scene needs, decided before anything is computed: which terms, how wide a margin, how many nodes.

mod bounds;
mod choose;
mod linear;
mod margin;
mod sample;
mod situation;

pub use choose::PlannedTerm;

use crate::error::Result;
use crate::kelvin::WakePlan;
use crate::memory;
use crate::raster::Raster;
use crate::scene::{Scene, Term};
use crate::setup::Setup;
pub(crate) use linear::smear;
use serde::Serialize;
pub(crate) use situation::Situation;

/// Fields of four bytes a pixel that are alive at once, at most; the target of the design.
const FIELDS_IN_MEMORY: u64 = 40;

/// The plan of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Every term: used or not, what leaving it out would change at most, and why.
    pub terms: Vec<PlannedTerm>,
    /// How much is computed.
    pub sizes: Sizes,
    /// What a user should know about this scene.
    pub notes: Vec<String>,
    pub(crate) wake: WakePlan,
    /// Mean σ⁰ expected \[1\].
    pub(crate) mean_sigma0: f64,
}

/// How much is computed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sizes {
    /// Rows and columns added on each side of the image.
    pub margin: [usize; 2],
    /// Rows and columns computed.
    pub computed: [usize; 2],
    /// Largest resolved wavenumber [rad/m].
    pub band: f64,
    /// Rows and columns of the periodic lattice of the sea; 0 without a sea.
    pub sea_lattice: [usize; 2],
    /// Plane waves of the Kelvin wake: transverse and divergent.
    pub wake_nodes: [usize; 2],
    /// Ranges of the direction of wake waves to the track \[deg\].
    pub wake_directions: Vec<[f64; 2]>,
    /// Nodes of the backscatter table along the two slopes; 0 where σ⁰ is evaluated exactly.
    pub table: [usize; 2],
}

impl Plan {
    /// Whether a term is computed.
    #[must_use]
    pub fn uses(&self, term: Term) -> bool {
        self.terms.iter().any(|t| t.term == term && t.used)
    }

    /// Computes these terms, and not those.
    pub(crate) fn change(&mut self, with: &[Term], without: &[Term]) {
        for t in &mut self.terms {
            t.used = (t.used || with.contains(&t.term)) && !without.contains(&t.term);
        }
    }

    /// Sum of the bounds of the terms left out of the image before speckle.
    #[must_use]
    pub fn bound(&self) -> f64 {
        let out = |t: &&PlannedTerm| !t.used && t.term != Term::Speckle;
        self.terms.iter().filter(out).map(|t| t.bound).sum()
    }

    /// Plans a valid scene.
    ///
    /// # Errors
    ///
    /// [`Error::TooLarge`](crate::Error::TooLarge) if the fields do not fit in memory.
    pub fn new(scene: &Scene) -> Result<Self> {
        scene.validate()?;
        Self::of(scene, &Setup::new(scene))
    }

    pub(crate) fn of(scene: &Scene, setup: &Setup) -> Result<Self> {
        Self::of_situation(scene, setup, &Situation::new(scene, setup))
    }

    pub(crate) fn of_situation(
        scene: &Scene,
        setup: &Setup,
        situation: &Situation,
    ) -> Result<Self> {
        let effects = situation.effects();
        let terms = choose::choose(&effects, &scene.model.terms, scene.model.tolerance);
        let margin = situation.margin(setup);
        let raster = setup.image.with_margin(margin[0], margin[1]);
        let needed = FIELDS_IN_MEMORY * 4 * raster.len() as u64;
        memory::check([scene.grid.rows, scene.grid.columns], margin, needed)?;
        let mut plan = Self {
            terms,
            sizes: Sizes {
                margin,
                computed: [raster.rows, raster.columns],
                band: raster.nyquist_wavenumber(),
                sea_lattice: [0, 0],
                wake_nodes: [0, 0],
                wake_directions: Vec::new(),
                table: [0, 0],
            },
            notes: situation.notes(scene, setup),
            wake: WakePlan::default(),
            mean_sigma0: situation.mean[0] + situation.mean[1],
        };
        if plan.uses(Term::Kelvin) {
            plan.plan_wake(setup, &raster, scene.model.tolerance);
        }
        Ok(plan)
    }

    fn plan_wake(&mut self, setup: &Setup, raster: &Raster, tolerance: f64) {
        let Some(wake) = &setup.wake else { return };
        self.wake = wake.plan(raster, tolerance);
        self.sizes.wake_nodes = [self.wake.transverse_nodes, self.wake.divergent_nodes];
        let zones = &self.wake.zones;
        self.sizes.wake_directions = zones
            .iter()
            .map(|z| z.directions.map(f64::to_degrees))
            .collect();
    }
}

/// A table of the terms, then the sizes.
impl std::fmt::Display for Plan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "{:<16} {:<5} {:>10}  why", "term", "used", "bound")?;
        for t in &self.terms {
            let used = if t.used { "yes" } else { "no" };
            let name = t.term.name();
            writeln!(f, "{name:<16} {used:<5} {:>10.2e}  {}", t.bound, t.why)?;
        }
        let s = &self.sizes;
        write!(
            f,
            "computed {} x {} pixels (margin {} x {}), sea lattice {} x {}, wake nodes {} + {}, table {} x {}",
            s.computed[0],
            s.computed[1],
            s.margin[0],
            s.margin[1],
            s.sea_lattice[0],
            s.sea_lattice[1],
            s.wake_nodes[0],
            s.wake_nodes[1],
            s.table[0],
            s.table[1]
        )
    }
}
