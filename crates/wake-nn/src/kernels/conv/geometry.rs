//! Sizes of a convolution.

/// Sizes of a convolution with a square kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Geometry {
    /// Number of images.
    pub(crate) batch: usize,
    /// Channels in and out.
    pub(crate) channels: [usize; 2],
    /// Rows and columns of the input image.
    pub(crate) size: [usize; 2],
    /// Rows and columns of the kernel.
    pub(crate) kernel: usize,
    /// Pixels between two outputs.
    pub(crate) stride: usize,
    /// Zeros above, left, below and right of the image.
    pub(crate) border: [usize; 4],
}

impl Geometry {
    /// Rows and columns of the output image.
    pub(crate) fn size_out(&self) -> [usize; 2] {
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
