//! Grey levels of fields.

use wake_physics::Field;
use wake_physics::grey::GreyScale;

/// Levels that use the whole range.
pub(crate) fn filling(field: &Field) -> Vec<u8> {
    let grey = GreyScale::filling(field);
    let level = |&value: &f32| grey.level(f64::from(value));
    field.values.iter().map(level).collect()
}

/// Levels of a signed field: mid-grey is zero, black and white are three standard deviations.
pub(crate) fn signed(field: &Field) -> Vec<u8> {
    let scale = 3.0 * field.rms().max(1e-9);
    let level = |&value: &f32| (127.5 * (1.0 + f64::from(value) / scale)).clamp(0.0, 255.0) as u8;
    field.values.iter().map(level).collect()
}

/// Levels linear in amplitude, as in quick-looks.
pub(crate) fn amplitude(field: &Field) -> Vec<u8> {
    let grey = GreyScale::amplitude_around(field.mean());
    let level = |&value: &f32| grey.level(f64::from(value));
    field.values.iter().map(level).collect()
}
