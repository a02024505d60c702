//! What the crossings of all contours ask of the particles.

use cloth_audit::Crossing;
use glam::DVec3;

use crate::{
    Cloth, Effort,
    contours::{Link, contours},
    mesh::Surfaces,
    place::Place,
    sides::{Memory, Side, sides},
};

/// How often ways are spread to the particles around.
const SPREADS: usize = 12;

/// By how much of the length of an edge the way of a particle that nothing pushes is shorter than the mean of those of its neighbours: what is
/// pushed a little takes little along.
const SLACK: f64 = 0.04;

/// The same where more is taken along.
const SLACK_STRONG: f64 = 0.01;

/// Where particles are pushed.
pub(crate) struct Pushes<'a> {
    pub(crate) surfaces: &'a Surfaces<'a>,
    pub(crate) cloth: &'a Cloth<'a>,
    /// The gap that is made \[m\].
    pub(crate) gap: f64,
    /// Mean length of the edges of the cloth at the start \[m\].
    pub(crate) edge: f64,
    /// How it is pushed.
    pub(crate) effort: Effort,
}

/// Particles with shares that add up to 1.
type Shares = [(u32, f64)];

/// The ways that are asked of a particle, each as often as its share says.
type Sums = Vec<(DVec3, f64)>;

impl Pushes<'_> {
    /// The way of each particle in this round \[m\]. `crossed` ascends.
    pub(crate) fn ways(
        &self,
        at: &[DVec3],
        crossed: &[Crossing],
        memory: &mut Memory,
    ) -> Vec<DVec3> {
        let of_cloth = crossed.iter().filter(|crossing| crossing.edge_surface == 0);
        let mut edges: Vec<usize> =
            of_cloth.filter_map(|c| self.surfaces.cloth.find(c.edge)).collect();
        edges.sort_unstable();
        edges.dedup();
        let longest = self.longest(at, &edges);
        let mut sums = vec![(DVec3::ZERO, 0.0); at.len()];
        let contours = contours(self.surfaces, crossed);
        let sides = sides((self.surfaces, self.cloth), at, &contours, &edges, memory);
        for (contour, side) in contours.iter().zip(sides) {
            match side {
                Some(side) => self.push(at, contour, (side, longest), &mut sums),
                None => self.shorten(at, contour, longest, &mut sums),
            }
        }
        self.spread(sums)
    }

    /// How far a push goes in a round at most \[m\]: half of the mean length of the crossed edges, or twice the gap if that is more.
    fn longest(&self, at: &[DVec3], edges: &[usize]) -> f64 {
        let length = |&edge: &usize| {
            let [a, b] = self.surfaces.cloth.edges[edge].ends;
            at[a as usize].distance(at[b as usize])
        };
        let sum: f64 = edges.iter().map(length).sum();
        (0.5 * sum / edges.len().max(1) as f64).max(2.0 * self.gap)
    }

    /// Pushes the edges and triangles of a contour to their sides.
    fn push(
        &self,
        at: &[DVec3],
        contour: &[Link],
        (Side { mover, side }, longest): (Side, f64),
        sums: &mut Sums,
    ) {
        for Link { crossing, sheet, .. } in contour {
            let Some(place) = Place::new(self.surfaces, at, crossing) else { continue };
            if *sheet == mover {
                // The end of the edge that is less far out comes out of the triangle.
                let inner = usize::from(side * place.heights[1] < side * place.heights[0]);
                let depth = (-side * place.heights[inner]).max(0.0);
                let end = [(crossing.edge[inner], 1.0)];
                let amount = (depth + self.gap).min(longest);
                self.add(sums, (&end, &place.triangle), side * place.normal, amount);
            } else {
                // The triangle comes out beyond the edge.
                let normal = self.surfaces.normal_at(at, crossing.edge_surface, crossing.edge);
                let depths = place.ends.map(|end| side * normal.dot(end - place.point));
                let amount = (depths[0].max(depths[1]) + self.gap).min(longest);
                self.add(sums, (&place.triangle, &place.edge), side * normal, amount);
            }
        }
    }

    /// Moves one sheet of a contour against the other one so that it becomes shorter: all of it in one direction.
    fn shorten(&self, at: &[DVec3], contour: &[Link], longest: f64, sums: &mut Sums) {
        let places: Vec<_> =
            contour.iter().map(|link| Place::new(self.surfaces, at, &link.crossing)).collect();
        let signs = contour.iter().map(|link| [1.0, -1.0][link.sheet]);
        let mut whole = DVec3::ZERO;
        for ((Link { crossing, .. }, place), sign) in contour.iter().zip(&places).zip(signs.clone())
        {
            let Some(place) = place else { continue };
            let across = self.surfaces.across(at, crossing.edge_surface, crossing.edge);
            whole += sign * place.shorter(across);
        }
        let length = whole.length();
        if length == 0.0 {
            return;
        }
        // A short contour is left by a short way.
        let points = || places.iter().flatten().map(|place| place.point);
        let low = points().fold(DVec3::INFINITY, DVec3::min);
        let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
        let short = match self.effort {
            Effort::Strong => f64::INFINITY,
            Effort::Gentle | Effort::Loose => 0.5 * low.distance(high) + self.gap,
        };
        let most = (0.5 * longest).min(short);
        let amount = most * length / (1.0 + length * length).sqrt();
        for (place, sign) in places.iter().zip(signs) {
            let Some(place) = place else { continue };
            self.add(sums, (&place.edge, &place.triangle), sign / length * whole, amount);
        }
    }

    fn is_held(&self, particle: usize) -> bool {
        self.cloth.is_held.get(particle).is_some_and(|held| *held)
    }

    /// Moves one point by `amount` along `way` relative to another one, each particle by its share.
    fn add(&self, sums: &mut Sums, (moved, against): (&Shares, &Shares), way: DVec3, amount: f64) {
        let parts = moved.iter().map(|&(i, share)| (i, share));
        let parts = parts.chain(against.iter().map(|&(i, share)| (i, -share)));
        let parts: Vec<_> =
            parts.filter(|&(i, share)| share != 0.0 && !self.is_held(i as usize)).collect();
        let sum: f64 = parts.iter().map(|(_, share)| share * share).sum();
        if sum < 1e-6 {
            return;
        }
        for (i, share) in parts {
            let way = share * amount / sum * way;
            sums[i as usize].0 += share.abs() * way;
            sums[i as usize].1 += share.abs();
        }
    }

    /// The mean of what is asked of each particle, with the particles around taken along.
    fn spread(&self, sums: Sums) -> Vec<DVec3> {
        let mut is_pushed: Vec<bool> = sums.iter().map(|(_, count)| *count > 0.0).collect();
        let mut ways: Vec<DVec3> = sums
            .into_iter()
            .map(|(sum, count)| if count > 0.0 { sum / count } else { DVec3::ZERO })
            .collect();
        let slack = match self.effort {
            Effort::Strong => SLACK_STRONG,
            Effort::Gentle | Effort::Loose => SLACK,
        };
        for _ in 0..SPREADS {
            let (known, was) = (is_pushed.clone(), ways.clone());
            for particle in 0..ways.len() {
                if known[particle] || self.is_held(particle) {
                    continue;
                }
                let around = self.surfaces.cloth.around(particle as u32);
                let (mut sum, mut count) = (DVec3::ZERO, 0.0);
                for (_, other) in around.filter(|(_, other)| known[*other as usize]) {
                    sum += was[other as usize];
                    count += 1.0;
                }
                if count > 0.0 {
                    let mean = sum / count;
                    let length = mean.length();
                    let shorter = (length - slack * self.edge).max(0.0);
                    ways[particle] = if length > 0.0 { shorter / length * mean } else { mean };
                    is_pushed[particle] = true;
                }
            }
        }
        ways
    }
}
