//! Triangles of spheres and capsules (NUMERICS §15).

use std::f64::consts::{FRAC_PI_2, TAU};

/// About how far a triangle may lie inside the round surface \[m\]; near the poles it is twice that.
const SAG: f64 = 3e-4;
/// Rings of triangles from a pole to the equator are so many at least and at most.
const RINGS: [f64; 2] = [8.0, 64.0];
/// A capsule's straight part has quads that are so many times as long as they are wide.
const LENGTH: f64 = 4.0;

/// Rings of vertices around the z axis, from one pole to the other: ring r from a pole has 4 r vertices, so that triangles have about
/// the same size everywhere. The straight part of a capsule repeats the ring of its equator.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoundSurface {
    half_length: f64,
    radius: f64,
    /// Rings from a pole to the equator, the pole left out.
    rings: u32,
    /// Quads along the straight part.
    bands: u32,
}

/// The number of a ring from its pole, its height \[m\] and its radius \[m\].
type Ring = (u32, f64, f64);

impl RoundSurface {
    /// All points within `radius` \[m\] of a segment along z; a sphere if that has no length.
    pub(super) fn new(half_length: f64, radius: f64) -> Self {
        // A triangle with sides e that lies on a sphere of radius R goes e^2 / 6 R deep.
        let edge = (6.0 * SAG * radius).sqrt();
        let rings = (FRAC_PI_2 * radius / edge).ceil().clamp(RINGS[0], RINGS[1]);
        let width = FRAC_PI_2 * radius / rings;
        let bands = match half_length > 0.0 {
            true => (2.0 * half_length / (LENGTH * width)).ceil().clamp(1.0, 1000.0) as u32,
            false => 0,
        };
        Self { half_length, radius, rings: rings as u32, bands }
    }

    /// All rings from the upper pole to the lower one.
    fn all_rings(self) -> impl Iterator<Item = Ring> {
        let Self { half_length, radius, rings, bands } = self;
        let cap = move |ring: u32, sign: f64| {
            let angle = FRAC_PI_2 * f64::from(ring) / f64::from(rings);
            (ring, sign * (half_length + radius * angle.cos()), radius * angle.sin())
        };
        let equator = move |band: u32| {
            let share = 1.0 - 2.0 * f64::from(band) / f64::from(bands.max(1));
            (rings, half_length * share, radius)
        };
        let upper = (0..rings).map(move |ring| cap(ring, 1.0));
        let lower = (0..rings).rev().map(move |ring| cap(ring, -1.0));
        upper.chain((0..=bands).map(equator)).chain(lower)
    }

    /// Its vertices \[m\].
    pub(super) fn positions(self) -> Vec<[f64; 3]> {
        let ring = |(ring, height, radius): Ring| {
            let count = (4 * ring).max(1);
            (0..count).map(move |at| {
                let (sin, cos) = (TAU * f64::from(at) / f64::from(count)).sin_cos();
                [radius * cos, radius * sin, height]
            })
        };
        self.all_rings().flat_map(ring).collect()
    }

    /// Its triangles, which face outwards.
    pub(super) fn triangles(self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        let mut first = 0;
        let rings: Vec<u32> = self.all_rings().map(|(ring, ..)| ring).collect();
        for pair in rings.windows(2) {
            let [upper, lower] = [pair[0], pair[1]];
            let below = first + (4 * upper).max(1);
            let vertex = |(first, ring): (u32, u32), quarter: u32, at: u32| match ring {
                0 => first,
                _ => first + (quarter * ring + at) % (4 * ring),
            };
            let [above, under] = [(first, upper), (below, lower)];
            for quarter in 0..4 {
                let a = |at| vertex(above, quarter, at);
                let b = |at| vertex(under, quarter, at);
                // Where a ring has one vertex more in a quarter than the other, its triangles begin and end there.
                let shift = u32::from(upper > lower);
                triangles.extend((0..lower).map(|at| [a(at + shift), b(at), b(at + 1)]));
                triangles.extend((0..upper).map(|at| match shift {
                    0 => [a(at), b(at + 1), a(at + 1)],
                    _ => [a(at), b(at), a(at + 1)],
                }));
            }
            first = below;
        }
        triangles
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use glam::DVec3;

    use super::*;

    #[test]
    fn spheres_and_capsules_are_closed_and_no_further_inside_than_they_may() {
        for (half_length, radius) in [(0.0, 0.02), (0.0, 0.25), (0.0, 1.5), (1.3, 0.02), (0.2, 0.1)]
        {
            let surface = RoundSurface::new(half_length, radius);
            let (x, triangles) = (surface.positions(), surface.triangles());
            let depth = |at: DVec3| {
                let along = at.z.clamp(-half_length, half_length);
                radius - (at - DVec3::new(0.0, 0.0, along)).length()
            };
            assert!(x.iter().all(|&at| depth(at.into()).abs() < 1e-12 * (radius + half_length)));
            let mut edges = BTreeMap::new();
            let (mut deepest, mut volume) = (0.0_f64, 0.0);
            for triangle in &triangles {
                let [a, b, c] = triangle.map(|i| DVec3::from(x[i as usize]));
                deepest = deepest.max(depth((a + b + c) / 3.0));
                volume += a.dot(b.cross(c)) / 6.0;
                for k in 0..3 {
                    let [from, to] = [triangle[k], triangle[(k + 1) % 3]];
                    assert_ne!(from, to);
                    *edges.entry([from.min(to), from.max(to)]).or_insert(0) +=
                        if from < to { 1 } else { -2 };
                }
            }
            // Each edge once in each direction; as many vertices, edges and triangles as a sphere has.
            assert!(edges.values().all(|&sum| sum == -1), "{half_length} {radius}");
            assert_eq!(x.len() + triangles.len(), edges.len() + 2);
            assert!(deepest <= 2.2 * SAG, "{half_length} {radius}: {deepest}");
            let exact = TAU * radius.powi(2) * (half_length + radius * 2.0 / 3.0);
            assert!((volume / exact - 1.0).abs() < 0.04, "{volume} {exact}");
        }
    }
}
