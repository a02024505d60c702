//! `cloth run`.

mod feedback;
mod interrupt;
mod outputs;
mod progress;
mod report;
mod solver_summary;
mod summary;

use std::time::Instant;

use cloth::{
    AUTO, Backend, BackendOptions, Checkpoint, PoseLog, Simulation, StepReport, backend_choose,
    backend_open, frame_solids, picture_style_moving, topology,
};
use cloth::{io::PictureStyle, scene::CompiledScene};

use crate::{
    arguments::{Extra, RunArguments},
    check::stability_warning,
    failure::{Failure, WriteError},
    passages::passages,
    run_folder::RunFolder,
    scene_source::SceneSource,
};

use feedback::Feedback;
use interrupt::Interrupt;
use outputs::Outputs;
use progress::Progress;
use report::ReportWriter;
use summary::Summary;

pub(crate) fn run(arguments: &RunArguments) -> Result<(), Failure> {
    let with_colliders = Extra::colliders(&arguments.with, &arguments.format.0)?;
    let interrupt = Interrupt::install()?;
    let source = SceneSource::read(&arguments.scene)?;
    let (scene, backend) = scene_and_backend(&source, arguments)?;
    if !scene.choice.reason.is_empty() {
        eprintln!("solver: {}", scene.choice.reason);
    }
    if let Some(warning) = stability_warning(&scene) {
        eprintln!("warning: {warning}");
    }
    let folder = RunFolder::new(arguments.out.as_deref(), &scene.name);
    let topology = topology(&scene);
    // Nothing is written before everything is known to be good.
    let mut simulation = simulation(scene, backend.as_ref(), &folder, arguments.resume)?;
    let bodies = simulation.scene().rigids.len();
    // Where bodies are nothing else tells; other colliders follow from the scene.
    let poses =
        (bodies > 0).then(|| PoseLog::new(simulation.frame(), simulation.colliders().to_vec()));
    if let Some(poses) = poses.as_ref().filter(|_| arguments.resume && folder.poses().exists()) {
        let colliders = simulation.model().colliders().len();
        let earlier = PoseLog::read(&folder.poses(), colliders).map_err(Failure::input)?;
        poses.earlier_set(&earlier);
    }
    let style = style(&simulation, poses.clone().unwrap_or_default(), arguments);
    #[cfg(feature = "viewer")]
    let maker = crate::viewer::picture_maker(arguments, simulation.scene(), &style)?;
    #[cfg(not(feature = "viewer"))]
    let maker = None;
    let mut feedback = Feedback::new(arguments.feedback.as_deref(), arguments.frame_stride.get());
    std::fs::create_dir_all(&folder.root).map_err(WriteError::of(&folder.root))?;
    let mut outputs = if arguments.resume {
        let reached = (simulation.frame(), poses.as_ref());
        Outputs::resume(&folder, &topology, style, maker, arguments, reached)?
    } else {
        Outputs::create(&folder, &topology, style, maker, arguments, bodies)?
    };
    if with_colliders {
        let solids = frame_solids(simulation.scene(), poses.clone());
        outputs = outputs.with_solids(Some(solids));
    }
    folder.scene_write(&source.scene, &source.options)?;
    let mut reports = ReportWriter::open(&folder.report(), simulation.frame(), arguments.json)?;
    if simulation.frame() == 0 {
        let (state, normals) = simulation.state_and_normals()?;
        outputs.write(0, state, normals)?;
    }

    let start = Instant::now();
    let mut summary =
        Summary::new(simulation.model().particle_count(), passages(simulation.model()));
    let mut progress = Progress::new(simulation.frame(), u64::from(simulation.scene().frames));
    let mut ended = Ok(());
    while ended.is_ok() && !simulation.is_finished() && !interrupt.is_requested() {
        ended = frame(&mut simulation, poses.as_ref(), &mut outputs, &mut reports, &mut summary);
        if ended.is_ok() {
            ended = feedback.add(&mut simulation);
        }
        progress.frame(simulation.frame(), &summary);
        let every = arguments.checkpoint_every;
        if ended.is_ok() && every > 0 && simulation.frame().is_multiple_of(every) {
            ended = checkpoint_write(&mut simulation, &mut outputs, &folder);
        }
    }
    progress.finish();

    // After an error the checkpoint from before is the better place to continue from.
    if ended.is_ok() {
        ended = checkpoint_write(&mut simulation, &mut outputs, &folder);
    }
    let mut lines = summary.lines(start.elapsed());
    if ended.is_ok() && !simulation.is_finished() {
        lines.push(format!(
            "interrupted after frame {} of {}; the same command with --resume continues",
            simulation.frame(),
            simulation.scene().frames,
        ));
    }
    // The frames before an error are worth having; the error itself counts more than another one
    // that follows from it.
    match outputs.finish(&folder) {
        Ok(files) => lines.push(files),
        Err(failure) => ended = ended.and(Err(failure)),
    }
    // Frames before an error are worth having here too.
    if let Err(failure) = feedback.write(&source.scene) {
        ended = ended.and(Err(failure));
    }
    summary::print(&lines, arguments.json)?;
    ended
}

/// The scene, compiled, and the backend for it.
fn scene_and_backend(
    source: &SceneSource,
    arguments: &RunArguments,
) -> Result<(CompiledScene, Box<dyn Backend>), Failure> {
    let options = BackendOptions {
        threads: arguments.threads,
        adapter: arguments.adapter.clone(),
        ..BackendOptions::default()
    };
    if arguments.backend != AUTO {
        // A wrong name is told before a large scene is compiled.
        let backend = backend_open(&arguments.backend, &options)?;
        return Ok((source.compile(arguments.threads)?, backend));
    }
    let scene = source.compile(arguments.threads)?;
    let choice = backend_choose(&scene.model, &scene.config, &options)?;
    eprintln!("backend: {}", choice.reason);
    Ok((scene, choice.backend))
}

/// Computes a frame and writes it.
fn frame(
    simulation: &mut Simulation,
    poses: Option<&PoseLog>,
    outputs: &mut Outputs<'_>,
    reports: &mut ReportWriter,
    summary: &mut Summary,
) -> Result<(), Failure> {
    simulation.step()?;
    if let Some(poses) = poses {
        poses.push(simulation.colliders());
    }
    let frame = simulation.frame();
    let (state, normals) = simulation.state_and_normals()?;
    outputs.write(frame, state, normals)?;
    let report = StepReport { audit: simulation.audit()?, ..simulation.report().clone() };
    reports.write(frame, &report)?;
    summary.add(frame, &report);
    Ok(())
}

/// The simulation at its start, or where the checkpoint in `folder` has it.
fn simulation(
    scene: CompiledScene,
    backend: &dyn Backend,
    folder: &RunFolder,
    resume: bool,
) -> Result<Simulation, Failure> {
    if !resume {
        return Ok(Simulation::new(scene, backend)?);
    }
    let checkpoint = Checkpoint::read(&folder.checkpoint(), &scene.model, scene.config.precision)?;
    Ok(Simulation::resume(scene, backend, &checkpoint)?)
}

fn style(simulation: &Simulation, poses: PoseLog, arguments: &RunArguments) -> PictureStyle {
    let size = arguments.picture_size;
    let style = picture_style_moving(simulation.scene(), poses);
    PictureStyle { width: size.width, height: size.height, ..style }
}

/// Writes a checkpoint, once the frames up to it are safe.
fn checkpoint_write(
    simulation: &mut Simulation,
    outputs: &mut Outputs<'_>,
    folder: &RunFolder,
) -> Result<(), Failure> {
    outputs.sync()?;
    Ok(simulation.checkpoint()?.write(&folder.checkpoint())?)
}
