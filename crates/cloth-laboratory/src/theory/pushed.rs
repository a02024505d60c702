//! A strip without weight that is clamped upright at one end, whose other end stands on the ground and turns freely there (Sano, Yamaguchi, Wada 2017,
//! "Slip morphology of elastic strips on frictional rigid substrates").

/// Its equilibrium, with its end below the clamp. Lengths are over that of the strip L, forces over B / L^2 per width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PushedStrip {
    /// How much nearer to the ground the clamp is than the strip is long.
    pub(crate) shortening: f64,
    /// Force of the ground upwards and across, and curvature at the clamp.
    unknowns: [f64; 3],
}

/// Steps along the strip.
const STEPS: u32 = 400;
/// Steps of the shortening from one equilibrium to the next.
const GROWTH: f64 = 0.004;

impl PushedStrip {
    /// All equilibria from the straight strip to one of this shortening or a little more.
    pub(crate) fn until(shortening: f64) -> Vec<Self> {
        // Buckling of a strip that is clamped at one end and hinged at the other: tan k = k.
        let mut unknowns = [20.19, 0.4, 0.4];
        let mut all = Vec::new();
        let mut reached = 0.002;
        while all.last().is_none_or(|last: &Self| last.shortening < shortening) {
            unknowns = solved(unknowns, |at| {
                let [_, bend, x, z] = *shape(at).last().unwrap_or(&[0.0; 4]);
                [bend, x, z - (1.0 - reached)]
            });
            all.push(Self { shortening: reached, unknowns });
            reached += GROWTH;
        }
        all
    }

    /// The shortening at which a strip slips on ground of this friction.
    pub(crate) fn slips_at(friction: f64) -> f64 {
        let all = Self::until(0.5);
        let pair = all.windows(2).find(|pair| pair[1].slope() >= friction);
        pair.map_or(f64::NAN, |pair| {
            let [a, b] = [pair[0], pair[1]];
            let share = (friction - a.slope()) / (b.slope() - a.slope());
            a.shortening + share * (b.shortening - a.shortening)
        })
    }

    /// The force across over that upwards.
    pub(crate) fn slope(&self) -> f64 {
        let [up, across, _] = self.unknowns;
        (across / up).abs()
    }

    /// Places along it, at equal distances: across and below the clamp.
    pub(crate) fn places(&self) -> Vec<[f64; 2]> {
        shape(self.unknowns).into_iter().map(|[_, _, x, z]| [x, z]).collect()
    }

    /// Angle of its end to the vertical \[rad\].
    #[cfg(test)]
    pub(crate) fn end_angle(&self) -> f64 {
        shape(self.unknowns).last().map_or(0.0, |end| end[0].abs())
    }
}

/// Angle to the vertical, curvature and place along the strip, by Runge and Kutta's rule.
fn shape([up, across, bend]: [f64; 3]) -> Vec<[f64; 4]> {
    let rate = |[angle, bend, ..]: [f64; 4]| {
        let (sin, cos) = angle.sin_cos();
        [bend, -(up * sin + across * cos), sin, cos]
    };
    let h = 1.0 / f64::from(STEPS);
    let ahead = |at: [f64; 4], by: [f64; 4], h: f64| -> [f64; 4] {
        std::array::from_fn(|k| at[k] + h * by[k])
    };
    let mut at = [0.0, bend, 0.0, 0.0];
    let mut all = vec![at];
    for _ in 0..STEPS {
        let a = rate(at);
        let b = rate(ahead(at, a, 0.5 * h));
        let c = rate(ahead(at, b, 0.5 * h));
        let d = rate(ahead(at, c, h));
        at = ahead(at, std::array::from_fn(|k| (a[k] + 2.0 * (b[k] + c[k]) + d[k]) / 6.0), h);
        all.push(at);
    }
    all
}

/// The root of three functions, by Newton's method from a place near to it.
fn solved(mut at: [f64; 3], of: impl Fn([f64; 3]) -> [f64; 3]) -> [f64; 3] {
    for _ in 0..50 {
        let here = glam::DVec3::from(of(at));
        let column = |k: usize| {
            let step = 1e-6 * at[k].abs().max(1.0);
            let mut there = at;
            there[k] += step;
            (glam::DVec3::from(of(there)) - here) / step
        };
        let slopes = glam::DMat3::from_cols(column(0), column(1), column(2));
        let change = slopes.inverse() * here;
        at = (glam::DVec3::from(at) - change).into();
        if change.length() < 1e-10 {
            break;
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use super::PushedStrip;

    /// The numbers that Romero et al. (2021, "Physical validation of simulators in computer graphics") give for it.
    #[test]
    fn strips_slip_where_published_numbers_say() {
        for (friction, shortening) in
            [(0.1, 0.047), (0.2, 0.155), (0.3, 0.271), (0.4, 0.371), (0.5, 0.449)]
        {
            let found = PushedStrip::slips_at(friction);
            assert!((found - shortening).abs() < 6e-4, "{friction}: {found}");
        }
    }

    /// From a friction of .4 on the end of the strip would lie below the ground before it slips.
    #[test]
    fn the_strip_stands_on_its_end_up_to_a_friction_of_a_third() {
        let angle = |friction| {
            let at = PushedStrip::slips_at(friction);
            PushedStrip::until(at).last().unwrap().end_angle().to_degrees()
        };
        assert!(angle(0.3) < 82.0 && angle(0.4) > 95.0, "{} {}", angle(0.3), angle(0.4));
    }
}
