//! The four corners that keys hold and let go.

use cloth::{Model, scene::CompiledScene};

/// The particles at the corners of the first cloth: 0 and 1 at the start and end of the first row of a
/// grid, 2 and 3 of the last. Of a mesh, those that lie farthest towards the corners of its box.
#[must_use]
pub fn corner_particles(scene: &CompiledScene) -> [u32; 4] {
    let model = &scene.model;
    let Some(range) = model.cloths().first().map(|cloth| cloth.particles.clone()) else {
        return [0; 4];
    };
    match scene.cloths.first().and_then(|cloth| cloth.grid) {
        Some([columns, _]) => {
            let (start, end) = (range.start, range.end);
            [start, start + columns - 1, end - columns, end - 1]
        }
        None => mesh_corners(model, range),
    }
}

/// Along the two longest sides of the box around the cloth.
fn mesh_corners(model: &Model, range: std::ops::Range<u32>) -> [u32; 4] {
    let positions = &model.positions()[range.start as usize..range.end as usize];
    let bounds = cloth::io::Bounds::of(positions);
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| {
        (bounds.max[b] - bounds.min[b]).total_cmp(&(bounds.max[a] - bounds.min[a]))
    });
    [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]].map(|signs| {
        let reach = |x: &[f64; 3]| signs[0] * x[axes[0]] + signs[1] * x[axes[1]];
        let best = (0..).zip(positions).max_by(|a, b| reach(a.1).total_cmp(&reach(b.1)));
        range.start + best.map_or(0, |(index, _)| index)
    })
}
