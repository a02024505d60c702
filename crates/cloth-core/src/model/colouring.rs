//! Springs in groups without a common particle (NUMERICS §4).

use super::{SpringClass, Springs};

/// Springs sorted into colours: no two springs of one colour share a particle, so that all of a
/// colour can be changed at the same time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SpringColouring {
    offsets: Vec<u32>,
    springs: Vec<[u32; 3]>,
}

impl SpringColouring {
    /// Greedy colouring of the springs of the given classes, in the order of the springs: each
    /// takes the smallest colour that is free at both its ends. The same springs always give the
    /// same colours.
    #[must_use]
    pub fn greedy(springs: &Springs, particle_count: usize, classes: &[SpringClass]) -> Self {
        let mut pending: Vec<[u32; 3]> = springs
            .iter()
            .filter(|spring| classes.contains(&springs.kinds()[spring.kind as usize].class))
            .map(|spring| [spring.particles[0], spring.particles[1], spring.kind])
            .collect();
        let mut colouring = Self { offsets: vec![0], springs: Vec::with_capacity(pending.len()) };
        let mut used = vec![0_u64; particle_count];
        // A word holds 64 colours. Springs that find none free wait for the next 64.
        while !pending.is_empty() {
            used.fill(0);
            let mut groups: Vec<Vec<[u32; 3]>> = Vec::new();
            pending.retain(|spring| {
                let taken = used[spring[0] as usize] | used[spring[1] as usize];
                let colour = taken.trailing_ones();
                if colour == u64::BITS {
                    return true;
                }
                used[spring[0] as usize] |= 1 << colour;
                used[spring[1] as usize] |= 1 << colour;
                if groups.len() <= colour as usize {
                    groups.resize_with(colour as usize + 1, Vec::new);
                }
                groups[colour as usize].push(*spring);
                false
            });
            for group in groups {
                colouring.springs.extend(group);
                colouring.offsets.push(colouring.springs.len() as u32);
            }
        }
        colouring
    }

    /// Number of colours.
    #[must_use]
    pub fn len(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// Whether there is no colour.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The springs of one colour, each as its two particles and its kind.
    #[must_use]
    pub fn colour(&self, colour: usize) -> &[[u32; 3]] {
        &self.springs[self.offsets[colour] as usize..self.offsets[colour + 1] as usize]
    }
}
