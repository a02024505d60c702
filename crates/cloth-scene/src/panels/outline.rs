//! The outline of a piece.

use kurbo::{ParamCurve, ParamCurveArclen, PathSeg, Point};

/// Ends of an outline nearer to each other than this share of its size are one.
const CLOSED: f64 = 1e-6;

/// Accuracy of lengths, as a share of the size of the piece.
const ACCURACY: f64 = 1e-6;

/// Points along an outline at which it is looked for crossings, for each of its edges.
const CHECK_POINTS: usize = 32;

/// Most edges of an outline.
const EDGES_MAX: usize = 4096;

/// A closed line of named edges.
#[derive(Clone, Debug)]
pub(crate) struct Outline {
    /// Its name.
    pub name: String,
    /// The line of the file where it begins.
    pub line: usize,
    /// Its edges \[m\], each from the end of the one before.
    pub edges: Vec<PathSeg>,
    /// Names of the first edges; others are called by their number.
    pub names: Vec<String>,
    /// Whether the file closes it.
    pub is_closed: bool,
    /// Lines in it along which triangles have edges.
    pub lines: Vec<InnerLine>,
}

/// A line in a piece.
#[derive(Clone, Debug)]
pub(crate) struct InnerLine {
    /// Its name.
    pub name: String,
    /// Its parts \[m\], each from the end of the one before.
    pub parts: Vec<PathSeg>,
}

impl InnerLine {
    /// Points along it, about `spacing` \[m\] apart, with both ends and all corners.
    pub(crate) fn points(&self, spacing: f64) -> Vec<Point> {
        let mut points: Vec<Point> =
            self.parts.iter().flat_map(|part| spaced(part, spacing, ACCURACY * spacing)).collect();
        points.extend(self.parts.last().map(ParamCurve::end));
        points
    }
}

/// Points along a part, about `spacing` apart, from its start on and without its end.
fn spaced(part: &PathSeg, spacing: f64, accuracy: f64) -> Vec<Point> {
    let length = part.arclen(accuracy);
    // An outline of at most so many is meshed.
    let count = (length / spacing).round().clamp(1.0, 1e6) as usize;
    let place = |i: usize| match i {
        0 => 0.0,
        _ => part.inv_arclen(length * i as f64 / count as f64, accuracy),
    };
    (0..count).map(|i| part.eval(place(i))).collect()
}

impl Outline {
    /// Name of an edge.
    pub(crate) fn edge_name(&self, edge: usize) -> String {
        let name = self.names.get(edge).cloned().unwrap_or_else(|| edge.to_string());
        format!("{}:{name}", self.name)
    }

    /// Its longer side \[m\].
    fn size(&self) -> f64 {
        let [low, high] = self.bounds();
        (high.x - low.x).max(high.y - low.y)
    }

    /// The corners of the box around it \[m\].
    pub(crate) fn bounds(&self) -> [Point; 2] {
        let mut bounds = [Point::new(f64::MAX, f64::MAX), Point::new(f64::MIN, f64::MIN)];
        for point in
            self.edges.iter().flat_map(|edge| (0..=8).map(|i| edge.eval(f64::from(i) / 8.0)))
        {
            bounds[0] = Point::new(bounds[0].x.min(point.x), bounds[0].y.min(point.y));
            bounds[1] = Point::new(bounds[1].x.max(point.x), bounds[1].y.max(point.y));
        }
        bounds
    }

    /// Whether it runs counter-clockwise.
    fn area(&self) -> f64 {
        let points: Vec<Point> = self.edges.iter().flat_map(|edge| samples(edge, 8)).collect();
        let next = points.iter().cycle().skip(1);
        points.iter().zip(next).map(|(a, b)| 0.5 * (a.x * b.y - a.y * b.x)).sum()
    }

    /// What is wrong with it, with the mend.
    pub(crate) fn check(&self) -> Result<(), String> {
        let name = &self.name;
        let numbers = self.edges.iter().flat_map(|edge| [edge.start(), edge.eval(0.5), edge.end()]);
        if let Some(point) = numbers.into_iter().find(|point| !point.is_finite()) {
            return Err(format!("piece {name:?} has a point at {point}: give finite numbers"));
        }
        let count = self.edges.len();
        if !(2..=EDGES_MAX).contains(&count) {
            return Err(format!(
                "piece {name:?} has {count} edges: an outline has 2 to {EDGES_MAX}"
            ));
        }
        let (Some(first), Some(last)) = (self.edges.first(), self.edges.last()) else {
            return Ok(());
        };
        let gap = first.start().distance(last.end());
        if !self.is_closed && gap > CLOSED * self.size() {
            return Err(format!(
                "piece {name:?} is open: it ends {gap:.4} m from where it begins; close it (Z in SVG, flag 1 in DXF)"
            ));
        }
        if self.names.len() > count {
            return Err(format!(
                "piece {name:?} has {} names for {count} edges: give each edge one name at most",
                self.names.len()
            ));
        }
        let points: Vec<(usize, Point)> = self
            .edges
            .iter()
            .enumerate()
            .flat_map(|(edge, line)| {
                let count = if matches!(line, PathSeg::Line(_)) { 1 } else { CHECK_POINTS };
                samples(line, count).into_iter().map(move |point| (edge, point))
            })
            .collect();
        if let Some((edges, place)) = crossing(&points) {
            return Err(format!(
                "piece {name:?} crosses itself near ({:.4}, {:.4}) m, edge {} and edge {}: an outline may not; move their points",
                place.x, place.y, edges[0], edges[1]
            ));
        }
        if self.area().abs() <= CLOSED * self.size().powi(2) {
            return Err(format!("piece {name:?} has no area: give it an outline around cloth"));
        }
        for line in &self.lines {
            let name = &line.name;
            let numbers =
                line.parts.iter().flat_map(|part| [part.start(), part.eval(0.5), part.end()]);
            if let Some(point) = numbers.into_iter().find(|point| !point.is_finite()) {
                return Err(format!("line {name:?} has a point at {point}: give finite numbers"));
            }
            if line.parts.is_empty() || line.parts.len() > EDGES_MAX {
                return Err(format!(
                    "line {name:?} has {} parts: a line has 1 to {EDGES_MAX}",
                    line.parts.len()
                ));
            }
        }
        Ok(())
    }

    /// Points along the whole line, counter-clockwise, at equal distances along each edge, about `spacing` \[m\] apart, with the
    /// edges that each is on.
    pub(crate) fn points(&self, spacing: f64) -> Vec<(Point, usize)> {
        let accuracy = ACCURACY * self.size();
        let mut points = Vec::new();
        for (number, edge) in self.edges.iter().enumerate() {
            points.extend(spaced(edge, spacing, accuracy).into_iter().map(|point| (point, number)));
        }
        points
    }

    /// Makes it run counter-clockwise. The names of its edges stay.
    pub(crate) fn turned(mut self) -> Self {
        if self.area() < 0.0 {
            let count = self.edges.len();
            let names = (0..count)
                .map(|edge| self.names.get(edge).cloned().unwrap_or_else(|| edge.to_string()));
            let mut names: Vec<String> = names.collect();
            names.reverse();
            self.names = names;
            self.edges.reverse();
            self.edges.iter_mut().for_each(|edge| *edge = edge.reverse());
        }
        self
    }
}

fn samples(edge: &PathSeg, count: usize) -> Vec<Point> {
    (0..count).map(|i| edge.eval(i as f64 / count as f64)).collect()
}

/// Two edges that cross, and where.
fn crossing(points: &[(usize, Point)]) -> Option<([usize; 2], Point)> {
    let count = points.len();
    let side = |i: usize| (points[i].1, points[(i + 1) % count].1);
    let boxes: Vec<[f64; 4]> = (0..count)
        .map(|i| {
            let (a, b) = side(i);
            [a.x.min(b.x), a.y.min(b.y), a.x.max(b.x), a.y.max(b.y)]
        })
        .collect();
    let turn = |a: Point, b: Point, c: Point| {
        let coord = |p: Point| robust::Coord { x: p.x, y: p.y };
        robust::orient2d(coord(a), coord(b), coord(c))
    };
    for i in 0..count {
        for j in i + 2..count {
            if i == 0 && j + 1 == count {
                continue;
            }
            let (p, q) = (boxes[i], boxes[j]);
            if p[2] < q[0] || q[2] < p[0] || p[3] < q[1] || q[3] < p[1] {
                continue;
            }
            let ((a, b), (c, d)) = (side(i), side(j));
            let splits = |a, b, c, d| turn(a, b, c) * turn(a, b, d) <= 0.0;
            if splits(a, b, c, d) && splits(c, d, a, b) {
                return Some(([points[i].0, points[j].0], a.midpoint(b)));
            }
        }
    }
    None
}
