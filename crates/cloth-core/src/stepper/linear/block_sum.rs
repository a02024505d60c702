//! The order in which the sums of blocks are added up: the same function of their number everywhere.

/// Values of a tree.
const TREE: usize = 32;

/// The sum of up to 32 values: the second half of 32 places is added to the first, and so on, until one is left.
fn tree(values: &[f64]) -> f64 {
    let mut places = [0.0; TREE];
    places[..values.len()].copy_from_slice(values);
    let mut half = TREE / 2;
    while half > 0 {
        let (low, high) = places.split_at_mut(half);
        low.iter_mut().zip(high).for_each(|(low, high)| *low += *high);
        half /= 2;
    }
    places[0]
}

/// The sum of all blocks: trees of 32 blocks, trees of 32 of these, and the rest in order (NUMERICS §5).
#[must_use]
pub fn block_sum(blocks: impl Iterator<Item = f64>) -> f64 {
    let mut blocks = blocks.fuse();
    let mut total = 0.0;
    loop {
        let mut groups = [0.0; TREE];
        let mut count = 0;
        for group in &mut groups {
            let mut values = [0.0; TREE];
            let mut taken = 0;
            for (value, block) in values.iter_mut().zip(&mut blocks) {
                *value = block;
                taken += 1;
            }
            if taken == 0 {
                break;
            }
            *group = tree(&values[..taken]);
            count += 1;
        }
        if count == 0 {
            return total;
        }
        total += tree(&groups[..count]);
    }
}

#[cfg(test)]
mod tests {
    use super::block_sum;

    #[test]
    fn every_block_counts_once() {
        for count in [0_u32, 1, 31, 32, 33, 1023, 1024, 1025, 5000] {
            let expected = f64::from(count) * (f64::from(count) + 1.0) / 2.0;
            assert_eq!(block_sum((1..=count).map(f64::from)), expected);
        }
    }

    #[test]
    fn blocks_are_added_as_trees() {
        // 1 is lost beside 2^53, but not once it has met another 1.
        let large = 2_f64.powi(53);
        let mut blocks = [0.0; 32];
        [blocks[0], blocks[1], blocks[17]] = [large, 1.0, 1.0];
        assert_eq!(block_sum(blocks.into_iter()), large + 2.0);
        [blocks[1], blocks[17], blocks[16], blocks[8]] = [0.0, 0.0, 1.0, 1.0];
        assert_eq!(block_sum(blocks.into_iter()), large);
    }
}
