//! What rigid bodies hold.

/// Particles that a rigid body holds by springs, which pull at both.
#[derive(Clone, Debug, PartialEq)]
pub struct RigidHold {
    /// Index into [`CompiledScene::rigids`](super::CompiledScene::rigids).
    pub body: usize,
    /// The particles.
    pub points: Vec<HeldPoint>,
    /// Stiffness of the spring of each \[N/m\], before its weight; as much as the body bears if not given.
    pub stiffness: Option<f64>,
    /// Damping of each \[N s/m\], before its weight.
    pub damping: Option<f64>,
    /// When they are let go \[s\].
    pub release: Option<f64>,
}

/// A particle that a rigid body holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldPoint {
    /// Its number in the composite model.
    pub particle: u32,
    /// Where it is held, in the local frame of the body \[m\].
    pub place: [f64; 3],
    /// By which stiffness and damping of its spring are multiplied.
    pub weight: f64,
}
