//! σ⁰ as a table over two slopes: the fast way.

use crate::raster::Field;
use crate::scattering::bicubic::Bicubic;
use crate::scattering::lattice::{Lattice, radius};
use crate::scattering::slopes::PrincipalAxes;
use crate::scattering::{Backscatter, FacetFields};
use rayon::prelude::*;

/// First spacing of facets tried [1]: half the width of the roll-off near nadir.
const FIRST_SPACING: f64 = 0.025;

/// Steepest slope along an axis that the table covers [1]; steeper facets are rare and evaluated exactly.
const STEEPEST: f64 = 1.5;

/// Rounding of an interpolated value: single precision of the nodes and of the sum over them.
const ROUNDING: f64 = 2.0 * f32::EPSILON as f64;

/// Most facets evaluated for one table, and most nodes in it: about 0.1 s.
const MOST_NODES: usize = 1 << 19;

/// Backscatter of facets by interpolation.
///
/// The Bragg return of plane facets is sampled on a lattice of slopes along the principal axes of the unresolved
/// ones. There the average over tilt is two one-dimensional sums, taken at the nodes of a finer lattice. The
/// averaged values are interpolated bicubically; the specular return is a single Gaussian and needs no table.
///
/// # Error
///
/// Two errors are measured while the table is made, and halved again and again until their sum is small enough.
/// The averages are compared with those from every other facet: the sum converges faster than any power, so
/// an eighth of the difference bounds its error. The interpolation is repeated with every other node and
/// compared at the nodes left out: it is of fourth order, so its error is a sixteenth of the difference, stated
/// as an eighth. To this comes the rounding of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct BackscatterTable {
    backscatter: Backscatter,
    axes: PrincipalAxes,
    bragg: Bicubic,
    error: f64,
}

impl BackscatterTable {
    /// A table for the slopes that occur in two fields.
    ///
    /// - `error` largest absolute error of σ⁰ [1]: a tolerance times the mean σ⁰
    #[must_use]
    pub fn covering(
        backscatter: Backscatter,
        slope_x: &Field,
        slope_y: &Field,
        error: f64,
    ) -> Self {
        let axes = backscatter.tilt.principal_axes();
        let range = extent(&axes, &slope_x.values, &slope_y.values);
        Self::over(backscatter, range, error)
    }

    /// A table for ranges of slope [first, last] along the two principal axes of the unresolved slopes.
    fn over(backscatter: Backscatter, range: [[f64; 2]; 2], error: f64) -> Self {
        let axes = backscatter.tilt.principal_axes();
        let mut spacing = FIRST_SPACING;
        loop {
            let facets = Facets::sample(&backscatter, &axes, range, spacing);
            let (lattice, reached) = facets.averaged(error);
            if reached <= error || 2 * facets.lattice.values.len() > MOST_NODES {
                return Self {
                    backscatter,
                    axes,
                    bragg: Bicubic::through(&lattice),
                    error: reached,
                };
            }
            spacing *= (0.9 * (error / reached).powf(0.25)).clamp(0.6, 0.8);
        }
    }

    /// Stated absolute error of the interpolated σ⁰ [1].
    #[must_use]
    pub fn error(&self) -> f64 {
        self.error
    }

    /// Bragg and specular cross-section of a facet of resolved slope (s_x, s_y); exact outside the table.
    #[must_use]
    #[inline]
    pub fn lookup(&self, slope: [f64; 2]) -> [f64; 2] {
        match self.bragg.at(self.axes.coordinates(slope)) {
            Some(bragg) => [f64::from(bragg), self.backscatter.specular.sigma0(slope)],
            None => self.backscatter.parts(slope),
        }
    }

    /// σ⁰ of every pixel, row by row in parallel.
    #[must_use]
    pub fn sigma0_field(&self, fields: &FacetFields<'_>) -> Field {
        let (rows, columns) = (fields.slope_x.rows, fields.slope_x.columns);
        let mut values = vec![0.0; rows * columns];
        values
            .par_chunks_mut(columns.max(1))
            .enumerate()
            .for_each(|(row, out)| {
                for (column, value) in out.iter_mut().enumerate() {
                    let n = row * columns + column;
                    *value = fields.combine(n, self.lookup(fields.slope(n)));
                }
            });
        Field {
            rows,
            columns,
            values,
        }
    }
}

/// Bragg return of plane facets on a lattice of slopes, with what is needed to average it.
struct Facets {
    lattice: Lattice,
    std: [f64; 2],
    radius: [usize; 2],
}

impl Facets {
    /// Facets over a range of slopes and as far beyond as their average reaches.
    fn sample(
        backscatter: &Backscatter,
        axes: &PrincipalAxes,
        range: [[f64; 2]; 2],
        spacing: f64,
    ) -> Self {
        let std = axes.variance.map(f64::sqrt);
        let radius = std.map(|s| radius(s, spacing));
        // Three nodes beyond the range at each end, and an odd number, so that every other node spans it too.
        let cells = range.map(|[first, last]| ((last - first) / (2.0 * spacing)).ceil() as usize);
        let nodes = [0, 1].map(|a| 2 * cells[a] + 7 + 2 * radius[a]);
        let start = [0, 1].map(|a| range[a][0] - spacing * (3 + radius[a]) as f64);
        let lattice = Lattice::sample(start, spacing, nodes, |point| {
            backscatter.two_scale.facet(axes.slope(point))
        });
        Self {
            lattice,
            std,
            radius,
        }
    }

    /// The average over tilt on a lattice fine enough for an interpolation of this error, if there is one, and
    /// the error reached.
    fn averaged(&self, error: f64) -> (Lattice, f64) {
        let mut average = self.lattice.smoothed(self.std, self.radius, 1);
        let averaging = self.averaging_error(&average);
        let mut reached = averaging + interpolation_error(&average);
        let resolved = self.std.iter().all(|&s| s >= self.lattice.step);
        for refinement in [2, 3, 4, 6, 8, 12, 16] {
            let size = average.values.len() * refinement * refinement;
            if reached <= error || averaging > 0.5 * error || !resolved || size > MOST_NODES {
                break;
            }
            average = self.lattice.smoothed(self.std, self.radius, refinement);
            reached = averaging + interpolation_error(&average);
        }
        (average, reached)
    }

    /// An eighth of the largest difference that leaving out every other facet makes to the average.
    fn averaging_error(&self, average: &Lattice) -> f64 {
        let half = self.radius.map(|r| r / 2);
        let coarse = self.lattice.every_other().smoothed(self.std, half, 1);
        let fine = average.every_other();
        let pairs = fine.values.iter().zip(&coarse.values);
        pairs.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) / 8.0
    }
}

/// An eighth of the largest difference between a lattice and the interpolation of every other node of it, and the
/// rounding of the largest value.
fn interpolation_error(lattice: &Lattice) -> f64 {
    let coarse = Bicubic::through(&lattice.every_other());
    let (mut difference, mut largest) = (0.0f64, 0.0f64);
    for (j, row) in lattice.values.chunks(lattice.nodes[0]).enumerate() {
        let v = lattice.start[1] + lattice.step * j as f64;
        for (i, &value) in row.iter().enumerate() {
            largest = largest.max(value.abs());
            let u = lattice.start[0] + lattice.step * i as f64;
            if let Some(other) = coarse.at([u, v]) {
                difference = difference.max((f64::from(other) - value).abs());
            }
        }
    }
    difference / 8.0 + ROUNDING * largest
}

/// Range of the slopes along two axes, at least 0 to 0 and at most [`STEEPEST`] either way.
fn extent(axes: &PrincipalAxes, slope_x: &[f32], slope_y: &[f32]) -> [[f64; 2]; 2] {
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
    range.map(|r| r.map(|bound| bound.clamp(-STEEPEST, STEEPEST)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constants::SPEED_OF_LIGHT;
    use crate::permittivity::sea_water;
    use crate::raster::Raster;
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

    /// Slopes out to 0.3 and 0.24, a regular pattern of irrational frequencies.
    fn slopes(size: usize) -> [Field; 2] {
        let raster = Raster::image(size, size, 1.0);
        let field = |scale: f64, a: f64, b: f64| {
            Field::from_fn(&raster, move |i, j| {
                (scale * (a * i as f64 + b * j as f64).sin()) as f32
            })
        };
        [field(0.3, 1.7320508, 0.577), field(0.24, 2.236, 1.4142135)]
    }

    fn mean(backscatter: &Backscatter) -> f64 {
        let resolved = SlopeCovariance::isotropic(0.004);
        backscatter.mean_over(&resolved).iter().sum()
    }

    /// The caller's tolerance is met at every level, and the stated error bounds the true one.
    #[test]
    fn tolerance_is_met_at_every_level() {
        let [x, y] = slopes(12);
        let fields = FacetFields {
            slope_x: &x,
            slope_y: &y,
            modulation: None,
            damping: None,
        };
        let cases = [
            DEFAULT,
            Case {
                degrees: 16.0,
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
            let exact = backscatter.sigma0_field(&fields);
            for tolerance in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5] {
                let allowed = tolerance * mean(&backscatter);
                let table = BackscatterTable::covering(backscatter.clone(), &x, &y, allowed);
                let (error, _) = table.sigma0_field(&fields).difference(&exact);
                assert!(table.error() <= allowed, "{} {tolerance}", case.degrees);
                assert!(
                    error <= table.error(),
                    "{} {tolerance}: {error} {}",
                    case.degrees,
                    table.error()
                );
            }
        }
    }

    /// Pixels so fine that no slope is unresolved: the table interpolates plane facets.
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
        let fields = FacetFields {
            slope_x: &x,
            slope_y: &y,
            modulation: None,
            damping: None,
        };
        let exact = backscatter.sigma0_field(&fields);
        let table = BackscatterTable::covering(backscatter, &x, &y, 1e-3 * exact.rms());
        let (error, _) = table.sigma0_field(&fields).difference(&exact);
        assert!(error <= 1e-3 * exact.rms(), "{error}");
    }

    /// Slopes outside the table are evaluated exactly.
    #[test]
    fn steep_facets_are_exact() {
        let backscatter = DEFAULT.backscatter();
        let table = BackscatterTable::over(backscatter.clone(), [[-0.1, 0.1]; 2], 1e-3);
        for slope in [[0.5, 0.0], [-0.3, 0.9], [7.0, 0.0]] {
            assert_eq!(table.lookup(slope), backscatter.parts(slope));
        }
    }

    /// Only the Bragg part is modulated and damped, and never below nothing.
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
            values: vec![0.5, -2.0, 0.0],
        };
        let damping = Field {
            rows: 1,
            columns: 3,
            values: vec![1.0, 1.0, 0.25],
        };
        let table = BackscatterTable::covering(backscatter, &flat, &flat, 1e-3);
        let sigma0 = table.sigma0_field(&FacetFields {
            slope_x: &flat,
            slope_y: &flat,
            modulation: Some(&modulation),
            damping: Some(&damping),
        });
        let [bragg, specular] = table.lookup([0.0; 2]);
        for (value, factor) in sigma0.values.iter().zip([1.5, 0.0, 0.25]) {
            assert!((f64::from(*value) - (factor * bragg + specular)).abs() < 1e-6 * bragg);
        }
    }

    /// A sea without wind: no Bragg return, a glint where the facet is a mirror, nothing else.
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
        let table = BackscatterTable::covering(backscatter, &x, &y, 0.0);
        let fields = FacetFields {
            slope_x: &x,
            slope_y: &y,
            modulation: None,
            damping: None,
        };
        let sigma0 = table.sigma0_field(&fields);
        assert_eq!(sigma0.values[0], 0.0);
        assert!(sigma0.values[1] > 1e3 && sigma0.values[1].is_finite());
        assert_eq!(table.error(), 0.0);
    }

    /// Every angle, wind and band of a scene: finite and not negative.
    #[test]
    fn hard_cases_are_finite() {
        let [x, y] = slopes(5);
        let fields = FacetFields {
            slope_x: &x,
            slope_y: &y,
            modulation: None,
            damping: None,
        };
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
                    let table = BackscatterTable::covering(backscatter, &x, &y, allowed);
                    for value in table.sigma0_field(&fields).values {
                        assert!(
                            value.is_finite() && value >= -0.1 * allowed as f32,
                            "{value}"
                        );
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
        let table = BackscatterTable::covering(DEFAULT.backscatter(), &none, &none, 1e-3);
        let fields = FacetFields {
            slope_x: &none,
            slope_y: &none,
            modulation: None,
            damping: None,
        };
        assert!(table.sigma0_field(&fields).values.is_empty());
    }
}
#[cfg(test)]
mod probe {
    use super::*;
    use crate::scattering::*;
    #[test]
    fn probe() {
        use std::time::Instant;
        for (deg, u, f, h) in [
            (32.0f64, 5.0, 9.6e9, 2.5),
            (16.0, 5.0, 9.6e9, 2.5),
            (16.0, 3.0, 9.6e9, 2.5),
            (24.0, 7.0, 9.6e9, 2.5),
            (70.0, 15.0, 9.6e9, 2.5),
            (5.0, 5.0, 9.6e9, 2.5),
            (32.0, 5.0, 1.27e9, 2.5),
            (20.0, 10.0, 1e10, 20.0),
        ] {
            let k = 2.0 * std::f64::consts::PI * f / 299792458.0;
            let e = crate::permittivity::sea_water(f, 20.0, 35.0);
            let t = TwoScale::new(
                deg.to_radians(),
                k,
                Polarization::VV,
                e,
                crate::spectrum::Elfouhaily::new(u, 4e4),
                [1.0, 0.0],
            );
            let tilt = t.slopes_from(std::f64::consts::PI / h);
            let res = {
                let a = t.slopes_from(0.0);
                SlopeCovariance {
                    xx: a.xx - tilt.xx,
                    xy: 0.0,
                    yy: a.yy - tilt.yy,
                }
            };
            let b = Backscatter {
                specular: Specular::new(e, deg.to_radians(), &tilt, Specular::mirror_lobe(k, h)),
                two_scale: t,
                tilt,
            };
            println!(
                "deg {deg} U {u} f {f} h {h} tilt std {:.3} {:.3} resolved {:.3} {:.3}",
                tilt.xx.sqrt(),
                tilt.yy.sqrt(),
                res.xx.sqrt(),
                res.yy.sqrt()
            );
            for s in [[0.0, 0.0], [0.15, 0.1]] {
                let v: Vec<f64> = [0.08, 0.06, 0.04, 0.03, 0.02, 0.01, 0.005, 0.0025]
                    .iter()
                    .map(|&h| b.two_scale.average(s, &b.tilt, h))
                    .collect();
                let l = v[7];
                println!(
                    "   conv {:?}",
                    v.iter()
                        .map(|x| format!("{:.1e}", x / l - 1.0))
                        .collect::<Vec<_>>()
                );
                let t0 = Instant::now();
                let x = b.parts(s);
                println!(
                    "   oracle {:?} us, {:.1e} {:?}",
                    t0.elapsed().as_micros(),
                    x[0] / l - 1.0,
                    x
                );
            }
            let t0 = Instant::now();
            for i in 0..10000 {
                std::hint::black_box(b.two_scale.facet([0.0001 * f64::from(i) - 0.3, 0.01]));
            }
            println!("   facet {} ns", t0.elapsed().as_nanos() / 10000);
            let t0 = Instant::now();
            let s = b.sensitivity(&res);
            println!("   sens {:?} us {:?}", t0.elapsed().as_micros(), s);
            let m = s.mean[0] + s.mean[1];
            let r = [
                [-5.0 * res.xx.sqrt(), 5.0 * res.xx.sqrt()],
                [-5.0 * res.yy.sqrt(), 5.0 * res.yy.sqrt()],
            ];
            for tol in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
                let t0 = Instant::now();
                let t = BackscatterTable::over(b.clone(), r, tol * m);
                let dt = t0.elapsed().as_micros();
                let axes = b.tilt.principal_axes();
                let mut err = 0.0f64;
                for i in 0..40 {
                    let p = [
                        r[0][0] + (r[0][1] - r[0][0]) * (0.137 * f64::from(i)).fract(),
                        r[1][0] + (r[1][1] - r[1][0]) * (0.3819 * f64::from(i)).fract(),
                    ];
                    let s = axes.slope(p);
                    err = err.max((t.lookup(s)[0] - b.parts(s)[0]).abs());
                }
                println!(
                    "   tol {tol:.0e} build {dt} us stated {:.1e} true {:.1e} {}",
                    t.error() / m,
                    err / m,
                    format!("{:?}", t.bragg)
                        .chars()
                        .take(120)
                        .collect::<String>()
                );
            }
            let ra = crate::Raster::image(616, 520, 2.5);
            let (su, sv) = (res.xx.sqrt() * 1.4, res.yy.sqrt() * 1.4);
            let x = crate::Field::from_fn(&ra, |i, j| {
                (su * (1.3 * i as f64 + 0.7 * j as f64).sin()) as f32
            });
            let y = crate::Field::from_fn(&ra, |i, j| {
                (sv * (0.3 * i as f64 + 1.7 * j as f64).sin()) as f32
            });
            let ff = FacetFields {
                slope_x: &x,
                slope_y: &y,
                modulation: Some(&x),
                damping: None,
            };
            for _ in 0..3 {
                let t0 = Instant::now();
                let t = BackscatterTable::covering(b.clone(), &x, &y, 1e-3 * m);
                let t1 = t0.elapsed().as_micros();
                let f = t.sigma0_field(&ff);
                println!(
                    "   covering {t1} us, covering+field {} us mean {}",
                    t0.elapsed().as_micros(),
                    f.mean()
                );
            }
        }
    }
}
