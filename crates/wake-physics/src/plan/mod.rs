//! What a scene needs, decided before anything is computed: which terms, how wide a margin, how many nodes.
//!
//! A plan is complete when it is returned and never changed. What the methods then reach is
//! [`Accuracy`](crate::Accuracy).

mod budget;
mod cost;
mod estimates;
mod terms;

pub(crate) use budget::SHARES;
pub use cost::Cost;
pub use terms::PlannedTerm;

use crate::error::Result;
use crate::kelvin::WakePlan;
use crate::memory;
use crate::models::Models;
use crate::raster::Raster;
use crate::scene::{Scene, Term};
use crate::surface::lattice_size;
use crate::survey::Survey;
use serde::Serialize;

/// Fields of four bytes a pixel that are alive at once, at most; the target of the design.
const FIELDS_IN_MEMORY: u64 = 40;

/// Bytes a pixel that a scene in strips keeps as a whole: of the computed ones the waves of the sea, the intensity and what its
/// impulse response takes; of the image its ten fields, a complex image and one to write.
const WHOLE: [u64; 2] = [24, 52];

/// Pixels that are computed at once, margins included; more are computed in strips of at most half as many (chosen: about a
/// gibibyte of fields, and an image of 4096 × 4096 pixels is one strip).
const MOST_AT_ONCE: usize = 1 << 25;
/// Bytes of a plane wave while its amplitudes are found and it is summed.
const BYTES_OF_A_WAVE: u64 = 64;

/// The plan of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Every term: used or not, an estimate of what leaving it out changes, and why.
    pub terms: Vec<PlannedTerm>,
    /// How much is computed.
    pub sizes: Sizes,
    /// What a user should know about this scene.
    pub notes: Vec<String>,
    /// Pixels of the image.
    pub(crate) image_pixels: usize,
    /// One a ship.
    pub(crate) wakes: Vec<WakePlan>,
    /// Mean σ⁰ expected \[1\].
    pub(crate) mean_sigma0: f64,
    /// Variance of the hydrodynamic modulation by the resolved sea \[1\].
    pub(crate) modulation_variance: f64,
}

/// How much is computed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sizes {
    /// Spacing of the computed pixels \[m\]: that of the image or an integer fraction of it.
    pub computed_spacing: f64,
    /// Strips of rows that are computed one after the other.
    pub strips: usize,
    /// Rows and columns added on each side of the image.
    pub margin: [usize; 2],
    /// Rows and columns computed.
    pub computed: [usize; 2],
    /// Largest resolved wavenumber [rad/m].
    pub band: f64,
    /// Rows and columns of the periodic lattice of the sea; 0 without a sea.
    pub sea_lattice: [usize; 2],
    /// Plane waves of the Kelvin wakes: transverse and divergent.
    pub wake_nodes: [usize; 2],
    /// Ranges of the direction of wake waves to the track \[deg\].
    pub wake_directions: Vec<[f64; 2]>,
}

/// Number of strips of rows of an image.
fn strips(computed: &Raster, image: &Raster) -> usize {
    if computed.len() <= MOST_AT_ONCE {
        return 1;
    }
    (2 * computed.len()).div_ceil(MOST_AT_ONCE).min(image.rows)
}

/// Bytes that are needed at once, at most.
fn needed(computed: &Raster, image: &Raster, (strips, margin): (usize, usize)) -> u64 {
    let all = FIELDS_IN_MEMORY * 4;
    if strips == 1 {
        return all * computed.len() as u64;
    }
    let rows = computed.rows / strips + 6 * margin;
    let [of_computed, of_image] = WHOLE;
    all * (rows * computed.columns) as u64
        + of_computed * computed.len() as u64
        + of_image * image.len() as u64
}

impl Plan {
    /// Whether a term is computed.
    #[must_use]
    pub fn uses(&self, term: Term) -> bool {
        self.terms.iter().any(|t| t.term == term && t.used)
    }

    /// What a simulation costs by this plan.
    #[must_use]
    pub fn cost(&self) -> Cost {
        Cost::new(self.sizes.computed, self.image_pixels)
    }

    /// Sum of the estimates of the terms left out of the image before speckle.
    #[must_use]
    pub fn left_out(&self) -> f64 {
        let out = |t: &&PlannedTerm| !t.used && t.term != Term::Speckle;
        self.terms.iter().filter(out).map(|t| t.estimate).sum()
    }

    /// Plans a valid scene.
    ///
    /// # Errors
    ///
    /// [`Error::TooLarge`](crate::Error::TooLarge) if the fields do not fit in memory.
    pub fn new(scene: &Scene) -> Result<Self> {
        scene.validate()?;
        let models = Models::new(scene);
        Self::of(scene, &models, &Survey::new(scene, &models))
    }

    pub(crate) fn of(scene: &Scene, models: &Models, survey: &Survey) -> Result<Self> {
        let tolerance = scene.model.tolerance;
        let effects = estimates::effects(survey);
        let terms = terms::choose(&effects, &scene.model.terms, tolerance);
        let uses = |term| terms.iter().any(|t| t.term == term && t.used);
        let margin = survey.margin(models);
        let raster = models.image.with_margin(margin[0], margin[1]);
        let strips = strips(&raster, &models.delivered);
        let needed = needed(&raster, &models.delivered, (strips, margin[0]));
        memory::check([scene.grid.rows, scene.grid.columns], margin, needed)?;
        // Each ship's share, so that all of them keep the tolerance together.
        let share = SHARES.wake_nodes / models.wakes.len().max(1) as f64;
        let wakes = models.wakes.iter().filter(|_| uses(Term::Kelvin));
        let wakes = wakes.map(|wake| wake.kelvin.plan(&raster, share * tolerance));
        let wakes: Vec<WakePlan> = wakes.collect();
        let waves = wakes.iter().map(WakePlan::nodes).max().unwrap_or(0);
        let needed = needed + BYTES_OF_A_WAVE * waves as u64;
        memory::check([scene.grid.rows, scene.grid.columns], margin, needed)?;
        let zones = wakes.iter().flat_map(|wake| &wake.zones);
        let directions = zones.map(|z| z.directions.map(f64::to_degrees));
        let nodes = |of: fn(&WakePlan) -> usize| wakes.iter().map(of).sum();
        Ok(Self {
            image_pixels: models.delivered.len(),
            sizes: Sizes {
                computed_spacing: raster.spacing,
                strips,
                margin,
                computed: [raster.rows, raster.columns],
                band: raster.nyquist_wavenumber(),
                sea_lattice: if uses(Term::Sea) {
                    lattice_size(&models.sea, &raster)
                } else {
                    [0, 0]
                },
                wake_nodes: [nodes(|w| w.transverse_nodes), nodes(|w| w.divergent_nodes)],
                wake_directions: directions.collect(),
            },
            terms,
            notes: survey.notes(scene, models),
            wakes,
            mean_sigma0: survey.mean[0] + survey.mean[1],
            modulation_variance: survey.modulation_variance,
        })
    }

    /// The same for the mean over all seas: no sea is drawn, and what its waves do is averaged over.
    pub(crate) fn over_all_seas(mut self) -> Self {
        let bunching = self.uses(Term::Bunching);
        for t in &mut self.terms {
            t.used = match t.term {
                Term::Sea | Term::Swell | Term::Gusts | Term::Slicks => false,
                Term::TiltAverage | Term::Specular => true,
                Term::Coherence => t.used || bunching,
                _ => t.used,
            };
        }
        self.sizes.sea_lattice = [0, 0];
        self
    }
}

/// A table of the terms, then the sizes.
impl std::fmt::Display for Plan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "{:<16} {:<5} {:>10}  why", "term", "used", "estimate")?;
        for t in &self.terms {
            let used = if t.used { "yes" } else { "no" };
            let name = t.term.name();
            writeln!(f, "{name:<16} {used:<5} {:>10.2e}  {}", t.estimate, t.why)?;
        }
        let s = &self.sizes;
        write!(
            f,
            "computed {} x {} pixels of {} m in {} (margin {} x {}), sea lattice {} x {}, wake nodes {} + {}",
            s.computed[0],
            s.computed[1],
            s.computed_spacing,
            match s.strips {
                1 => "one piece".to_owned(),
                strips => format!("{strips} strips"),
            },
            s.margin[0],
            s.margin[1],
            s.sea_lattice[0],
            s.sea_lattice[1],
            s.wake_nodes[0],
            s.wake_nodes[1]
        )
    }
}
