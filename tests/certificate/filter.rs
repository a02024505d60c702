//! The judge's answer in double precision with bounds of its rounding, where these suffice: most pairs need no exact arithmetic. The method is
//! that of the judge, signs of a determinant over time, and has nothing in common with the certificate.

use cloth_core::contact::Split;

/// What is known of two features in motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Known {
    /// They are apart at all times.
    Apart,
    /// They meet.
    Meet,
    /// Too close for this arithmetic.
    Nothing,
}

type Vector = [f64; 3];

/// Parts of the time that are looked at before it gives up.
const PARTS: usize = 100;

pub(crate) fn look(start: &[Vector; 4], end: &[Vector; 4], split: Split) -> Known {
    let at = |points: &[Vector; 4]| -> [Vector; 3] {
        let d = |i: usize, j: usize| std::array::from_fn(|k| points[i][k] - points[j][k]);
        match split {
            Split::VertexTriangle => [d(1, 0), d(2, 0), d(3, 0)],
            Split::EdgeEdge => [d(2, 0), d(1, 0), d(3, 2)],
        }
    };
    let ends = [at(start), at(end)];
    let size = |i: usize| {
        let norm = |v: Vector| v[0].abs() + v[1].abs() + v[2].abs();
        norm(ends[0][i]).max(norm(ends[1][i]))
    };
    let error = 64.0 * f64::EPSILON * (size(0) * size(1) * size(2)) + 1e-290;
    let between = |t: f64| -> [Vector; 3] {
        std::array::from_fn(|i| {
            std::array::from_fn(|k| (1.0 - t) * ends[0][i][k] + t * ends[1][i][k])
        })
    };
    let mut open = vec![[0.0, 1.0]];
    let mut parts = 0;
    while let Some([low, high]) = open.pop() {
        let [a, b] = [between(low), between(high)];
        let volumes = [
            determinant([a[0], a[1], a[2]]),
            (determinant([b[0], a[1], a[2]])
                + determinant([a[0], b[1], a[2]])
                + determinant([a[0], a[1], b[2]]))
                / 3.0,
            (determinant([a[0], b[1], b[2]])
                + determinant([b[0], a[1], b[2]])
                + determinant([b[0], b[1], a[2]]))
                / 3.0,
            determinant([b[0], b[1], b[2]]),
        ];
        if volumes.iter().all(|v| *v > error) || volumes.iter().all(|v| *v < -error) {
            continue;
        }
        let slack = 4.0 * f64::EPSILON;
        let boxes: [[Interval; 3]; 3] = std::array::from_fn(|i| {
            let wide = slack * size(i);
            std::array::from_fn(|k| Interval::over(a[i][k], b[i][k], wide))
        });
        let weights = weights(&boxes, split);
        if weights.iter().any(|w| w.high < 0.0) {
            continue;
        }
        let [first, .., last] = volumes;
        let changes = first.abs() > error && last.abs() > error && (first > 0.0) != (last > 0.0);
        if changes && weights.iter().all(|w| w.low > 0.0) {
            return Known::Meet;
        }
        parts += 1;
        if parts > PARTS {
            return Known::Nothing;
        }
        let middle = 0.5 * (low + high);
        open.extend([[low, middle], [middle, high]]);
    }
    Known::Apart
}

fn determinant([a, b, c]: [Vector; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// The weights of the judge; all are positive where features that are in one plane meet.
fn weights(boxes: &[[Interval; 3]; 3], split: Split) -> Vec<Interval> {
    let [p, q, r] = boxes;
    match split {
        Split::VertexTriangle => {
            let normal = cross(&minus(q, p), &minus(r, p));
            [[p, q], [q, r], [r, p]].map(|[a, b]| dot(&cross(a, b), &normal)).to_vec()
        }
        Split::EdgeEdge => {
            let normal = cross(q, r);
            let square = dot(&normal, &normal);
            let s = dot(&cross(p, r), &normal);
            let t = dot(&cross(p, q), &normal);
            vec![square.minus(s), square.minus(t), s, t]
        }
    }
}

fn minus(a: &[Interval; 3], b: &[Interval; 3]) -> [Interval; 3] {
    std::array::from_fn(|k| a[k].minus(b[k]))
}

fn dot(a: &[Interval; 3], b: &[Interval; 3]) -> Interval {
    a[0].times(b[0]).plus(a[1].times(b[1])).plus(a[2].times(b[2]))
}

fn cross(a: &[Interval; 3], b: &[Interval; 3]) -> [Interval; 3] {
    [[1, 2], [2, 0], [0, 1]].map(|[i, j]| a[i].times(b[j]).minus(a[j].times(b[i])))
}

/// Numbers from `low` to `high`, rounded outwards.
#[derive(Clone, Copy, Debug)]
struct Interval {
    low: f64,
    high: f64,
}

impl Interval {
    fn over(a: f64, b: f64, wide: f64) -> Self {
        Self::outwards(a.min(b) - wide, a.max(b) + wide)
    }

    fn outwards(low: f64, high: f64) -> Self {
        Self { low: low.next_down(), high: high.next_up() }
    }

    fn plus(self, other: Self) -> Self {
        Self::outwards(self.low + other.low, self.high + other.high)
    }

    fn minus(self, other: Self) -> Self {
        Self::outwards(self.low - other.high, self.high - other.low)
    }

    fn times(self, other: Self) -> Self {
        let products = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        let low = products.into_iter().fold(f64::INFINITY, f64::min);
        Self::outwards(low, products.into_iter().fold(f64::NEG_INFINITY, f64::max))
    }
}
