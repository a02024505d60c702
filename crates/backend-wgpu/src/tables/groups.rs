//! Particles by groups, in the form of `shared/group.wgsl`.

use cloth_core::Model;

use crate::dispatch::GROUP;

/// The particles of all groups. Those of a group ascend: threads side by side then mostly read what lies side by
/// side. Places without a particle come last.
pub(super) fn members(model: &Model) -> Vec<u32> {
    let mut members = model.particle_groups(GROUP as usize);
    for group in members.chunks_mut(GROUP as usize) {
        group.sort_unstable();
    }
    members
}

#[cfg(test)]
mod tests {
    use cloth_core::{Cloth, Geometry, GridPatch, MaterialPreset, ModelBuilder, NONE};

    use super::*;

    #[test]
    fn every_particle_is_in_one_group_and_every_group_begins_with_one() {
        let mut builder = ModelBuilder::new();
        for name in ["a", "b"] {
            builder = builder.cloth(Cloth {
                name: name.to_owned(),
                geometry: Geometry::Grid(GridPatch::horizontal(9, 0.1, 0.0)),
                material: MaterialPreset::ALL[0].material(0.1).into(),
                pins: vec![],
                velocity: [0.0; 3],
            });
        }
        let members = members(&builder.build().unwrap());
        let mut particles: Vec<u32> = Vec::new();
        for group in members.chunks(GROUP as usize) {
            assert_ne!(group[0], NONE);
            assert!(group.is_sorted());
            particles.extend(group.iter().filter(|&&particle| particle != NONE));
        }
        particles.sort_unstable();
        assert!(particles.into_iter().eq(0..162));
    }
}
