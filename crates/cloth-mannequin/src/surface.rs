//! Triangles of the surface of a body.

use fast_surface_nets::{
    SurfaceNetsBuffer,
    ndshape::{RuntimeShape, Shape},
    surface_nets,
};
use glam::DVec3;

use crate::{body::Body, flips::flip};

/// How often vertices are moved to the middle of their neighbours, along the surface.
const ROUNDS: usize = 8;
/// Side of the cells of the grid, in edges: those within cells are shorter than their sides.
const CELL: f64 = 1.1;

/// The triangles of a body, with edges of about `edge` \[m\], counter-clockwise from outside.
pub(crate) fn surface(body: &Body, edge: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = nets(body, CELL * edge);
    onto(body, edge, &mut positions);
    for _ in 0..ROUNDS {
        flip(&positions, &mut triangles);
        let neighbours = neighbours(positions.len(), &triangles);
        let middle = |(at, near): (&DVec3, &Vec<u32>)| {
            let sum: DVec3 = near.iter().filter_map(|&n| positions.get(n as usize)).sum();
            let pull = sum / near.len().max(1) as f64 - *at;
            let normal = body.gradient(*at).normalize_or_zero();
            *at + 0.6 * (pull - pull.dot(normal) * normal)
        };
        positions = positions.iter().zip(&neighbours).map(middle).collect();
        onto(body, edge, &mut positions);
    }
    (positions, triangles)
}

/// Surface nets (Gibson 1998) of the field on a grid.
fn nets(body: &Body, cell: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let h = body.height;
    // Arms and head fit with two cells to spare; no sample is at the ground, where the field of the soles is zero.
    let half = DVec3::new(0.48, 0.16, 0.0) * h;
    let cells = (half / cell).ceil().as_uvec3() + 2;
    let counts = [2 * cells.x + 1, 2 * cells.y + 1, (h / cell).ceil() as u32 + 6];
    let corner = DVec3::new(-f64::from(cells.x), -f64::from(cells.y), -2.5) * cell;
    let shape = RuntimeShape::<u32, 3>::new(counts);
    let sample = |number: u32| {
        let [x, y, z] = shape.delinearize(number).map(f64::from);
        body.distance(corner + cell * DVec3::new(x, y, z)) as f32
    };
    let mut samples: Vec<f32> = (0..shape.size()).map(sample).collect();
    well_compose(&mut samples, counts, cell as f32);
    let mut found = SurfaceNetsBuffer::default();
    surface_nets(&samples, &shape, [0; 3], counts.map(|count| count - 1), &mut found);
    let place = |at: &[f32; 3]| corner + cell * DVec3::from(at.map(f64::from));
    let (triples, _) = found.indices.as_chunks::<3>();
    (found.positions.iter().map(place).collect(), triples.to_vec())
}

/// Moves vertices onto the surface, by steps of Newton's method along the gradient.
fn onto(body: &Body, edge: f64, positions: &mut [DVec3]) {
    for at in positions {
        for _ in 0..2 {
            let gradient = body.gradient(*at);
            let step = body.distance(*at) / gradient.length_squared().max(0.1) * gradient;
            *at -= step.clamp_length_max(edge / 2.0);
        }
    }
}

/// The vertices that share an edge with each vertex, in ascending order.
fn neighbours(count: usize, triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut lists = vec![Vec::new(); count];
    for &[a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            if let Some(list) = lists.get_mut(from as usize) {
                list.push(to);
            }
        }
    }
    lists
}

/// Takes samples into the body until those inside are well-composed (Latecki 1997), which makes the surface around them a manifold: no two of
/// a face or a cell of the grid touch at a corner alone. Vertices come back to the surface later.
fn well_compose(samples: &mut [f32], counts: [u32; 3], cell: f32) {
    let counts = counts.map(|count| count as usize);
    let strides = [1, counts[0], counts[0] * counts[1]];
    // The corners of a face from its own, and two opposite corners of a cell with the six others.
    let faces =
        [[0, 1], [1, 2], [0, 2]].map(|[a, b]| [0, strides[a] + strides[b], strides[a], strides[b]]);
    let corner =
        |bits: usize| (0..3).filter(|k| bits >> k & 1 == 1).map(|k| strides[k]).sum::<usize>();
    let cells = [0, 1, 2, 4].map(|one: usize| {
        let mut corners: Vec<usize> =
            (0..8).filter(|&bits| bits != one && bits != 7 - one).map(corner).collect();
        corners.splice(0..0, [corner(one), corner(7 - one)]);
        corners
    });
    let groups: Vec<&[usize]> =
        faces.iter().map(|face| &face[..]).chain(cells.iter().map(|cell| &cell[..])).collect();
    let end = samples.len() - strides.iter().sum::<usize>();
    loop {
        let mut changed = false;
        for at in 0..end {
            for group in &groups {
                let inside = |&offset: &usize| samples[at + offset] < 0.0;
                let (pair, others) = group.split_at(2);
                let apart = (pair.iter().all(inside) && !others.iter().any(inside))
                    || (!pair.iter().any(inside) && others.iter().all(inside));
                if apart {
                    // The least outside goes in.
                    let outside =
                        group.iter().map(|offset| at + offset).filter(|&k| samples[k] >= 0.0);
                    if let Some(least) = outside.min_by(|&a, &b| samples[a].total_cmp(&samples[b]))
                    {
                        samples[least] = -0.1 * cell;
                        changed = true;
                    }
                }
            }
        }
        if !changed {
            return;
        }
    }
}
