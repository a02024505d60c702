//! `cloth view` and `cloth render`.

use std::io::{Write, stdout};

use cloth::{
    io::{PictureMaker, PictureStyle, vertex_normals},
    scene::CompiledScene,
};
use cloth_viewer::{
    ClipFormat, ClipOptions, FramePainter, Gpu, Listener, Severity, Source, ViewerError,
    WindowOptions, clip_render, window_run,
};
use indicatif::ProgressBar;

use crate::{
    arguments::{RenderArguments, RunArguments, SolverArguments, ViewArguments},
    failure::Failure,
    foreign::hushed,
    run_folder::RunSettings,
    say,
};

pub(crate) fn render(arguments: &RenderArguments) -> Result<(), Failure> {
    // Before any work.
    ClipFormat::of_path(&arguments.out)?;
    let source = source(&arguments.scene, &arguments.source.solver)?;
    let gpu = hushed(|| Gpu::headless(arguments.source.adapter.as_deref()))?;
    let size = arguments.picture_size;
    let options = ClipOptions {
        size: [size.width, size.height],
        overlays: arguments.overlays(),
        backend: arguments.source.backend.clone(),
        frames: arguments.frames,
        stride: arguments.frame_stride.get(),
        still: arguments.still,
    };
    let is_shown = say::is_at(say::Level::Normal);
    let bar = if is_shown { ProgressBar::new(0) } else { ProgressBar::hidden() };
    let path = clip_render(&gpu, source, &arguments.out, &options, |done, all| {
        bar.set_length(all);
        bar.set_position(done);
    })?;
    bar.finish_and_clear();
    if is_shown {
        let mut out = say::Shown(stdout().lock());
        writeln!(out, "drawn on {}; look at `{}`", gpu.description(), path.display())?;
    }
    Ok(())
}

pub(crate) fn view(arguments: &ViewArguments) -> Result<(), Failure> {
    let size = arguments.window_size;
    let options = WindowOptions {
        source: source(&arguments.scene, &arguments.source.solver)?,
        backend: arguments.source.backend.clone(),
        adapter: arguments.source.adapter.clone(),
        paused: arguments.paused,
        size: [size.width as f32, size.height as f32],
        folder: arguments.out.clone(),
        keep: u64::from(arguments.keep) << 20,
        log: arguments.log.clone(),
        listener: Listener::new(|message| match message.severity {
            Severity::Error => say::error(&message.text),
            Severity::Info => say::detail(&message.text),
        }),
    };
    Ok(hushed(|| window_run(options))?)
}

/// What draws the pictures of `cloth run --render`, if it was asked for and there is an adapter; that
/// there is none is said.
pub(crate) fn picture_maker(
    arguments: &RunArguments,
    settings: &RunSettings,
    scene: &CompiledScene,
    style: &PictureStyle,
) -> Result<Option<PictureMaker<'static>>, Failure> {
    if !settings.render {
        return Ok(None);
    }
    let gpu = match hushed(|| Gpu::headless(arguments.adapter.as_deref())) {
        Ok(gpu) => gpu,
        Err(error) => {
            say::warning(format_args!("pictures are drawn on the processor: {error}"));
            return Ok(None);
        }
    };
    let mut painter = FramePainter::new(&gpu, scene, style)?;
    let triangles = scene.model.triangles().to_vec();
    Ok(Some(Box::new(move |frame| {
        let computed;
        let normals = match frame.normals {
            Some(normals) => normals,
            None => {
                computed = vertex_normals(frame.positions, &triangles);
                &computed
            }
        };
        Ok(painter.picture(frame.time, frame.positions, normals)?)
    })))
}

/// What a word means, with the values of the command line in place of its own.
fn source(word: &str, solver: &SolverArguments) -> Result<Source, Failure> {
    let mut source = Source::open(word)?;
    if let Source::Scene(scene, _) = &mut source {
        solver.apply(scene)?;
    }
    Ok(source)
}

impl From<ViewerError> for Failure {
    fn from(error: ViewerError) -> Self {
        match error {
            ViewerError::Simulation(error) => error.into(),
            ViewerError::Backend(error) => error.into(),
            ViewerError::Scene(error) => error.into(),
            ViewerError::Frames(error) => error.into(),
            ViewerError::Window { .. } | ViewerError::Device { .. } => Self::other(error),
            error => Self::input(error),
        }
    }
}
