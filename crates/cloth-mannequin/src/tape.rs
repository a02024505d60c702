//! A tape measure.

/// What a tape reads that is laid around the part of a closed mesh that is around the z axis, level at height `z` \[m\]: arms are apart from the trunk, and left out.
/// 0 where there is nothing.
#[must_use]
pub fn girth(positions: &[[f64; 3]], triangles: &[[u32; 3]], z: f64) -> f64 {
    let cut = |a: [f64; 3], b: [f64; 3]| {
        let share = (z - a[2]) / (b[2] - a[2]);
        ((a[2] < z) != (b[2] < z)).then(|| [0, 1].map(|k| a[k] + share * (b[k] - a[k])))
    };
    // The section in pieces, each from one edge of the mesh to another one, and joined where they meet.
    let mut loops: Vec<Vec<[f64; 2]>> = Vec::new();
    for triangle in triangles {
        let corners = triangle.map(|vertex| positions.get(vertex as usize).copied());
        let [Some(a), Some(b), Some(c)] = corners else { continue };
        let ends: Vec<[f64; 2]> =
            [(a, b), (b, c), (c, a)].into_iter().filter_map(|(a, b)| cut(a, b)).collect();
        let near = |loops: &[[f64; 2]]| {
            loops.iter().any(|p| ends.iter().any(|q| (p[0] - q[0]).hypot(p[1] - q[1]) < 1e-12))
        };
        let (touched, mut others): (Vec<_>, Vec<_>) =
            loops.into_iter().partition(|known| near(known));
        let mut joined: Vec<[f64; 2]> = touched.into_iter().flatten().collect();
        joined.extend(ends);
        if !joined.is_empty() {
            others.push(joined);
        }
        loops = others;
    }
    let widest = |points: &Vec<[f64; 2]>| {
        points.iter().map(|p| p[0]).fold(f64::MAX, f64::min) < 0.0
            && points.iter().map(|p| p[0]).fold(f64::MIN, f64::max) > 0.0
    };
    loops.into_iter().find(widest).map_or(0.0, around)
}

/// The length of the shortest loop around `points`: that of their convex hull (Andrew 1979).
pub(crate) fn around(mut points: Vec<[f64; 2]>) -> f64 {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let lower = chain(points.iter());
    let upper = chain(points.iter().rev());
    let length = |chain: Vec<[f64; 2]>| {
        chain.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum::<f64>()
    };
    length(lower) + length(upper)
}

/// The points of one side of the hull.
fn chain<'a>(points: impl Iterator<Item = &'a [f64; 2]>) -> Vec<[f64; 2]> {
    let mut hull: Vec<[f64; 2]> = Vec::new();
    for &point in points {
        while let [.., a, b] = hull[..]
            && (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]) <= 0.0
        {
            hull.pop();
        }
        hull.push(point);
    }
    hull
}
