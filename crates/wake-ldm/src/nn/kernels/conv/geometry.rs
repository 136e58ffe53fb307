//! Sizes of a convolution.

/// Sizes of a convolution with a square kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::nn) struct Geometry {
    /// Images.
    pub(in crate::nn) batch: usize,
    /// Channels in and out.
    pub(in crate::nn) channels: [usize; 2],
    /// Rows and columns of the image that comes in.
    pub(in crate::nn) size: [usize; 2],
    /// Rows and columns of the kernel.
    pub(in crate::nn) kernel: usize,
    /// Pixels between two outputs.
    pub(in crate::nn) stride: usize,
    /// Zeros above, left, below and right of the image.
    pub(in crate::nn) border: [usize; 4],
}

impl Geometry {
    /// Rows and columns of the image that goes out.
    pub(in crate::nn) fn size_out(&self) -> [usize; 2] {
        let [top, left, bottom, right] = self.border;
        let out = |size, border| (size + border - self.kernel) / self.stride + 1;
        [
            out(self.size[0], top + bottom),
            out(self.size[1], left + right),
        ]
    }

    pub(super) fn pixels_out(&self) -> usize {
        let [rows, columns] = self.size_out();
        rows * columns
    }

    /// Length of a row of the weight matrix: `channels in · kernel · kernel`.
    pub(super) fn patch(&self) -> usize {
        self.channels[0] * self.kernel * self.kernel
    }
}
