//! Plan of a simulation, made before anything is computed: terms used, margin, numbers of nodes.
//!
//! A plan is complete when it is returned and never changes. The accuracy achieved by the methods is in
//! [`Accuracy`](crate::Accuracy).

mod cost;
mod estimates;
mod notes;
mod sizes;
mod terms;
mod work;

pub use cost::Cost;
pub use sizes::Sizes;
pub use terms::PlannedTerm;
pub(crate) use terms::SHARES;

use crate::error::Result;
use crate::kelvin::WakePlan;
use crate::linear::{Amplitudes, FirstOrder};
use crate::memory;
use crate::prepared::Prepared;
use crate::raster::Raster;
use crate::scene::{Scene, Term};
use crate::surface::lattice_size;
use sizes::strips;
use work::{Counts, Work};

/// The plan of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Every term: whether it is used, the estimated change without it, and why.
    pub terms: Vec<PlannedTerm>,
    /// Numbers of pixels, waves and nodes.
    pub sizes: Sizes,
    /// Notes for the user about this scene.
    pub notes: Vec<String>,
    /// Pixels of the image.
    pub(crate) image_pixels: usize,
    /// Work of the stages.
    pub(crate) work: Work,
    /// One plan per ship.
    pub(crate) wakes: Vec<WakePlan>,
    /// Expected mean σ⁰ \[1\].
    pub(crate) mean_sigma0: f64,
    /// Variance of the hydrodynamic modulation by the resolved sea \[1\].
    pub(crate) modulation_variance: f64,
}

impl Plan {
    /// Whether a term is computed.
    #[must_use]
    pub fn uses(&self, term: Term) -> bool {
        self.terms.iter().any(|t| t.term == term && t.used)
    }

    /// Estimated cost of a simulation by this plan.
    #[must_use]
    pub fn cost(&self) -> Cost {
        Cost::new(self.sizes.computed, self.image_pixels, &self.work)
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
        Self::of(&Prepared::new(scene))
    }

    /// Plans a prepared scene.
    pub(crate) fn of(prepared: &Prepared<'_>) -> Result<Self> {
        let (scene, models) = (prepared.scene, &prepared.models);
        let tolerance = scene.model.tolerance;
        let first = &FirstOrder::new(models, &prepared.open);
        let weighed = estimates::weighed(prepared, &Amplitudes::new(first));
        let terms = terms::choose(&weighed, &scene.model.terms, tolerance);
        let uses = |term| terms.iter().any(|t| t.term == term && t.used);
        let margin = first.margin(models);
        let raster = models.pixels.computed.with_margin(margin[0], margin[1]);
        let mut sizes = Sizes {
            computed_spacing: raster.spacing,
            strips: strips(&raster, &models.pixels.image),
            margin,
            computed: [raster.rows, raster.columns],
            band: raster.nyquist_wavenumber(),
            sea_lattice: match uses(Term::Sea) {
                true => lattice_size(&models.sea, &raster),
                false => [0, 0],
            },
            wake_nodes: [0, 0],
            wake_directions: Vec::new(),
        };
        let measured = |wakes: &[WakePlan]| -> Result<Work> {
            let counts = Counts {
                prepared,
                first,
                sizes: &sizes,
                wakes,
            };
            let work = Work::of(&counts, uses);
            let (needed, advice) = work.bytes();
            let size = [scene.grid.rows, scene.grid.columns];
            memory::check(size, margin, needed, advice.text())?;
            Ok(work)
        };
        // Checked first without the wakes' waves, whose planning takes longer the more pixels there are.
        measured(&[])?;
        // Each ship gets a share, so that all together keep the tolerance.
        let share = SHARES.wake_nodes / models.wakes.len().max(1) as f64;
        let wakes = models.wakes.iter().filter(|_| uses(Term::Kelvin));
        let wakes = wakes.map(|wake| {
            let plan = wake.plan(&raster, share * tolerance);
            wake.with_ring_work(plan)
        });
        let wakes: Vec<WakePlan> = wakes.collect();
        let work = measured(&wakes)?;
        let nodes = |of: fn(&WakePlan) -> usize| wakes.iter().map(of).sum();
        sizes.wake_nodes = [nodes(|w| w.transverse_nodes), nodes(|w| w.divergent_nodes)];
        let zones = wakes.iter().flat_map(|wake| &wake.zones);
        sizes.wake_directions = zones.map(|z| z.directions.map(f64::to_degrees)).collect();
        Ok(Self {
            image_pixels: models.pixels.image.len(),
            sizes,
            terms,
            work,
            notes: notes::notes(prepared),
            wakes,
            mean_sigma0: first.mean_sigma0(),
            modulation_variance: first.modulation_variance,
        })
    }

    /// The computed pixels with their margin.
    pub(crate) fn with_margin(&self, computed: &Raster) -> Raster {
        let [rows, columns] = self.sizes.margin;
        computed.with_margin(rows, columns)
    }

    /// The same plan for the mean over all seas: no sea is drawn, and the effects of its waves are averaged.
    pub(crate) fn over_all_seas(mut self) -> Self {
        let bunching = self.uses(Term::VelocityBunching);
        for t in &mut self.terms {
            t.used = match t.term {
                Term::Sea | Term::Swell => false,
                Term::TiltAverage | Term::Specular => true,
                Term::AzimuthSmear => t.used || bunching,
                _ => t.used,
            };
        }
        self.sizes.sea_lattice = [0, 0];
        self
    }
}

/// Prints a table of the terms, then the sizes.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Raster;

    fn raster(rows: usize, columns: usize) -> Raster {
        Raster::image(rows, columns, 5.0)
    }

    fn plan(keys: &[&str]) -> Plan {
        let small = ["grid.rows=32", "grid.columns=48"];
        let scene = Scene::default().with_assignments(&small).unwrap();
        Plan::new(&scene.with_assignments(keys).unwrap()).unwrap()
    }

    /// One piece up to 2²⁵ pixels; beyond, strips of at most half as many, each with at least one row of the image.
    #[test]
    fn strips_hold_at_most_half_of_what_one_piece_may() {
        let image = raster(4000, 4000);
        assert_eq!(strips(&raster(4096, 8192), &image), 1);
        assert_eq!(strips(&raster(4097, 8192), &image), 3);
        for rows in [8192, 10_000, 32_768] {
            let computed = raster(rows, 10_000);
            let count = strips(&computed, &image);
            assert!(computed.len().div_ceil(count) <= 1 << 24, "{rows}");
            assert!(computed.len().div_ceil(count - 1) > 1 << 24, "{rows}");
        }
        assert_eq!(strips(&raster(1 << 20, 1 << 10), &raster(3, 9)), 3);
    }

    /// The counts grow with their causes: pixels, looks, waves of a turn, nodes of a table; the distance of a ship does not
    /// matter.
    #[test]
    fn work_is_counted() {
        let base = plan(&[]).cost();
        let looks = ["radar.sensor=sentinel-1-iw", "radar.looks=1000"];
        let [few, many] = [&looks[..1], &looks].map(|keys| plan(keys).cost());
        assert!(
            many.core_seconds > 1.5 * few.core_seconds,
            "{few:?} {many:?}"
        );
        assert_eq!(many.bytes, few.bytes);
        assert!(many.to_string().contains("radar.looks"), "{many}");
        for rate in ["0.9", "-0.1"] {
            let turn = plan(&[&format!("ship.turn_rate={rate}")]).cost();
            assert!(turn.core_seconds > 2.0 * base.core_seconds && turn.bytes > base.bytes);
            assert!(turn.to_string().contains("ship.turn_rate"), "{turn}");
        }
        let finest = plan(&["model.tolerance=1e-6", "radar.sensor=terrasar-x-sm"]);
        assert!(finest.work.table > 1e6 && finest.work.table <= (1u64 << 22) as f64);
        for far in ["1e7", "1e300"] {
            let cost = plan(&[&format!("ship.position=[{far}, {far}]")]).cost();
            assert!(
                cost.core_seconds < 2.0 * base.core_seconds && cost.bytes <= 2 * base.bytes,
                "{far}"
            );
        }
        // Strips hold only a part of the pixels at once.
        let large = plan(&["grid.rows=16384", "grid.columns=4096", "model.terms=[]"]);
        assert!(large.sizes.strips > 2 && large.work.at_once < 0.5 * large.work.whole[0]);
        assert!(large.work.computed >= large.work.whole[0]);
    }

    /// A wide turn in a large image has more waves than fit in memory: refused, with advice on what to change.
    #[test]
    fn waves_of_a_turn_count_as_memory() {
        let keys = [
            "grid.rows=16384",
            "grid.columns=8",
            "radar.sensor=sentinel-1-ew",
            "ship.heading=180",
            "ship.turn_rate=0.006",
        ];
        let scene = Scene::default().with_assignments(&keys).unwrap();
        match Plan::new(&scene) {
            Err(error) => assert!(error.to_string().contains("ship.turn_rate"), "{error}"),
            // If there is enough memory, or the system does not report it.
            Ok(plan) => assert!(plan.cost().bytes > 10 << 30),
        }
    }

    /// Only unused terms are summed, and speckle is not part of the image before speckle.
    #[test]
    fn what_is_left_out_is_summed_without_speckle() {
        let mut plan = plan(&[]);
        for term in &mut plan.terms {
            (term.used, term.estimate) = match term.term {
                Term::Sea => (true, 1.0),
                Term::Kelvin => (false, 0.25),
                Term::Specular => (false, 0.5),
                Term::Speckle => (false, 8.0),
                _ => (true, 16.0),
            };
        }
        assert!((plan.left_out() - 0.75).abs() < 1e-15);
        assert!(plan.uses(Term::Sea) && !plan.uses(Term::Kelvin) && !plan.uses(Term::Speckle));
        plan.terms.clear();
        assert!(!plan.uses(Term::Sea));
    }

    /// The mean over all seas draws no sea, and averages over the effects of its waves.
    #[test]
    fn the_mean_over_all_seas_draws_no_sea() {
        let rough = [
            "model.terms=all",
            "sea.swell_height=1",
            "sea.gust_strength=0.1",
        ];
        let one = plan(&rough);
        assert!(one.uses(Term::Sea) && one.sizes.sea_lattice != [0, 0]);
        assert!(one.uses(Term::Swell) && one.uses(Term::Gusts));
        let mean = one.over_all_seas();
        for term in [Term::Sea, Term::Swell] {
            assert!(!mean.uses(term), "{term:?}");
        }
        for term in [
            Term::Gusts,
            Term::TiltAverage,
            Term::Specular,
            Term::AzimuthSmear,
            Term::Kelvin,
        ] {
            assert!(mean.uses(term), "{term:?}");
        }
        assert_eq!(mean.sizes.sea_lattice, [0, 0]);
        // Displaced pixels smear: coherence is averaged over if bunching is computed, and only then.
        for (terms, smeared) in [("[\"sea\", \"bunching\"]", true), ("[\"sea\"]", false)] {
            let of_list = plan(&[&format!("model.terms={terms}")]).over_all_seas();
            assert_eq!(of_list.uses(Term::AzimuthSmear), smeared, "{terms}");
        }
    }

    /// Sizes match the computed pixels: the image and its margins.
    #[test]
    fn sizes_are_those_of_the_image_and_its_margins() {
        let of_ship = plan(&[]);
        let s = &of_ship.sizes;
        let around = [32 + 2 * s.margin[0], 48 + 2 * s.margin[1]];
        assert_eq!((s.computed, s.strips), (around, 1));
        assert!((s.band - std::f64::consts::PI / s.computed_spacing).abs() < 1e-15);
        assert!((0..2).all(|axis| s.sea_lattice[axis] >= s.computed[axis]));
        let planned: usize = of_ship.wakes.iter().map(WakePlan::nodes).sum();
        assert_eq!(s.wake_nodes[0] + s.wake_nodes[1], planned);
        assert!(s.wake_nodes.iter().all(|&nodes| nodes > 0));
        // Degrees to the track: transverse waves within 35.26°, divergent ones beyond.
        let [low, high] = [0, 1].map(|end| s.wake_directions.iter().map(move |d| d[end]));
        assert!(low.fold(90.0, f64::min) < 35.0 && high.fold(0.0, f64::max) > 36.0);
        let empty = plan(&["model.terms=[]"]);
        assert_eq!(
            (empty.sizes.sea_lattice, empty.sizes.wake_nodes),
            ([0, 0], [0, 0])
        );
    }

    /// The table names each term once, and gives the sizes in order.
    #[test]
    fn the_table_says_what_the_plan_holds() {
        let plan = plan(&[]);
        let text = plan.to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), plan.terms.len() + 2);
        for (line, term) in lines[1..].iter().zip(&plan.terms) {
            let words: Vec<&str> = line.split_whitespace().collect();
            let used = if term.used { "yes" } else { "no" };
            assert_eq!(words[..2], [term.term.name(), used], "{line}");
        }
        let [rows, columns] = plan.sizes.computed;
        let beginning = format!("computed {rows} x {columns} pixels");
        let last = lines[lines.len() - 1];
        assert!(
            last.starts_with(&beginning) && last.contains("one piece"),
            "{last}"
        );
    }

    /// Ships share the error budget of the nodes: their bounds add up to the bound of one ship.
    #[test]
    fn ships_share_the_tolerance() {
        let one = plan(&["model.terms=all"]);
        let alone = one.wakes[0].error_bound;
        let mut scene = Scene::default()
            .with_assignments(&["grid.rows=32", "grid.columns=48"])
            .unwrap();
        scene.ships = vec![scene.ships[0].clone(); 3];
        let three = Plan::new(&scene).unwrap();
        let sum: f64 = three.wakes.iter().map(|wake| wake.error_bound).sum();
        assert!(three.wakes.len() == 3 && (sum / alone - 1.0).abs() < 1e-12);
    }

    /// σ⁰ is the sum of Bragg and specular returns, both present near nadir.
    #[test]
    fn the_mean_is_the_sum_of_both_returns() {
        let scene = Scene::default()
            .with_assignments(&["radar.incidence=15"])
            .unwrap();
        let prepared = Prepared::new(&scene);
        let [bragg, specular] = FirstOrder::new(&prepared.models, &prepared.open).mean;
        assert!(bragg > 0.0 && specular > 0.1 * bragg);
        let plan = Plan::new(&scene).unwrap();
        assert!((plan.mean_sigma0 / (bragg + specular) - 1.0).abs() < 1e-15);
    }
}
