//! Who takes cloth along (NUMERICS §15, `contact_carry`).

use crate::Real;

/// How what is joined to prescribed particles goes along with them.
pub trait Carrier<T> {
    /// The rigid body that a node belongs to, if it turns by less than a radian in the substep.
    fn body(&self, node: u32) -> Option<u32>;

    /// The way \[m\] of what is at `place` \[m\] at the start and moves like a part of this body, to a few units of roundoff.
    fn way(&self, body: u32, place: [T; 3]) -> [T; 3];

    /// Whether the body of this node goes too far in the substep to take anything along.
    fn jumps(&self, node: u32) -> bool;

    /// The triangles of all bodies, whose nodes count from the first one.
    fn faces(&self) -> Vec<[u32; 3]>;
}

/// No rigid bodies.
impl<T: Real> Carrier<T> for () {
    fn body(&self, _: u32) -> Option<u32> {
        None
    }

    fn way(&self, _: u32, _: [T; 3]) -> [T; 3] {
        [T::ZERO; 3]
    }

    fn jumps(&self, _: u32) -> bool {
        false
    }

    fn faces(&self) -> Vec<[u32; 3]> {
        Vec::new()
    }
}
