//! Cloth that intersects at the start is pulled apart, if the scene asks for it.

use cloth_core::{Collider, GridSets, Model, SelfContact};
use cloth_recover::{Body, Cloth, Recovered, recover};

use crate::Scene;

/// The model from where its cloths do not intersect, as far as that can be done, and what was done.
pub(super) fn recovered(scene: &Scene, model: Model) -> (Model, Option<Recovered>) {
    // Another run is where it starts from, if it names one.
    let asked =
        scene.start.is_none() && scene.contact_chosen().is_some_and(|contact| contact.recover);
    let Some(&contact) = model.self_contact().filter(|_| asked && model.has_triangle_contact())
    else {
        return (model, None);
    };
    let mut positions = model.positions().to_vec();
    let triangles = sewn(&model);
    let mut is_held = vec![false; positions.len()];
    model.pins().iter().for_each(|&pin| is_held[pin as usize] = true);
    let mut layers = Vec::with_capacity(positions.len());
    for (cloth, range) in scene.cloths.iter().zip(model.cloths()) {
        layers.resize(range.particles.end as usize, cloth.layer);
    }
    let bodies: Vec<Body> = model.colliders().iter().filter_map(body).collect();
    let cloth = Cloth { triangles: &triangles, is_held: &is_held, layers: &layers };
    let SelfContact { distance, .. } = contact;
    let found = recover(&mut positions, &cloth, &bodies, distance);
    follow(&model, &mut positions);
    (model.with_positions(&positions), Some(found))
}

/// For each particle the one that stands for it: the first of those that closed seams join to it.
fn places(model: &Model) -> Option<Vec<u32>> {
    if model.seams().is_empty() && model.tears().is_empty() {
        return None;
    }
    let positions = model.positions();
    let classes = model.seam_classes().all();
    let one = |(own, &class): (usize, &u32)| {
        let is_closed = positions[own] == positions[class as usize];
        if is_closed { class } else { own as u32 }
    };
    Some(classes.iter().enumerate().map(one).collect())
}

/// The triangles of all cloths; what a closed seam joins is one particle.
fn sewn(model: &Model) -> Vec<[u32; 3]> {
    let places = places(model);
    let one = |i: u32| places.as_ref().map_or(i, |places| places[i as usize]);
    model.triangles().iter().map(|triangle| triangle.map(one)).collect()
}

/// Particles that closed seams join to another one go where that went.
fn follow(model: &Model, positions: &mut [[f64; 3]]) {
    for (own, first) in places(model).into_iter().flatten().enumerate() {
        positions[own] = positions[first as usize];
    }
}

/// The faces of a collider where it is at the start; none of a plane.
fn body(collider: &Collider) -> Option<Body> {
    let triangles = collider.shape.body_triangles()?.into_owned();
    let positions = collider.shape.body_positions(GridSets::default());
    Some(Body {
        positions: positions.iter().map(|&at| collider.pose.point(at)).collect(),
        triangles,
    })
}
