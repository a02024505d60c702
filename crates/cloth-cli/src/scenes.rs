//! `cloth scenes`.

mod gallery;

use std::io::{Write, stdout};

use cloth::scene::{CompileOptions, Scene, builtin_scenes, scene_reference, scene_schema};
use serde::Serialize;

use crate::{
    arguments::{ScenesArguments, ScenesCommand},
    failure::Failure,
};

#[derive(Serialize)]
struct SceneRow {
    name: &'static str,
    summary: &'static str,
    particles: u64,
    frames: u32,
    frames_per_second: f64,
}

pub(crate) fn scenes(arguments: &ScenesArguments) -> Result<(), Failure> {
    if let Some(folder) = &arguments.gallery {
        return gallery::gallery(folder, &arguments.scene);
    }
    let mut out = stdout().lock();
    if let Some(ScenesCommand::Show { name }) = &arguments.command {
        // For the error with the most similar name.
        Scene::builtin(name)?;
        let builtin = builtin_scenes().iter().find(|builtin| builtin.name == name);
        out.write_all(builtin.map_or("", |builtin| builtin.text).as_bytes())?;
        return Ok(());
    }
    if arguments.schema || arguments.reference {
        let text = if arguments.schema { scene_schema() } else { scene_reference() };
        out.write_all(text.as_bytes())?;
        return Ok(());
    }
    let rows = builtin_scenes().iter().map(|builtin| {
        let scene = Scene::builtin(builtin.name)?;
        Ok(SceneRow {
            name: builtin.name,
            summary: builtin.summary,
            particles: scene.memory_estimate(&CompileOptions::default()).particles,
            frames: scene.simulation.frames,
            frames_per_second: scene.simulation.frames_per_second,
        })
    });
    let rows = rows.collect::<Result<Vec<_>, Failure>>()?;
    if arguments.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&rows).map_err(Failure::other)?)?;
        return Ok(());
    }
    writeln!(out, "{:<14} {:>9} {:>7}  summary", "name", "particles", "frames")?;
    for row in rows {
        let SceneRow { name, particles, frames, summary, .. } = row;
        writeln!(out, "{name:<14} {particles:>9} {frames:>7}  {summary}")?;
    }
    Ok(())
}
