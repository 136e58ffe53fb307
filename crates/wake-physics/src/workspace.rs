//! Memory buffers and FFT plans that one simulation leaves to the next.
//!
//! A freed block returns to the system, and every page of the next one costs a page fault, in total a quarter of the time
//! of a simulation. Results are unaffected: buffers have any content and are overwritten by their user.

use crate::raster::{Field, Raster};
use num_complex::{Complex, Complex32, Complex64};
use rayon::iter::ParallelIterator;
use rustfft::FftPlanner;

/// Buffers kept for reuse.
#[derive(Debug)]
pub(crate) struct Shelf<T> {
    blocks: Vec<Vec<T>>,
    /// Allocates a block of zeros.
    fresh: fn(usize) -> Vec<T>,
}

impl<T: Copy + Default> Shelf<T> {
    fn new(fresh: fn(usize) -> Vec<T>) -> Self {
        Self {
            blocks: Vec::new(),
            fresh,
        }
    }

    /// Takes a buffer of `len` values with any content.
    pub(crate) fn take(&mut self, len: usize) -> Vec<T> {
        let blocks = &mut self.blocks;
        let fits = |block: &Vec<T>| block.capacity() >= len;
        // The smallest block that fits; if none does, the largest is dropped for a new one.
        let order = |&n: &usize| (!fits(&blocks[n]), blocks[n].capacity().abs_diff(len));
        let block = (0..blocks.len()).min_by_key(order);
        match block.map(|n| blocks.swap_remove(n)) {
            Some(mut block) if block.capacity() >= len => {
                block.resize(len, T::default());
                block
            }
            _ => (self.fresh)(len),
        }
    }

    fn len(&self) -> usize {
        self.blocks.len()
    }

    /// Returns a buffer.
    pub(crate) fn give(&mut self, block: Vec<T>) {
        if block.capacity() > 0 {
            self.blocks.push(block);
        }
    }
}

/// Source of buffers and FFT plans for the stages.
pub(crate) struct Workspace {
    /// Values of fields.
    pub(crate) floats: Shelf<f32>,
    /// Spectra, in single and in double precision.
    pub(crate) spectra: (Shelf<Complex32>, Shelf<Complex64>),
    /// FFTs planned so far.
    pub(crate) planners: (FftPlanner<f32>, FftPlanner<f64>),
}

impl Default for Workspace {
    fn default() -> Self {
        Self {
            // Zeros from the system, whose pages are allocated when a stage first writes to them, on all threads.
            floats: Shelf::new(|len| vec![0.0; len]),
            // Zeros of a compound type are written one by one, hence by all threads.
            spectra: (
                Shelf::new(|len| rayon::iter::repeat_n(Complex::default(), len).collect()),
                Shelf::new(|len| rayon::iter::repeat_n(Complex::default(), len).collect()),
            ),
            planners: (FftPlanner::new(), FftPlanner::new()),
        }
    }
}

impl std::fmt::Debug for Workspace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let spectra = [self.spectra.0.len(), self.spectra.1.len()];
        f.debug_struct("Workspace")
            .field("floats", &self.floats.len())
            .field("spectra", &spectra)
            .finish_non_exhaustive()
    }
}

impl Workspace {
    /// A field with any content.
    pub(crate) fn field(&mut self, raster: &Raster) -> Field {
        Field {
            rows: raster.rows,
            columns: raster.columns,
            values: self.floats.take(raster.len()),
        }
    }

    /// A field that is 0 everywhere.
    pub(crate) fn flat_field(&mut self, raster: &Raster) -> Field {
        let mut field = self.field(raster);
        field.values.fill(0.0);
        field
    }

    /// Takes back the buffer of a field.
    pub(crate) fn give(&mut self, field: Field) {
        self.floats.give(field.values);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The best-fitting block is taken, and there are never more blocks than were in use at once.
    #[test]
    fn blocks_are_used_again() {
        let mut shelf = Shelf::new(|len| vec![7u8; len]);
        let (small, large) = (vec![1u8; 10], vec![2u8; 100]);
        let places = [small.as_ptr(), large.as_ptr()];
        shelf.give(large);
        shelf.give(small);
        let nine = shelf.take(9);
        assert_eq!((nine.as_ptr(), nine.len()), (places[0], 9));
        shelf.give(nine);
        let eleven = shelf.take(11);
        assert_eq!((eleven.as_ptr(), eleven.len()), (places[1], 11));
        shelf.give(eleven);
        // None fits: the large block is replaced by a larger one.
        let block = shelf.take(1000);
        assert_eq!(block, vec![7; 1000]);
        shelf.give(block);
        assert_eq!(shelf.len(), 2);
    }
}
