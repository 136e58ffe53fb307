//! Columns of a matrix, as parts that several cores write.

/// Cuts every row of a matrix at the same columns: for each block of columns, its part of each row.
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
