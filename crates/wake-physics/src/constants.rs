//! Physical constants, each with value, unit and source.

/// Standard acceleration of gravity g [m/s²] (CGPM 1901).
pub const GRAVITY: f64 = 9.80665;

/// Speed of light in vacuum c [m/s] (exact, SI).
pub const SPEED_OF_LIGHT: f64 = 299_792_458.0;

/// Density of sea water ρ [kg/m³] at 15–20 °C and 35 psu, rounded (ITTC 7.5-02-01-03).
pub const SEA_WATER_DENSITY: f64 = 1025.0;

/// Kinematic surface tension τ/ρ of sea water [m³/s²], about 0.074 N/m over 1025 kg/m³.
pub const KINEMATIC_SURFACE_TENSION: f64 = 7.2e-5;

/// Von Kármán's constant κ \[1\], as used with the logarithmic wind profile.
pub const VON_KARMAN: f64 = 0.4;
