//! What can go through cloth: what is too thin for contact of particles.

use cloth::{ColliderShape, Model, SpringClass};

/// The hole between four particles of a grid is this much wider than their distance.
const HOLE: f64 = std::f64::consts::SQRT_2;

/// A warning for each collider, and for contact of cloth with cloth, that can slip through between the particles of some cloth.
pub(crate) fn passages(model: &Model) -> Vec<String> {
    let mut warnings = Vec::new();
    let spacings = spacings(model);
    let widest = model.cloths().iter().zip(&spacings).max_by(|a, b| a.1.total_cmp(b.1));
    let Some((cloth, &spacing)) = widest else { return warnings };
    let hole = HOLE * spacing - cloth.thickness;
    // Triangles that touch triangles let nothing through, however thin they are.
    let solids = model.colliders().iter().enumerate();
    for (_, collider) in solids.filter(|&(number, _)| !model.is_contact_body(number)) {
        let Some(thickness) = thickness(&collider.shape).filter(|&thickness| thickness < hole)
        else {
            continue;
        };
        warnings.push(format!(
            "the collider {:?} is {thickness:.4} m thin, and particles of the cloth {:?} are {spacing:.4} m apart: as contact is one of \
             particles, it can slip through between them; use a finer cloth or a thicker collider",
            collider.name, cloth.name
        ));
    }
    if let Some(contact) = (model.self_contact())
        .filter(|contact| !contact.is_of_triangles() && contact.distance < 0.5 * HOLE * spacing)
    {
        warnings.push(format!(
            "the contact distance {} m is short for the cloth {:?}, whose particles are {spacing:.4} m apart: a particle can slip through \
             between four others untouched; use at least {:.4} m",
            contact.distance,
            cloth.name,
            0.5 * HOLE * spacing
        ));
    }
    warnings
}

/// The mean rest length of the stretch springs of each cloth \[m\], or of the short sides that its triangles of fabric would have in a square
/// grid; 0 without any.
fn spacings(model: &Model) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0_f64); model.cloths().len()];
    let mut add = |particle: u32, length: f64| {
        let (sum, count) = &mut sums[model.cloth_of(particle)];
        *sum += length;
        *count += 1.0;
    };
    for spring in model.springs().iter() {
        let kind = &model.springs().kinds()[spring.kind as usize];
        if kind.class == SpringClass::Stretch {
            add(spring.particles[0], kind.rest_length);
        }
    }
    for triangle in model.elements().triangles() {
        add(triangle.particles[0], (2.0 * triangle.rest.area).sqrt());
    }
    sums.into_iter().map(|(sum, count)| sum / count.max(1.0)).collect()
}

/// The least width of a solid \[m\]; of a mesh that of the box around it. `None` for a half space.
fn thickness(shape: &ColliderShape) -> Option<f64> {
    match shape {
        ColliderShape::Plane | ColliderShape::Surface(_) => None,
        ColliderShape::Sphere { radius } | ColliderShape::Capsule { radius, .. } => {
            Some(2.0 * radius)
        }
        ColliderShape::Box { half_extents } => {
            Some(2.0 * half_extents.iter().copied().fold(f64::INFINITY, f64::min))
        }
        ColliderShape::Grid(grid) => {
            let width = |axis: usize| {
                let places = grid.surface.positions.iter().map(|position| position[axis]);
                let (low, high) = places
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| {
                        (low.min(place), high.max(place))
                    });
                high - low
            };
            Some((0..3).map(width).fold(f64::INFINITY, f64::min))
        }
    }
}
