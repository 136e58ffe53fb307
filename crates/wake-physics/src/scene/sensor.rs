//! Imaging satellites: the radar keys that each mode sets, with the source of every number.

use super::polarization::Polarization;
use crate::constants::SPEED_OF_LIGHT;
use crate::window::Window;
use serde::{Deserialize, Serialize};

/// Mean radius of the Earth \[m\] (IUGG, rounded).
const EARTH_RADIUS: f64 = 6.371e6;

/// Gravitational constant times the mass of the Earth [m³/s²] (IAU 2015 nominal value).
const EARTH_GRAVITY: f64 = 3.986_004e14;

/// Noise-equivalent cross-section where no published value was found \[dB\]: chosen.
const CHOSEN_NOISE: f64 = -22.0;

/// Resolution in range \[m\], constant over the swath either in slant range or in ground range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RangeResolution {
    /// In slant range: one bandwidth for the whole swath.
    Slant(f64),
    /// In ground range: the bandwidth changes with incidence.
    Ground(f64),
}

/// Values that a sensor sets.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SensorMode {
    /// Frequency \[Hz\].
    pub frequency: f64,
    /// Polarization, unless the scene sets it.
    pub polarization: Polarization,
    /// Height of the orbit over a spherical Earth \[m\].
    pub altitude: f64,
    /// Incidence \[deg\], unless the scene sets it.
    pub incidence: f64,
    /// Smallest and largest incidence that the mode images \[deg\].
    pub incidence_range: [f64; 2],
    /// Pixel spacing in ground range and azimuth \[m\].
    pub spacing: f64,
    /// Single-look resolution in range; see [`Self::range_resolution_at`].
    pub range_resolution: RangeResolution,
    /// Single-look resolution in azimuth \[m\].
    pub azimuth_resolution: f64,
    /// Windows in range and azimuth.
    pub windows: [Window; 2],
    /// Number of looks, and the overlap of adjacent looks as a share of a look's band.
    pub looks: (u32, f64),
    /// Noise-equivalent cross-section σ⁰ \[dB\].
    pub nesz: f64,
    /// Pulse repetition frequency \[Hz\].
    pub prf: f64,
}

/// The sensors, each with its name in scene files and the numbers of its mode.
macro_rules! sensors {
    ($($sensor:ident = $name:literal => $mode:expr,)*) => {
        /// A satellite and one of its modes.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
        #[expect(missing_docs, reason = "the names of the satellites and their modes")]
        #[non_exhaustive]
        pub enum Sensor {
            $(#[serde(rename = $name)] $sensor,)*
        }

        impl Sensor {
            /// Every sensor.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$sensor),*];

            /// Returns the numbers of the mode. Those marked "chosen" in the source are plausible, but not from a document.
            #[must_use]
            pub fn mode(self) -> SensorMode {
                match self {
                    $(Self::$sensor => $mode,)*
                }
            }
        }
    };
}

sensors! {
    Sentinel1Iw = "sentinel-1-iw" => sentinel_1_iw(),
    Sentinel1Ew = "sentinel-1-ew" => sentinel_1_ew(),
    TerraSarXSm = "terrasar-x-sm" => terrasar_x_sm(),
    CosmoSkyMedHi = "cosmo-skymed-hi" => cosmo_skymed_hi(),
    IceyeStrip = "iceye-strip" => iceye_strip(),
    // Spacing 2.5, 3.1, 6.25 m and resolution: distributor's table. Noise, windows: chosen.
    Alos2Sm3 = "alos-2-sm3" => alos_2(2.5, [3.0, 3.0], 1, -24.0),
    Alos2Sm6 = "alos-2-sm6" => alos_2(3.125, [6.0, 4.3], 1, -28.0),
    Alos2Sm10 = "alos-2-sm10" => alos_2(6.25, [9.1, 5.3], 2, -26.0),
    Radarsat2S = "radarsat-2-s" => radarsat_2_s(),
    NovaSar1 = "novasar-1" => novasar_1(),
    Ers2Pri = "ers-2-pri" => ers_2_pri(),
    CosmoSkyMedDgm = "cosmo-skymed-dgm" => cosmo_skymed_dgm(),
    AlosFbs = "alos-fbs" => alos_fbs(),
}

/// Interferometric wide swath, ground range detected, high resolution; Sentinel-1A to 1D have the same radar and orbit.
///
/// Frequency, windows, looks and overlap (3.5 of 14.1 MHz), noise, pulse rate (of IW1) and resolution: annotation of a
/// product of 12 June 2022. Azimuth has no window, as measured in its image of the sea.
fn sentinel_1_iw() -> SensorMode {
    SensorMode {
        frequency: 5.405e9,
        polarization: Polarization::VV,
        altitude: 698e3,
        incidence: 38.7,
        incidence_range: [30.1, 46.0],
        spacing: 10.0,
        // 14.1 MHz and Hamming 0.70 in the first sub-swath; the bandwidths of the others give 19.6 and 19.5 m.
        range_resolution: RangeResolution::Ground(20.3),
        azimuth_resolution: 18.4,
        windows: [Window::Hamming(0.70), Window::Uniform],
        looks: (5, 0.25),
        nesz: -25.0,
        prf: 1717.0,
    }
}

/// Extra-wide swath, ground range detected, medium resolution. Resolution, looks, noise and pulse rate: chosen.
fn sentinel_1_ew() -> SensorMode {
    SensorMode {
        polarization: Polarization::HH,
        incidence: 33.0,
        incidence_range: [19.0, 47.0],
        spacing: 40.0,
        range_resolution: RangeResolution::Ground(93.0),
        azimuth_resolution: 87.0,
        looks: (12, 0.25),
        nesz: CHOSEN_NOISE,
        prf: 1700.0,
        ..sentinel_1_iw()
    }
}

/// Stripmap. Incidence: product specification TX-GS-DD-3302. Spacing, resolution, window, noise, pulse rate: chosen.
fn terrasar_x_sm() -> SensorMode {
    SensorMode {
        frequency: 9.65e9,
        polarization: Polarization::VV,
        altitude: 514e3,
        incidence: 32.0,
        incidence_range: [19.7, 45.5],
        spacing: 1.25,
        range_resolution: slant(3.0, 32.0),
        azimuth_resolution: 3.3,
        windows: [Window::Hamming(0.6); 2],
        looks: (1, 0.0),
        nesz: CHOSEN_NOISE,
        prf: 3800.0,
    }
}

/// Himage stripmap. Altitude, resolution: the mission's pages. Spacing, window, noise, pulse rate: chosen.
fn cosmo_skymed_hi() -> SensorMode {
    SensorMode {
        frequency: 9.6e9,
        polarization: Polarization::VV,
        altitude: 619.6e3,
        incidence: 35.0,
        incidence_range: [20.0, 59.0],
        spacing: 2.5,
        range_resolution: slant(3.0, 35.0),
        azimuth_resolution: 3.0,
        windows: [Window::Hamming(0.75); 2],
        looks: (1, 0.0),
        nesz: -20.0,
        prf: 3100.0,
    }
}

/// Himage stripmap as delivered: detected, multi-looked to 5 m, in ground range (DGM). Resolution, spacing, looks: the
/// mission's product description, quoted from memory, not verified. The rest as [`cosmo_skymed_hi`].
fn cosmo_skymed_dgm() -> SensorMode {
    SensorMode {
        spacing: 2.5,
        range_resolution: RangeResolution::Ground(5.0),
        azimuth_resolution: 5.0,
        looks: (3, 0.0),
        ..cosmo_skymed_hi()
    }
}

/// Fine beam single of PALSAR on ALOS, level 1.5. Frequency, altitude, incidence, spacing, resolution, looks, noise: the user
/// handbook of 2008, quoted from memory, not verified. Windows, pulse rate: chosen.
fn alos_fbs() -> SensorMode {
    SensorMode {
        frequency: 1.27e9,
        polarization: Polarization::HH,
        altitude: 691.65e3,
        incidence: 38.7,
        incidence_range: [8.0, 60.0],
        spacing: 6.25,
        range_resolution: slant(10.0, 38.7),
        azimuth_resolution: 10.0,
        windows: [Window::Hamming(0.75); 2],
        looks: (2, 0.0),
        nesz: -23.0,
        prf: 2100.0,
    }
}

/// Strip. Altitude, resolution: pages of ESA and EARSC. Incidence, spacing, window, looks, noise, pulse rate: chosen.
fn iceye_strip() -> SensorMode {
    SensorMode {
        frequency: 9.65e9,
        polarization: Polarization::VV,
        altitude: 570e3,
        incidence: 22.0,
        incidence_range: [15.0, 30.0],
        spacing: 2.5,
        range_resolution: slant(3.0, 22.0),
        azimuth_resolution: 3.0,
        windows: [Window::Hamming(0.75); 2],
        looks: (1, 0.0),
        nesz: -18.0,
        prf: 5000.0,
    }
}

/// Stripmap of PALSAR-2. Frequency, altitude, incidence, resolution: distributor's table. The rest: chosen.
fn alos_2(spacing: f64, resolution: [f64; 2], looks: u32, nesz: f64) -> SensorMode {
    SensorMode {
        frequency: 1.26e9,
        polarization: Polarization::HH,
        altitude: 628e3,
        incidence: 35.0,
        incidence_range: [8.0, 70.0],
        spacing,
        range_resolution: slant(resolution[0], 35.0),
        azimuth_resolution: resolution[1],
        windows: [Window::Hamming(0.75); 2],
        looks: (looks, 0.0),
        nesz,
        prf: 2100.0,
    }
}

/// Standard beams. Altitude, incidence, spacing, resolution, looks: product table. Overlap, noise, pulse rate: chosen.
fn radarsat_2_s() -> SensorMode {
    SensorMode {
        frequency: 5.405e9,
        polarization: Polarization::VV,
        altitude: 798e3,
        incidence: 36.0,
        incidence_range: [20.0, 52.0],
        spacing: 12.5,
        // Within the table's 26.8 to 17.3 m from the nearest to the farthest beam: each beam has its own bandwidth.
        range_resolution: RangeResolution::Ground(21.0),
        azimuth_resolution: 24.7,
        windows: [Window::Hamming(0.75); 2],
        looks: (4, 0.5),
        nesz: -28.0,
        prf: 1300.0,
    }
}

/// Stripmap of 6 m. Incidence, resolution, looks: reader's help. Altitude, spacing, window, noise, pulse rate: chosen.
fn novasar_1() -> SensorMode {
    SensorMode {
        frequency: 3.2e9,
        polarization: Polarization::HH,
        altitude: 583e3,
        incidence: 24.0,
        incidence_range: [16.0, 31.0],
        spacing: 3.0,
        range_resolution: slant(6.0, 24.0),
        azimuth_resolution: 6.0,
        windows: [Window::Hamming(0.75); 2],
        looks: (3, 0.0),
        nesz: -17.0,
        prf: 3000.0,
    }
}

/// Precision image. Altitude, incidence, spacing, looks: ESA SP-1199. Resolution, overlap, noise, pulse rate: chosen.
fn ers_2_pri() -> SensorMode {
    SensorMode {
        frequency: 5.3e9,
        polarization: Polarization::VV,
        altitude: 785e3,
        incidence: 23.0,
        incidence_range: [19.4, 26.6],
        spacing: 12.5,
        range_resolution: slant(26.0, 23.0),
        azimuth_resolution: 22.0,
        windows: [Window::Hamming(0.75); 2],
        looks: (3, 0.4),
        nesz: -24.0,
        prf: 1680.0,
    }
}

/// Constant resolution in slant range, given in ground range \[m\] at an incidence \[deg\].
fn slant(ground: f64, incidence: f64) -> RangeResolution {
    RangeResolution::Slant(ground * incidence.to_radians().sin())
}

impl SensorMode {
    /// Ratio R/V of slant range and platform speed \[s\] at an incidence \[deg\], see [`range_to_velocity`].
    #[must_use]
    pub fn range_to_velocity_at(&self, incidence: f64) -> f64 {
        range_to_velocity(self.altitude, incidence.to_radians())
    }

    /// Resolution in ground range \[m\] at an incidence \[deg\].
    #[must_use]
    pub fn range_resolution_at(&self, incidence: f64) -> f64 {
        match self.range_resolution {
            RangeResolution::Slant(slant) => ground_range(slant, incidence),
            RangeResolution::Ground(ground) => ground,
        }
    }
}

/// Ratio R/V of slant range and platform speed \[s\]: azimuth displacement on the ground per 1 m/s along the line of sight.
///
/// ```text
/// R = √((r + h)² − r² sin²θ) − r cos θ,     V = √(GM/(r + h))
/// ```
///
/// for a circular orbit at the height h over a sphere of radius r. A point that approaches at the speed u is shifted in time
/// by u R/(V `V_g`), with `V_g` the speed of the beam on the ground, so by u R/V on the ground.
///
/// - `altitude` h \[m\]; `incidence` θ \[rad\], at the ground, 0 to π/2
#[must_use]
pub fn range_to_velocity(altitude: f64, incidence: f64) -> f64 {
    let orbit = EARTH_RADIUS + altitude;
    let (sin, cos) = incidence.sin_cos();
    let range = (orbit * orbit - (EARTH_RADIUS * sin).powi(2)).sqrt() - EARTH_RADIUS * cos;
    range / (EARTH_GRAVITY / orbit).sqrt()
}

/// Azimuth distance of the first ambiguity \[m\]: the displacement by a Doppler shift of one pulse repetition frequency.
///
/// ```text
/// Δy = PRF λ β/2,     β = R/V
/// ```
#[must_use]
pub fn ambiguity_distance(prf: f64, frequency: f64, range_to_velocity: f64) -> f64 {
    0.5 * prf * SPEED_OF_LIGHT / frequency * range_to_velocity
}

/// Resolution in slant range \[m\] of a bandwidth \[Hz\]: ρB c/(2B).
#[must_use]
pub fn slant_resolution(bandwidth: f64, window: Window) -> f64 {
    window.width() * SPEED_OF_LIGHT / (2.0 * bandwidth)
}

/// Length in ground range \[m\] of a length in slant range \[m\], such as a resolution, at an incidence \[deg\].
#[must_use]
pub fn ground_range(slant: f64, incidence: f64) -> f64 {
    slant / incidence.to_radians().sin()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// β agrees with tabulated values of each orbit and incidence to the digits printed; the modes of ALOS-2 share one value.
    #[test]
    fn range_to_velocity_of_the_orbits() {
        let table = [
            (Sensor::Sentinel1Iw, 115.0, 0.6),
            (Sensor::Sentinel1Ew, 109.0, 0.6),
            (Sensor::TerraSarXSm, 78.5, 0.06),
            (Sensor::CosmoSkyMedHi, 98.0, 0.6),
            (Sensor::IceyeStrip, 81.0, 0.6),
            (Sensor::Alos2Sm6, 99.0, 0.6),
            (Sensor::Radarsat2S, 129.0, 0.6),
            (Sensor::NovaSar1, 84.0, 0.6),
            (Sensor::Ers2Pri, 113.0, 0.6),
        ];
        for (sensor, expected, rounding) in table {
            let mode = sensor.mode();
            let beta = mode.range_to_velocity_at(mode.incidence);
            assert!((beta - expected).abs() < rounding, "{sensor:?}: {beta}");
        }
        // At nadir the range is the altitude; at the horizon it is the tangent.
        let speed = |h: f64| (EARTH_GRAVITY / (EARTH_RADIUS + h)).sqrt();
        let h = 7e5;
        assert!((range_to_velocity(h, 0.0) * speed(h) / h - 1.0).abs() < 1e-12);
        let tangent = (h * (2.0 * EARTH_RADIUS + h)).sqrt();
        let grazing = range_to_velocity(h, std::f64::consts::FRAC_PI_2);
        assert!((grazing * speed(h) / tangent - 1.0).abs() < 1e-12);
    }

    /// Distance of the first ambiguity in kilometres; for Sentinel-1 IW, 5 km for its three sub-swaths together.
    #[test]
    fn ambiguities_lie_where_tabulated() {
        for (sensor, expected, rounding) in [
            (Sensor::Sentinel1Iw, 5.0, 0.6),
            (Sensor::TerraSarXSm, 4.6, 0.06),
            (Sensor::CosmoSkyMedHi, 4.8, 0.06),
            (Sensor::Alos2Sm3, 25.0, 0.6),
            (Sensor::Radarsat2S, 4.6, 0.06),
            (Sensor::NovaSar1, 12.0, 0.6),
            (Sensor::Ers2Pri, 5.4, 0.06),
        ] {
            let mode = sensor.mode();
            let beta = mode.range_to_velocity_at(mode.incidence);
            let distance = ambiguity_distance(mode.prf, mode.frequency, beta) / 1e3;
            assert!(
                (distance - expected).abs() < rounding,
                "{sensor:?}: {distance}"
            );
        }
    }

    /// The resolution of the annotated bandwidth in the nearest sub-swath is 20.3 m at 33°.
    #[test]
    fn ground_resolution_falls_with_incidence() {
        let first = slant_resolution(14.1e6, Window::Hamming(0.70));
        assert!((ground_range(first, 33.0) - 20.3).abs() < 0.06);
        let mode = Sensor::Sentinel1Iw.mode();
        assert!((mode.range_resolution_at(45.0) - 20.3).abs() < 1e-12);
        // With a constant slant resolution, 3 m at 32° is 4.716 m at 19.7°.
        let mode = Sensor::TerraSarXSm.mode();
        assert!((mode.range_resolution_at(32.0) - 3.0).abs() < 1e-12);
        assert!((mode.range_resolution_at(19.7) - 4.716).abs() < 1e-3);
        // Without a window, 0.886 c/(2B).
        let slant = slant_resolution(100e6, Window::Uniform);
        assert!((slant - 0.885_892_9 * 1.498_962_29).abs() < 1e-6);
    }

    /// Equivalent numbers of looks that the products state.
    #[test]
    fn equivalent_looks_of_the_products() {
        for (sensor, low, high) in [
            (Sensor::Sentinel1Iw, 4.4, 4.9),
            (Sensor::Sentinel1Ew, 10.6, 11.8),
            (Sensor::Radarsat2S, 3.0, 3.3),
            (Sensor::Ers2Pri, 2.6, 2.8),
        ] {
            let mode = sensor.mode();
            let (looks, overlap) = mode.looks;
            let enl = mode.windows[0].overlapping_looks(looks, overlap);
            assert!((low..=high).contains(&enl), "{sensor:?}: {enl}");
        }
    }

    #[test]
    fn every_mode_lies_within_the_ranges_of_a_scene() {
        for sensor in Sensor::ALL {
            let mode = sensor.mode();
            assert!((1e9..=2e10).contains(&mode.frequency));
            let [near, far] = mode.incidence_range;
            assert!(5.0 <= near && near < mode.incidence && mode.incidence < far && far <= 75.0);
            for incidence in [near, mode.incidence, far] {
                assert!((0.0..=200.0).contains(&mode.range_to_velocity_at(incidence)));
                assert!((0.5..=500.0).contains(&mode.range_resolution_at(incidence)));
            }
            assert!((-40.0..=0.0).contains(&mode.nesz), "{sensor:?}");
        }
    }

    #[test]
    fn names_are_those_of_scene_files() {
        let names = Sensor::ALL.map(|s| serde_json::to_string(&s).unwrap());
        assert_eq!(names[0], "\"sentinel-1-iw\"");
        assert_eq!(names[5], "\"alos-2-sm3\"");
        for (sensor, name) in Sensor::ALL.into_iter().zip(&names) {
            assert_eq!(serde_json::from_str::<Sensor>(name).unwrap(), sensor);
        }
    }
}
