//! Normal distribution to which an image is encoded.

use burn::tensor::Tensor;

/// An independent normal distribution for every element of the latent image.
///
/// The logarithm of the variance is clamped to [−30, 20], so that no standard deviation overflows.
///
/// # References
///
/// Kingma & Welling (2014), "Auto-Encoding Variational Bayes", section 3 and appendix B.
#[derive(Debug, Clone)]
pub struct GaussianPosterior {
    /// Means μ, `[batch, latent_channels, rows, columns]`.
    pub mean: Tensor<4>,
    /// Logarithms of the variances ln σ², shaped like the means.
    pub logvar: Tensor<4>,
}

impl GaussianPosterior {
    /// Splits the encoder's result into means and (clamped) log-variances.
    ///
    /// # Shapes
    ///
    /// `[batch, 2 · latent_channels, rows, columns]`
    pub fn from_moments(moments: Tensor<4>) -> Self {
        let channels = moments.dims()[1] / 2;
        Self {
            mean: moments.clone().narrow(1, 0, channels),
            logvar: moments.narrow(1, channels, channels).clamp(-30.0, 20.0),
        }
    }

    /// The most likely latent image: the means.
    pub fn mode(&self) -> Tensor<4> {
        self.mean.clone()
    }

    /// Standard deviations σ.
    pub fn std(&self) -> Tensor<4> {
        (self.logvar.clone() * 0.5).exp()
    }

    /// Draws a latent image from standard normal noise of its shape.
    ///
    /// ```text
    /// z = μ + σ n
    /// ```
    pub fn sample(&self, noise: Tensor<4>) -> Tensor<4> {
        self.mean.clone() + self.std() * noise
    }

    /// Divergence from the standard normal distribution, one number per image.
    ///
    /// ```text
    /// KL = ½ Σ (μ² + σ² − 1 − ln σ²)
    /// ```
    ///
    /// # Shapes
    ///
    /// Result: `[batch]`
    pub fn kl(&self) -> Tensor<1> {
        let (mean, logvar) = (self.mean.clone(), self.logvar.clone());
        sum_per_image((mean.square() + logvar.clone().exp() - 1.0 - logvar) * 0.5)
    }

    /// Divergence from another distribution of this kind, one number per image.
    ///
    /// ```text
    /// KL = ½ Σ ((μ − μ₂)² / σ₂² + σ² / σ₂² − 1 − ln σ² + ln σ₂²)
    /// ```
    ///
    /// # Shapes
    ///
    /// Result: `[batch]`
    pub fn kl_to(&self, other: &Self) -> Tensor<1> {
        let inverse = (-other.logvar.clone()).exp();
        let distance = (self.mean.clone() - other.mean.clone()).square() * inverse.clone();
        let ratio = self.logvar.clone().exp() * inverse;
        let logs = other.logvar.clone() - self.logvar.clone();
        sum_per_image((distance + ratio - 1.0 + logs) * 0.5)
    }

    /// Negative logarithm of the density at a latent image, one number per image.
    ///
    /// ```text
    /// −ln p(z) = ½ Σ (ln 2π + ln σ² + (z − μ)² / σ²)
    /// ```
    ///
    /// # Shapes
    ///
    /// `z`: as the means; result: `[batch]`
    pub fn negative_log_likelihood(&self, z: Tensor<4>) -> Tensor<1> {
        let distance = (z - self.mean.clone()).square() * (-self.logvar.clone()).exp();
        let constant = (2.0 * std::f64::consts::PI).ln();
        sum_per_image((self.logvar.clone() + distance + constant) * 0.5)
    }
}

fn sum_per_image(x: Tensor<4>) -> Tensor<1> {
    let [batch, channels, rows, columns] = x.dims();
    x.reshape([batch, channels * rows * columns])
        .sum_dim(1)
        .reshape([batch])
}
