//! Connected pieces of cloth.

use crate::Model;

impl Model {
    /// The particles of each piece of two and more that interactions in the matrix connect, ascending; pieces in the order of
    /// their first particles.
    #[must_use]
    pub fn connected_pieces(&self) -> Vec<Vec<u32>> {
        let mut parent = self.pieces();
        let mut members = vec![Vec::new(); parent.len()];
        for particle in 0..parent.len() as u32 {
            members[root(&mut parent, particle) as usize].push(particle);
        }
        members.retain(|piece| piece.len() > 1);
        members
    }

    /// How many particles the largest piece has.
    #[must_use]
    pub fn largest_piece(&self) -> usize {
        let mut parent = self.pieces();
        let mut sizes = vec![0; parent.len()];
        for particle in 0..parent.len() as u32 {
            sizes[root(&mut parent, particle) as usize] += 1;
        }
        sizes.into_iter().max().unwrap_or_default()
    }

    /// For each particle one before it in its piece, or itself: the first one.
    fn pieces(&self) -> Vec<u32> {
        let mut parent: Vec<u32> = (0..self.particle_count() as u32).collect();
        self.interactions().in_matrix().for_each(|particles| {
            for pair in particles.windows(2) {
                let [a, b] = [pair[0], pair[1]].map(|particle| root(&mut parent, particle));
                // The smaller one, for the order of the pieces.
                parent[a.max(b) as usize] = a.min(b);
            }
        });
        parent
    }
}

/// The first particle of a piece; halves the way to it.
fn root(parent: &mut [u32], mut particle: u32) -> u32 {
    while parent[particle as usize] != particle {
        let above = parent[parent[particle as usize] as usize];
        parent[particle as usize] = above;
        particle = above;
    }
    particle
}

#[cfg(test)]
mod tests {
    use crate::{
        Cloth, Geometry, Mass, MaterialPreset, ModelBuilder, NetworkSpring, SpringClass,
        SpringNetwork,
    };

    #[test]
    fn pieces_are_what_springs_connect() {
        let spring = |particles| NetworkSpring {
            particles,
            class: SpringClass::Stretch,
            rest_length: None,
            coefficients: None,
        };
        let network = SpringNetwork {
            positions: (0..6).map(|i| [f64::from(i), 0.0, 0.0]).collect(),
            springs: [[3, 5], [1, 4], [0, 2], [4, 2]].map(spring).to_vec(),
        };
        let mut material = MaterialPreset::ALL[0].material(1.0);
        // It has no area.
        material.mass = Mass::PerParticle(1.0);
        let cloth = Cloth {
            name: "net".into(),
            geometry: Geometry::Network(network),
            material: material.into(),
            pins: vec![],
            velocity: [0.0; 3],
        };
        let model = ModelBuilder::new().cloth(cloth).build().unwrap();
        assert_eq!(model.connected_pieces(), [vec![0, 1, 2, 4], vec![3, 5]]);
    }
}
