//! Random features in motion, most of them of the kinds that go wrong.

use cloth_core::contact::Split;
use harness::random::Random;

type Vector = [f64; 3];

/// What is special about a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A small gap at the start, with common, sliding, approaching and irregular motion.
    Near,
    /// All points go from anywhere to anywhere.
    Anywhere,
    /// They touch at the start, exactly, and go on together.
    Touching,
    /// Touching, then some coordinates changed in their last bit.
    LastBit,
    /// Collapsed features, parallel edges, motion in one plane or line.
    Degenerate,
    /// Coordinates close to the smallest and largest numbers there are.
    Extreme,
}

impl Kind {
    pub(crate) const ALL: [Self; 6] = [
        Self::Near,
        Self::Anywhere,
        Self::Touching,
        Self::LastBit,
        Self::Degenerate,
        Self::Extreme,
    ];

    /// The kind of the pair of this number: more than half are near, one in 64 is extreme.
    pub(crate) const fn of(number: u64) -> Self {
        match number % 64 {
            0 => Self::Extreme,
            1..8 => Self::Anywhere,
            8..14 => Self::Touching,
            14..22 => Self::LastBit,
            22..26 => Self::Degenerate,
            _ => Self::Near,
        }
    }
}

/// Two features at both ends of a step, before they are rounded to a precision.
#[derive(Clone, Debug)]
pub(crate) struct Pair {
    pub(crate) start: [Vector; 4],
    pub(crate) end: [Vector; 4],
    pub(crate) split: Split,
}

impl Pair {
    pub(crate) fn new(kind: Kind, random: &mut Random, is_double: bool) -> Self {
        let split = if random.bits() & 1 == 0 { Split::VertexTriangle } else { Split::EdgeEdge };
        match kind {
            Kind::Near => near(random, split),
            Kind::Anywhere => anywhere(random, split, 1.0),
            Kind::Touching => touching(random, split, is_double),
            Kind::LastBit => last_bit(random, split, is_double),
            Kind::Degenerate => degenerate(random, split),
            Kind::Extreme => {
                let exponent = if is_double { 300.0 } else { 37.0 };
                let size = 10.0_f64.powf(random.between(-1.2 * exponent, exponent));
                anywhere(random, split, size)
            }
        }
    }
}

fn plus(a: Vector, b: Vector, times: f64) -> Vector {
    std::array::from_fn(|k| a[k] + times * b[k])
}

/// Whether point i is of the first feature.
fn is_first(split: Split, i: usize) -> bool {
    i < match split {
        Split::VertexTriangle => 1,
        Split::EdgeEdge => 2,
    }
}

/// Three directions at right angles.
fn frame(random: &mut Random) -> [Vector; 3] {
    let length = |v: Vector| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let unit = |v: Vector| v.map(|x| x / length(v));
    let cross = |a: Vector, b: Vector| {
        [[1, 2], [2, 0], [0, 1]].map(|[i, j]: [usize; 2]| a[i] * b[j] - a[j] * b[i])
    };
    let z = unit(plus(random.vector(1.0), [0.0, 0.0, 1.5], 1.0));
    let x = unit(cross(z, plus(random.vector(0.5), [1.0, 0.0, 0.0], 1.0)));
    [x, cross(z, x), z]
}

/// Weights of a point inside a triangle, or of a point on each of two edges.
fn inside(random: &mut Random) -> [f64; 2] {
    let [a, b] = [random.unit(), random.unit()];
    if a + b > 1.0 { [1.0 - a, 1.0 - b] } else { [a, b] }
}

/// Zero in one of three cases, else of any order of magnitude up to `largest`.
fn amount(random: &mut Random, largest: f64) -> f64 {
    if random.bits().is_multiple_of(3) { 0.0 } else { random.logarithmic(1e-5, 1.0) * largest }
}

fn near(random: &mut Random, split: Split) -> Pair {
    let size = random.logarithmic(1e-4, 1.0);
    let distance = [0.0, 1.0, 10.0, 1e3][(random.bits() % 4) as usize];
    let origin = random.vector(distance);
    let [x, y, z] = frame(random);
    let gap = random.logarithmic(1e-7, 0.3) * size;
    let mut flat = || {
        let [u, v] = [random.between(-size, size), random.between(-size, size)];
        plus(plus(origin, x, u), y, v)
    };
    let mut start = [flat(), flat(), flat(), flat()];
    let [s, t] = inside(random);
    let on = |p: Vector, q: Vector, share: f64| plus(p, plus(q, p, -1.0), share);
    match split {
        Split::VertexTriangle => {
            let [_, a, b, c] = start;
            start[0] = plus(on(a, b, s), plus(c, a, -1.0), t);
        }
        Split::EdgeEdge => {
            let shift = plus(on(start[2], start[3], t), on(start[0], start[1], s), -1.0);
            start[0] = plus(start[0], shift, 1.0);
            start[1] = plus(start[1], shift, 1.0);
        }
    }
    let common = random.vector(1.0);
    let common = plus([0.0; 3], common, amount(random, 10.0 * size));
    let along = plus(plus([0.0; 3], x, random.between(-1.0, 1.0)), y, random.between(-1.0, 1.0));
    let (slide, approach) = (amount(random, size), amount(random, 2.0 * gap));
    let noise = amount(random, gap.max(0.1 * size));
    let mut end = start;
    for i in 0..4 {
        let side = if is_first(split, i) { 0.5 } else { -0.5 };
        start[i] = plus(start[i], z, side * gap);
        end[i] = plus(plus(start[i], common, 1.0), along, side * slide);
        end[i] = plus(plus(end[i], z, -side * approach), random.vector(noise), 1.0);
    }
    Pair { start, end, split }
}

fn anywhere(random: &mut Random, split: Split, size: f64) -> Pair {
    let apart = plus([0.0; 3], random.vector(size), random.between(0.0, 2.0));
    let motion = random.between(0.0, 1.0);
    let start: [Vector; 4] = std::array::from_fn(|i| {
        let place = if is_first(split, i) { apart } else { [0.0; 3] };
        plus(place, random.vector(size), 1.0)
    });
    let end = start.map(|point| plus(point, random.vector(size), motion));
    Pair { start, end, split }
}

/// Whole numbers small enough that all of it, the point of touch included, has no rounding.
fn touching(random: &mut Random, split: Split, is_double: bool) -> Pair {
    let size = if is_double { 1_i64 << 40 } else { 1 << 14 };
    let whole = |random: &mut Random, size: i64| -> Vector {
        std::array::from_fn(|_| ((random.bits() % (2 * size as u64)) as i64 - size) as f64)
    };
    let origin = whole(random, 16 * size);
    let [a, b, c] = [whole(random, size), whole(random, size), whole(random, size)];
    // Eighths of vectors that are multiples of 8.
    let eighths = |random: &mut Random| (random.bits() % 9) as f64;
    let mut start = match split {
        Split::VertexTriangle => {
            let i = eighths(random);
            let j = (random.bits() % (9 - i as u64)) as f64;
            let far = [plus([0.0; 3], a, 8.0), plus([0.0; 3], b, 8.0)];
            [plus(plus([0.0; 3], a, i), b, j), [0.0; 3], far[0], far[1]]
        }
        Split::EdgeEdge => {
            let (i, j) = (eighths(random), eighths(random));
            let (p, q) = (plus(c, a, -i), plus(c, b, -j));
            [p, plus(p, a, 8.0), q, plus(q, b, 8.0)]
        }
    };
    start = start.map(|point| plus(point, origin, 1.0));
    let motion = if random.bits() & 1 == 0 { size } else { 1 };
    let motion = whole(random, motion);
    Pair { start, end: start.map(|point| plus(point, motion, 1.0)), split }
}

fn last_bit(random: &mut Random, split: Split, is_double: bool) -> Pair {
    let mut pair = touching(random, split, is_double);
    let scale = random.logarithmic(1e-6, 1.0);
    let mut nudge = |x: &mut f64| {
        let scaled = *x * scale;
        let up = random.bits() % 4;
        *x = if is_double {
            [scaled, scaled.next_up(), scaled.next_down(), scaled][up as usize]
        } else {
            let single = scaled as f32;
            f64::from([single, single.next_up(), single.next_down(), single][up as usize])
        };
    };
    pair.start.iter_mut().chain(&mut pair.end).flatten().for_each(&mut nudge);
    pair
}

fn degenerate(random: &mut Random, split: Split) -> Pair {
    let mut pair =
        if random.bits() & 1 == 0 { near(random, split) } else { anywhere(random, split, 1.0) };
    let both = [&mut pair.start, &mut pair.end];
    let other = (1 + random.bits() % 3) as usize;
    let share = (random.bits() % 5) as f64 / 4.0;
    let plane = (random.bits() % 3) as usize;
    let kind = random.bits() % 6;
    for points in both {
        let [_, _, c, d] = *points;
        match kind {
            // Two points are one.
            0 => points[3] = points[2],
            // A triangle in one line, an edge that is a point.
            1 => points[1] = plus(plus(c, c, -share), d, share),
            2 => points[1] = points[0],
            // Parallel edges.
            3 => points[1] = plus(plus(points[0], d, share), c, -share),
            // All in one plane.
            4 => points.iter_mut().for_each(|point| point[plane] = 0.25),
            // All in one line.
            _ => {
                for point in points.iter_mut() {
                    point[plane] = 0.25;
                    point[(plane + 1) % 3] = -3.0;
                }
            }
        }
    }
    if random.bits().is_multiple_of(4) {
        pair.end[other] = pair.end[0];
    }
    pair
}
