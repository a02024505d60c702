//! Angles of joints.

use crate::body::ARM_RAISE;

/// The direction of a limb, as of the shoulder in the recommendation of the International Society of Biomechanics (Wu et al. 2005): how far it is raised,
/// and in which plane. The limb goes there by the shortest arc.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Swing {
    /// Angle from hanging straight down \[degrees\].
    pub raise: f64,
    /// The plane in which it is raised \[degrees\]: 0 sideways, 90 forwards, -90 backwards.
    pub forwards: f64,
}

impl Swing {
    fn between(self, to: Self, share: f64) -> Self {
        let Self { raise, forwards } = self;
        Self {
            raise: raise + share * (to.raise - raise),
            forwards: forwards + share * (to.forwards - forwards),
        }
    }
}

/// The angles of all joints \[degrees\]. Pairs are of the left side, then of the right one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Upper arms.
    pub shoulders: [Swing; 2],
    /// How far forearms are bent; 0 is straight.
    pub elbows: [f64; 2],
    /// Thighs.
    pub hips: [Swing; 2],
    /// How far shins are bent; 0 is straight.
    pub knees: [f64; 2],
    /// How far the head is turned to the left.
    pub head: f64,
}

impl Default for Pose {
    /// The pose at rest: upright, straight arms 45 degrees from the vertical.
    fn default() -> Self {
        Self {
            shoulders: [Swing { raise: ARM_RAISE, forwards: 0.0 }; 2],
            elbows: [0.0; 2],
            hips: [Swing::default(); 2],
            knees: [0.0; 2],
            head: 0.0,
        }
    }
}

impl Pose {
    /// The pose at a share of the way to another one, angle by angle.
    #[must_use]
    pub fn between(&self, to: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + share * (b - a);
        let swings =
            |a: [Swing; 2], b: [Swing; 2]| [a[0].between(b[0], share), a[1].between(b[1], share)];
        let angles = |a: [f64; 2], b: [f64; 2]| [mix(a[0], b[0]), mix(a[1], b[1])];
        Self {
            shoulders: swings(self.shoulders, to.shoulders),
            elbows: angles(self.elbows, to.elbows),
            hips: swings(self.hips, to.hips),
            knees: angles(self.knees, to.knees),
            head: mix(self.head, to.head),
        }
    }
}
