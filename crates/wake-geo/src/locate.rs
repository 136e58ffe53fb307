//! Place, calibration and σ⁰ of single pixels.

use crate::error::{Result, check_range};
use crate::product::Product;

/// Place, calibration and σ⁰ of one pixel.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Located {
    /// Line, from 0.
    pub line: usize,
    /// Pixel, from 0.
    pub pixel: usize,
    /// Latitude on WGS84 \[degrees\].
    pub latitude: f64,
    /// Longitude on WGS84 \[degrees\].
    pub longitude: f64,
    /// Incidence angle \[degrees\]; `None` for images other than Sentinel-1 products.
    pub incidence: Option<f64>,
    /// Two-way slant range time \[s\]; `None` for images other than Sentinel-1 products.
    pub slant_range_time: Option<f64>,
    /// A of σ⁰ = (DN² − noise) / A²; `None` for images other than Sentinel-1 products.
    pub sigma_nought_lut: Option<f64>,
    /// Thermal noise \[DN²\]; `None` for images other than Sentinel-1 products.
    pub noise: Option<f64>,
    /// σ⁰, linear; `None` for no data, or if there is neither a measurement nor a given number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma0: Option<f64>,
}

/// Describes a pixel of a product. σ⁰ uses `digital_number` if given, else the number in the measurement.
///
/// # Errors
/// A pixel outside the image, an image without places, a measurement that cannot be read, a digital number below 0 or
/// not finite.
pub fn locate(
    product: &Product,
    line: usize,
    pixel: usize,
    digital_number: Option<f64>,
) -> Result<Located> {
    let (at_line, at_pixel) = (line as f64, pixel as f64);
    let (lines, pixels) = product.size();
    check_range("line", at_line, 0.0, lines as f64 - 1.0)?;
    check_range("pixel", at_pixel, 0.0, pixels as f64 - 1.0)?;
    let place = product.place(at_line, at_pixel)?;
    if let Some(number) = digital_number {
        check_range("digital number", number, 0.0, 1e9)?;
    }
    let sentinel1 = product.sentinel1();
    let calibration = sentinel1.map(|product| product.calibration(at_line, at_pixel));
    let number = match (digital_number, sentinel1) {
        (Some(number), _) => Some(number),
        (None, Some(sentinel1)) if sentinel1.has_measurement() => {
            let mut number = [0.0];
            sentinel1.digital_numbers(line..line + 1, pixel..pixel + 1, &mut number)?;
            Some(f64::from(number[0])).filter(|&number| number > 0.0)
        }
        _ => None,
    };
    Ok(Located {
        line,
        pixel,
        latitude: place.latitude,
        longitude: place.longitude,
        incidence: place.incidence,
        slant_range_time: place.slant_range_time,
        sigma_nought_lut: calibration.map(|c| c.sigma_nought_lut),
        noise: calibration.map(|c| c.noise),
        sigma0: calibration
            .zip(number)
            .map(|(c, number)| c.sigma_nought(number)),
    })
}
