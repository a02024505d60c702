//! A strip that bends under its own weight, clamped level at one end (Bickley 1934).
//!
//! With theta the angle below the horizontal at t = s / L and Gamma = rho g L^3 / B: theta'' = -Gamma (1 - t) cos theta, theta(0) = 0,
//! theta'(1) = 0.

/// The free end of a heavy elastica of length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FreeEnd {
    /// How far it hangs below the clamp.
    pub(crate) drop: f64,
    /// How far it is away from the clamp.
    pub(crate) reach: f64,
}

const STEPS: u32 = 2000;

/// The free end for a Gamma.
pub(crate) fn free_end(gamma: f64) -> FreeEnd {
    let (mut low, mut high) = (0.0, std::f64::consts::FRAC_PI_2);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if shoot(gamma, middle).0 > 0.0 { high = middle } else { low = middle }
    }
    shoot(gamma, 0.5 * (low + high)).1
}

/// The angle at the clamp for one at the free end, by Runge and Kutta from there on; and where the end is, as seen from the clamp.
fn shoot(gamma: f64, end_angle: f64) -> (f64, FreeEnd) {
    let h = 1.0 / f64::from(STEPS);
    // Angle, its derivative, drop and reach, over the distance from the free end.
    let rate = |u: f64, [angle, slope, ..]: [f64; 4]| {
        [slope, -gamma * u * angle.cos(), angle.sin(), angle.cos()]
    };
    let along = |y: [f64; 4], k: [f64; 4], h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
    let mut y = [end_angle, 0.0, 0.0, 0.0];
    for step in 0..STEPS {
        let u = f64::from(step) * h;
        let k1 = rate(u, y);
        let k2 = rate(u + 0.5 * h, along(y, k1, 0.5 * h));
        let k3 = rate(u + 0.5 * h, along(y, k2, 0.5 * h));
        let k4 = rate(u + h, along(y, k3, h));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
    }
    (y[0], FreeEnd { drop: y[2], reach: y[3] })
}

impl FreeEnd {
    /// Drop over reach.
    pub(crate) fn ratio(&self) -> f64 {
        self.drop / self.reach
    }
}

/// The Gamma of a strip whose free end has this drop over reach, up to 120: of a strip that hangs straight down, rounding leaves nothing
/// from which the clamp could be told.
pub(crate) fn gamma_of_ratio(ratio: f64) -> f64 {
    if !ratio.is_finite() {
        return f64::NAN;
    }
    let (mut low, mut high): (f64, f64) = (1e-3, 120.0);
    for _ in 0..50 {
        let middle = (low * high).sqrt();
        if free_end(middle).ratio() > ratio { high = middle } else { low = middle }
    }
    (low * high).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_table_of_the_heavy_elastica() {
        let table = [
            (0.1, 0.012_500),
            (1.0, 0.124_562),
            (2.0, 0.246_673),
            (5.0, 0.585_721),
            (10.0, 1.066_802),
            (100.0, 5.888_105),
        ];
        for (gamma, ratio) in table {
            let found = free_end(gamma).ratio();
            // The table has six places.
            assert!((found - ratio).abs() < 6e-7, "{gamma}: {found}");
            assert!((gamma_of_ratio(ratio) / gamma - 1.0).abs() < 1e-4, "{gamma}");
        }
    }
}
