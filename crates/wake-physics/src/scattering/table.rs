//! σ⁰ by interpolation in a table over two slopes: the fast method.

use crate::numeric::vectorized;
use crate::raster::Field;
use crate::scattering::bicubic::Bicubic;
use crate::scattering::facets::Facets;
use crate::scattering::slope_means::SlopeMeans;
use crate::scattering::slopes::PrincipalAxes;
use crate::scattering::table_error::{OF_MEANS, Weights, error_between_nodes};
use crate::scattering::{Backscatter, FacetFields, SlopeCovariance};
use rayon::prelude::*;

/// First facet spacing tried \[1\]: a quarter of the width of the roll-off near nadir.
const FIRST_SPACING: f64 = 0.02;

/// Steepest slope along an axis that the table covers \[1\]; steeper facets are rare and evaluated exactly.
const STEEPEST: f64 = 1.5;

/// Largest number of nodes of a table, and per pixel if that is more: chosen; 32 MiB.
const MOST_NODES: usize = 1 << 22;
const NODES_FOR_EACH: usize = 4;

/// Standard deviations of the slopes that a table is expected to cover.
const COVERED: f64 = 5.0;

/// Largest number of facets evaluated for a table.
const MOST_FACETS: usize = 1 << 19;

/// Backscatter of facets by interpolation.
///
/// The Bragg return of plane facets is sampled on a lattice of slopes along the principal axes of the unresolved slopes.
/// There, the average over tilt is two one-dimensional sums, evaluated at the nodes of a finer lattice. The averaged values
/// are interpolated bicubically; the specular return is a single Gaussian and needs no table.
///
/// # Error
///
/// Two errors are measured while the table is built; it is refined until their sum is small enough.
///
/// Averages: they are compared with averages over every other facet. The trapezoidal rule converges so fast that halving
/// the spacing reduces a relative error e to about e^1.8 (the roll-off near nadir is the sharpest feature); the stated
/// error is e^(4/3), relative to the largest average.
///
/// Interpolation: it is repeated from every other node and compared at the omitted nodes. It is of fourth order, so its
/// error is a sixteenth of the difference; the stated error is an eighth.
///
/// Plane facets, which no tilt average smooths, have corners near nadir, where the order of convergence is unreliable.
/// There the table is compared with the facets themselves, between the nodes of the least smooth cells. A table of plane
/// facets that misses the demanded error is not used: each pixel is then evaluated exactly.
///
/// σ⁰ is at least 0; interpolated values below 0 are set to 0.
#[derive(Debug, Clone, PartialEq)]
pub struct BackscatterTable {
    backscatter: Backscatter,
    axes: PrincipalAxes,
    /// `None`: every facet is evaluated exactly.
    interpolation: Option<Bicubic>,
    error: f64,
    /// Inputs for which the table was built.
    made_for: MadeFor,
    /// Ranges of slope covered along the axes.
    range: [[f64; 2]; 2],
    /// Rules for means over additional subpixel slopes, if there are any.
    means: Option<SlopeMeans>,
}

/// Inputs for which a table is built.
#[derive(Debug, Clone, Copy, PartialEq)]
struct MadeFor {
    /// Ranges of the facets' slopes along the axes.
    facets: [[f64; 2]; 2],
    /// Largest variance of additional subpixel slopes.
    variance: f64,
    /// The demanded error.
    error: f64,
    /// Largest number of nodes.
    most_nodes: usize,
}

/// Largest number of nodes of a table for a number of pixels.
fn most_nodes(pixels: usize) -> usize {
    MOST_NODES.max(NODES_FOR_EACH * pixels)
}

impl MadeFor {
    /// Ranges of slopes needed by facets and by means over additional subpixel slopes.
    fn range(&self) -> [[f64; 2]; 2] {
        let reach = SlopeMeans::reach(self.variance);
        let widened = |[first, last]: [f64; 2]| [first - reach, last + reach];
        self.facets
            .map(|range| widened(range).map(|bound| bound.clamp(-STEEPEST, STEEPEST)))
    }

    fn weights(&self) -> Weights {
        Weights {
            facets: self.facets,
            variance: self.variance,
        }
    }
}

impl BackscatterTable {
    /// A table covering the slopes of the given facets, extended by the reach of means over their subpixel slopes.
    ///
    /// - `error` largest absolute error of σ⁰ \[1\]: a tolerance times the mean σ⁰
    #[must_use]
    pub fn covering(backscatter: Backscatter, facets: &FacetFields<'_>, error: f64) -> Self {
        Self::covering_or(None, backscatter, facets, error)
    }

    /// [`Self::covering`], but returns `last` if it was built for the same inputs.
    pub(crate) fn covering_or(
        last: Option<Self>,
        backscatter: Backscatter,
        facets: &FacetFields<'_>,
        error: f64,
    ) -> Self {
        let axes = backscatter.tilt.principal_axes();
        let slopes = [facets.slope_x, facets.slope_y].map(|field| &field.values[..]);
        let made_for = MadeFor {
            facets: extent(&axes, slopes),
            variance: facets.largest_subpixel_variance(),
            error,
            most_nodes: most_nodes(facets.slope_x.values.len()),
        };
        last.filter(|last| last.made_for == made_for && last.backscatter == backscatter)
            .unwrap_or_else(|| Self::over(backscatter, made_for))
    }

    /// Builds a table and the rules of the means over it.
    fn over(backscatter: Backscatter, made_for: MadeFor) -> Self {
        if made_for.variance <= 0.0 {
            return Self::interpolating(backscatter, made_for, made_for.error);
        }
        let mut table = Self::interpolating(backscatter, made_for, 0.5 * made_for.error);
        table.error *= OF_MEANS;
        let left = (made_for.error - table.error).max(0.0);
        // In the coordinates of the table, whose axes are those of the nodes.
        let means = SlopeMeans::new(
            |point| table.bragg_around(point),
            made_for.facets,
            made_for.variance,
            left,
        );
        table.error += means.error();
        table.means = Some(means);
        table
    }

    /// Builds a table without means.
    fn interpolating(backscatter: Backscatter, made_for: MadeFor, error: f64) -> Self {
        let axes = backscatter.tilt.principal_axes();
        let weights = made_for.weights();
        let mut spacing = FIRST_SPACING;
        loop {
            let facets = Facets::sample(&backscatter, &axes, made_for.range(), spacing);
            let mut average = facets.averaged(error, &weights, made_for.most_nodes);
            let exhausted = 2 * facets.lattice.values.len() > MOST_FACETS;
            let plane = facets.std.iter().all(|&s| s <= 0.0);
            if plane && average.error <= error {
                let facet = |point| backscatter.two_scale.facet(axes.slope(point));
                average.error = average
                    .error
                    .max(error_between_nodes(&average.lattice, facet));
            }
            let kept = average.error <= error || (exhausted && !plane);
            if kept || exhausted {
                return Self {
                    backscatter,
                    axes,
                    error: if kept { average.error } else { 0.0 },
                    made_for,
                    range: made_for.range(),
                    interpolation: kept.then(|| Bicubic::through(average.lattice)),
                    means: None,
                };
            }
            spacing *= average.next_spacing(error);
        }
    }

    /// Estimated number of nodes of a table, from the smoothness of the coarsest one.
    ///
    /// - `slopes` of the facets; largest `variance` of additional subpixel slopes
    /// - `error` as in [`Self::covering`]; `pixels`: their number
    pub(crate) fn foreseen(
        backscatter: &Backscatter,
        slopes: &SlopeCovariance,
        variance: f64,
        error: f64,
        pixels: usize,
    ) -> f64 {
        // Errors too small for `f32` fields get no table.
        if error < f64::from(f32::MIN_POSITIVE) {
            return 0.0;
        }
        let axes = backscatter.tilt.principal_axes();
        let reach = |axis: usize| {
            let outward = COVERED * variance_along(&axes, slopes, axis).sqrt();
            let outward = (outward / RANGE_STEP).ceil();
            (outward * RANGE_STEP).min(STEEPEST)
        };
        let made_for = MadeFor {
            facets: [0, 1].map(|axis| [-reach(axis), reach(axis)]),
            variance,
            error,
            most_nodes: most_nodes(pixels),
        };
        let share = if made_for.variance > 0.0 { 0.5 } else { 1.0 };
        let facets = Facets::sample(backscatter, &axes, made_for.range(), FIRST_SPACING);
        let weights = made_for.weights();
        let coarse = facets.averaged(f64::MAX, &weights, 1);
        let finer = 1.1 * (coarse.error / (share * made_for.error)).powf(0.25);
        let nodes = coarse.lattice.values.len() as f64 * finer.max(1.0).powi(2);
        nodes.min(made_for.most_nodes as f64)
    }

    /// Nodes along the two principal axes of the unresolved slopes; 0 where every facet is evaluated exactly.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        self.interpolation.as_ref().map_or([0; 2], Bicubic::nodes)
    }

    /// Stated absolute error of the interpolated σ⁰ \[1\]; above the demanded one if that needed too many facets.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.error
    }

    /// Bragg and specular cross-section of a facet of resolved slope (`s_x`, `s_y`); exact outside the table.
    #[cfg(test)]
    fn lookup(&self, slope: [f64; 2]) -> [f64; 2] {
        [self.bragg(slope), self.backscatter.specular.sigma0(slope)]
    }

    #[inline(always)]
    fn bragg(&self, slope: [f64; 2]) -> f64 {
        let table = self.interpolation.as_ref();
        let interpolated = table.and_then(|table| table.at(self.axes.coordinates(slope)));
        match interpolated {
            Some(bragg) => bragg.max(0.0),
            None => self.backscatter.parts(slope)[0],
        }
    }

    /// Bragg return at a node of a mean, in coordinates along the axes; slopes beyond the table get the value at its edge.
    #[inline(always)]
    fn bragg_around(&self, point: [f64; 2]) -> f64 {
        let Some(table) = &self.interpolation else {
            return self.backscatter.parts(self.axes.slope(point))[0];
        };
        let [u, v] = point;
        let [[left, right], [low, high]] = self.range;
        let inside = [u.max(left).min(right), v.max(low).min(high)];
        table.at(inside).map_or(0.0, |bragg| bragg.max(0.0))
    }

    /// σ⁰ of every pixel, row by row in parallel.
    #[must_use]
    pub fn sigma0_field(&self, fields: &FacetFields<'_>) -> Field {
        let (rows, columns) = (fields.slope_x.rows, fields.slope_x.columns);
        let mut field = Field {
            rows,
            columns,
            values: vec![0.0; rows * columns],
        };
        self.fill_sigma0(&mut field, fields);
        field
    }

    /// [`Self::sigma0_field`] written into a field of the same size.
    pub(crate) fn fill_sigma0(&self, field: &mut Field, fields: &FacetFields<'_>) {
        let columns = field.columns;
        field
            .values
            .par_chunks_mut(columns.max(1))
            .enumerate()
            .for_each_init(
                || vec![0.0; columns],
                |bragg, (row, out)| self.sigma0_row(fields, row * columns, bragg, out),
            );
    }

    /// σ⁰ of the pixels from `first`: a lookup loop, followed by a loop that the compiler can vectorise.
    fn sigma0_row(
        &self,
        fields: &FacetFields<'_>,
        first: usize,
        bragg: &mut [f64],
        out: &mut [f32],
    ) {
        vectorized(
            #[inline(always)]
            || {
                for (n, bragg) in (first..).zip(&mut *bragg) {
                    *bragg = self.bragg(fields.slope(n));
                }
                if fields.subpixel_variances.is_some() {
                    return self.roughened_row(fields, first, bragg, out);
                }
                for ((n, &mut bragg), value) in (first..).zip(bragg).zip(out) {
                    let specular = self.backscatter.specular.sigma0(fields.slope(n));
                    *value = fields.combine(n, [bragg, specular]);
                }
            },
        );
    }
}

impl Backscatter {
    /// Share of Gaussian slopes, along the axes of the unresolved slopes, steeper than a table covers; at most 1.
    pub(crate) fn steep_share(&self, slopes: &SlopeCovariance) -> f64 {
        let axes = self.tilt.principal_axes();
        let share =
            |axis| libm::erfc(STEEPEST / (2.0 * variance_along(&axes, slopes, axis)).sqrt());
        (share(0) + share(1)).min(1.0)
    }
}

/// Variance of slopes along one of the given axes.
fn variance_along(axes: &PrincipalAxes, slopes: &SlopeCovariance, axis: usize) -> f64 {
    let mut unit = [0.0; 2];
    unit[axis] = 1.0;
    let [x, y] = axes.slope(unit);
    (slopes.xx * x * x + 2.0 * slopes.xy * x * y + slopes.yy * y * y).max(0.0)
}

impl BackscatterTable {
    /// σ⁰ of the pixels from `first` where some have additional subpixel slopes; `bragg` is the return without these.
    fn roughened_row(
        &self,
        fields: &FacetFields<'_>,
        first: usize,
        bragg: &[f64],
        out: &mut [f32],
    ) {
        let specular = &self.backscatter.specular;
        for ((n, &bragg), value) in (first..).zip(bragg).zip(out) {
            let slope = fields.slope(n);
            let parts = match fields.subpixel_variance(n).zip(self.means.as_ref()) {
                None => [bragg, specular.sigma0(slope)],
                Some((more, means)) => [
                    {
                        let point = self.axes.coordinates(slope);
                        let more = more.turned(&self.axes);
                        means.around(&more, point, |point| self.bragg_around(point))
                    },
                    specular.over(&more).sigma0(slope),
                ],
            };
            *value = fields.combine(n, parts);
        }
    }
}

/// The range of a table ends on multiples of this slope \[1\], so that almost equal fields get the same table.
const RANGE_STEP: f64 = 1.0 / 16.0;

/// Range of the slopes along two axes, rounded outward, including 0 and limited to [`STEEPEST`] either way.
fn extent(axes: &PrincipalAxes, [slope_x, slope_y]: [&[f32]; 2]) -> [[f64; 2]; 2] {
    let widen = |a: [[f64; 2]; 2], b: [[f64; 2]; 2]| {
        [0, 1].map(|n| [a[n][0].min(b[n][0]), a[n][1].max(b[n][1])])
    };
    let of_chunk = |(x, y): (&[f32], &[f32])| {
        x.iter().zip(y).fold([[0.0; 2]; 2], |range, (&x, &y)| {
            let point = axes.coordinates([f64::from(x), f64::from(y)]);
            widen(range, point.map(|p| [p, p]))
        })
    };
    let range = slope_x
        .par_chunks(1 << 14)
        .zip(slope_y.par_chunks(1 << 14))
        .map(of_chunk)
        .reduce(|| [[0.0; 2]; 2], widen);
    let outward = |bound: f64| bound.signum() * (bound.abs() / RANGE_STEP).ceil() * RANGE_STEP;
    range.map(|r| r.map(|bound| outward(bound).clamp(-STEEPEST, STEEPEST)))
}

#[cfg(test)]
#[allow(
    clippy::float_cmp,
    reason = "exact zeros and values that nothing may change"
)]
mod tests {
    use super::*;
    use crate::constants::SPEED_OF_LIGHT;
    use crate::permittivity::sea_water;
    use crate::raster::Raster;
    use crate::scattering::facets::Average;
    use crate::scattering::slope_lattice::SlopeLattice;
    use crate::scattering::{Polarization, SlopeCovariance, Specular, TwoScale};
    use crate::spectrum::Elfouhaily;
    use std::f64::consts::PI;

    struct Case {
        degrees: f64,
        wind_speed: f64,
        frequency: f64,
        spacing: f64,
        polarization: Polarization,
    }

    const DEFAULT: Case = Case {
        degrees: 32.0,
        wind_speed: 5.0,
        frequency: 9.6e9,
        spacing: 2.5,
        polarization: Polarization::VV,
    };

    impl Case {
        fn backscatter(&self) -> Backscatter {
            let incidence = self.degrees.to_radians();
            let k = 2.0 * PI * self.frequency / SPEED_OF_LIGHT;
            let permittivity = sea_water(self.frequency, 20.0, 35.0);
            let two_scale = TwoScale::new(
                incidence,
                k,
                self.polarization,
                permittivity,
                Elfouhaily::new(self.wind_speed, 4e4),
                [0.8, -0.6],
            );
            let tilt = two_scale.slopes_from(PI / self.spacing);
            let lobe = Specular::mirror_lobe(k, self.spacing);
            Backscatter {
                specular: Specular::new(permittivity, incidence, &tilt, lobe),
                two_scale,
                tilt,
            }
        }
    }

    fn made_for(facets: [[f64; 2]; 2], error: f64) -> MadeFor {
        MadeFor {
            facets,
            variance: 0.0,
            error,
            most_nodes: MOST_NODES,
        }
    }

    /// Slopes up to 0.3 and 0.24, in a regular pattern of irrational frequencies.
    fn slopes(size: usize) -> [Field; 2] {
        let raster = Raster::image(size, size, 1.0);
        let field = |scale: f64, a: f64, b: f64| {
            Field::from_fn(&raster, move |i, j| {
                (scale * (a * i as f64 + b * j as f64).sin()) as f32
            })
        };
        [field(0.3, 1.732, 0.577), field(0.24, 2.236, 1.43)]
    }

    fn mean(backscatter: &Backscatter) -> f64 {
        let resolved = SlopeCovariance::isotropic(0.004);
        backscatter.mean_over(&resolved).iter().sum()
    }

    /// The requested tolerance holds at all levels, and the stated error bounds the true one.
    #[test]
    fn tolerance_is_met_at_every_level() {
        let [x, y] = slopes(8);
        let cases = [
            DEFAULT,
            Case {
                degrees: 16.0,
                ..DEFAULT
            },
            Case {
                degrees: 20.0,
                spacing: 20.0,
                wind_speed: 10.0,
                ..DEFAULT
            },
            Case {
                degrees: 70.0,
                wind_speed: 15.0,
                polarization: Polarization::HH,
                ..DEFAULT
            },
            Case {
                degrees: 5.0,
                wind_speed: 2.0,
                ..DEFAULT
            },
            Case {
                frequency: 1.2e9,
                wind_speed: 8.0,
                ..DEFAULT
            },
        ];
        for case in cases {
            let backscatter = case.backscatter();
            let slopes: Vec<[f64; 2]> = (x.values.iter().zip(&y.values))
                .map(|(&x, &y)| [f64::from(x), f64::from(y)])
                .collect();
            let exact: Vec<f64> = slopes
                .par_iter()
                .map(|&s| backscatter.parts(s)[0])
                .collect();
            for tolerance in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
                let allowed = tolerance * mean(&backscatter);
                let table = BackscatterTable::covering(
                    backscatter.clone(),
                    &FacetFields::of_slopes(&x, &y),
                    allowed,
                );
                assert!(table.error() <= allowed, "{} {tolerance}", case.degrees);
                for (&slope, &exact) in slopes.iter().zip(&exact) {
                    let error = (table.lookup(slope)[0] - exact).abs();
                    // Plus the reference's own error.
                    let bound = table.error() + 2e-7 * exact;
                    assert!(
                        error <= bound,
                        "{} {tolerance}: {error} {bound}",
                        case.degrees
                    );
                }
            }
        }
    }

    /// Whole fields, table against reference, up to rounding to single precision.
    #[test]
    fn fields_agree_with_the_oracle() {
        let [x, y] = slopes(8);
        let mut factors = y.clone();
        for factor in &mut factors.values {
            *factor += 1.0;
        }
        let fields = FacetFields {
            modulation: Some(&factors),
            ..FacetFields::of_slopes(&x, &y)
        };
        let backscatter = Case {
            degrees: 24.0,
            ..DEFAULT
        }
        .backscatter();
        let exact = backscatter.sigma0_field(&fields);
        let table = BackscatterTable::covering(backscatter, &fields, 1e-4 * exact.mean());
        let (error, _) = table.sigma0_field(&fields).difference(&exact);
        // Factors of at most 1.24 here.
        assert!(
            error <= 1.24 * table.error() + 1e-6 * exact.rms(),
            "{error}"
        );
    }

    /// Pixels so fine that all slopes are resolved: the table interpolates plane facets.
    #[test]
    fn works_without_unresolved_slopes() {
        let case = Case {
            frequency: 1e9,
            spacing: 0.1,
            degrees: 40.0,
            ..DEFAULT
        };
        let backscatter = case.backscatter();
        assert_eq!(backscatter.tilt, SlopeCovariance::NONE);
        let [x, y] = slopes(12);
        let fields = FacetFields::of_slopes(&x, &y);
        let exact = backscatter.sigma0_field(&fields);
        let table = BackscatterTable::covering(backscatter, &fields, 1e-3 * exact.rms());
        let (error, _) = table.sigma0_field(&fields).difference(&exact);
        assert!(error <= 1e-3 * exact.rms(), "{error}");
    }

    /// Near nadir plane facets have a corner that breaks the order of convergence: σ⁰ is never negative, and matches the
    /// facets' own within the demanded error.
    #[test]
    fn plane_facets_near_nadir_are_not_negative_and_within_the_error() {
        let [x, y] = slopes(48);
        for (degrees, frequency) in [
            (5.2, 3.8e9),
            (5.0, 1e9),
            (5.0, 2e10),
            (10.0, 9.6e9),
            (23.0, 5.4e9),
        ] {
            let case = Case {
                degrees,
                frequency,
                wind_speed: 7.4,
                spacing: 1.3,
                ..DEFAULT
            };
            let backscatter = Backscatter {
                tilt: SlopeCovariance::NONE,
                ..case.backscatter()
            };
            let facets = FacetFields::of_slopes(&x, &y);
            let exact = backscatter.sigma0_field(&facets);
            let allowed = 0.01 * exact.mean();
            let table = BackscatterTable::covering(backscatter, &facets, allowed);
            assert!(table.error() <= allowed, "{degrees}");
            let (error, _) = table.sigma0_field(&facets).difference(&exact);
            // Plus rounding to f32.
            assert!(
                error <= allowed + 1e-6 * exact.rms(),
                "{degrees} {frequency}: {error} {allowed}"
            );
            let least = table
                .sigma0_field(&facets)
                .values
                .into_iter()
                .fold(f32::INFINITY, f32::min);
            assert!(least >= 0.0, "{degrees} {frequency}: {least}");
        }
    }

    /// Subpixel slopes of waves of one direction and of two, up to breaking: within the demanded error of quadrature over
    /// the sum of both covariances.
    #[test]
    fn unresolved_slopes_are_averaged_over_within_the_error() {
        let l_band = Case {
            frequency: 1.27e9,
            degrees: 35.0,
            polarization: Polarization::HH,
            ..DEFAULT
        };
        let c_band = Case {
            frequency: 5.405e9,
            degrees: 25.0,
            ..DEFAULT
        };
        let [mut x, mut y] = slopes(8);
        for slope in x.values.iter_mut().chain(&mut y.values) {
            *slope *= 0.5;
        }
        let covariance = |n: usize| {
            let wave = |variance: f64, angle: f64| {
                let (sin, cos) = angle.sin_cos();
                SlopeCovariance::along_wind([variance, 0.0], [cos, sin])
            };
            let variance = [0.02, 0.005, 1e-3, 1e-5, 0.0][n % 5];
            let second = [0.0, 0.02, 1e-4][n % 3] * f64::from(u8::from(variance > 0.0));
            wave(variance, 0.7 * n as f64).plus(&wave(second, 2.3 - 0.2 * n as f64))
        };
        let of = |part: fn(&SlopeCovariance) -> f64| Field {
            values: (0..64).map(|n| part(&covariance(n)) as f32).collect(),
            ..x.clone()
        };
        let unresolved = [of(|c| c.xx), of(|c| c.xy), of(|c| c.yy)];
        let facets = FacetFields {
            subpixel_variances: Some(&unresolved),
            ..FacetFields::of_slopes(&x, &y)
        };
        for case in [DEFAULT, c_band, l_band] {
            let backscatter = case.backscatter();
            let exact = backscatter.sigma0_field(&facets);
            for tolerance in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5] {
                let allowed = tolerance * mean(&backscatter);
                let table = BackscatterTable::covering(backscatter.clone(), &facets, allowed);
                // With such large slopes, corners near nadir prevent low error levels, which the table states.
                let stated = table.error() / allowed;
                assert!(
                    stated <= 1.0 || tolerance < 0.1,
                    "{}: {stated}",
                    case.degrees
                );
                let (error, _) = table.sigma0_field(&facets).difference(&exact);
                // Rounding to f32, and the reference's own error.
                assert!(
                    error <= table.error() + 1e-6 * exact.rms(),
                    "{} {tolerance}: {error} {allowed}",
                    case.degrees
                );
            }
        }
    }

    /// Time and error of a single fixed rule for all means over slopes, and the spacings of tables: figures of decision 32.
    #[test]
    #[ignore = "a report of times and errors: --ignored --nocapture"]
    #[allow(clippy::print_stdout, reason = "figures are what it is for")]
    fn report_of_fixed_rules() {
        const TOLERANCE: f64 = 1e-2;
        let [mut x, mut y] = slopes(200);
        for slope in x.values.iter_mut().chain(&mut y.values) {
            *slope *= 0.5;
        }
        // The waves of a wake, from far away to breaking.
        let variance = |n: usize| 0.02 * (1.0 - n as f32 / x.values.len() as f32).powi(8);
        let of = |share: f32| Field {
            values: (0..x.values.len()).map(|n| share * variance(n)).collect(),
            ..x.clone()
        };
        let unresolved = [of(0.8), of(0.1), of(0.2)];
        let facets = FacetFields {
            subpixel_variances: Some(&unresolved),
            ..FacetFields::of_slopes(&x, &y)
        };
        let rules = SlopeMeans::RULES_TAKEN;
        let mut rows = vec![[0.0f64; 2]; rules + 1];
        let mut spacings = [f64::INFINITY, 0.0f64];
        for degrees in [16.0, 24.0, 32.0, 45.0] {
            for wind_speed in [3.0, 7.0, 12.0] {
                for (frequency, spacing) in [(1.27e9, 5.0), (5.4e9, 10.0), (9.6e9, 2.5)] {
                    let case = Case {
                        degrees,
                        wind_speed,
                        frequency,
                        spacing,
                        ..DEFAULT
                    };
                    let backscatter = case.backscatter();
                    let allowed = TOLERANCE * mean(&backscatter);
                    let mut table = BackscatterTable::covering(backscatter, &facets, allowed);
                    if let Some(interpolation) = &table.interpolation {
                        let [[first, last], _] = table.range;
                        let step = (last - first) / interpolation.nodes()[0] as f64;
                        spacings = [spacings[0].min(step), spacings[1].max(step)];
                    }
                    let chosen = table.means.clone().expect("unresolved slopes");
                    table.means = Some(SlopeMeans::fixed(rules - 1));
                    let exact = table.sigma0_field(&facets);
                    for (n, row) in rows.iter_mut().enumerate() {
                        table.means = Some(match n {
                            0 => chosen.clone(),
                            n => SlopeMeans::fixed(n - 1),
                        });
                        let times = (0..3).map(|_| {
                            let begun = std::time::Instant::now();
                            let (error, _) = table.sigma0_field(&facets).difference(&exact);
                            row[1] = row[1].max(error / exact.mean());
                            begun.elapsed().as_secs_f64()
                        });
                        row[0] += times.fold(f64::INFINITY, f64::min);
                    }
                }
            }
        }
        println!("spacing of tables {:.4} to {:.4}", spacings[0], spacings[1]);
        for (n, [time, error]) in rows.iter().enumerate() {
            let ratio = time / rows[0][0];
            println!(
                "rule {n} (0: chosen): time {ratio:.2}, largest error {error:.1e} of the mean"
            );
        }
    }

    /// Slopes outside the table are evaluated exactly.
    #[test]
    fn steep_facets_are_exact() {
        let backscatter = DEFAULT.backscatter();
        let table = BackscatterTable::over(backscatter.clone(), made_for([[-0.1, 0.1]; 2], 1e-3));
        for slope in [[0.5, 0.0], [-0.3, 0.9], [7.0, 0.0]] {
            assert_eq!(table.lookup(slope), backscatter.parts(slope));
        }
    }

    /// Only the Bragg part is modulated and damped, and it never becomes negative.
    #[test]
    fn modulation_and_damping_act_on_bragg_alone() {
        let backscatter = Case {
            degrees: 20.0,
            ..DEFAULT
        }
        .backscatter();
        let raster = Raster::image(1, 3, 1.0);
        let flat = Field::constant(&raster, 0.0);
        let modulation = Field {
            rows: 1,
            columns: 3,
            values: vec![1.5, 0.0, 1.0],
        };
        let remaining = Field {
            rows: 1,
            columns: 3,
            values: vec![1.0, 1.0, 0.25],
        };
        let table =
            BackscatterTable::covering(backscatter, &FacetFields::of_slopes(&flat, &flat), 1e-3);
        let sigma0 = table.sigma0_field(&FacetFields {
            modulation: Some(&modulation),
            bragg_remaining: Some(&remaining),
            ..FacetFields::of_slopes(&flat, &flat)
        });
        let [bragg, specular] = table.lookup([0.0; 2]);
        for (value, factor) in sigma0.values.iter().zip([1.5, 0.0, 0.25]) {
            assert!((f64::from(*value) - (factor * bragg + specular)).abs() < 1e-6 * bragg);
        }
    }

    /// A sea without wind has no Bragg return, only a glint where the facet is a mirror.
    #[test]
    fn calm_sea_returns_glints_only() {
        let backscatter = Case {
            wind_speed: 0.0,
            degrees: 5.0,
            ..DEFAULT
        }
        .backscatter();
        let raster = Raster::image(1, 2, 1.0);
        let x = Field {
            rows: 1,
            columns: 2,
            values: vec![0.0, 5f32.to_radians().tan()],
        };
        let y = Field::constant(&raster, 0.0);
        let fields = FacetFields::of_slopes(&x, &y);
        let table = BackscatterTable::covering(backscatter, &fields, 0.0);
        let sigma0 = table.sigma0_field(&fields);
        assert_eq!(sigma0.values[0], 0.0);
        assert!(sigma0.values[1] > 1e3 && sigma0.values[1].is_finite());
        assert_eq!(table.error(), 0.0);
    }

    /// σ⁰ is finite and not negative for every angle, wind and band of a scene.
    #[test]
    fn hard_cases_are_finite() {
        let [x, y] = slopes(5);
        let fields = FacetFields::of_slopes(&x, &y);
        for degrees in [5.0, 32.0, 75.0] {
            for wind_speed in [0.0, 0.5, 2.6, 30.0] {
                for (frequency, spacing) in [(1e9, 0.1), (1e9, 100.0), (2e10, 0.1), (2e10, 100.0)] {
                    let case = Case {
                        degrees,
                        wind_speed,
                        frequency,
                        spacing,
                        ..DEFAULT
                    };
                    let backscatter = case.backscatter();
                    let allowed = 0.1 * mean(&backscatter);
                    let table = BackscatterTable::covering(backscatter, &fields, allowed);
                    for value in table.sigma0_field(&fields).values {
                        assert!(value.is_finite() && value >= 0.0, "{value}");
                    }
                }
            }
        }
    }

    #[test]
    fn empty_fields_are_allowed() {
        let none = Field {
            rows: 0,
            columns: 0,
            values: Vec::new(),
        };
        let fields = FacetFields::of_slopes(&none, &none);
        let table = BackscatterTable::covering(DEFAULT.backscatter(), &fields, 1e-3);
        assert!(table.sigma0_field(&fields).values.is_empty());
    }

    /// Facets lie three nodes and the reach of their average beyond the range, at both ends.
    #[test]
    fn facets_span_their_range() {
        let backscatter = DEFAULT.backscatter();
        let axes = backscatter.tilt.principal_axes();
        let range = [[-0.21, 0.34], [-0.1, 0.07]];
        for spacing in [0.02, 0.013] {
            let facets = Facets::sample(&backscatter, &axes, range, spacing);
            for (axis, [first, last]) in range.into_iter().enumerate() {
                let beyond = spacing * (3 + facets.radius[axis]) as f64;
                let lattice = &facets.lattice;
                assert!((lattice.start[axis] - (first - beyond)).abs() < 1e-12);
                let end = lattice.start[axis] + spacing * (lattice.nodes[axis] - 1) as f64;
                // Up to two extra nodes make the number odd.
                let more = end - (last + beyond);
                assert!((-1e-12..2.0 * spacing).contains(&more), "{spacing}: {more}");
                assert!(!lattice.nodes[axis].is_multiple_of(2));
            }
        }
    }

    /// For an error e^{−a/h}, from 10⁻³ to 10⁻⁴ the spacing falls to three quarters; the factor stays within 0.5 to 0.85.
    #[test]
    fn the_next_spacing_follows_the_exponent() {
        let average = |error: f64| Average {
            lattice: SlopeLattice::sample([0.0; 2], 1.0, [1; 2], |_| 2.0),
            largest: 2.0,
            error,
        };
        let next = |error: f64, asked: f64| average(2.0 * error).next_spacing(2.0 * asked);
        assert!((next(1e-3, 1e-4) - 0.75).abs() < 1e-12);
        assert!((next(1e-1, 1e-8) - 0.5).abs() < 1e-12);
        assert!((next(1e-4, 0.99e-4) - 0.85).abs() < 1e-12);
        assert!((next(2.0, 1e-4) - 0.5).abs() < 1e-12);
    }

    /// For an unreachable error the search ends and states the error reached. Plane facets need no table.
    #[test]
    fn what_cannot_be_reached_is_stated() {
        let backscatter = DEFAULT.backscatter();
        let range = [[-0.05, 0.05]; 2];
        let asked = 1e-15 * mean(&backscatter);
        let table = BackscatterTable::over(backscatter.clone(), made_for(range, asked));
        assert!(table.error() > asked && table.error() < 1e-6 * mean(&backscatter));
        let plane = Backscatter {
            tilt: SlopeCovariance::NONE,
            ..backscatter
        };
        let table = BackscatterTable::over(plane.clone(), made_for(range, asked));
        assert_eq!((table.size(), table.error()), ([0; 2], 0.0));
        assert_eq!(table.lookup([0.01, 0.02]), plane.parts([0.01, 0.02]));
    }
}
