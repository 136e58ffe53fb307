//! What several rows share, because it is slow.

use wake_physics::DirectPixels;

/// Seconds of an oracle, and its values.
type Exact = (f64, Vec<f64>);

/// What several rows share, because it is slow.
#[derive(Default)]
pub(crate) struct Memo {
    /// Seconds and exact σ⁰ of the sample, by stage and size.
    backscatter: Vec<(&'static str, usize, Exact)>,
    /// Pixels of the scene by the oracles, by size.
    scene: Vec<(usize, DirectPixels)>,
}

impl Memo {
    pub(crate) fn at_size(
        &mut self,
        stage: &'static str,
        size: usize,
        compute: impl FnOnce() -> Exact,
    ) -> &Exact {
        let mut known = self.backscatter.iter();
        let known = known.position(|known| (known.0, known.1) == (stage, size));
        let index = known.unwrap_or_else(|| {
            self.backscatter.push((stage, size, compute()));
            self.backscatter.len() - 1
        });
        &self.backscatter[index].2
    }

    pub(crate) fn scene_at(
        &mut self,
        size: usize,
        compute: impl FnOnce() -> wake_physics::Result<DirectPixels>,
    ) -> wake_physics::Result<&DirectPixels> {
        let known = self.scene.iter().position(|(s, _)| *s == size);
        let index = match known {
            Some(index) => index,
            None => {
                self.scene.push((size, compute()?));
                self.scene.len() - 1
            }
        };
        Ok(&self.scene[index].1)
    }
}
