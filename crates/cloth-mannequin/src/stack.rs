//! Sections along an axis, and smooth unions of what they bound.

use glam::DVec3;

/// How far beyond its ends a stack is left alone \[m\]: more than any fillet is wide.
const FAR: f64 = 0.2;

/// One section across the axis. Its outline is an oval of two halves that meet at its sides; all lengths in metres.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Section {
    /// Where it is along the axis.
    pub(crate) at: f64,
    /// Its centre, across the axis.
    pub(crate) centre: [f64; 2],
    /// Half of its width, along x.
    pub(crate) side: f64,
    /// How far it reaches along -y.
    pub(crate) front: f64,
    /// How far it reaches along y.
    pub(crate) back: f64,
    /// 0 of an ellipse to 1 of a rectangle.
    pub(crate) square: f64,
}

impl Section {
    const fn numbers(&self) -> [f64; 6] {
        [self.centre[0], self.centre[1], self.side, self.front, self.back, self.square]
    }
}

/// Sections in ascending order along z, and smooth curves between them; domes close both ends.
#[derive(Clone, Debug)]
pub(crate) struct Stack {
    knots: Vec<Knot>,
    /// Heights of the domes below the first section and above the last one.
    domes: [f64; 2],
}

#[derive(Clone, Debug)]
struct Knot {
    at: f64,
    values: [f64; 6],
    slopes: [f64; 6],
}

impl Stack {
    pub(crate) fn new(sections: &[Section], domes: [f64; 2]) -> Self {
        let slope = |i: usize, k: usize| {
            let value = |i: usize| sections[i].numbers()[k];
            let chord =
                |i: usize| (value(i + 1) - value(i)) / (sections[i + 1].at - sections[i].at);
            let last = sections.len() - 1;
            match i {
                _ if last == 0 => 0.0,
                0 => chord(0),
                i if i == last => chord(last - 1),
                // That of the parabola through three neighbours.
                i => {
                    let [below, above] =
                        [sections[i].at - sections[i - 1].at, sections[i + 1].at - sections[i].at];
                    (above * chord(i - 1) + below * chord(i)) / (below + above)
                }
            }
        };
        let knot = |(i, section): (usize, &Section)| Knot {
            at: section.at,
            values: section.numbers(),
            slopes: std::array::from_fn(|k| slope(i, k)),
        };
        Self { knots: sections.iter().enumerate().map(knot).collect(), domes }
    }

    /// The numbers of the section at `z`, those of the nearest end beyond them: cubic Hermite curves.
    fn section(&self, z: f64) -> [f64; 6] {
        let above = self.knots.partition_point(|knot| knot.at <= z);
        let (Some(a), Some(b)) = (
            above.checked_sub(1).and_then(|below| self.knots.get(below)).or(self.knots.first()),
            self.knots.get(above).or(self.knots.last()),
        ) else {
            return [0.0; 6];
        };
        let length = b.at - a.at;
        if length <= 0.0 {
            return a.values;
        }
        let t = (z - a.at) / length;
        let [t2, t3] = [t * t, t * t * t];
        std::array::from_fn(|k| {
            (2.0 * t3 - 3.0 * t2 + 1.0) * a.values[k]
                + (t3 - 2.0 * t2 + t) * length * a.slopes[k]
                + (3.0 * t2 - 2.0 * t3) * b.values[k]
                + (t3 - t2) * length * b.slopes[k]
        })
    }

    /// How far `point` is outside, about: along the ray from the centre of its section. Negative inside.
    ///
    /// The outline of a section is the squircle of Fernández-Guasti (1992), which needs no powers.
    pub(crate) fn distance(&self, point: DVec3) -> f64 {
        let (Some(first), Some(last)) = (self.knots.first(), self.knots.last()) else {
            return f64::MAX;
        };
        let past = (point.z - last.at).max(first.at - point.z);
        if past > FAR {
            return past;
        }
        let [x, y, side, front, back, square] = self.section(point.z);
        let across = DVec3::new(point.x - x, point.y - y, 0.0);
        let depth = if across.y < 0.0 { front } else { back };
        let (beyond, dome) = if point.z > last.at {
            (point.z - last.at, self.domes[1])
        } else {
            ((first.at - point.z).max(0.0), self.domes[0])
        };
        let [u, v, w] = [across.x / side, across.y / depth, beyond / dome].map(|q| q * q);
        let sum = u + v;
        let flat = (sum + (sum * sum - 4.0 * square * square * u * v).max(0.0).sqrt()) / 2.0;
        let ratio = (flat + w).sqrt();
        let length = (across.length_squared() + beyond * beyond).sqrt();
        if ratio < 1e-9 { -side.min(depth) } else { length - length / ratio }
    }
}

/// The smaller of two distances, rounded where they differ by less than `width`: a union with a fillet.
/// Twice continuously differentiable, after the cubic polynomial of Quilez (2013).
pub(crate) fn smooth_min(a: f64, b: f64, width: f64) -> f64 {
    let near = (1.0 - (a - b).abs() / width).max(0.0);
    a.min(b) - near * near * near * width / 6.0
}

/// The larger of two distances, rounded likewise.
pub(crate) fn smooth_max(a: f64, b: f64, width: f64) -> f64 {
    -smooth_min(-a, -b, width)
}

/// From 0 to 1 where `x` goes from -1/2 to 1/2, with continuous curvature (Perlin 2002).
pub(crate) fn smooth_step(x: f64) -> f64 {
    let t = (x + 0.5).clamp(0.0, 1.0);
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}
