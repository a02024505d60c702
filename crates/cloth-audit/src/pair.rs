//! Two triangles, which may share particles.

use crate::predicate::{Point, edge_meets_triangle, edges_meet, is_in_triangle, side};

/// The corner of a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    /// Number of the particle among those of all surfaces.
    pub(crate) particle: u64,
    pub(crate) point: Point,
}

/// An edge of one triangle that meets the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// Whether the edge is of the second triangle.
    pub(crate) is_second: bool,
    /// Particles of the edge.
    pub(crate) edge: [u64; 2],
    /// A point of both, to rounding.
    pub(crate) place: Point,
}

/// What two triangles have in common beyond the particles and edges that they share.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Common {
    /// Edges of one that meet the other and share no particle with it.
    pub(crate) crossings: Vec<Crossing>,
    /// A place where they meet, to rounding.
    pub(crate) place: Option<Point>,
}

/// Looks at two triangles. Those that share nothing intersect where an edge of one meets the other. Those that share one particle meet beyond
/// it only if the edge opposite to it of one meets the other: from the shared particle a common ray leaves one of them first, there. Those
/// that share an edge meet beyond it only if they are folded onto each other, in one plane.
pub(crate) fn common(first: &[Corner; 3], second: &[Corner; 3]) -> Common {
    if has_gap(first, second) {
        return Common::default();
    }
    let shared = first.iter().filter(|corner| is_of(second, corner)).count();
    match shared {
        0 | 1 => apart(first, second),
        2 => {
            let own = |of: &[Corner; 3], other: &[Corner; 3]| {
                of.iter().find(|corner| !is_of(other, corner)).map(|corner| corner.point)
            };
            let edge: Vec<Point> =
                first.iter().filter(|c| is_of(second, c)).map(|c| c.point).collect();
            let place = match (edge.as_slice(), own(first, second), own(second, first)) {
                (&[p, q], Some(a), Some(b)) => folded([p, q], a, b),
                // A triangle with one particle twice has no area of its own.
                _ => None,
            };
            Common { crossings: vec![], place }
        }
        // The same triangle twice.
        _ => Common { crossings: vec![], place: Some(middle(&first.map(|corner| corner.point))) },
    }
}

fn is_of(of: &[Corner; 3], corner: &Corner) -> bool {
    of.iter().any(|c| c.particle == corner.particle)
}

/// What rounding may do to a height over a plane, relative to the sizes that it is computed from: far more than it does.
const ROUNDING: f64 = 1e-12;

/// Whether a plane through what two triangles share, if they do, has the rest of each on its own side, with room for rounding: then there is nothing
/// beyond. It spares most pairs of a flat cloth the exact predicates, which take longest where all is in one plane.
///
/// The plane is at a right angle to the way between the middles of both rests, as far as a shared edge leaves it free: a height over it and one over
/// the plane that is exactly so differ by rounding.
fn has_gap(first: &[Corner; 3], second: &[Corner; 3]) -> bool {
    let mut shared = first.iter().filter(|corner| is_of(second, corner)).map(|c| c.point);
    let (origin, other) = (shared.next(), shared.next());
    let touches = origin.is_some();
    let origin = origin.unwrap_or(first[0].point);
    if shared.next().is_some() {
        return false;
    }
    let rest = |of: &[Corner; 3], others: &[Corner; 3]| {
        let mut rest = [[0.0; 3]; 3];
        let mut count = 0;
        for corner in of.iter().filter(|corner| !is_of(others, corner)) {
            rest[count] = minus(corner.point, origin);
            count += 1;
        }
        (rest, count)
    };
    let ((of_first, m), (of_second, n)) = (rest(first, second), rest(second, first));
    if m == 0 || n == 0 {
        return false;
    }
    let (of_first, of_second) = (&of_first[..m], &of_second[..n]);
    let mut normal = minus(middle(of_first), middle(of_second));
    let size = length(normal);
    if let Some(other) = other {
        let edge = minus(other, origin);
        let along = dot(normal, edge) / dot(edge, edge);
        normal = std::array::from_fn(|k| normal[k] - along * edge[k]);
    }
    // The least; what is no number stays so.
    let least = |of: &[Point], sign: f64| {
        let bound = |x: Point| (ROUNDING * size * length(x)).max(f64::MIN_POSITIVE);
        let height = |x: &Point| sign * dot(normal, *x) - bound(*x);
        let smaller = |low: f64, h: f64| if h < low || h.is_nan() { h } else { low };
        of.iter().map(height).fold(f64::INFINITY, smaller)
    };
    let (above, below) = (least(of_first, 1.0), least(of_second, -1.0));
    if touches { above > 0.0 && below > 0.0 } else { above + below > 0.0 }
}

fn minus(a: Point, b: Point) -> Point {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The sum of the sizes of coordinates, which neither vanishes nor overflows where a square does.
fn length(a: Point) -> f64 {
    a[0].abs() + a[1].abs() + a[2].abs()
}

/// Whether all corners of a triangle that are not those of the other one are on one side of its plane, and so all of it but what both share.
fn is_beside(triangle: &[Corner; 3], other: &[Corner; 3]) -> bool {
    let [a, b, c] = other.map(|corner| corner.point);
    let is_shared = |corner: &&Corner| other.iter().any(|c| c.particle == corner.particle);
    let own = triangle.iter().filter(|corner| !is_shared(corner));
    let mut sides = own.map(|corner| side(a, b, c, corner.point));
    let first = sides.next().unwrap_or_default();
    first != 0 && sides.all(|side| side == first)
}

/// Triangles that share no edge.
fn apart(first: &[Corner; 3], second: &[Corner; 3]) -> Common {
    if is_beside(first, second) || is_beside(second, first) {
        return Common::default();
    }
    let mut crossings = vec![];
    for (is_second, of, other) in [(false, first, second), (true, second, first)] {
        let triangle = other.map(|corner| corner.point);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let edge = [of[i], of[j]];
            let shares = other.iter().any(|c| edge.iter().any(|e| e.particle == c.particle));
            let points = edge.map(|corner| corner.point);
            if !shares && edge_meets_triangle(points, triangle) {
                let edge = edge.map(|corner| corner.particle);
                crossings.push(Crossing { is_second, edge, place: place(points, triangle) });
            }
        }
    }
    let place = crossings.first().map(|crossing| crossing.place);
    Common { crossings, place }
}

/// Two triangles that share the edge p q and have the corners a and b: where they meet beyond it.
fn folded([p, q]: [Point; 2], a: Point, b: Point) -> Option<Point> {
    if side(p, q, a, b) != 0 {
        return None;
    }
    let meets = is_in_triangle(a, [p, q, b])
        || is_in_triangle(b, [p, q, a])
        || edges_meet([p, a], [q, b])
        || edges_meet([q, a], [p, b]);
    meets.then(|| middle(&[p, q, a, b]))
}

/// About where an edge goes through a triangle.
fn place([p, q]: [Point; 2], [a, b, c]: [Point; 3]) -> Point {
    let (u, v) = (minus(b, a), minus(c, a));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let height = |x: Point| dot(minus(x, a), normal);
    let [of_p, of_q] = [height(p), height(q)];
    let share = if of_p == of_q { 0.5 } else { (of_p / (of_p - of_q)).clamp(0.0, 1.0) };
    std::array::from_fn(|k| p[k] + share * (q[k] - p[k]))
}

fn middle(points: &[Point]) -> Point {
    std::array::from_fn(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64)
}
