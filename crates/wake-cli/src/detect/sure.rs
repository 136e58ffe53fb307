//! Confidence of a detection as text.

/// The probability of a detection, or its score if the probability is unknown.
pub(super) fn how_sure(probability: Option<f64>, score: f64) -> String {
    match probability {
        Some(probability) => format!("probability {probability:.2}"),
        None => format!("score {score:.2}"),
    }
}
