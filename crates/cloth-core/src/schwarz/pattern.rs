//! Which groups a matrix couples.

use crate::Interactions;

/// The groups that each group is coupled with by what never changes, itself among them, ascending.
#[derive(Clone, Debug)]
pub struct GroupPattern {
    starts: Vec<u32>,
    columns: Vec<u32>,
}

impl GroupPattern {
    /// That of particles of these groups and their interactions.
    #[must_use]
    pub fn new(group_of: &[u32], group_count: usize, interactions: &Interactions<'_>) -> Self {
        let mut pairs: Vec<[u32; 2]> = (0..group_count as u32).map(|group| [group; 2]).collect();
        let mut groups = Vec::new();
        interactions.for_each(|particles| {
            groups.clear();
            for &particle in particles {
                let group = group_of[particle as usize];
                if !groups.contains(&group) {
                    groups.push(group);
                }
            }
            if groups.len() > 1 {
                pairs.extend(groups.iter().flat_map(|&a| groups.iter().map(move |&b| [a, b])));
            }
        });
        let (starts, columns) = rows(pairs, group_count);
        Self { starts, columns }
    }

    /// Starts and columns of the rows of the coarse matrix, where these pairs of groups are coupled as well.
    #[must_use]
    pub fn with(&self, more: impl Iterator<Item = [u32; 2]>) -> (Vec<u32>, Vec<u32>) {
        let group_count = self.starts.len() - 1;
        let mut pairs: Vec<[u32; 2]> = more.flat_map(|[a, b]| [[a, b], [b, a]]).collect();
        if pairs.is_empty() {
            return (self.starts.clone(), self.columns.clone());
        }
        for group in 0..group_count {
            let row = self.starts[group] as usize..self.starts[group + 1] as usize;
            pairs.extend(self.columns[row].iter().map(|&column| [group as u32, column]));
        }
        rows(pairs, group_count)
    }
}

/// Pairs as rows.
fn rows(mut pairs: Vec<[u32; 2]>, count: usize) -> (Vec<u32>, Vec<u32>) {
    pairs.sort_unstable();
    pairs.dedup();
    let mut starts = vec![0_u32; count + 1];
    for [row, _] in &pairs {
        starts[*row as usize + 1] += 1;
    }
    for row in 0..count {
        starts[row + 1] += starts[row];
    }
    (starts, pairs.into_iter().map(|[_, column]| column).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Cloth, GridPatch, GroupHierarchy, MaterialPreset, ModelBuilder, Neighbours,
        schwarz::Schwarz,
    };

    #[test]
    fn a_pattern_is_that_of_the_particles_and_of_more_pairs() {
        let cloth = Cloth::grid("c", GridPatch::horizontal(20, 0.02, 0.0), &MaterialPreset::JERSEY);
        let model = ModelBuilder::new().cloth(cloth).build().unwrap();
        let schwarz = Schwarz::new(GroupHierarchy::new(&model));
        let neighbours = Neighbours::new(&model.interactions().in_matrix());
        let group_of = schwarz.group_of();
        let count = schwarz.group_starts().len() - 1;
        let pattern = GroupPattern::new(group_of, count, &model.interactions().in_matrix());
        let more = [[0_u32, count as u32 - 1]];
        let (starts, columns) = pattern.with(more.into_iter());
        for row in 0..count {
            let found = &columns[starts[row] as usize..starts[row + 1] as usize];
            let mut expected = vec![row as u32];
            for i in (0..400).filter(|&i| group_of[i] as usize == row) {
                expected.extend(neighbours.row(i).iter().map(|&j| group_of[j as usize]));
            }
            expected.extend((row == 0).then_some(count as u32 - 1));
            expected.extend((row == count - 1).then_some(0));
            expected.sort_unstable();
            expected.dedup();
            assert_eq!(found, expected);
        }
    }
}
