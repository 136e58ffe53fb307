//! Columns of a matrix in blocks that several cores can write.

/// Splits every row of a matrix at the same columns; returns each block of columns as its parts of all rows.
pub(super) fn columns(matrix: &mut [f32], row: usize, block: usize) -> Vec<Vec<&mut [f32]>> {
    let rows = matrix.len() / row;
    let mut blocks: Vec<Vec<&mut [f32]>> = (0..row.div_ceil(block))
        .map(|_| Vec::with_capacity(rows))
        .collect();
    for row in matrix.chunks_mut(row) {
        for (block, part) in blocks.iter_mut().zip(row.chunks_mut(block)) {
            block.push(part);
        }
    }
    blocks
}
