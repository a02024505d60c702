//! A flat piece, folded.

use std::collections::{HashMap, VecDeque};

use cloth_core::{MeshFold, TriangleMesh};
use glam::{DQuat, DVec3};

/// A rigid motion.
#[derive(Clone, Copy)]
struct Motion {
    turn: DQuat,
    shift: DVec3,
}

impl Motion {
    fn of(self, place: DVec3) -> DVec3 {
        self.turn * place + self.shift
    }
}

/// Where the vertices of a piece are once it is folded along `folds`: every part beyond a line is turned about it, and all of it so that its
/// mean normal looks along z.
/// Lines that end within the piece leave no such shape; then a vertex is in the middle of where its triangles have it.
pub(crate) fn folded(mesh: &TriangleMesh, folds: &[MeshFold]) -> Vec<[f64; 3]> {
    let ends = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
    let angles: HashMap<[u32; 2], f64> =
        folds.iter().map(|fold| (ends(fold.edge), fold.angle)).collect();
    let mut beside: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
    let sides = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];
    for (t, &triangle) in mesh.triangles.iter().enumerate() {
        for side in sides(triangle) {
            beside.entry(ends(side)).or_default().push(t);
        }
    }
    let flat = |i: u32| DVec3::from(mesh.positions[i as usize]);
    let mut motions: Vec<Option<Motion>> = vec![None; mesh.triangles.len()];
    let mut sums = vec![(DVec3::ZERO, 0.0_f64); mesh.positions.len()];
    for first in 0..mesh.triangles.len() {
        if motions[first].is_some() {
            continue;
        }
        motions[first] = Some(Motion { turn: DQuat::IDENTITY, shift: DVec3::ZERO });
        let mut next = VecDeque::from([first]);
        while let Some(t) = next.pop_front() {
            let Some(motion) = motions[t] else { continue };
            for i in mesh.triangles[t] {
                sums[i as usize].0 += motion.of(flat(i));
                sums[i as usize].1 += 1.0;
            }
            for side in sides(mesh.triangles[t]) {
                for &other in beside.get(&ends(side)).into_iter().flatten() {
                    if motions[other].is_some() {
                        continue;
                    }
                    // The triangle is on the left of its side: what is beyond rises towards the normal.
                    let angle = angles.get(&ends(side)).copied().unwrap_or_default();
                    let [a, b] = side.map(flat);
                    let axis = (b - a).normalize_or_zero();
                    let turn = if axis == DVec3::ZERO {
                        DQuat::IDENTITY
                    } else {
                        DQuat::from_axis_angle(axis, -angle)
                    };
                    let about = Motion { turn, shift: a - turn * a };
                    motions[other] = Some(Motion {
                        turn: motion.turn * about.turn,
                        shift: motion.of(about.shift),
                    });
                    next.push_back(other);
                }
            }
        }
    }
    let places: Vec<DVec3> = sums.iter().map(|(sum, count)| *sum / count.max(1.0)).collect();
    let area = |&[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|i| places[i as usize]);
        (b - a).cross(c - a)
    };
    let front: DVec3 = mesh.triangles.iter().map(area).sum();
    let turn = front
        .try_normalize()
        .map_or(DQuat::IDENTITY, |front| DQuat::from_rotation_arc(front, DVec3::Z));
    places.into_iter().map(|place| (turn * place).to_array()).collect()
}
