//! The one inner loop of all dense products.

use cloth_core::Real;

use super::TILE;

/// Three sums for each row of a tile.
pub(crate) type TileSums<T> = [[T; TILE]; 3];

/// The product of a tile, [`TILE`] rows kept column by column, with three vectors. Even and odd
/// columns are summed apart, which hides the latency of additions, and then together.
#[inline(always)]
pub(crate) fn tile_product<T: Real>(tile: &[T], [x, y, z]: [&[T]; 3]) -> TileSums<T> {
    let mut even = [[T::ZERO; TILE]; 3];
    let mut odd = [[T::ZERO; TILE]; 3];
    let (columns, _) = tile.as_chunks::<TILE>();
    let (pairs, last) = columns.as_chunks::<2>();
    let [xs, ys, zs] = [x, y, z].map(|component| component.as_chunks::<2>().0);
    for (((pair, x), y), z) in pairs.iter().zip(xs).zip(ys).zip(zs) {
        accumulate(&pair[0], [x[0], y[0], z[0]], &mut even);
        accumulate(&pair[1], [x[1], y[1], z[1]], &mut odd);
    }
    if let [column] = last {
        let place = columns.len() - 1;
        accumulate(column, [x[place], y[place], z[place]], &mut even);
    }
    for axis in 0..3 {
        for row in 0..TILE {
            even[axis][row] += odd[axis][row];
        }
    }
    even
}

#[inline(always)]
fn accumulate<T: Real>(column: &[T; TILE], factors: [T; 3], sums: &mut TileSums<T>) {
    for axis in 0..3 {
        for row in 0..TILE {
            sums[axis][row] += column[row] * factors[axis];
        }
    }
}
