//! Built-in scenes cut down, so that whole runs of all of them are short.

use cloth::scene::{Scene, SceneError, SceneGeometry, ScenePin};

/// A built-in scene whose patches have at most `side` particles along a side. Pins that are particles with numbers go where they are on the
/// smaller patch, about.
///
/// # Errors
/// There is no such scene.
pub fn small(name: &str, side: u32) -> Result<Scene, SceneError> {
    let mut scene = Scene::builtin(name)?;
    for cloth in &mut scene.cloths {
        let SceneGeometry::Grid(grid) = &mut cloth.geometry else { continue };
        let before = [grid.columns, grid.rows];
        (grid.columns, grid.rows) = (grid.columns.min(side), grid.rows.min(side));
        let after = [grid.columns, grid.rows];
        moved(&mut cloth.pins, before, after);
        let events = scene.events.iter_mut().filter(|event| event.cloth == cloth.name);
        events.for_each(|event| moved(&mut event.pins, before, after));
    }
    Ok(scene)
}

fn moved(pins: &mut Vec<ScenePin>, before: [u32; 2], after: [u32; 2]) {
    for pin in &mut *pins {
        if let ScenePin::Index(particle) = pin {
            let [column, row] = [*particle % before[0], *particle / before[0]];
            let scaled = |k: usize, place: u32| place * (after[k] - 1) / (before[k] - 1);
            *particle = scaled(1, row) * after[0] + scaled(0, column);
        }
    }
    pins.dedup();
}
