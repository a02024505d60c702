//! Fabric that is not the same everywhere: painted by attributes of vertices, or by sets.

use std::collections::BTreeMap;

use cloth_core::{
    ContactMap, PanelFabrics, TriangleMesh,
    fabric::{Fabric, FabricScale},
};

use crate::{SceneError, SceneMap, SceneMapOf};

use super::{Check, pins::PinSets};

/// Steps between 0 and 1 that a map has: triangles with the same ones have one fabric.
const STEPS: f64 = 64.0;

/// The least factor: fabric without stiffness or mass is none.
const FACTOR_MIN: f64 = 1e-6;

/// Most fabrics of a cloth.
const FABRICS_MAX: usize = 1 << 16;

/// The value of each vertex, from 0 to 1.
fn values(
    check: &Check<'_>,
    key: &str,
    name: &str,
    (mesh, sets): (&TriangleMesh, &PinSets),
) -> Result<Vec<f64>, SceneError> {
    let count = mesh.positions.len();
    if let Some(attribute) = mesh.attribute(name) {
        let of = |i: usize| attribute.values.get(i).copied().unwrap_or_default();
        let found = (0..count).map(|i| f64::from(of(i)));
        return Ok(found.map(|value| if value > 0.0 { value.min(1.0) } else { 0.0 }).collect());
    }
    let attributes = mesh.attributes.iter().map(|attribute| attribute.name.clone());
    let set = sets.of_mesh((check, key), mesh, name, attributes)?;
    let mut found = vec![0.0; count];
    for vertex in set {
        if let Some(value) = found.get_mut(vertex as usize) {
            *value = 1.0;
        }
    }
    Ok(found)
}

/// The value of each vertex for one of the maps of the cloth at `key`, whose factors are checked.
fn checked_values(
    check: &Check<'_>,
    key: &str,
    (index, map): (usize, &SceneMap),
    (mesh, sets): (&TriangleMesh, &PinSets),
) -> Result<Vec<f64>, SceneError> {
    let key = format!("{key}.material.maps[{index}]");
    let range = format!("{key}.range");
    check.finite(&range, &map.range)?;
    if let Some(factor) = map.range.iter().find(|factor| **factor < FACTOR_MIN) {
        let problem = format!("is {factor}: a factor is at least {FACTOR_MIN}");
        return Err(check.error(&range, &problem));
    }
    values(check, &format!("{key}.by"), &map.by, (mesh, sets))
}

/// What maps make of contact at the vertices of the cloth at `key`; nothing if none is about it.
pub(super) fn contact(
    check: &Check<'_>,
    (key, cloth): (&str, &str),
    maps: &[SceneMap],
    (mesh, sets): (&TriangleMesh, &PinSets),
) -> Result<Option<ContactMap>, SceneError> {
    let mut found = ContactMap { cloth: cloth.to_owned(), ..ContactMap::default() };
    for (index, map) in maps.iter().enumerate() {
        let factors = match map.of {
            SceneMapOf::Thickness => &mut found.distance,
            SceneMapOf::Friction => &mut found.friction,
            _ => continue,
        };
        let values = checked_values(check, key, (index, map), (mesh, sets))?;
        let [low, high] = map.range;
        factors.resize(values.len(), 1.0);
        for (factor, value) in factors.iter_mut().zip(values) {
            *factor *= low + (high - low) * value;
        }
    }
    let is_empty = found.distance.is_empty() && found.friction.is_empty();
    Ok((!is_empty).then_some(found))
}

/// The fabrics of all triangles of the cloth at `key` of the fabric `base`, as its panels and maps say.
pub(super) fn compile(
    check: &Check<'_>,
    key: &str,
    (maps, base): (&[SceneMap], &Fabric),
    (mesh, sets): (&TriangleMesh, &PinSets),
) -> Result<PanelFabrics, SceneError> {
    // Of each triangle the step of every map.
    let mut steps = vec![Vec::with_capacity(maps.len()); mesh.triangles.len()];
    for (index, map) in maps.iter().enumerate() {
        if matches!(map.of, SceneMapOf::Thickness | SceneMapOf::Friction) {
            steps.iter_mut().for_each(|steps| steps.push(0));
            continue;
        }
        let values = checked_values(check, key, (index, map), (mesh, sets))?;
        for (triangle, steps) in mesh.triangles.iter().zip(&mut steps) {
            let of = |i: u32| values.get(i as usize).copied().unwrap_or_default();
            let mean = triangle.iter().map(|&i| of(i)).sum::<f64>() / 3.0;
            steps.push((mean * STEPS).round() as u8);
        }
    }
    let mut known = BTreeMap::new();
    let mut panels = PanelFabrics::default();
    for (t, steps) in steps.into_iter().enumerate() {
        let panel = mesh.panels.triangles.get(t).copied().unwrap_or_default();
        let number = match known.get(&(panel, steps.clone())) {
            Some(&number) => number,
            None => {
                let scale = scale(maps, &steps);
                panels.fabrics.push(mesh.panels.of(base, t).scaled(&scale));
                let number = panels.fabrics.len() as u32;
                known.insert((panel, steps), number);
                number
            }
        };
        panels.triangles.push(number);
    }
    if panels.fabrics.len() > FABRICS_MAX {
        let problem = format!("make {} fabrics: use fewer maps", panels.fabrics.len());
        return Err(check.error(&format!("{key}.material.maps"), &problem));
    }
    Ok(panels)
}

/// The factors of a triangle.
fn scale(maps: &[SceneMap], steps: &[u8]) -> FabricScale {
    let mut scale = FabricScale::ONE;
    for (SceneMap { of, range: [low, high], .. }, &step) in maps.iter().zip(steps) {
        let factor = low + (high - low) * f64::from(step) / STEPS;
        *match of {
            SceneMapOf::Stretch => &mut scale.stretch,
            SceneMapOf::Bend => &mut scale.bend,
            SceneMapOf::Mass => &mut scale.density,
            SceneMapOf::Damping => &mut scale.damping,
            SceneMapOf::Thickness | SceneMapOf::Friction => continue,
        } *= factor;
    }
    scale
}
