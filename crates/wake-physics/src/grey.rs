//! Mappings between backscatter and grey.

use serde::{Deserialize, Serialize};
use std::f64::consts::LN_10;

use crate::error::{Error, Result};
use crate::raster::Field;

/// Grey between two fixed ends, equal for all scenes: linear in decibel, or in amplitude as in quick-looks.
///
/// ```text
/// g = (10 log₁₀ σ⁰ − darkest)/(brightest − darkest),     cut to 0…1
/// g = (√σ⁰ − √σ_d)/(√σ_b − √σ_d) with the ends as σ⁰,    in amplitude
/// ```
///
/// Brightness carries wind and incidence, so an image is never stretched to its own range. [`GreyScale::default`] is −30 to
/// +10 dB, 0.16 dB per 8-bit level: at X band, 16 to 32° and winds of 3 to 7 m/s, mean σ⁰ lies between about −23 dB
/// (crosswind) and +4 dB, which leaves at least 6 dB for waves and most of the speckle. Ship echoes are white. The scale is
/// stored with data sets and weights: without it, an image has no unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GreyScale {
    /// σ⁰ of grey 0 \[dB\].
    pub darkest_db: f64,
    /// σ⁰ of grey 1 \[dB\], above `darkest_db`.
    pub brightest_db: f64,
    /// Quantity that grey is linear in.
    #[serde(default, skip_serializing_if = "Mapping::is_decibel")]
    pub mapping: Mapping,
}

/// Quantity that grey is linear in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mapping {
    /// σ⁰ in dB: every level is the same contrast.
    #[default]
    Decibel,
    /// The amplitude √σ⁰, as in the quick-looks and 8-bit products of real sensors.
    Amplitude,
}

impl Mapping {
    #[expect(
        clippy::trivially_copy_pass_by_ref,
        reason = "the signature serde asks for"
    )]
    fn is_decibel(&self) -> bool {
        *self == Self::Decibel
    }
}

impl Default for GreyScale {
    fn default() -> Self {
        Self {
            darkest_db: -30.0,
            brightest_db: 10.0,
            mapping: Mapping::Decibel,
        }
    }
}

impl GreyScale {
    /// Grey in amplitude for a sea of the given mean σ⁰: −60 dB is black, and the mean lies at four tenths of the range,
    /// where one in two hundred single-look pixels is clipped (chosen).
    ///
    /// - `mean_sigma0` \[1\], above 0; use one value for all images to be compared
    #[must_use]
    pub fn amplitude_around(mean_sigma0: f64) -> Self {
        Self {
            darkest_db: -60.0,
            brightest_db: 10.0 * mean_sigma0.log10() + 8.0,
            mapping: Mapping::Amplitude,
        }
    }

    /// Grey in amplitude stretched to one image: one pixel in a hundred lies below black, and one in two hundred above
    /// white. For viewing only: images are not comparable.
    ///
    /// - `field`: σ⁰ \[1\], at least one pixel
    #[must_use]
    pub fn filling(field: &Field) -> Self {
        let mut sorted = field.values.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        let db = |share: f64| {
            let place = (share * sorted.len().saturating_sub(1) as f64) as usize;
            let value = sorted.get(place).copied().unwrap_or_default();
            10.0 * f64::from(value).max(1e-9).log10()
        };
        Self {
            darkest_db: db(0.01),
            brightest_db: db(0.995),
            mapping: Mapping::Amplitude,
        }
    }

    /// Checks that grey rises with σ⁰.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for an end beyond −200 to 100 dB, [`Error::Conflict`] for ends in the wrong order or less than
    /// a thousandth of a decibel apart.
    pub fn validate(&self) -> Result<()> {
        let ends = [
            ("grey.darkest_db", self.darkest_db),
            ("grey.brightest_db", self.brightest_db),
        ];
        for (name, value) in ends {
            if !(-200.0..=100.0).contains(&value) {
                return Err(Error::OutOfRange {
                    name: name.to_owned(),
                    value,
                    min: -200.0,
                    max: 100.0,
                    unit: "dB",
                });
            }
        }
        if self.brightest_db - self.darkest_db >= 1e-3 {
            return Ok(());
        }
        Err(Error::Conflict {
            name: "grey.brightest_db".to_owned(),
            value: self.brightest_db.to_string(),
            requirement: format!(
                "but must be above grey.darkest_db, which is {}",
                self.darkest_db
            ),
        })
    }

    /// Grey 0…1 of σ⁰ \[1\]; σ⁰ = 0 is black.
    #[must_use]
    pub fn grey(&self, sigma0: f64) -> f64 {
        let value = match self.mapping {
            Mapping::Decibel => 10.0 * sigma0.max(0.0).log10(),
            Mapping::Amplitude => sigma0.max(0.0).sqrt(),
        };
        let [dark, bright] = self.ends();
        ((value - dark) / (bright - dark)).clamp(0.0, 1.0)
    }

    /// The ends in the quantity in which grey is linear.
    fn ends(&self) -> [f64; 2] {
        let ends = [self.darkest_db, self.brightest_db];
        match self.mapping {
            Mapping::Decibel => ends,
            Mapping::Amplitude => ends.map(|db| 10f64.powf(0.05 * db)),
        }
    }

    /// σ⁰ \[1\] of a grey value: the inverse of [`Self::grey`] between the ends, extrapolated beyond them.
    #[must_use]
    pub fn sigma0(&self, grey: f64) -> f64 {
        let [dark, bright] = self.ends();
        let value = dark + grey * (bright - dark);
        match self.mapping {
            Mapping::Decibel => (0.1 * LN_10 * value).exp(),
            Mapping::Amplitude => value.max(0.0).powi(2),
        }
    }

    /// Derivative of grey by ln σ⁰, dg/d ln σ⁰ \[1\], between the ends.
    #[must_use]
    pub fn slope(&self, sigma0: f64) -> f64 {
        let by_value = match self.mapping {
            Mapping::Decibel => 10.0 / LN_10,
            Mapping::Amplitude => 0.5 * sigma0.max(0.0).sqrt(),
        };
        let [dark, bright] = self.ends();
        by_value / (bright - dark)
    }

    /// Grey as the nearest 8-bit level.
    #[must_use]
    pub fn level(&self, sigma0: f64) -> u8 {
        (255.0 * self.grey(sigma0)).round() as u8
    }

    /// σ⁰ \[1\] of an 8-bit level.
    #[must_use]
    pub fn sigma0_of_level(&self, level: u8) -> f64 {
        self.sigma0(f64::from(level) / 255.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 201 values, the third is the first percentile and the second to last the 99.5th.
    #[test]
    fn one_image_fills_its_own_range() {
        let field = Field {
            rows: 1,
            columns: 201,
            values: (1..=201).rev().map(|n| n as f32).collect(),
        };
        let grey = GreyScale::filling(&field);
        assert!((grey.darkest_db - 10.0 * 3f64.log10()).abs() < 1e-12);
        assert!((grey.brightest_db - 10.0 * 200f64.log10()).abs() < 1e-12);
        assert_eq!((grey.level(3.0), grey.level(200.0)), (0, 255));
    }

    /// Compares with finite differences of the mapping.
    #[test]
    fn the_slope_is_that_of_the_grey() {
        for scale in [GreyScale::default(), GreyScale::amplitude_around(0.1)] {
            for sigma0 in [0.02, 0.1, 0.3] {
                let step = 1e-5;
                let difference =
                    scale.grey(sigma0 * (1.0 + step)) - scale.grey(sigma0 * (1.0 - step));
                // Central difference: error of order step²; rounding 1e-16/step.
                assert!((scale.slope(sigma0) - 0.5 * difference / step).abs() < 1e-9);
            }
        }
    }

    #[test]
    #[allow(clippy::float_cmp, reason = "the ends are exact")]
    fn the_ends_are_black_and_white() {
        let scale = GreyScale::default();
        for (sigma0, grey) in [
            (0.0, 0.0),
            (1e-9, 0.0),
            (-1.0, 0.0),
            (1e3, 1.0),
            (f64::INFINITY, 1.0),
        ] {
            assert_eq!(scale.grey(sigma0), grey);
        }
        assert!((scale.grey(0.1) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn inverse_both_ways() {
        let scale = GreyScale::default();
        for level in 0..=255 {
            assert_eq!(scale.level(scale.sigma0_of_level(level)), level);
        }
        for i in 1..40 {
            let sigma0 = 10f64.powf(0.1 * f64::from(i - 30));
            assert!((scale.sigma0(scale.grey(sigma0)) / sigma0 - 1.0).abs() < 1e-12);
            let db = 10.0 * (scale.sigma0_of_level(scale.level(sigma0)) / sigma0).log10();
            // Half a level of 40/255 dB.
            assert!(db.abs() < 0.5 * 40.0 / 255.0 + 1e-9);
        }
    }

    #[test]
    fn amplitude_is_linear_and_has_its_inverse() {
        let scale = GreyScale::amplitude_around(0.01);
        // −60 dB is amplitude 0.001, −12 dB is 0.251189: amplitude 0.1 lies four tenths up.
        assert!((scale.grey(0.01) - 0.099 / 0.250_189).abs() < 1e-6);
        // Equal steps of amplitude are equal steps of grey.
        let grey = |amplitude: f64| scale.grey(amplitude * amplitude);
        assert!((grey(0.16) - grey(0.1) - (grey(0.22) - grey(0.16))).abs() < 1e-12);
        for level in 0..=255 {
            assert_eq!(scale.level(scale.sigma0_of_level(level)), level);
        }
        for sigma0 in [1.1e-6, 1e-4, 0.02, 0.06] {
            assert!((scale.sigma0(scale.grey(sigma0)) / sigma0 - 1.0).abs() < 1e-10);
        }
        let text = serde_json::to_string(&scale).unwrap();
        assert!(text.contains(r#""mapping":"amplitude""#), "{text}");
        assert_eq!(serde_json::from_str::<GreyScale>(&text).unwrap(), scale);
    }

    #[test]
    fn ends_that_no_grey_lies_between_are_refused() {
        let refused = |darkest_db, brightest_db| {
            let scale = GreyScale {
                darkest_db,
                brightest_db,
                mapping: Mapping::Amplitude,
            };
            scale.validate().unwrap_err().to_string()
        };
        assert_eq!(
            refused(0.0, -10.0),
            "grey.brightest_db is -10, but must be above grey.darkest_db, which is 0"
        );
        assert!(refused(-300.0, 0.0).starts_with("grey.darkest_db is -300, outside"));
        assert!(refused(-30.0, f64::NAN).starts_with("grey.brightest_db is NaN, outside"));
        GreyScale::default().validate().unwrap();
        GreyScale::amplitude_around(0.01).validate().unwrap();
    }

    #[test]
    fn brighter_is_never_darker() {
        let scale = GreyScale::default();
        let greys: Vec<f64> = (0..200)
            .map(|i| scale.grey(1e-4 * 1.1f64.powi(i)))
            .collect();
        assert!(greys.windows(2).all(|w| w[0] <= w[1]));
    }

    #[test]
    fn stored_and_read_again() {
        let scale = GreyScale::default();
        let text = serde_json::to_string(&scale).unwrap();
        assert_eq!(text, r#"{"darkest_db":-30.0,"brightest_db":10.0}"#);
        assert_eq!(serde_json::from_str::<GreyScale>(&text).unwrap(), scale);
    }
}
