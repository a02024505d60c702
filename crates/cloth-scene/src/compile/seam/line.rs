//! Lines along the borders of panels, and the stitches between two of them.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::cut::Cutter;

/// Vertices in order, with how far along the line they are \[m\].
#[derive(Clone, Debug)]
pub(super) struct Line {
    /// Lists of vertices that edges join. One begins where the one before it ends, as far as sewing goes.
    pieces: Vec<Vec<u32>>,
}

/// Why there is no line.
pub(super) enum LineProblem {
    /// These vertices are no single way along the border.
    NoWay,
}

impl Line {
    /// The way along the border through the vertices of each of these sets; each begins near the end of the one before.
    pub(super) fn new(cutter: &Cutter<'_>, sets: &[Vec<u32>]) -> Result<Self, LineProblem> {
        let mut border: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
        for [a, b] in cutter.border() {
            border.entry(a).or_default().insert(b);
            border.entry(b).or_default().insert(a);
        }
        let mut pieces = Vec::with_capacity(sets.len());
        for set in sets {
            pieces.push(way(&border, set)?);
        }
        let at = |vertex: u32| DVec3::from(cutter.mesh().positions[vertex as usize]);
        let distance = |a: &[u32], b: &[u32]| match (a.last(), b.first()) {
            (Some(&a), Some(&b)) => at(a).distance(at(b)),
            _ => 0.0,
        };
        for next in 1..pieces.len() {
            let flipped = |piece: &Vec<u32>| piece.iter().rev().copied().collect::<Vec<u32>>();
            let (before, after) = (&pieces[next - 1], &pieces[next]);
            if next == 1 {
                let nearest =
                    |piece: &[u32]| distance(piece, after).min(distance(piece, &flipped(after)));
                if nearest(&flipped(before)) < nearest(before) {
                    pieces[0].reverse();
                }
            }
            let (before, after) = (&pieces[next - 1], &pieces[next]);
            if distance(before, &flipped(after)) < distance(before, after) {
                pieces[next].reverse();
            }
        }
        Ok(Self { pieces })
    }

    pub(super) fn reverse(&mut self) {
        self.pieces.reverse();
        self.pieces.iter_mut().for_each(|piece| piece.reverse());
    }

    /// First and last vertex.
    pub(super) fn ends(&self) -> Option<[u32; 2]> {
        Some([*self.pieces.first()?.first()?, *self.pieces.last()?.last()?])
    }

    /// Its length \[m\].
    pub(super) fn length(&self, cutter: &Cutter<'_>) -> f64 {
        self.segments(cutter).last().map_or(0.0, |segment| segment.range[1])
    }

    /// Its edges, each with its length \[m\].
    pub(super) fn edges(&self, cutter: &Cutter<'_>) -> Vec<([u32; 2], f64)> {
        let segments = self.segments(cutter).into_iter();
        segments.map(|Segment { edge, range: [start, end] }| (edge, end - start)).collect()
    }

    fn segments(&self, cutter: &Cutter<'_>) -> Vec<Segment> {
        let at = |vertex: u32| DVec3::from(cutter.mesh().positions[vertex as usize]);
        let mut along = 0.0;
        let mut segments = Vec::new();
        for pair in self.pieces.iter().flat_map(|piece| piece.windows(2)) {
            let edge = [pair[0], pair[1]];
            let end = along + at(edge[0]).distance(at(edge[1]));
            segments.push(Segment { edge, range: [along, end] });
            along = end;
        }
        segments
    }
}

struct Segment {
    edge: [u32; 2],
    range: [f64; 2],
}

/// The way along the border through all of `set`.
fn way(border: &BTreeMap<u32, BTreeSet<u32>>, set: &[u32]) -> Result<Vec<u32>, LineProblem> {
    let within: BTreeSet<u32> = set.iter().copied().collect();
    let next = |vertex: u32, before: Option<u32>| -> Vec<u32> {
        let beside = border.get(&vertex).into_iter().flatten().copied();
        beside.filter(|v| within.contains(v) && Some(*v) != before).collect()
    };
    let start = within.iter().copied().find(|&vertex| next(vertex, None).len() == 1);
    let mut way = vec![start.ok_or(LineProblem::NoWay)?];
    let mut before = None;
    while way.len() <= within.len() {
        let here = way[way.len() - 1];
        match next(here, before)[..] {
            [] => break,
            [vertex] => way.push(vertex),
            _ => return Err(LineProblem::NoWay),
        }
        before = Some(here);
    }
    if way.len() == within.len() { Ok(way) } else { Err(LineProblem::NoWay) }
}

/// Stitches two lines end to end: each vertex of one to where the other is as far along, both lengths taken for the same.
pub(super) fn stitches(cutter: &mut Cutter<'_>, lines: &[Line; 2]) -> Vec<[u32; 2]> {
    let segments = lines.each_ref().map(|line| line.segments(cutter));
    let lengths = lines.each_ref().map(|line| line.length(cutter));
    let mut found = Vec::new();
    let mut matched = BTreeSet::new();
    for side in [0, 1] {
        let other = 1 - side;
        let places = segments[side]
            .iter()
            .flat_map(|s| [(s.edge[0], s.range[0]), (s.edge[1], s.range[1])])
            .map(|(vertex, along)| (vertex, along / lengths[side] * lengths[other]));
        let places: Vec<(u32, f64)> = places.collect();
        for (index, &(vertex, along)) in places.iter().enumerate() {
            // Inner vertices are the end of one edge and the start of the next.
            if (index > 0 && places[index - 1].0 == vertex) || matched.contains(&vertex) {
                continue;
            }
            let of = |s: &&Segment| along <= s.range[1];
            let Some(segment) = segments[other].iter().find(of).or(segments[other].last()) else {
                continue;
            };
            let [start, end] = segment.range;
            let place = ((along - start) / (end - start)).clamp(0.0, 1.0);
            let partner = cutter.point(vertex, segment.edge, place);
            matched.insert(vertex);
            matched.insert(partner);
            found.push(if side == 0 { [vertex, partner] } else { [partner, vertex] });
        }
    }
    found
}
