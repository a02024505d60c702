//! Built-in scenes cut down, so that whole runs of all of them are short.

use cloth::scene::{Scene, SceneError, SceneGeometry};

/// A built-in scene whose patches have at most `side` particles along a side; but for the curtain, whose hooks are at particles with numbers.
///
/// # Errors
/// There is no such scene.
pub fn small(name: &str, side: u32) -> Result<Scene, SceneError> {
    let mut scene = Scene::builtin(name)?;
    for cloth in &mut scene.cloths {
        if let SceneGeometry::Grid(grid) = &mut cloth.geometry
            && name != "curtain"
        {
            (grid.columns, grid.rows) = (grid.columns.min(side), grid.rows.min(side));
        }
    }
    Ok(scene)
}
