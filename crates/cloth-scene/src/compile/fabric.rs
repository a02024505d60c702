//! Cloth of triangles: what it is made of, its rest shape and its warp.

use cloth_core::{
    Aerodynamics, FabricMaterial, ModelError, PanelFabrics, RestSource, TextureMap, TriangleMesh,
    fabric::{Fabric, FabricError, FitReport, USUAL_DAMPING},
};

use crate::{
    MeasuredFabric, SceneCloth, SceneError, SceneGeometry, SceneMass, ScenePanel, ScenePattern,
    ScenePatternSource, SceneTriangles, error::SceneUnknown, fabric_sheet_read,
};

use super::{Check, CompileOptions, mesh};

/// Layers of a panel at most.
const LAYERS_MAX: u32 = 100;

/// The fabric of the cloth at `key` in a mesh, whose warp is turned as its pattern says. What is worth knowing of it goes to `notes`.
pub(super) fn compile(
    check: &Check<'_>,
    key: &str,
    cloth: &SceneCloth,
    options: &CompileOptions,
    mesh: &mut TriangleMesh,
    notes: &mut Vec<String>,
) -> Result<FabricMaterial, SceneError> {
    springs_alone(check, key, cloth)?;
    let mut fabric = base(check, &format!("{key}.material"), cloth, options, notes)?;
    let scene = &cloth.material;
    if let Some(SceneMass::PerArea(density)) = scene.mass {
        fabric.area_density = density;
    }
    if let Some(thickness) = scene.thickness {
        fabric.thickness = thickness;
    }
    if let Some(limit) = scene.stretch_limit {
        fabric.stretch_limit = limit;
    }
    let given = scene.damping.unwrap_or_default();
    for (damping, (name, given)) in
        fabric.damping.iter_mut().zip([("stretch", given.stretch), ("bend", given.bend)])
    {
        let Some(given) = given else { continue };
        check.not_negative(&format!("{key}.material.damping.{name}"), given)?;
        *damping = given;
    }
    let air = Aerodynamics::default();
    let given = scene.aerodynamics.unwrap_or_default();
    let aerodynamics = Aerodynamics {
        pressure: given.pressure.unwrap_or(air.pressure),
        friction: given.friction.unwrap_or(air.friction),
    };
    for (name, value) in [("pressure", aerodynamics.pressure), ("friction", aerodynamics.friction)]
    {
        check.not_negative(&format!("{key}.material.aerodynamics.{name}"), value)?;
    }
    let pattern_key = format!("{key}.pattern");
    let rest = pattern(check, &pattern_key, cloth, &fabric, mesh)?;
    let imperfection = cloth.pattern.as_ref().and_then(|pattern| pattern.imperfection);
    if let Some(given) = imperfection {
        check.not_negative(&format!("{pattern_key}.imperfection"), given)?;
    }
    let imperfection = imperfection.map_or(FabricMaterial::IMPERFECTION, f64::to_radians);
    Ok(FabricMaterial { fabric, rest, aerodynamics, imperfection })
}

/// Refuses keys that springs alone have.
fn springs_alone(check: &Check<'_>, key: &str, cloth: &SceneCloth) -> Result<(), SceneError> {
    let mend =
        "is of springs, and this cloth is of fabric: remove it, or give `model = \"springs\"`";
    if let Some(name) = cloth.material.springs_key() {
        return Err(check.error(&format!("{key}.material.{name}"), mend));
    }
    if cloth.stencil_is_given() {
        return Err(check.error(&format!("{key}.geometry.grid.stencil"), mend));
    }
    Ok(())
}

/// Refuses keys that fabric alone has.
pub(super) fn fabric_alone(
    check: &Check<'_>,
    key: &str,
    cloth: &SceneCloth,
) -> Result<(), SceneError> {
    let material = &cloth.material;
    let meshing = match &cloth.geometry {
        SceneGeometry::Grid(grid) => grid.meshing.is_some(),
        _ => false,
    };
    let keys = [
        ("material.sheet", material.sheet.is_some()),
        ("material.damping", material.damping.is_some()),
        ("material.stretch_limit", material.stretch_limit.is_some()),
        ("geometry.grid.meshing", meshing),
        ("pattern", cloth.pattern.is_some()),
        ("folds", !cloth.folds.is_empty()),
        ("tear", cloth.tear.is_some()),
        ("material.maps", !material.maps.is_empty()),
    ];
    match keys.into_iter().find(|(_, is_given)| *is_given) {
        Some((name, _)) => {
            let mend = "is of fabric, and this cloth is of springs: remove it, or give `model = \"fabric\"`";
            Err(check.error(&format!("{key}.{name}"), mend))
        }
        None => Ok(()),
    }
}

/// The fabric of the preset or sheet.
fn base(
    check: &Check<'_>,
    key: &str,
    cloth: &SceneCloth,
    options: &CompileOptions,
    notes: &mut Vec<String>,
) -> Result<Fabric, SceneError> {
    let material = &cloth.material;
    let (what, fitted) = match (&material.preset, &material.sheet) {
        (Some(_), Some(_)) => {
            return Err(check.error(key, "has a `preset` and a `sheet`: remove one"));
        }
        (Some(name), None) => {
            let key = format!("{key}.preset");
            let fitted = preset(check, &key, name)?;
            (key, fitted)
        }
        (None, Some(file)) => {
            let key = format!("{key}.sheet");
            let path = mesh::resolve(&check.origin().directory, file, options).ok_or_else(|| {
                let problem = format!(
                    "`{file}` is not a plain path below the folder of the scene: keep it there, or allow its folder as a mesh root"
                );
                check.error(&key, &problem)
            })?;
            let sheet = fabric_sheet_read(&path)
                .map_err(|error| check.error(&key, &format!("cannot be used: {error}")))?;
            let owner = format!("laboratory sheet `{file}`");
            let fit = sheet.fit(&owner);
            (key, (owner, fit))
        }
        (None, None) => {
            let problem = "has no `preset`: give one that `cloth fabrics` lists, or a `sheet`";
            return Err(check.error(key, problem));
        }
    };
    let (name, fit) = fitted;
    let (fabric, report) = fit.map_err(|error| SceneError::Model {
        place: check.place(&what),
        source: ModelError::from(error),
    })?;
    // What was not measured of a preset is what `cloth fabrics NAME` says.
    if material.sheet.is_some() {
        notes.extend(fit_note(&cloth.name, &name, &report));
    }
    Ok(Fabric { damping: USUAL_DAMPING, ..fabric })
}

/// A fabric and what is to be known of its fit.
type Fitted = Result<(Fabric, FitReport), FabricError>;

/// The name and the fit of the preset at `key`.
fn preset(check: &Check<'_>, key: &str, name: &str) -> Result<(String, Fitted), SceneError> {
    let fabric = MeasuredFabric::find(name).map_err(|error| match error {
        SceneError::Unknown(unknown) => {
            SceneError::Unknown(Box::new(SceneUnknown { place: check.place(key), ..*unknown }))
        }
        other => other,
    })?;
    Ok((fabric.name.clone(), fabric.fit()))
}

/// What was not measured, in one line.
fn fit_note(cloth: &str, fabric: &str, report: &FitReport) -> Option<String> {
    let mut parts = report.notes.clone();
    if !report.assumed.is_empty() {
        parts.push(format!("not measured, and assumed: {}", report.assumed.join("; ")));
    }
    (!parts.is_empty()).then(|| format!("cloth {cloth:?}, {fabric}: {}", parts.join("; ")))
}

/// Where the rest shape comes from; the angles of the warp go into the mesh.
fn pattern(
    check: &Check<'_>,
    key: &str,
    cloth: &SceneCloth,
    fabric: &Fabric,
    mesh: &mut TriangleMesh,
) -> Result<RestSource, SceneError> {
    let nothing = ScenePattern::default();
    let ScenePattern { from, scale, axis, warp, panels, imperfection: _ } =
        cloth.pattern.as_ref().unwrap_or(&nothing);
    let is_flat = matches!(cloth.geometry, SceneGeometry::Grid(_) | SceneGeometry::Panels(_));
    if matches!(cloth.geometry, SceneGeometry::Panels(_)) && warp.is_some() {
        let problem = "is of other meshes: give `warp` to the pieces";
        return Err(check.error(&format!("{key}.warp"), problem));
    }
    if is_flat {
        let keys = [
            ("from", from.is_some()),
            ("scale", scale.is_some()),
            ("axis", axis.is_some()),
            ("panels", !panels.is_empty() && matches!(cloth.geometry, SceneGeometry::Grid(_))),
        ];
        if let Some((name, _)) = keys.into_iter().find(|(_, is_given)| *is_given) {
            let problem = "is of meshes: remove it, the pattern of a grid is its columns and rows, and that of pieces their outlines";
            return Err(check.error(&format!("{key}.{name}"), problem));
        }
    }
    let has_pieces = matches!(cloth.geometry, SceneGeometry::Panels(_));
    if let Some(index) = panels.iter().position(|panel| has_pieces && panel.warp.is_some()) {
        let problem = "is of other meshes: give `warp` to the pieces";
        return Err(check.error(&format!("{key}.panels[{index}].warp"), problem));
    }
    let of = panels_of(check, key, panels, mesh)?;
    grain(check, key, (*warp, panels), &of, mesh)?;
    mesh.panels = panel_fabrics(check, key, (fabric, panels, cloth.material.stretch_limit), &of)?;
    if is_flat || *from == Some(ScenePatternSource::Uv) {
        if axis.is_some() {
            let problem = "is of `from = \"shape\"`: remove it, in a pattern the warp runs along u";
            return Err(check.error(&format!("{key}.axis"), problem));
        }
        let scale = scale.unwrap_or(1.0);
        check.positive(&format!("{key}.scale"), scale)?;
        return Ok(RestSource::Pattern { scale });
    }
    if scale.is_some() {
        let problem = "is of texture coordinates: give `from = \"uv\"`, or remove it";
        return Err(check.error(&format!("{key}.scale"), problem));
    }
    if let Some(axis) = axis {
        check.direction(&format!("{key}.axis"), *axis)?;
    }
    Ok(RestSource::Start { warp: *axis })
}

/// The first panel that each triangle of `mesh` belongs to.
fn panels_of(
    check: &Check<'_>,
    key: &str,
    panels: &[ScenePanel],
    mesh: &TriangleMesh,
) -> Result<Vec<Option<usize>>, SceneError> {
    let mut of = vec![None; if panels.is_empty() { 0 } else { mesh.triangles.len() }];
    for (index, panel) in panels.iter().enumerate() {
        let Some(group) = mesh.group(&panel.group) else {
            let known = mesh.groups.iter().map(|group| group.name.clone()).collect();
            let place = check.place(&format!("{key}.panels[{index}].group"));
            return Err(SceneUnknown::error(place, "group of the mesh", &panel.group, known));
        };
        let mut is_in = vec![false; mesh.positions.len()];
        group.vertices.iter().for_each(|&vertex| is_in[vertex as usize] = true);
        for (triangle, of) in mesh.triangles.iter().zip(&mut of) {
            if triangle.iter().all(|&vertex| is_in[vertex as usize]) {
                of.get_or_insert(index);
            }
        }
    }
    Ok(of)
}

/// Gives each triangle of `mesh` the angle of its warp, if any is given.
fn grain(
    check: &Check<'_>,
    key: &str,
    (warp, panels): (Option<f64>, &[ScenePanel]),
    of: &[Option<usize>],
    mesh: &mut TriangleMesh,
) -> Result<(), SceneError> {
    let own = warp.unwrap_or_default();
    check.finite(&format!("{key}.warp"), &[own])?;
    for (index, panel) in panels.iter().enumerate() {
        check.finite(&format!("{key}.panels[{index}].warp"), &[panel.warp.unwrap_or_default()])?;
    }
    if own == 0.0 && panels.iter().all(|panel| panel.warp.is_none()) {
        return Ok(());
    }
    let angle = |t: usize| {
        let panel = of.get(t).copied().flatten().map(|panel| &panels[panel]);
        panel.and_then(|panel| panel.warp).unwrap_or(own).to_radians()
    };
    mesh.grain = (0..mesh.triangles.len()).map(angle).collect();
    Ok(())
}

/// The fabrics of panels that are not of the fabric of the cloth.
fn panel_fabrics(
    check: &Check<'_>,
    key: &str,
    (base, panels, limit): (&Fabric, &[ScenePanel], Option<f64>),
    of: &[Option<usize>],
) -> Result<PanelFabrics, SceneError> {
    let mut fabrics = Vec::new();
    let mut numbers = vec![0; panels.len()];
    for (index, (panel, number)) in panels.iter().zip(&mut numbers).enumerate() {
        let key = format!("{key}.panels[{index}]");
        let layers = panel.layers.unwrap_or(1);
        if !(1..=LAYERS_MAX).contains(&layers) {
            let problem = format!("must be from 1 to {LAYERS_MAX}");
            return Err(check.error(&format!("{key}.layers"), &problem));
        }
        if panel.preset.is_none() && layers == 1 {
            continue;
        }
        let own = match &panel.preset {
            Some(name) => {
                let key = format!("{key}.preset");
                let (_, fit) = preset(check, &key, name)?;
                let (fabric, _) = fit.map_err(|error| SceneError::Model {
                    place: check.place(&key),
                    source: ModelError::from(error),
                })?;
                Fabric {
                    damping: base.damping,
                    stretch_limit: limit.unwrap_or(fabric.stretch_limit),
                    ..fabric
                }
            }
            None => *base,
        };
        fabrics.push(own.layers(layers));
        *number = fabrics.len() as u32;
    }
    if fabrics.is_empty() {
        return Ok(PanelFabrics::default());
    }
    let triangles = of.iter().map(|panel| panel.map_or(0, |panel| numbers[panel])).collect();
    Ok(PanelFabrics { fabrics, triangles })
}

/// The pattern coordinates that a mesh in the scene itself gives.
pub(super) fn texture(
    check: &Check<'_>,
    key: &str,
    triangles: &SceneTriangles,
) -> Result<Option<TextureMap>, SceneError> {
    let SceneTriangles { vertices, faces, uv, uv_faces } = triangles;
    if uv.is_empty() {
        if uv_faces.is_empty() {
            return Ok(None);
        }
        return Err(check.error(&format!("{key}.uv_faces"), "name coordinates of no `uv`: give it"));
    }
    let by_vertex = uv_faces.is_empty();
    if by_vertex && uv.len() != vertices.len() {
        let problem = format!(
            "has {} coordinates, and there are {} vertices: give one to each, or `uv_faces`",
            uv.len(),
            vertices.len()
        );
        return Err(check.error(&format!("{key}.uv"), &problem));
    }
    let triangles = if by_vertex { faces.clone() } else { uv_faces.clone() };
    Ok(Some(TextureMap { coordinates: uv.clone(), triangles }))
}
