//! Outlines in DXF: polylines (LWPOLYLINE, POLYLINE) of straight edges and arcs, in text.
//!
//! A piece is called as its layer, with `-2` and so on behind it where a layer has several.

use std::collections::HashMap;

use kurbo::{Arc, Line, ParamCurve, PathSeg, Point, Shape, Vec2};

use super::{Outline, PatternProblem};

/// Metres of the values of `$INSUNITS`.
const UNITS: [(i64, f64); 6] =
    [(1, 0.0254), (2, 0.3048), (4, 1e-3), (5, 1e-2), (6, 1.0), (10, 0.9144)];

/// Accuracy of arcs, as a share of their chord.
const ARC_ACCURACY: f64 = 1e-6;

/// One polyline while it is read.
struct Polyline {
    line: usize,
    layer: String,
    is_closed: bool,
    /// Vertices, and the bulge of the edge that starts there.
    vertices: Vec<(Point, f64)>,
}

pub(super) fn read(
    file: &str,
    text: &str,
    unit: Option<f64>,
) -> Result<Vec<Outline>, PatternProblem> {
    let syntax = |line: usize, problem: String| PatternProblem::Syntax {
        file: file.to_owned(),
        line,
        problem,
    };
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let mut polylines: Vec<Polyline> = Vec::new();
    let mut units = None;
    let (mut entity, mut variable) = (String::new(), String::new());
    for (index, pair) in lines.chunks(2).enumerate() {
        let line = 2 * index + 1;
        let [code, value] = pair else { break };
        let Ok(code) = code.parse::<i32>() else {
            if code.is_empty() {
                break;
            }
            let problem = format!("`{code}` is no group code: save the drawing as DXF in text");
            return Err(syntax(line, problem));
        };
        let number = || -> Result<f64, PatternProblem> {
            value.parse().map_err(|_| syntax(line + 1, format!("`{value}` is no number")))
        };
        match (code, entity.as_str()) {
            (9, _) => variable = (*value).to_owned(),
            (70, _) if variable == "$INSUNITS" && units.is_none() => {
                let found = number()? as i64;
                units = UNITS.iter().find(|(name, _)| *name == found).map(|(_, metres)| *metres);
                variable.clear();
            }
            (0, _) => {
                entity = (*value).to_owned();
                variable.clear();
                if entity == "LWPOLYLINE" || entity == "POLYLINE" {
                    let (layer, vertices) = (String::new(), Vec::new());
                    polylines.push(Polyline { line, layer, is_closed: false, vertices });
                } else if entity == "SPLINE" || entity == "ELLIPSE" {
                    let problem = format!(
                        "{entity} is not read: turn curves into polylines in the drawing program"
                    );
                    return Err(syntax(line, problem));
                }
            }
            (8, "LWPOLYLINE" | "POLYLINE") => {
                if let Some(open) = polylines.last_mut() {
                    open.layer = (*value).to_owned();
                }
            }
            (70, "LWPOLYLINE" | "POLYLINE") => {
                let flags = number()? as i64;
                if let Some(open) = polylines.last_mut() {
                    open.is_closed = flags & 1 == 1;
                }
            }
            (10, "LWPOLYLINE" | "VERTEX") => {
                let x = number()?;
                if let Some(open) = polylines.last_mut() {
                    open.vertices.push((Point::new(x, 0.0), 0.0));
                }
            }
            (20, "LWPOLYLINE" | "VERTEX") => {
                let y = number()?;
                if let Some((point, _)) = polylines.last_mut().and_then(|o| o.vertices.last_mut()) {
                    point.y = y;
                }
            }
            (42, "LWPOLYLINE" | "VERTEX") => {
                let bulge = number()?;
                if let Some((_, of)) = polylines.last_mut().and_then(|o| o.vertices.last_mut()) {
                    *of = bulge;
                }
            }
            _ => {}
        }
    }
    let unit = unit.or(units).ok_or_else(|| PatternProblem::Units {
        file: file.to_owned(),
        problem: "does not say how long its units are ($INSUNITS): give `unit` in metres".into(),
    })?;
    let mut counts: HashMap<String, usize> = HashMap::new();
    let outlines = polylines.into_iter().map(|polyline| {
        let count = counts.entry(polyline.layer.clone()).or_insert(0);
        *count += 1;
        let name = if *count == 1 {
            polyline.layer.clone()
        } else {
            format!("{}-{count}", polyline.layer)
        };
        polyline.outline(name, unit)
    });
    Ok(outlines.collect())
}

impl Polyline {
    fn outline(&self, name: String, unit: f64) -> Outline {
        let at = |i: usize| {
            let point = self.vertices[i % self.vertices.len()].0;
            Point::new(unit * point.x, unit * point.y)
        };
        let last =
            if self.is_closed { self.vertices.len() } else { self.vertices.len().max(1) - 1 };
        let mut edges = Vec::with_capacity(last);
        for i in 0..last {
            let (a, b, bulge) = (at(i), at(i + 1), self.vertices[i].1);
            if a != b {
                edges.extend(edge(a, b, bulge));
            }
        }
        Outline {
            name,
            line: self.line,
            edges,
            names: Vec::new(),
            is_closed: self.is_closed,
            lines: Vec::new(),
        }
    }
}

/// A straight edge, or an arc whose `bulge` is the tangent of a quarter of its angle, as curves.
fn edge(a: Point, b: Point, bulge: f64) -> Vec<PathSeg> {
    if bulge == 0.0 {
        return vec![PathSeg::Line(Line::new(a, b))];
    }
    let chord = b - a;
    let angle = 4.0 * bulge.atan();
    let radius = chord.hypot() / (2.0 * (angle / 2.0).sin().abs());
    // The middle of the circle lies beside that of the chord.
    let across = Vec2::new(-chord.y, chord.x) * ((1.0 - bulge * bulge) / (4.0 * bulge));
    let centre = a.midpoint(b) + across;
    let start = (a - centre).atan2();
    let arc = Arc::new(centre, (radius, radius), start, angle, 0.0);
    let mut edges: Vec<PathSeg> = arc.to_path(ARC_ACCURACY * chord.hypot()).segments().collect();
    if let (Some(first), count) = (edges.first().copied(), edges.len()) {
        // Its ends are exactly those of its neighbours.
        if let (PathSeg::Cubic(mut cubic), 1) = (first, count) {
            (cubic.p0, cubic.p3) = (a, b);
            edges[0] = PathSeg::Cubic(cubic);
        }
    }
    edges.retain(|edge| edge.start() != edge.end());
    edges
}
