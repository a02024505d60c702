//! The body as a field of distances.

use glam::DVec3;

use crate::{
    Measures,
    stack::{Section, Stack, smooth_max, smooth_min},
    tape,
};

/// Angle between a hanging arm and that of the body at rest \[degrees\].
pub(crate) const ARM_RAISE: f64 = 45.0;
/// Heights at which the tape goes around neck, chest, waist and hips, in parts of the height.
pub(crate) const LEVELS: [f64; 4] = [0.868, 0.72, 0.62, 0.515];
/// How often the girths are measured and corrected.
const FITTINGS: usize = 5;

/// Sections of the trunk from the crotch to the middle of the head, in parts of the height: place, centre along y, half width, front, back,
/// squareness.
const TRUNK: [[f64; 6]; 20] = [
    [0.44, 0.004, 0.04, 0.022, 0.03, 0.0],
    [0.455, 0.003, 0.07, 0.038, 0.05, 0.1],
    [0.475, 0.002, 0.091, 0.05, 0.0665, 0.2],
    [0.5, 0.0, 0.0985, 0.056, 0.0745, 0.3],
    [0.52, 0.0, 0.0995, 0.0585, 0.0735, 0.3],
    [0.55, 0.0, 0.0955, 0.06, 0.064, 0.3],
    [0.585, 0.0, 0.086, 0.059, 0.051, 0.2],
    [0.62, 0.0, 0.078, 0.0565, 0.0455, 0.2],
    [0.655, 0.0, 0.08, 0.058, 0.049, 0.3],
    [0.69, 0.0, 0.0865, 0.064, 0.0555, 0.4],
    [0.72, 0.0, 0.092, 0.069, 0.061, 0.5],
    [0.75, 0.001, 0.0955, 0.0655, 0.0635, 0.5],
    [0.775, 0.004, 0.097, 0.058, 0.06, 0.5],
    [0.8, 0.008, 0.095, 0.048, 0.052, 0.4],
    [0.818, 0.011, 0.086, 0.04, 0.043, 0.3],
    [0.832, 0.012, 0.066, 0.036, 0.037, 0.2],
    [0.845, 0.011, 0.046, 0.035, 0.0345, 0.1],
    [0.86, 0.007, 0.035, 0.034, 0.0335, 0.0],
    [0.88, 0.002, 0.0325, 0.033, 0.033, 0.0],
    [0.91, -0.002, 0.0325, 0.033, 0.033, 0.0],
];

/// Those of the head.
const HEAD: [[f64; 6]; 10] = [
    [0.874, -0.006, 0.015, 0.034, 0.015, 0.0],
    [0.882, -0.006, 0.025, 0.041, 0.027, 0.0],
    [0.898, -0.006, 0.0345, 0.047, 0.041, 0.1],
    [0.915, -0.006, 0.0405, 0.0505, 0.0515, 0.1],
    [0.93, -0.006, 0.044, 0.0525, 0.0585, 0.1],
    [0.95, -0.006, 0.0422, 0.0503, 0.056, 0.1],
    [0.968, -0.006, 0.037, 0.0441, 0.0491, 0.0],
    [0.982, -0.006, 0.0295, 0.0352, 0.0392, 0.0],
    [0.992, -0.006, 0.0205, 0.0244, 0.0272, 0.0],
    [0.998, -0.006, 0.0106, 0.0126, 0.014, 0.0],
];

/// Those of a leg, which hangs from the hip: the centre along x comes first.
const LEG: [[f64; 6]; 11] = [
    [0.045, 0.048, 0.012, 0.0185, 0.019, 0.0215],
    [0.07, 0.048, 0.012, 0.017, 0.0175, 0.02],
    [0.11, 0.0485, 0.01, 0.021, 0.0205, 0.025],
    [0.17, 0.049, 0.008, 0.0285, 0.0255, 0.0345],
    [0.21, 0.0495, 0.006, 0.03, 0.0275, 0.035],
    [0.255, 0.05, 0.002, 0.028, 0.029, 0.027],
    [0.285, 0.0505, -0.001, 0.03, 0.032, 0.027],
    [0.35, 0.0515, -0.002, 0.0385, 0.04, 0.036],
    [0.41, 0.0525, 0.0, 0.0435, 0.046, 0.044],
    [0.46, 0.053, 0.002, 0.043, 0.045, 0.05],
    [0.5, 0.053, 0.002, 0.035, 0.038, 0.045],
];

/// Those of an arm, from the shoulder: place, half of the thickness, half of the width.
const ARM: [[f64; 3]; 13] = [
    [0.000, 0.0330, 0.0345],
    [0.040, 0.0320, 0.0335],
    [0.090, 0.0275, 0.0300],
    [0.140, 0.0245, 0.0255],
    [0.172, 0.0225, 0.0230],
    [0.205, 0.0235, 0.0235],
    [0.250, 0.0205, 0.0210],
    [0.305, 0.0148, 0.0175],
    [0.325, 0.0142, 0.0175],
    [0.350, 0.0150, 0.0215],
    [0.375, 0.0148, 0.0240],
    [0.400, 0.0128, 0.0225],
    [0.415, 0.0125, 0.0215],
];

/// Those of a foot, from the heel to the toes: place, half of the width, height above the middle. It is cut off at the ground.
const FOOT: [[f64; 3]; 6] = [
    [0.000, 0.0165, 0.022],
    [0.025, 0.0185, 0.034],
    [0.055, 0.0185, 0.034],
    [0.085, 0.0225, 0.020],
    [0.110, 0.0255, 0.013],
    [0.130, 0.0225, 0.009],
];

/// Places of the joints of the left side, which is that of positive x, and of the neck \[m\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joints {
    pub(crate) shoulder: DVec3,
    pub(crate) elbow: DVec3,
    pub(crate) hip: DVec3,
    pub(crate) knee: DVec3,
    pub(crate) neck: DVec3,
    /// Direction of the arm at rest.
    pub(crate) arm: DVec3,
}

/// How far a point is from the parts of a body \[m\]; negative inside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Distances {
    pub(crate) trunk: f64,
    pub(crate) head: f64,
    /// Left, then right.
    pub(crate) arms: [f64; 2],
    pub(crate) legs: [f64; 2],
}

/// A body that stands on z = 0 and looks along -y.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub(crate) height: f64,
    pub(crate) joints: Joints,
    trunk: Stack,
    head: Stack,
    arm: Stack,
    leg: Stack,
    foot: Stack,
}

impl Body {
    /// The body whose girths are those of `measures`: what a tape reads is measured and corrected until they are.
    pub(crate) fn new(measures: &Measures) -> Self {
        let wanted = [measures.neck, measures.chest, measures.waist, measures.hips];
        let mut scales = [measures.height / Measures::default().height; 4];
        let mut body = Self::of_scales(measures, scales);
        for _ in 0..FITTINGS {
            for (k, scale) in scales.iter_mut().enumerate() {
                *scale *= wanted[k] / body.girth(LEVELS[k] * measures.height);
            }
            body = Self::of_scales(measures, scales);
        }
        body
    }

    /// A body whose neck, chest, waist and hips are those of the tables times `scales`.
    fn of_scales(measures: &Measures, scales: [f64; 4]) -> Self {
        let h = measures.height;
        let [neck, chest, waist, hips] = scales.map(|scale| scale * Measures::default().height / h);
        let breadth =
            measures.shoulders / (Measures::default().shoulders / Measures::default().height * h);
        let [neck_at, chest_at, waist_at, hips_at] = LEVELS;
        let along = |z: f64, points: &[[f64; 2]]| between(z, points);
        let trunk = TRUNK.map(|[at, y, side, front, back, square]| {
            let girths = [
                [hips_at, hips],
                [waist_at, waist],
                [chest_at, chest],
                [0.80, chest],
                [neck_at - 0.008, neck],
            ];
            let widths = [
                [hips_at, hips],
                [waist_at, waist],
                [chest_at, chest],
                [0.80, breadth],
                [neck_at - 0.008, neck],
            ];
            let [deep, wide] = [along(at, &girths), along(at, &widths)];
            Section {
                at: at * h,
                centre: [0.0, y * h],
                side: side * wide * h,
                front: front * deep * h,
                back: back * deep * h,
                square,
            }
        });
        let head = HEAD.map(|[at, y, side, front, back, square]| Section {
            at: at * h,
            centre: [0.0, y * h],
            side: side * h,
            front: front * h,
            back: back * h,
            square,
        });
        let leg = LEG.map(|[at, x, y, side, front, back]| {
            let thick = along(at, &[[0.05, hips.sqrt()], [0.45, hips]]) * h;
            let x = along(at, &[[0.3, x], [0.47, x * hips]]) * h;
            Section {
                at: at * h,
                centre: [x, y * h],
                side: side * thick,
                front: front * thick,
                back: back * thick,
                square: 0.0,
            }
        });
        let thick = chest.sqrt().sqrt() * h;
        let arm = ARM.map(|[at, thin, wide]| Section {
            at: at * h,
            centre: [0.0; 2],
            side: thin * thick,
            front: wide * thick,
            back: wide * thick,
            square: 0.0,
        });
        let foot = FOOT.map(|[at, wide, top]| Section {
            at: at * h,
            centre: [0.0; 2],
            side: wide * h,
            front: 0.03 * h,
            back: top * h,
            square: 0.2,
        });
        let (sine, cosine) = ARM_RAISE.to_radians().sin_cos();
        let direction = DVec3::new(sine, 0.0, -cosine);
        // A large chest moves the arms out.
        let out = breadth + 0.6 * (chest - breadth).max(0.0);
        let shoulder = DVec3::new(0.0965 * out, 0.008, 0.790) * h;
        Self {
            height: h,
            joints: Joints {
                shoulder,
                elbow: shoulder + 0.172 * h * direction,
                hip: DVec3::new(0.053 * hips, 0.0, 0.50) * h,
                knee: DVec3::new(0.0505, 0.0, 0.272) * h,
                neck: DVec3::new(0.0, 0.005, 0.865) * h,
                arm: direction,
            },
            trunk: Stack::new(&trunk, [0.012 * h, 0.02 * h]),
            head: Stack::new(&head, [0.004 * h, 0.002 * h]),
            arm: Stack::new(&arm, [0.033 * thick, 0.012 * h]),
            leg: Stack::new(&leg, [0.02 * h, 0.03 * h]),
            foot: Stack::new(&foot, [0.017 * h, 0.016 * h]),
        }
    }

    pub(crate) fn distances(&self, point: DVec3) -> Distances {
        let sides = [point, DVec3::new(-point.x, point.y, point.z)];
        let arms = sides.map(|point| {
            let out = point - self.joints.shoulder;
            let along = self.joints.arm;
            let thin = DVec3::new(-along.z, 0.0, along.x);
            self.arm.distance(DVec3::new(out.dot(thin), out.y, out.dot(along)))
        });
        let legs = sides.map(|point| {
            let h = self.height;
            // Its sections are upright, and it goes from the heel to the front.
            let foot = DVec3::new(
                point.x - (0.049 + 0.06 * (0.02 - point.y / h)) * h,
                point.z - 0.016 * h,
                0.030 * h - point.y,
            );
            let foot = smooth_max(self.foot.distance(foot), -point.z, 0.012 * h);
            smooth_min(self.leg.distance(point), foot, 0.02 * h)
        });
        Distances { trunk: self.trunk.distance(point), head: self.head.distance(point), arms, legs }
    }

    /// How far `point` is outside of the body, about.
    pub(crate) fn distance(&self, point: DVec3) -> f64 {
        let h = self.height;
        let Distances { trunk, head, arms, legs } = self.distances(point);
        let top = smooth_min(trunk, head, 0.018 * h);
        let legs = smooth_min(legs[0], legs[1], 0.012 * h);
        let body = smooth_min(top, legs, 0.02 * h);
        smooth_min(body, smooth_min(arms[0], arms[1], 0.01 * h), 0.028 * h)
    }

    /// Where the distance grows, by differences along the diagonals of a tetrahedron; about a unit vector.
    pub(crate) fn gradient(&self, point: DVec3) -> DVec3 {
        const STEP: f64 = 1e-5;
        let diagonals = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        let part = |diagonal: [f64; 3]| {
            let diagonal = DVec3::from(diagonal);
            self.distance(point + STEP * diagonal) * diagonal
        };
        diagonals.map(part).iter().sum::<DVec3>() / (4.0 * STEP)
    }

    /// What a tape around the trunk reads at height `z` \[m\].
    fn girth(&self, z: f64) -> f64 {
        const RAYS: usize = 64;
        let hit = |ray: usize| {
            let angle = ray as f64 / RAYS as f64 * std::f64::consts::TAU;
            let at = |r: f64| DVec3::new(r * angle.cos(), r * angle.sin(), z);
            // The first crossing: beyond it there are arms.
            let step = 0.008 * self.height;
            let mut outer = step;
            while outer < 0.3 * self.height && self.distance(at(outer)) < 0.0 {
                outer += step;
            }
            let mut inner = outer - step;
            for _ in 0..16 {
                let middle = f64::midpoint(inner, outer);
                if self.distance(at(middle)) < 0.0 { inner = middle } else { outer = middle }
            }
            [at(outer).x, at(outer).y]
        };
        tape::around((0..RAYS).map(hit).collect())
    }
}

/// The value at `x` of lines through points in ascending order; those at the ends hold beyond them.
fn between(x: f64, points: &[[f64; 2]]) -> f64 {
    let above = points.partition_point(|point| point[0] <= x);
    match (above.checked_sub(1).and_then(|below| points.get(below)), points.get(above)) {
        (Some(a), Some(b)) => a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1]),
        (Some(end), None) | (None, Some(end)) => end[1],
        (None, None) => 1.0,
    }
}
