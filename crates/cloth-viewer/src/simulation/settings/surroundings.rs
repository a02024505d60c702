//! Surfaces that cloth slides on.

use cloth::scene::Scene;

/// The surface of a collider or a rigid body.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceSettings {
    /// Name of the collider or body.
    pub name: String,
    /// Whether it is a rigid body.
    pub is_rigid: bool,
    /// Coulomb friction coefficient, dimensionless.
    pub friction: f64,
}

/// Those of the colliders of a scene, then those of its rigid bodies.
pub(super) fn surfaces(scene: &Scene) -> Vec<SurfaceSettings> {
    let surface = |name: &String, is_rigid, friction| SurfaceSettings {
        name: name.clone(),
        is_rigid,
        friction,
    };
    let colliders = scene.colliders.iter().map(|c| surface(&c.name, false, c.friction));
    let bodies = scene.rigids.iter().map(|b| surface(&b.name, true, b.friction));
    colliders.chain(bodies).collect()
}

/// Puts them into the scene again, in the same order.
pub(super) fn surfaces_apply(surfaces: &[SurfaceSettings], scene: &mut Scene) {
    let colliders = scene.colliders.iter_mut().map(|collider| &mut collider.friction);
    let bodies = scene.rigids.iter_mut().map(|body| &mut body.friction);
    for (friction, surface) in colliders.chain(bodies).zip(surfaces) {
        *friction = surface.friction;
    }
}
