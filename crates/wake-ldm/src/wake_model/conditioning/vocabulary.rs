//! Compact vocabulary: of CLIP's 49,408 tokens few occur in prompts about wakes; all others share one id.

use std::collections::BTreeSet;

use wake_physics::Scene;
use wake_text::{Tokenizer, Wording};

use crate::error::Result;

/// CLIP's ids of a prompt, including marks and padding.
pub fn tokens(prompt: &str) -> Vec<u32> {
    Tokenizer::clip().encode(prompt).ids.to_vec()
}

/// CLIP's ids in the vocabulary of a small text transformer, in increasing order.
///
/// Compact id 0 stands for every other token.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Vocabulary {
    known: Vec<u32>,
}

impl Vocabulary {
    /// Makes the vocabulary of the given ids.
    pub fn new(ids: impl IntoIterator<Item = u32>) -> Self {
        let known: BTreeSet<u32> = ids.into_iter().collect();
        Self {
            known: known.into_iter().collect(),
        }
    }

    /// Vocabulary of prompts about wakes: the words of every [`Wording`], and every digit.
    ///
    /// # Errors
    ///
    /// [`Error::Text`](crate::Error::Text) for a scene that cannot be put into words, which the default scenes always can.
    pub fn of_wordings() -> Result<Self> {
        let (ship, mut calm) = (Scene::default(), Scene::default());
        calm.ships.clear();
        calm.sea.wind_speed = 0.0;
        let mut ids = tokens("0 1 2 3 4 5 6 7 8 9 .");
        for scene in [ship, calm] {
            for wording in Wording::ALL {
                ids.extend(tokens(&wording.prompt(&scene)?));
            }
        }
        Ok(Self::new(ids))
    }

    /// CLIP's ids, in increasing order.
    pub fn known(&self) -> &[u32] {
        &self.known
    }

    /// Number of compact ids, including the unknown token.
    pub fn size(&self) -> usize {
        self.known.len() + 1
    }

    /// Compact id of a CLIP id.
    pub fn compact(&self, id: u32) -> usize {
        self.known.binary_search(&id).map_or(0, |at| at + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_ids_have_their_own_number_and_others_share_one() {
        let vocabulary = Vocabulary::new([49406, 7, 320, 7]);
        assert_eq!(vocabulary.known(), [7, 320, 49406]);
        assert_eq!(vocabulary.size(), 4);
        assert_eq!([7, 320, 49406].map(|id| vocabulary.compact(id)), [1, 2, 3]);
        assert_eq!([0, 8, 49407].map(|id| vocabulary.compact(id)), [0, 0, 0]);
    }
}
