//! The sides of a tear come apart.

use std::collections::HashMap;

use glam::DVec3;

use super::Tears;
use crate::model::{Model, VertexClasses, Weld};

/// Share of the shortest edge at a vertex by which it moves at most where it is parted.
const SHARE_MAX: f64 = 0.02;

impl Tears {
    /// Which corners are one place where nothing is torn.
    pub(in crate::model) fn places(&self, corners: usize) -> VertexClasses {
        let mut classes = VertexClasses::new(corners);
        self.join(&mut classes, true);
        classes
    }
}

impl Weld {
    /// Positions \[m\] of the corners of `model`, of which this is a weld that joins fewer of them than the one `before`: where a vertex became
    /// several, each moves by `gap` \[m\], or by a fiftieth of the shortest edge there, towards the middle of its triangles. So they lie apart, as
    /// contact needs it.
    #[must_use]
    pub fn parted(
        &self,
        model: &Model,
        before: &Self,
        positions: &[[f64; 3]],
        gap: f64,
    ) -> Vec<[f64; 3]> {
        let mut parted = positions.to_vec();
        let places = model.tears().places(model.particle_count());
        part((model.triangles(), &places), (&self.map, Some(&before.map)), &mut parted, gap);
        parted
    }

    /// The same for positions of before it tore: corners of one vertex are those at one place.
    #[must_use]
    pub fn parted_from(&self, model: &Model, positions: &[[f64; 3]], gap: f64) -> Vec<[f64; 3]> {
        let mut parted = positions.to_vec();
        let places = model.tears().places(model.particle_count());
        let mut vertices = HashMap::new();
        let before = (0..).zip(positions).map(|(corner, position)| {
            let at = position.map(f64::to_bits);
            *vertices.entry((places.of(corner), at)).or_insert(corner)
        });
        let before: Vec<u32> = before.collect();
        part((model.triangles(), &places), (&self.map, Some(&before)), &mut parted, gap);
        parted
    }
}

/// Moves apart the corners of `triangles` that are one of `places` and not one in `map`, if they were in `before`.
pub(in crate::model) fn part(
    (triangles, places): (&[[u32; 3]], &VertexClasses),
    (map, before): (&[u32], Option<&[u32]>),
    positions: &mut [[f64; 3]],
    gap: f64,
) {
    let sizes = |map: &[u32]| {
        let mut sizes = vec![0_u32; map.iter().max().map_or(0, |last| *last as usize + 1)];
        map.iter().for_each(|&became| sizes[became as usize] += 1);
        sizes
    };
    let (now, then) = (sizes(map), before.map(sizes));
    let is_new = |corner: usize| match (before, &then) {
        (Some(before), Some(then)) => then[before[corner] as usize] != now[map[corner] as usize],
        _ => true,
    };
    // Vertices that have to move: new ones, beside another one of the same place.
    let mut moves = vec![false; now.len()];
    for corner in 0..map.len() {
        let first = places.of(corner as u32) as usize;
        if map[first] != map[corner] {
            for one in [first, corner] {
                moves[map[one] as usize] |= is_new(one);
            }
        }
    }
    if !moves.contains(&true) {
        return;
    }
    // Where to, and the shortest edge there.
    let mut ways = vec![(DVec3::ZERO, f64::INFINITY); now.len()];
    for triangle in triangles {
        let corners = triangle.map(|corner| DVec3::from(positions[corner as usize]));
        for (k, &corner) in triangle.iter().enumerate() {
            let became = map[corner as usize] as usize;
            if moves[became] {
                let edges = [1, 2].map(|side| corners[(k + side) % 3] - corners[k]);
                let (way, shortest) = &mut ways[became];
                *way += (edges[0] + edges[1]).normalize_or_zero();
                *shortest = edges.iter().fold(*shortest, |least, edge| least.min(edge.length()));
            }
        }
    }
    for (position, &became) in positions.iter_mut().zip(map) {
        if moves[became as usize] {
            let (way, shortest) = ways[became as usize];
            let step = gap.min(SHARE_MAX * shortest) * way.normalize_or_zero();
            *position = (DVec3::from(*position) + step).into();
        }
    }
}
