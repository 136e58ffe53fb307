//! Line of text for one value.

use wake_physics::estimate::Parameter;

/// Name, value, standard deviation and unit.
pub(super) fn line(parameter: Parameter, value: Option<f64>, deviation: f64) -> String {
    let name = parameter.name().replace('_', " ");
    let value = value.map_or(String::new(), |value| format!("{value:9.3} "));
    match deviation.is_finite() {
        true => format!("{name:<12} {value}± {deviation:.3} {}", parameter.unit())
            .trim_end()
            .to_owned(),
        false => format!("{name:<12} not determined"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_those_of_the_parameters() {
        let text = line(Parameter::Size, Some(195.0), 1.5);
        assert_eq!(text, "length         195.000 ± 1.500 m");
        let unknown = line(Parameter::Texture, Some(0.0), f64::INFINITY);
        assert_eq!(unknown, "texture      not determined");
    }
}
