//! Random valid scenes over all keys, to the ends of their ranges.

use proptest::prelude::*;
use std::f64::consts::TAU;
use wake_physics::Scene;
use wake_physics::constants::GRAVITY;
use wake_physics::scene::{
    Grid, HullForm, Model, Polarization, Radar, Recovery, Sea, Sensor, Ship,
};
use wake_physics::scene::{SpectrumModel, SpreadingModel, Term, TermRule, Terms};
use wake_physics::window::Window;

/// An end of a range, or anything between.
pub(crate) fn ends(min: f64, max: f64) -> impl Strategy<Value = f64> {
    prop_oneof![1 => Just(min), 1 => Just(max), 6 => min..=max]
}

/// The same of a range of several decades, whose parts count alike.
fn decades(min: f64, max: f64) -> impl Strategy<Value = f64> {
    let between = (min.ln()..=max.ln()).prop_map(move |ln| ln.exp().clamp(min, max));
    prop_oneof![1 => Just(min), 1 => Just(max), 6 => between]
}

/// A key that may be absent.
fn maybe<T: std::fmt::Debug>(value: impl Strategy<Value = T>) -> impl Strategy<Value = Option<T>> {
    proptest::option::weighted(0.3, value)
}

fn direction() -> impl Strategy<Value = f64> {
    prop_oneof![-720.0..=720.0_f64, Just(90.0), Just(-1e300)]
}

prop_compose! {
    /// - `most`: rows and columns at most
    fn grid(most: usize)(
        rows in decades(1.0, most as f64),
        columns in decades(1.0, most as f64),
        spacing in decades(0.1, 100.0),
        oversampling in maybe(1..=16_u32),
    ) -> Grid {
        Grid { rows: rows as usize, columns: columns as usize, spacing, oversampling }
    }
}

prop_compose! {
    fn sea()(
        (wind_speed, wind_toward, fetch) in (ends(0.0, 30.0), direction(), decades(100.0, 1e7)),
        (spectrum, spreading) in (0..3_usize, 0..3_usize),
        depth in prop_oneof![2 => Just(f64::INFINITY), 1 => decades(1.0, 1000.0)],
        time in prop_oneof![1 => Just(0.0), 1 => decades(1.0, 1e5)],
        (temperature, salinity) in (ends(-2.0, 40.0), ends(0.0, 45.0)),
        (gust_strength, gust_scale) in (prop_oneof![Just(0.0), ends(0.0, 0.5)], decades(100.0, 5e4)),
        (swell_height, swell_length, swell_toward) in
            (prop_oneof![Just(0.0), ends(0.0, 15.0)], decades(30.0, 1000.0), direction()),
        (mottle_strength, mottle_scale) in (prop_oneof![3 => Just(0.0), 1 => ends(0.0, 0.5)], decades(20.0, 5e3)),
        breaking in any::<bool>(),
        (slick_damping, slick_width, slick_scale) in
            (prop_oneof![Just(0.0), ends(0.0, 1.0)], decades(5.0, 1000.0), decades(100.0, 5e4)),
    ) -> Sea {
        let spectra = [SpectrumModel::Elfouhaily, SpectrumModel::Jonswap, SpectrumModel::PiersonMoskowitz];
        let spreads = [SpreadingModel::Hasselmann, SpreadingModel::Mitsuyasu, SpreadingModel::Elfouhaily];
        Sea {
            wind_speed, wind_toward, fetch, depth, time, temperature, salinity, gust_strength, gust_scale,
            mottle_strength, mottle_scale, swell_height,
            swell_length, swell_toward, breaking, slick_damping, slick_width, slick_scale,
            spectrum: spectra[spectrum],
            spreading: spreads[spreading],
        }
    }
}

/// A place of a ship: in and around small images, far away, and at the ends of what a number holds.
fn coordinate() -> impl Strategy<Value = f64> {
    let sizes =
        prop_oneof![6 => decades(10.0, 1e4), 2 => decades(1e4, 1e9), 1 => decades(1e9, f64::MAX)];
    prop_oneof![1 => Just(0.0), 4 => sizes.clone(), 4 => sizes.prop_map(|size| -size)]
}

prop_compose! {
    fn ship()(
        length in decades(1.0, 500.0),
        shape in (ends(0.2, 0.99), ends(0.1, 0.99)),
        (speed, heading) in (prop_oneof![ends(0.0, 40.0), 2.0..=15.0_f64], direction()),
        turn in maybe((ends(0.0, 1.0), any::<bool>())),
        position in (coordinate(), coordinate()),
        block_coefficient in maybe(ends(0.45, 0.9)),
        (full, echo, edge) in (any::<bool>(), any::<bool>(), any::<bool>()),
        filter_depth in prop_oneof![Just(0.0), ends(0.0, 20.0)],
        steepness in maybe(ends(0.02, 1.0)),
        (damping, windy) in (prop_oneof![Just(0.6), ends(0.0, 1.0)], any::<bool>()),
        edge_time in maybe(ends(0.0, 1000.0)),
        (edge_outflow, roll) in (ends(0.0, 0.3), ends(0.0, 2.0)),
        (roll_period, scatterers, halo) in (maybe(ends(4.0, 60.0)), maybe(1..=1000u32), maybe(ends(-40.0, 0.0))),
    ) -> Ship {
        // Radii from the narrowest turn to the widest, whose decades count alike.
        let narrowest = 2.0 * length.max(TAU * speed * speed / GRAVITY) * (1.0 + 1e-9);
        let radius = |part: f64| narrowest * (1e5 * (1.0 - 1e-9) / narrowest).powf(part);
        let rate = |(part, port): (f64, bool)| {
            let rate = (speed / radius(part)).to_degrees().min(10.0);
            if port { -rate } else { rate }
        };
        Ship {
            length,
            beam: (shape.0 * length).clamp(0.2, 100.0),
            draft: (shape.1 * length).clamp(0.1, 40.0),
            speed,
            heading,
            turn_rate: turn.filter(|_| speed > 0.0).map_or(0.0, rate),
            position: position.into(),
            hull: if full { HullForm::Full } else { HullForm::Wigley },
            block_coefficient: block_coefficient.filter(|_| full),
            echo,
            filter_depth,
            steepness,
            damping,
            recovery: if windy { Recovery::Wind } else { Recovery::Constant },
            edge,
            edge_time: edge_time.filter(|_| edge),
            edge_outflow: if edge { edge_outflow } else { 0.0 },
            roll: if echo { roll } else { 0.0 },
            roll_period: roll_period.filter(|_| echo),
            scatterers: scatterers.filter(|_| echo),
            halo: halo.filter(|_| echo),
        }
    }
}

fn window() -> impl Strategy<Value = Window> {
    prop_oneof![
        Just(Window::Uniform),
        ends(0.5, 1.0).prop_map(Window::Hamming),
        ends(0.0, 10.0).prop_map(Window::Kaiser),
    ]
}

fn looks() -> impl Strategy<Value = u32> {
    decades(1.0, 1000.0).prop_map(|looks| looks as u32)
}

prop_compose! {
    fn radar_of_keys()(
        (frequency, incidence) in (decades(1e9, 2e10), ends(5.0, 75.0)),
        horizontal in any::<bool>(),
        (range_to_velocity, azimuth_resolution) in (ends(0.0, 200.0), decades(0.5, 100.0)),
        range_resolution in maybe(decades(0.5, 500.0)),
        windows in (maybe(window()), maybe(window())),
        (looks, look_overlap) in (looks(), maybe(ends(0.0, 0.9))),
        nesz in maybe(ends(-60.0, 20.0)),
        (ambiguity, prf) in (maybe(ends(-60.0, 0.0)), decades(100.0, 2e4)),
        paired_echoes in maybe(ends(-40.0, 0.0)),
        relaxation_rate in maybe(decades(0.01, 100.0)),
    ) -> Radar {
        let responds = range_resolution.is_some();
        let ambiguity = ambiguity.filter(|_| responds);
        Radar {
            sensor: None,
            frequency,
            polarization: if horizontal { Polarization::HH } else { Polarization::VV },
            incidence,
            range_to_velocity,
            azimuth_resolution,
            range_resolution,
            window: windows.0.filter(|_| responds),
            azimuth_window: windows.1.filter(|_| responds),
            looks,
            look_overlap: look_overlap.filter(|_| responds),
            nesz,
            azimuth_ambiguity: ambiguity,
            prf: ambiguity.map(|_| prf),
            paired_echoes: paired_echoes.filter(|_| responds),
            relaxation_rate,
        }
    }
}

prop_compose! {
    /// A satellite's radar with its spacing of pixels, and looks of its own or others.
    fn satellite()(
        sensor in proptest::sample::select(Sensor::ALL.to_vec()),
        looks in maybe(looks()),
    ) -> (Radar, f64) {
        let name = serde_json::to_string(&sensor).expect("a name");
        let scene = Scene::from_toml(&format!("[radar]\nsensor = {name}")).expect("a sensor");
        let mut radar = scene.radar;
        radar.looks = looks.unwrap_or(radar.looks);
        (radar, scene.grid.spacing)
    }
}

/// A radar, and the spacing of its pixels where it has one \[m\].
fn radar() -> impl Strategy<Value = (Radar, Option<f64>)> {
    prop_oneof![
        2 => radar_of_keys().prop_map(|radar| (radar, None)),
        1 => satellite().prop_map(|(radar, spacing)| (radar, Some(spacing))),
    ]
}

pub(crate) fn terms() -> impl Strategy<Value = Terms> {
    prop_oneof![
        3 => Just(Terms::Rule(TermRule::Needed)),
        1 => Just(Terms::Rule(TermRule::All)),
        1 => proptest::sample::subsequence(Term::ALL.to_vec(), 1..=Term::ALL.len()).prop_map(Terms::List),
    ]
}

prop_compose! {
    /// - `most`: rows and columns at most
    pub(crate) fn scene(most: usize)(
        seed in any::<u64>(),
        grid in grid(most),
        sea in sea(),
        ships in prop_oneof![
            1 => proptest::collection::vec(ship(), 0..=0),
            6 => proptest::collection::vec(ship(), 1..=1),
            2 => proptest::collection::vec(ship(), 2..=4),
        ],
        (radar, spacing) in radar(),
        terms in terms(),
        tolerance in decades(1e-6, 0.1),
    ) -> Scene {
        let grid = Grid { spacing: spacing.unwrap_or(grid.spacing), ..grid };
        Scene { seed, grid, sea, ships, radar, model: Model { terms, tolerance } }
    }
}
