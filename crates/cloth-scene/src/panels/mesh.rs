//! Triangles in an outline.

use cloth_core::{TextureMap, TriangleMesh, VertexGroup};
use kurbo::Point;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::Outline;

/// How far from the outline points in a regular order may be, in target lengths of edges.
const BORDER: f64 = 0.65;

/// How far from the outline a line may end that ends on it, in target lengths of edges.
const LINE_END: f64 = 0.3;

/// Double area over the sum of squared sides of a triangle that is wide enough; 0.577 if its sides are equal.
const WIDE: f64 = 0.25;

/// The same of one that has no area but for rounding.
const FLAT: f64 = 1e-9;

/// Most points of a piece.
const POINTS_MAX: f64 = 1e5;

/// A piece as triangles whose edges are about `edge` \[m\] long: constrained Delaunay (spade) of points on the outline and of a hexagonal
/// lattice within. Its pattern is itself, flat in x and y; its groups are the piece and each edge, called `piece:edge`.
pub(crate) fn piece_mesh(outline: Outline, edge: f64) -> Result<TriangleMesh, String> {
    let outline = outline.turned();
    let name = outline.name.clone();
    let mut border = outline.points(edge);
    let lines: Vec<Vec<Point>> = outline.lines.iter().map(|line| line.points(edge)).collect();
    let mut taken = Vec::new();
    lines.iter().for_each(|line| line_end(&mut border, line, edge, &mut taken));
    let [low, high] = outline.bounds();
    let [width, height] = [high.x - low.x, high.y - low.y];
    if width * height / (edge * edge) > POINTS_MAX || border.len() as f64 > POINTS_MAX {
        return Err(format!(
            "piece {name:?} would have more than {POINTS_MAX} vertices: use longer edges"
        ));
    }
    if border.len() < 3 || width.max(height) < edge {
        return Err(format!(
            "piece {name:?} is smaller than its edges of {edge} m: use shorter ones"
        ));
    }
    let count = border.len();
    let polygon: Vec<Point> = border.iter().map(|(point, _)| *point).collect();
    let mut points = polygon.clone();
    // The points of each line by their numbers; its ends are points of the outline if they are near it.
    let mut along: Vec<Vec<usize>> = Vec::with_capacity(lines.len());
    for (line, drawn) in lines.iter().zip(&outline.lines) {
        let mut own = Vec::with_capacity(line.len());
        for &point in line {
            let (nearest, gap) = nearest(&polygon, point);
            if gap < LINE_END * edge {
                own.push(nearest);
            } else if is_inside(&polygon, point) {
                own.push(points.len());
                points.push(point);
            } else {
                return Err(format!(
                    "line {:?} leaves its piece {name:?} near ({:.4}, {:.4}) m: end it on the outline",
                    drawn.name, point.x, point.y
                ));
            }
        }
        own.dedup();
        along.push(own);
    }
    let rise = edge * 0.75_f64.sqrt();
    for row in 0..=(height / rise) as usize {
        let shift = if row % 2 == 1 { 0.5 * edge } else { 0.0 };
        for column in 0..=(width / edge) as usize {
            let point = Point::new(
                low.x + shift + edge * (column as f64 + 0.25),
                low.y + rise * (row as f64 + 0.5),
            );
            let is_free = |line: &Vec<Point>| distance(line, point) > BORDER * edge;
            if is_inside(&polygon, point)
                && distance_around(&polygon, point) > BORDER * edge
                && lines.iter().all(is_free)
            {
                points.push(point);
            }
        }
    }
    let failed = |_| format!("piece {name:?} cannot be meshed: move its points farther apart");
    let mut triangulation = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut handles = Vec::with_capacity(points.len());
    for point in &points {
        handles.push(triangulation.insert(Point2::new(point.x, point.y)).map_err(failed)?);
    }
    if triangulation.num_vertices() != points.len() {
        return Err(failed(spade::InsertionError::NAN));
    }
    for i in 0..count {
        let (a, b) = (handles[i], handles[(i + 1) % count]);
        if !triangulation.can_add_constraint(a, b) {
            return Err(format!(
                "piece {name:?} comes too near to itself for edges of {edge} m: use shorter ones"
            ));
        }
        triangulation.add_constraint(a, b);
    }
    for (own, line) in along.iter().zip(&outline.lines) {
        for pair in own.windows(2) {
            let (a, b) = (handles[pair[0]], handles[pair[1]]);
            if !triangulation.can_add_constraint(a, b) {
                return Err(format!(
                    "line {:?} of piece {name:?} crosses another line or comes too near to it for edges of {edge} m: move it, or use shorter ones",
                    line.name
                ));
            }
            triangulation.add_constraint(a, b);
        }
    }
    let mut number = vec![0_u32; points.len()];
    for (i, handle) in handles.iter().enumerate() {
        number[handle.index()] = i as u32;
    }
    let mut triangles: Vec<[u32; 3]> = triangulation
        .inner_faces()
        .map(|face| face.vertices().map(|vertex| number[vertex.fix().index()]))
        .filter(|&[a, b, c]| {
            // A side of the outline tells: the piece is on its left, however thin the triangle is.
            let sides = [[a, b], [b, c], [c, a]].map(|side| side.map(|i| i as usize));
            let follows = |a: usize, b: usize| a < count && b < count && (a + 1) % count == b;
            if sides.iter().any(|&[a, b]| follows(a, b)) {
                return true;
            }
            let [a, b, c] = [a, b, c].map(|i| points[i as usize].to_vec2());
            // Between points of a straight side, which are on a line but for rounding, nothing else tells inside from outside.
            let has_area = (b - a).cross(c - a) > FLAT * ((b - a).hypot2() + (c - a).hypot2());
            has_area
                && !sides.iter().any(|&[a, b]| follows(b, a))
                && is_inside(&polygon, ((a + b + c) / 3.0).to_point())
        })
        .collect();
    chords_open(&mut points, &mut triangles, count as u32);
    // In an order that does not depend on the triangulation.
    for triangle in &mut triangles {
        let first = (0..3).min_by_key(|&k| triangle[k]).unwrap_or(0);
        triangle.rotate_left(first);
    }
    triangles.sort_unstable();
    let mut groups =
        vec![VertexGroup { name: name.clone(), vertices: (0..points.len() as u32).collect() }];
    for edge in 0..outline.edges.len() {
        let own = (0..count).filter(|&i| border[i].1 == edge);
        let mut vertices: Vec<u32> = own.map(|i| i as u32).collect();
        if let Some(&last) = vertices.last() {
            vertices.push((last + 1) % count as u32);
        }
        vertices.sort_unstable();
        groups.push(VertexGroup { name: outline.edge_name(edge), vertices });
    }
    for (own, line) in along.iter().zip(&outline.lines) {
        let vertices = own.iter().map(|&i| i as u32);
        let line = format!("{name}:{}", line.name);
        match groups.iter_mut().find(|group| group.name == line) {
            Some(group) => group.vertices.extend(vertices),
            None => groups.push(VertexGroup { name: line, vertices: vertices.collect() }),
        }
    }
    for group in &mut groups {
        group.vertices.sort_unstable();
        group.vertices.dedup();
    }
    let coordinates: Vec<[f64; 2]> = points.iter().map(|point| [point.x, point.y]).collect();
    Ok(TriangleMesh {
        positions: coordinates.iter().map(|&[x, y]| [x, y, 0.0]).collect(),
        texture: Some(TextureMap { coordinates, triangles: triangles.clone() }),
        triangles,
        groups,
        ..TriangleMesh::default()
    })
}

/// Takes away edges that cross a piece from border to border, as at corners: two pieces that are sewn there would have four triangles at such an edge.
fn chords_open(points: &mut Vec<Point>, triangles: &mut Vec<[u32; 3]>, count: u32) {
    loop {
        // The lowest first, so that the order of the triangles does not matter.
        let chord = triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .filter(|&[a, b]| {
                let is_border = (a + 1) % count == b || (b + 1) % count == a;
                a < b && b < count && !is_border
            })
            .min();
        let Some([a, b]) = chord else { return };
        let of = |first: u32, second: u32| {
            let has = |t: &[u32; 3]| (0..3).find(|&k| t[k] == first && t[(k + 1) % 3] == second);
            let found = triangles.iter().enumerate();
            found.filter_map(|(i, t)| Some((i, t[(has(t)? + 2) % 3]))).next()
        };
        let (Some((left, p)), Some((right, q))) = (of(a, b), of(b, a)) else { return };
        let at = |i: u32| points[i as usize];
        let is_wide = |t: [u32; 3]| {
            let [a, b, c] = t.map(at);
            let sides = (b - a).hypot2() + (c - b).hypot2() + (a - c).hypot2();
            (b - a).cross(c - a) > WIDE * sides
        };
        let is_inner = |i: u32| i >= count;
        if (is_inner(p) || is_inner(q)) && is_wide([a, q, p]) && is_wide([q, b, p]) {
            triangles[left] = [a, q, p];
            triangles[right] = [q, b, p];
        } else {
            let middle = points.len() as u32;
            points.push(at(a).midpoint(at(b)));
            triangles[left] = [a, middle, p];
            triangles[right] = [b, middle, q];
            triangles.extend([[middle, b, p], [middle, a, q]]);
        }
    }
}

/// Even-odd rule.
fn is_inside(polygon: &[Point], point: Point) -> bool {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).fold(false, |inside, (a, b)| {
        let crosses = (a.y > point.y) != (b.y > point.y)
            && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x);
        inside != crosses
    })
}

/// How far a point is from a closed line.
fn distance_around(polygon: &[Point], point: Point) -> f64 {
    match (polygon.first(), polygon.last()) {
        (Some(&first), Some(&last)) => {
            distance(polygon, point).min(distance(&[last, first], point))
        }
        _ => f64::INFINITY,
    }
}

/// How far it is from an open one.
fn distance(line: &[Point], point: Point) -> f64 {
    line.windows(2).fold(f64::INFINITY, |least, pair| {
        let part = share(pair[0], pair[1], point);
        least.min(pair[0].lerp(pair[1], part).distance(point))
    })
}

/// Where on a side a point is nearest to it, from 0 to 1.
fn share(a: Point, b: Point, point: Point) -> f64 {
    let along = b - a;
    ((point - a).dot(along) / along.hypot2()).clamp(0.0, 1.0)
}

/// The nearest of some points, and how far it is.
fn nearest(points: &[Point], point: Point) -> (usize, f64) {
    let far = points.iter().map(|own| own.distance(point)).enumerate();
    far.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY))
}

/// Gives the outline points where a line ends on it; `taken` are those of lines before.
fn line_end(border: &mut Vec<(Point, usize)>, line: &[Point], edge: f64, taken: &mut Vec<Point>) {
    for &end in [line.first(), line.last()].into_iter().flatten() {
        let points: Vec<Point> = border.iter().map(|(point, _)| *point).collect();
        let count = points.len();
        let on_side = |i: usize| {
            let (a, b) = (points[i], points[(i + 1) % count]);
            (i, a.lerp(b, share(a, b, end)))
        };
        let sides = (0..count).map(on_side);
        let far = |(_, place): &(usize, Point)| place.distance(end);
        let Some((side, place)) = sides.min_by(|a, b| far(a).total_cmp(&far(b))) else { return };
        if place.distance(end) >= LINE_END * edge {
            continue;
        }
        let (near, gap) = nearest(&points, end);
        let is_corner = border[near].1 != border[(near + count - 1) % count].1;
        if gap >= LINE_END * edge {
            border.insert(side + 1, (place, border[side].1));
        } else if !is_corner && !taken.contains(&points[near]) {
            // One that is near enough goes there.
            border[near].0 = place;
        }
        taken.push(place);
    }
}
