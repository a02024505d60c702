//! A small run to write.

use cloth_core::TextureMap;
use cloth_io::{FrameStore, Topology, TopologyCloth};

/// Two squares of 4 particles; the second has a texture seam along its diagonal.
pub(crate) fn topology() -> Topology {
    let cloth = |name: &str, number: usize| TopologyCloth {
        name: name.to_owned(),
        particles: 4 * number..4 * number + 4,
        triangles: 2 * number..2 * number + 2,
        lines: 0..0,
    };
    Topology {
        triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
        lines: Vec::new(),
        texture: Some(TextureMap {
            coordinates: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]],
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 1, 2], [4, 2, 3]],
        }),
        particle_count: 8,
        cloths: vec![cloth("front & back", 0), cloth("sleeve", 1)],
        frames_per_second: 25.0,
        ..Topology::default()
    }
}

/// Positions [m] of frame `index`.
pub(crate) fn positions(index: usize) -> Vec<[f64; 3]> {
    let shift = 0.125 * index as f64;
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let at = |height: f64| square.map(|[x, y]| [x, y + shift, height + x * shift]);
    [at(0.0), at(1.0)].concat()
}

/// A store with `frame_count` frames.
pub(crate) fn store(path: &std::path::Path, frame_count: usize) -> FrameStore {
    let mut store = FrameStore::create(path, &topology()).expect("a new store");
    for index in 0..frame_count {
        store.append(index as f64 / 25.0, &positions(index)).expect("a new frame");
    }
    store
}
