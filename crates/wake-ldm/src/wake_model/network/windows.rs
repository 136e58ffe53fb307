//! Variance of a sea in each channel of the latents.

use rayon::prelude::*;
use wake_physics::LinearSea;

use super::patches::{PatchTransform, WINDOW};

/// Number of distances between two pixels of a window along rows or columns.
const LAGS: usize = 2 * WINDOW - 1;
/// Index of distance 0 among those along rows and columns.
const NONE: usize = LAGS * LAGS / 2;
/// Smallest variance of a channel, as a share of its variance for a white field.
const LEAST_SHARE: f64 = 1e-5;
/// Smallest standard deviation of white grey of any sea: a twenty-fifth of a decibel on the default scale, far below any
/// speckle (chosen).
const LEAST_GREY: f64 = 1e-3;

/// Weights of the latent channels for pixels, in the form needed for variances.
#[derive(Debug, Clone)]
pub struct ChannelWindows {
    /// Sums of w(p) w(p + d) over all pixels p of a window, for each channel and each distance d in rows and columns.
    correlations: Vec<Vec<f64>>,
}

impl ChannelWindows {
    /// Weights of a transform.
    pub fn new(patches: &PatchTransform) -> Self {
        let windows = patches.windows();
        let correlation = |window: &[f32]| {
            let mut sums = vec![0.0; LAGS * LAGS];
            for (p, &a) in window.iter().enumerate() {
                for (q, &b) in window.iter().enumerate() {
                    let [down, right] = [(p / WINDOW, q / WINDOW), (p % WINDOW, q % WINDOW)]
                        .map(|(p, q)| WINDOW - 1 + q - p);
                    sums[down * LAGS + right] += f64::from(a) * f64::from(b);
                }
            }
            sums
        };
        let windows = windows.par_chunks_exact(WINDOW * WINDOW);
        Self {
            correlations: windows.map(correlation).collect(),
        }
    }

    /// Variance of each channel for a sea: Σ C(d) Σ w(p) w(p + d), with C the covariance of two pixels; 0 without waves.
    pub(super) fn variances(&self, sea: &LinearSea) -> Vec<f64> {
        let covariance = sea.covariance();
        let wrapped = |lag: usize, n: usize| (lag + WINDOW * n - (WINDOW - 1)) % n;
        let [rows, columns] = [covariance.rows, covariance.columns];
        let lags = (0..LAGS * LAGS)
            .map(|lag| covariance.at(wrapped(lag / LAGS, rows), wrapped(lag % LAGS, columns)));
        let lags: Vec<f64> = lags.map(f64::from).collect();
        let of_channel = |sums: &Vec<f64>| {
            let sum: f64 = sums.iter().zip(&lags).map(|(w, c)| w * c).sum();
            sum.max(LEAST_SHARE * lags[NONE] * sums[NONE])
        };
        self.correlations.iter().map(of_channel).collect()
    }

    /// Logarithm of the standard deviation of a sea's grey in each channel.
    ///
    /// - `slope`: derivative of the grey with respect to the relative intensity
    pub(super) fn log_deviations(&self, sea: &LinearSea, slope: f64) -> Vec<f32> {
        self.of_variances(&self.variances(sea), slope)
    }

    /// As `log_deviations`, from the variances of the relative intensity.
    pub(super) fn of_variances(&self, variances: &[f64], slope: f64) -> Vec<f32> {
        let channels = variances.iter().zip(&self.correlations);
        let of = |(variance, sums): (&f64, &Vec<f64>)| {
            let floor = LEAST_GREY * LEAST_GREY * sums[NONE];
            (0.5 * (slope * slope * variance + floor).ln()) as f32
        };
        channels.map(of).collect()
    }
}
