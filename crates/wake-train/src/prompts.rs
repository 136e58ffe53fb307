//! Random prompts and the values they state.

use crate::error::Result;
use crate::streams;
use wake_dataset::Simulated;
use wake_nn::noise::NoiseSource;
use wake_text::{PartialScene, Wording};

/// Random numbers per prompt.
const DRAWS: u64 = 8;
/// Share of the prompts whose sentences are rearranged.
const MOVED: f64 = 0.5;
/// Share of the sentences left out of rearranged prompts.
const LEFT_OUT: f64 = 0.2;

/// Prompts of random scenes in every wording; half of them have sentences rearranged or left out.
#[derive(Debug, Clone)]
pub(crate) struct Prompts {
    scenes: Simulated,
}

impl Prompts {
    /// Prompts of the scenes of a set.
    pub(crate) fn new(scenes: Simulated) -> Self {
        Self { scenes }
    }

    /// Prompt number `position`, and the values that [`wake_text`] reads from it.
    ///
    /// # Errors
    ///
    /// [`Error::Text`](crate::Error::Text) for a scene that no prompt can state.
    pub(crate) fn prompt(&self, position: u64) -> Result<(String, PartialScene)> {
        let random = NoiseSource::new(self.scenes.seed());
        let draw = |i: u64| random.uniform(streams::PROMPTS, position * DRAWS + i);
        let wording = Wording::ALL[(draw(0) * Wording::ALL.len() as f64) as usize];
        let text = wording.prompt(&self.scenes.scene(position)?)?;
        let text = if draw(1) < MOVED {
            rearranged(&text, |i| draw(2 + i))
        } else {
            text
        };
        let said = PartialScene::read(&text)?;
        Ok((text, said))
    }
}

/// Shuffles the sentences of a prompt and leaves some out.
///
/// - `draw`: returns uniform number i
fn rearranged(text: &str, draw: impl Fn(u64) -> f64) -> String {
    let sentences = text.trim_end_matches('.').split(". ");
    let mut kept: Vec<(f64, &str)> = sentences
        .enumerate()
        .map(|(i, sentence)| (draw(i as u64), sentence))
        .filter(|&(draw, _)| draw >= LEFT_OUT)
        .collect();
    kept.sort_by(|a, b| a.0.total_cmp(&b.0));
    let sentences: Vec<&str> = kept.into_iter().map(|(_, sentence)| sentence).collect();
    sentences.join(". ") + "."
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_dataset::Recipe;

    fn prompts() -> Prompts {
        Prompts::new(Simulated::new(Recipe::default(), 3).unwrap())
    }

    #[test]
    fn prompts_are_a_function_of_their_number_and_state_what_is_said_of_them() {
        let prompts = prompts();
        let mut texts = std::collections::BTreeSet::new();
        let mut gaps = 0;
        for position in 0..200 {
            let (text, said) = prompts.prompt(position).unwrap();
            assert_eq!(prompts.prompt(position).unwrap(), (text.clone(), said));
            let again = PartialScene::read(&text).unwrap();
            assert_eq!(again, said, "{text}");
            gaps += usize::from(said.incidence.is_none());
            texts.insert(text);
        }
        assert!(texts.len() > 190, "{}", texts.len());
        // Three quarters of the wordings have sentences, half of these prompts are rearranged, a fifth of their sentences is
        // left out: 15 of 200 expected.
        assert!((3..40).contains(&gaps), "{gaps}");
    }

    #[test]
    fn sentences_change_places() {
        let draws = [0.9, 0.1, 0.5];
        let text = rearranged("One. Two. Three.", |i| draws[i as usize]);
        assert_eq!(text, "Three. One.");
    }
}
