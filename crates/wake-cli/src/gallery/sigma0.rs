//! Plot of open-sea σ⁰ against incidence and wind, at C band with CMOD5.N.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use wake_physics::permittivity::sea_water;
use wake_physics::reference::cmod5n;
use wake_physics::scattering::{Backscatter, Polarization, Specular, TwoScale};
use wake_physics::spectrum::Elfouhaily;
use wake_physics::spectrum::elfouhaily::{DragLaw, FULLY_DEVELOPED};

use crate::exit::Outcome;

/// Frequencies \[Hz\]: C band, for which CMOD5.N was fitted, and the default X band.
const C_BAND: f64 = 5.3e9;
const X_BAND: f64 = 9.6e9;
/// Wind speeds \[m/s\], each with a colour.
const WINDS: [(f64, RGBColor); 4] = [
    (3.0, RGBColor(31, 119, 180)),
    (5.0, RGBColor(44, 160, 44)),
    (7.0, RGBColor(230, 120, 0)),
    (10.0, RGBColor(214, 39, 40)),
];
/// Range of incidence \[deg\], and number of steps in it.
const INCIDENCE: [f64; 2] = [20.0, 50.0];
const STEPS: u32 = 30;
/// Range of σ⁰ \[dB\].
const DECIBELS: [f64; 2] = [-32.0, 4.0];
/// Speed of light \[m/s\].
const LIGHT: f64 = 299_792_458.0;
/// Wind directions: name, unit vector, and angle from upwind \[rad\].
const UPWIND: (&str, [f64; 2], f64) = ("upwind", [-1.0, 0.0], 0.0);
const CROSSWIND: (&str, [f64; 2], f64) = ("across the wind", [0.0, 1.0], FRAC_PI_2);

/// Draws three panels: C band upwind and crosswind with CMOD5.N as dots, and X band upwind, for which there is no such
/// model here.
pub(crate) fn draw(path: &Path) -> Outcome<()> {
    let area = SVGBackend::new(path, (1080, 420)).into_drawing_area();
    area.fill(&WHITE)?;
    let panels = area.split_evenly((1, 3));
    panel(&panels[0], "C band VV", C_BAND, UPWIND, true)?;
    panel(&panels[1], "C band VV", C_BAND, CROSSWIND, true)?;
    panel(&panels[2], "X band VV", X_BAND, UPWIND, false)?;
    area.present()?;
    Ok(())
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn panel(
    area: &Area<'_>,
    band: &str,
    frequency: f64,
    (name, wind, phi): (&str, [f64; 2], f64),
    beside: bool,
) -> Outcome<()> {
    let mut chart: Chart<'_> = ChartBuilder::on(area)
        .caption(format!("{band}, {name}"), ("sans-serif", 17))
        .margin(10)
        .x_label_area_size(36)
        .y_label_area_size(44)
        .build_cartesian_2d(INCIDENCE[0]..INCIDENCE[1], DECIBELS[0]..DECIBELS[1])?;
    chart
        .configure_mesh()
        .x_desc("incidence, degrees")
        .y_desc("NRCS, dB")
        .draw()?;
    let degrees = || (0..=STEPS).map(|n| INCIDENCE[0] + f64::from(n));
    for (speed, colour) in WINDS {
        let ours = degrees().map(|at| (at, two_scale(frequency, at, speed, wind)));
        chart
            .draw_series(LineSeries::new(ours, colour.stroke_width(2)))?
            .label(format!("{speed} m/s"))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        if beside {
            let others = degrees().step_by(3).map(|at| {
                let place = (at, decibels(cmod5n(speed, phi, at)));
                Circle::new(place, 3, colour.filled())
            });
            chart.draw_series(others)?;
        }
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .position(SeriesLabelPosition::UpperRight)
        .draw()?;
    Ok(())
}

/// Mean σ⁰ of a fully developed open sea by two-scale and specular theory \[dB\].
fn two_scale(frequency: f64, degrees: f64, speed: f64, wind: [f64; 2]) -> f64 {
    let (incidence, permittivity) = (degrees.to_radians(), sea_water(frequency, 20.0, 35.0));
    let spectrum = Elfouhaily::of_age(speed, FULLY_DEVELOPED, DragLaw::Wu);
    let wavenumber = TAU * frequency / LIGHT;
    let polarization = Polarization::VV;
    let two_scale = TwoScale::new(
        incidence,
        wavenumber,
        polarization,
        permittivity,
        spectrum,
        wind,
    );
    let tilt = two_scale.slopes_from(0.0);
    let model = Backscatter {
        specular: Specular::new(permittivity, incidence, &tilt, 0.0),
        two_scale,
        tilt,
    };
    decibels(model.parts([0.0; 2]).iter().sum())
}

fn decibels(value: f64) -> f64 {
    10.0 * value.log10()
}
