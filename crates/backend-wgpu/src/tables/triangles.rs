//! The triangles around each particle, in the form of `shared/triangles.wgsl`.

use cloth_core::Model;

/// Contents of `triangle_rows` and `triangles`.
pub(super) fn tables(model: &Model) -> (Vec<u32>, Vec<[u32; 4]>) {
    let count = model.particle_count();
    let mut rows = vec![0_u32; count + 1 + 3 * model.triangles().len()];
    let (offsets, list) = rows.split_at_mut(count + 1);
    for &vertex in model.triangles().iter().flatten() {
        offsets[vertex as usize + 1] += 1;
    }
    for particle in 0..count {
        offsets[particle + 1] += offsets[particle];
    }
    let mut next = offsets.to_vec();
    for (number, triangle) in model.triangles().iter().enumerate() {
        for &vertex in triangle {
            let slot = &mut next[vertex as usize];
            list[*slot as usize] = number as u32;
            *slot += 1;
        }
    }
    let mut triangles = Vec::with_capacity(model.triangles().len());
    for (cloth, range) in model.cloths().iter().enumerate() {
        let range = range.triangles.start as usize..range.triangles.end as usize;
        let corners = model.triangles()[range].iter();
        triangles.extend(corners.map(|&[a, b, c]| [a, b, c, cloth as u32]));
    }
    (rows, triangles)
}
