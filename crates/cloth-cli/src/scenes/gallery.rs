//! `cloth scenes --gallery`: runs built-in scenes, and makes a page of what they show.

use std::{
    fmt::Write,
    fs,
    path::Path,
    sync::{Arc, Mutex, PoisonError},
};

use cloth::{
    Backend, BackendOptions, Simulation, backend_open,
    io::{Frame, FrameFormat, FrameSequenceWriter, PictureShapes, PictureSolid, PictureStyle},
    picture_shapes, picture_style,
    scene::{BuiltinScene, CompileOptions, Scene, builtin_scenes},
    topology,
};

use crate::{
    failure::{Failure, WriteError},
    say,
    signals::Signals,
};

/// Width and height of the pictures \[pixel\].
const SIZE: [u32; 2] = [480, 270];
/// Pictures of a scene: its start, its end, and as many between them as this leaves.
const MOMENTS: u32 = 6;
/// The page.
const PAGE: &str = "index.html";

const HEAD: &str = "\
<!doctype html>
<html lang=\"en\">
<meta charset=\"utf-8\">
<meta name=\"viewport\" content=\"width=device-width\">
<title>Built-in scenes of cloth</title>
<style>
body { max-width: 1480px; margin: 2em auto; padding: 0 1em; font: 16px/1.5 sans-serif; color: #222; }
p { max-width: 46em; }
.moments { display: grid; grid-template-columns: repeat(auto-fill, minmax(320px, 1fr)); gap: 8px; }
figure { margin: 0; }
img { width: 100%; display: block; }
figcaption { font-size: 13px; color: #555; }
</style>
<h1>Built-in scenes of cloth</h1>
";

/// Writes the pictures and the page into `folder`; of all scenes if `names` is empty.
pub(super) fn gallery(folder: &Path, names: &[String]) -> Result<(), Failure> {
    // Nothing is left half written where it is interrupted.
    Signals::install()?;
    for name in names {
        // For the error with the most similar name.
        Scene::builtin(name)?;
    }
    let is_free = fs::read_dir(folder).map_or(true, |mut entries| entries.next().is_none());
    if !is_free {
        return Err(Failure::Usage(format!(
            "`{}` is not empty; name a new folder for the gallery",
            folder.display()
        )));
    }
    let backend = backend_open("cpu", &BackendOptions::default())?;
    fs::create_dir_all(folder).map_err(WriteError::of(folder))?;
    let mut page = HEAD.to_owned();
    let wanted = |scene: &&BuiltinScene| names.is_empty() || names.iter().any(|n| n == scene.name);
    for builtin in builtin_scenes().iter().filter(wanted) {
        say::note(format_args!("running `{}`", builtin.name));
        section(&mut page, builtin, backend.as_ref(), folder)?;
    }
    let path = folder.join(PAGE);
    fs::write(&path, page).map_err(WriteError::of(&path))?;
    say::note(format_args!("look at `{}`", path.display()));
    Ok(())
}

/// Runs a scene, draws it, and adds it to the page.
fn section(
    page: &mut String,
    builtin: &BuiltinScene,
    backend: &dyn Backend,
    folder: &Path,
) -> Result<(), Failure> {
    let BuiltinScene { name, .. } = *builtin;
    let scene = Scene::builtin(name)?.compile(&CompileOptions::default())?;
    let (description, rate) = (scene.description.clone(), scene.frames_per_second);
    let frames = u64::from(scene.frames);
    let topology = topology(&scene);
    let mut simulation = Simulation::new(scene, backend)?;
    // Rigid bodies are where the simulation has them and nowhere else.
    let shapes = Arc::new(Mutex::new(Vec::new()));
    let style = PictureStyle {
        width: SIZE[0],
        height: SIZE[1],
        shapes: {
            let shapes = Arc::clone(&shapes);
            PictureShapes::moving(move |_| locked(&shapes).clone())
        },
        ..picture_style(simulation.scene())
    };
    let writer = FrameSequenceWriter::new(FrameFormat::Png, folder, name, &topology)?;
    let mut writer = writer.with_style(style);
    let mut pictures = String::new();
    let mut moments: Vec<u64> =
        (0..MOMENTS).map(|k| frames * u64::from(k) / u64::from(MOMENTS - 1)).collect();
    moments.dedup();
    for moment in moments {
        while simulation.frame() < moment {
            simulation.step()?;
        }
        let time = moment as f64 / rate;
        *locked(&shapes) = picture_shapes(simulation.scene(), simulation.colliders(), time);
        let file = writer.write(&Frame::new(moment, time, &simulation.state()?.positions))?;
        let file = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        // Writing to a string cannot fail.
        let _ = writeln!(
            pictures,
            "<figure><img src=\"{file}\" alt=\"{name} at {time:.2} s\" width=\"{}\" height=\"{}\">\
             <figcaption>{time:.2} s</figcaption></figure>",
            SIZE[0], SIZE[1],
        );
    }
    let [description, sight] = [&description, &builtin.sight()].map(|text| escaped(text));
    let _ = write!(
        page,
        "<section>\n<h2>{name}</h2>\n<p>{description} <code>cloth run {name}</code></p>\n\
         <div class=\"moments\">\n{pictures}</div>\n<p>{sight}</p>\n</section>\n",
    );
    Ok(())
}

fn locked(shapes: &Mutex<Vec<PictureSolid>>) -> std::sync::MutexGuard<'_, Vec<PictureSolid>> {
    shapes.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Text for a page.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
