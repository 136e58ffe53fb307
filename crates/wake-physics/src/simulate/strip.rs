//! Which rows a strip of a large scene has.

use crate::computed::Parts;
use crate::models::Models;
use crate::plan::Plan;
use std::ops::Range;

/// Margins between a strip's image and the edge of what is computed for it.
const OVERLAP: usize = 2;

/// One strip.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Strip {
    /// Rows of the image.
    pub(super) image: Range<usize>,
    /// Rows of the computed image that they are made of; the last may be the first of the next strip as well.
    pub(super) computed: Range<usize>,
    /// Those of them that belong to no other strip.
    pub(super) own: Range<usize>,
    /// Rows of the computed pixels with their margin.
    pub(super) raster: Range<usize>,
}

impl Strip {
    /// All rows.
    pub(super) fn whole(models: &Models, plan: &Plan) -> Self {
        Self {
            image: 0..models.image.rows,
            computed: 0..models.computed.rows,
            own: 0..models.computed.rows,
            raster: 0..models.computed.rows + 2 * plan.sizes.margin[0],
        }
    }

    /// The strips of a plan, from the first row to the last.
    pub(super) fn all(models: &Models, plan: &Plan) -> Vec<Self> {
        let count = plan.sizes.strips;
        let whole = Self::whole(models, plan);
        let parts = Parts::new(&models.computed, &models.image);
        let margin = plan.sizes.margin[0];
        let one = |n: usize| {
            let [start, end] = [n, n + 1].map(|n| n * whole.image.end / count);
            let mut own = parts.rows(&(start..end)).start..parts.rows(&(end..end + 1)).start;
            let mut computed = parts.rows(&(start..end));
            // Around the rows of the strip lie margin rows, then the overlap.
            let mut raster = computed.start.saturating_sub((OVERLAP - 1) * margin)
                ..(computed.end + (OVERLAP + 1) * margin).min(whole.raster.end);
            if n == 0 {
                (own.start, computed.start, raster.start) = (0, 0, 0);
            }
            if n + 1 == count {
                (own.end, computed.end, raster.end) =
                    (whole.own.end, whole.computed.end, whole.raster.end);
            }
            Self {
                image: start..end,
                computed,
                own,
                raster,
            }
        };
        (0..count).map(one).collect()
    }
}
