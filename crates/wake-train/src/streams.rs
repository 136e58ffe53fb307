//! Streams of random numbers of training and evaluation; see [`wake_nn::noise`].

/// Normal numbers: the noise of fine-tuning.
pub(crate) const FINE_TUNE_STREAM: u32 = 3;

/// Prompts without images.
pub(crate) const PROMPTS: u32 = 1002;
/// Noise levels of examples.
pub(crate) const LEVELS: u32 = 2000;
/// Latent pixels of examples.
pub(crate) const CELLS: u32 = 2001;
/// Places of patches in a two-sample test.
pub(crate) const PLACES: u32 = 2002;
/// Places of the training patches of a sea.
pub(crate) const SEA_PLACES: u32 = 2003;
/// Diffusion steps of training examples.
pub(crate) const STEPS: u32 = 2100;
/// Prompts left out in text-to-image training.
pub(crate) const LEFT_OUT: u32 = 2101;
/// Pairs of fine-tuning.
pub(crate) const PAIRS: u32 = 2200;
/// Prompts left out in fine-tuning.
pub(crate) const UNTOLD: u32 = 2201;

#[cfg(test)]
mod tests {
    use super::*;
    use wake_dataset::streams::{ORDER, SEEDS, VALUES, WORDINGS};
    use wake_ldm::streams::*;

    /// Each purpose has its own streams; the last range is open-ended.
    #[test]
    fn streams_do_not_overlap() {
        let one = |stream| (stream, 1);
        let normal = [
            one(INITIAL_STREAM),
            one(POSTERIOR_STREAM),
            one(WHITE_STREAM),
            one(FINE_TUNE_STREAM),
            one(SEA_TEXTURE_STREAM),
            (STEP_STREAM, u32::MAX - STEP_STREAM),
        ];
        let uniform = [
            one(SEEDS),
            one(WORDINGS),
            one(PROMPTS),
            one(STYLES),
            one(LEVELS),
            one(CELLS),
            one(PLACES),
            one(SEA_PLACES),
            one(STEPS),
            one(LEFT_OUT),
            one(PAIRS),
            one(UNTOLD),
            (ORDER, VALUES - ORDER),
            (VALUES, u32::MAX - VALUES),
        ];
        for streams in [&normal[..], &uniform] {
            let ends = streams.windows(2).all(|w| w[0].0 + w[0].1 <= w[1].0);
            assert!(ends, "{streams:?}");
        }
    }
}
