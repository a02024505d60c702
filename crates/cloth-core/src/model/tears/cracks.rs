//! Cracks run on from their tips.

use crate::Model;

/// Load over what an edge bears from which on it tears wherever it is.
const OVERLOAD: f64 = 2.0;

/// The cracks of a model, while they run through the edges that bear no more.
///
/// The load that an edge gives up reaches far within a frame, at the speed of sound of the cloth: were all edges to tear that bear no more where a strip is
/// drawn out evenly, it would fall into shreds. So a crack runs on from its tips alone, through the edges with the largest load there, and where none runs on
/// the most loaded edge of each cloth begins another one. What bears twice what it can, as where a bullet hits, waits for no crack.
pub(super) struct Cracks<'a> {
    model: &'a Model,
    /// Of each edge, the places of its ends.
    ends: Vec<[u32; 2]>,
    /// At each place the torn edges, and the edges less the triangles: 0 inside a cloth, below at its border.
    torn: Vec<u32>,
    border: Vec<i32>,
    /// Triangles that have lost an edge in this frame, and with it their load.
    is_relieved: Vec<bool>,
    found: Vec<u32>,
}

impl<'a> Cracks<'a> {
    pub(super) fn new(model: &'a Model, torn: &[u32]) -> Self {
        let edges = &model.tears.edges;
        let places = model.tears.places(model.particle_count());
        let ends: Vec<_> =
            edges.iter().map(|edge| edge.joints.map(|[corner, _]| places.of(corner))).collect();
        let mut border = vec![0; model.particle_count()];
        ends.iter().flatten().for_each(|&place| border[place as usize] += 1);
        for &corner in model.triangles.iter().flatten() {
            border[places.of(corner) as usize] -= 1;
        }
        let mut cracks = Self {
            model,
            torn: vec![0; border.len()],
            border,
            is_relieved: vec![false; model.triangles.len()],
            found: Vec::new(),
            ends,
        };
        torn.iter().for_each(|&edge| cracks.count(edge));
        cracks
    }

    fn count(&mut self, edge: u32) {
        for place in self.ends.get(edge as usize).copied().into_iter().flatten() {
            self.torn[place as usize] += 1;
        }
    }

    /// The edges that tear of these, which come with their loads over what they bear, the largest first; ascending.
    pub(super) fn run(mut self, loads: &[(f64, u32)]) -> Vec<u32> {
        let loaded: Vec<u32> = loads.iter().map(|(_, edge)| *edge).collect();
        let loaded = &loaded[..];
        for &(_, edge) in loads.iter().take_while(|(load, _)| *load > OVERLOAD) {
            if self.bears(edge) {
                self.tear(edge);
            }
        }
        self.grow(loaded);
        for cloth in self.model.cloths() {
            let has = |edge: u32| {
                cloth.triangles.contains(&self.model.tears.edges[edge as usize].triangles[0])
            };
            if self.found.iter().any(|&edge| has(edge)) {
                continue;
            }
            if let Some(&first) = loaded.iter().find(|&&edge| has(edge)) {
                self.tear(first);
                self.grow(loaded);
            }
        }
        self.found.sort_unstable();
        self.found
    }

    fn grow(&mut self, loaded: &[u32]) {
        while let Some(&next) = loaded.iter().find(|&&edge| self.is_reached(edge)) {
            self.tear(next);
        }
    }

    /// Whether the tip of a crack is at an end of an edge whose triangles still bear load.
    fn is_reached(&self, edge: u32) -> bool {
        let is_tip = |&place: &u32| {
            let place = place as usize;
            self.torn[place] == 1 && self.border[place] == 0
        };
        self.ends[edge as usize].iter().any(is_tip) && self.bears(edge)
    }

    /// Whether both triangles of an edge still bear load.
    fn bears(&self, edge: u32) -> bool {
        let both = self.model.tears.edges[edge as usize].triangles;
        both.iter().all(|&triangle| !self.is_relieved[triangle as usize])
    }

    fn tear(&mut self, edge: u32) {
        self.count(edge);
        for triangle in self.model.tears.edges[edge as usize].triangles {
            self.is_relieved[triangle as usize] = true;
        }
        self.found.push(edge);
    }
}
