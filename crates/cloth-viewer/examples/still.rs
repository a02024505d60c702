//! One picture of a built-in scene: `still SCENE FRAMES FILE [BACKEND [OVERLAY...]]`.

use std::{error::Error, path::Path};

use cloth_viewer::{ClipOptions, Gpu, Overlays, Source, clip_render};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, frames, file, rest @ ..] = &arguments[..] else {
        return Err("give a scene, a number of frames and a file".into());
    };
    let has = |name: &str| rest.iter().any(|word| word == name);
    let options = ClipOptions {
        size: [960, 540],
        overlays: Some(Overlays {
            wires: has("wires"),
            springs: [has("stretch"), has("shear"), has("bend")],
            strain: has("strain"),
            threads: has("threads"),
            pins: has("pins"),
            contacts: has("contacts"),
            bins: has("bins"),
            ..Overlays::default()
        }),
        backend: rest.first().map_or("auto", String::as_str).to_owned(),
        frames: Some(frames.parse()?),
        stride: 1,
        still: true,
    };
    let gpu = Gpu::headless(None)?;
    clip_render(&gpu, Source::open(scene)?, Path::new(file), &options, |_, _| {})?;
    Ok(())
}
