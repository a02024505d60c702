//! Elastic bands along borders of panels.

use cloth_core::{Seam, SeamTie};

use crate::{Scene, SceneElastic, SceneError, error::SceneUnknown};

use super::{Check, Cutter};

/// The number of a band, and its edges with their lengths \[m\].
pub(super) type Band = (usize, Vec<([u32; 2], f64)>);

/// The cloth that a band is in.
fn cloth_of<'a>(scene: &'a Scene, band: &'a SceneElastic) -> Option<&'a str> {
    match (&band.cloth, &scene.cloths[..]) {
        (Some(name), _) => Some(name),
        (None, [cloth]) => Some(&cloth.name),
        (None, _) => None,
    }
}

/// Whether a cloth has any.
pub(super) fn are_in(scene: &Scene, name: &str) -> bool {
    scene.elastics.iter().any(|band| cloth_of(scene, band) == Some(name))
}

/// The edges of the bands of a cloth, which has all of its vertices.
pub(super) fn bands(
    (scene, check): (&Scene, &Check<'_>),
    name: &str,
    cutter: &Cutter<'_>,
) -> Result<Vec<Band>, SceneError> {
    let mut found = Vec::new();
    for (index, band) in scene.elastics.iter().enumerate() {
        if cloth_of(scene, band) == Some(name) {
            let key = format!("elastic[{index}].line");
            let mut edges = Vec::new();
            // One after the other, as groups may lie apart at the start.
            for group in &band.line {
                let group = std::slice::from_ref(group);
                edges.extend(super::line(check, &key, cutter, group)?.edges(cutter));
            }
            found.push((index, edges));
        }
    }
    Ok(found)
}

/// The bands for the model: seams that do not close.
pub(super) fn compile(
    scene: &Scene,
    check: &Check<'_>,
    mut within: Vec<Band>,
) -> Result<Vec<Seam>, SceneError> {
    let mut bands = Vec::with_capacity(scene.elastics.len());
    for (index, band) in scene.elastics.iter().enumerate() {
        let key = format!("elastic[{index}]");
        check.positive(&format!("{key}.ratio"), band.ratio)?;
        check.share(&format!("{key}.ratio"), band.ratio)?;
        check.positive(&format!("{key}.stiffness"), band.stiffness)?;
        if band.line.is_empty() {
            let problem = "is empty: name vertex groups along a border";
            return Err(check.error(&format!("{key}.line"), problem));
        }
        let Some(cloth) = cloth_of(scene, band) else {
            return Err(check.error(&key, "does not say which cloth it is in: give `cloth`"));
        };
        if scene.cloths.iter().all(|known| known.name != cloth) {
            let known = scene.cloths.iter().map(|cloth| cloth.name.clone()).collect();
            let place = check.place(&format!("{key}.cloth"));
            return Err(SceneUnknown::error(place, "cloth", cloth, known));
        }
        let Some(place) = within.iter().position(|(number, _)| *number == index) else {
            let problem = format!(
                "is in the cloth {cloth:?}, which has no borders: give it a mesh or panels"
            );
            return Err(check.error(&format!("{key}.line"), &problem));
        };
        let edges = within.swap_remove(place).1;
        // A spring of half the length is twice as stiff.
        let tie = |(_, length): &([u32; 2], f64)| SeamTie {
            length: band.ratio * length,
            share: 1.0 / (band.ratio * length),
        };
        bands.push(Seam {
            stiffness: band.stiffness,
            damping: Some(0.0),
            closing: band.close,
            weld: false,
            ties: edges.iter().map(tie).collect(),
            ..Seam::new(band.name.clone(), cloth, edges.iter().map(|(edge, _)| *edge).collect())
        });
    }
    Ok(bands)
}
