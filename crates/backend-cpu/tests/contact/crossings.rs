//! Counts edges that go through triangles, in double precision, pair by pair.

use cloth_core::Model;

/// Edges that go through triangles with which they share no particle.
pub(crate) fn crossings(model: &Model, positions: &[[f64; 3]]) -> usize {
    let mut edges: Vec<[u32; 2]> = (model.triangles().iter())
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    // Sorted along x, so that each edge meets few triangles.
    let at = |i: u32| positions[i as usize];
    let range = |particles: &[u32], axis: usize| {
        let values = particles.iter().map(|&i| at(i)[axis]);
        let low = values.clone().fold(f64::INFINITY, f64::min);
        [low, values.fold(f64::NEG_INFINITY, f64::max)]
    };
    let mut triangles: Vec<_> =
        model.triangles().iter().map(|t| (range(t, 0), range(t, 1), range(t, 2), *t)).collect();
    triangles.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
    let widest = triangles.iter().map(|(x, ..)| x[1] - x[0]).fold(0.0, f64::max);
    let mut count = 0;
    for edge in edges {
        let [x, y, z] = [0, 1, 2].map(|axis| range(&edge, axis));
        let first = triangles.partition_point(|(other, ..)| other[0] < x[0] - widest);
        for (tx, ty, tz, triangle) in &triangles[first..] {
            if tx[0] > x[1] {
                break;
            }
            let apart =
                [(tx, &x), (ty, &y), (tz, &z)].iter().any(|(a, b)| a[0] > b[1] || b[0] > a[1]);
            if apart || triangle.iter().any(|corner| edge.contains(corner)) {
                continue;
            }
            count += usize::from(goes_through(edge.map(at), triangle.map(at)));
        }
    }
    count
}

/// Whether a segment goes through a triangle.
fn goes_through([p, q]: [[f64; 3]; 2], [a, b, c]: [[f64; 3]; 3]) -> bool {
    let side = [volume(a, b, c, p), volume(a, b, c, q)];
    // What lies in the plane of a triangle, to what rounding leaves of a millimetre, does not go through it.
    if side[0] * side[1] >= 0.0 || side[0].abs().min(side[1].abs()) < 1e-16 {
        return false;
    }
    let turns = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    turns.iter().all(|&v| v >= 0.0) || turns.iter().all(|&v| v <= 0.0)
}

/// Six times the volume of a tetrahedron, with its sign.
fn volume(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let [u, v, w] = [a, b, c].map(|p| [p[0] - d[0], p[1] - d[1], p[2] - d[2]]);
    u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
}

#[test]
fn a_needle_through_a_triangle_is_counted() {
    let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    assert!(goes_through([[0.2, 0.2, -1.0], [0.2, 0.2, 1.0]], triangle));
    assert!(!goes_through([[0.8, 0.8, -1.0], [0.8, 0.8, 1.0]], triangle));
    assert!(!goes_through([[0.2, 0.2, 0.5], [0.2, 0.2, 1.0]], triangle));
}
