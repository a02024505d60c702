//! `cloth run`.

mod contacts;
mod feedback;
mod outputs;
mod progress;
mod report;
mod solver_summary;
mod summary;

use std::{sync::Arc, time::Instant};

use cloth::{
    AUTO, Backend, BackendOptions, Checkpoint, PoseLog, SceneAudit, SeamReport, Simulation,
    StepReport, backend_choose, backend_open, frame_solids, picture_style, picture_style_moving,
    topology,
};
use cloth::{io::PictureStyle, scene::CompiledScene};

use crate::{
    arguments::{Extra, RunArguments},
    check::{intersecting_warnings, stability_warning},
    failure::{Failure, WriteError},
    foreign::hushed,
    passages::passages,
    run_folder::{RunFolder, RunSettings},
    say,
    scene_source::SceneSource,
    signals::Signals,
};

use contacts::ContactFiles;
use feedback::Feedback;
use outputs::{Making, Outputs, store_create, store_resume};
use progress::Progress;
use report::ReportWriter;
use summary::Summary;

pub(crate) fn run(arguments: &RunArguments) -> Result<(), Failure> {
    #[cfg(not(feature = "viewer"))]
    if arguments.render {
        return Err(Failure::absent("`cloth run --render`", "viewer"));
    }
    let signals = Signals::install()?;
    let source = SceneSource::read(&arguments.scene)?;
    let mut feedback = Feedback::new(arguments, source.path.as_deref())?;
    let mut folder = folder(arguments, &source)?;
    let settings = RunSettings::new(arguments, arguments.resume.then_some(&folder))?;
    let (scene, backend) = scene_and_backend(&source, arguments)?;
    let with_colliders = Extra::colliders(&arguments.with, &settings.formats)?;
    if !scene.choice.reason.is_empty() {
        say::note(format_args!("solver: {}", scene.choice.reason));
    }
    scene.notes.iter().for_each(say::note);
    scene.warnings.iter().for_each(say::warning);
    if let Some(warning) = stability_warning(&scene) {
        say::warning(warning);
    }
    if !arguments.resume && scene.start.is_none() {
        intersecting_warnings(&scene).iter().for_each(say::warning);
    }
    let topology = topology(&scene);
    // Nothing is written before everything is known to be good.
    let mut simulation = simulation(scene, backend.as_ref(), &folder, arguments.resume)?;
    let bodies = simulation.scene().rigids.len();
    if !arguments.resume && arguments.out.is_none() && !arguments.overwrite {
        let kept;
        (folder, kept) = folder.create_free()?;
        if let Some(kept) = kept {
            say::note(format_args!(
                "`{}` has a run, which is kept; this one goes to `{}` (--overwrite replaces the first)",
                kept.display(),
                folder.root.display()
            ));
        }
    }
    std::fs::create_dir_all(&folder.root).map_err(WriteError::of(&folder.root))?;
    folder.outputs_check(&settings.formats)?;
    // First of all, as it locks out a second run in the same folder.
    let store = if arguments.resume {
        store_resume(&folder, &topology, simulation.frame())?
    } else {
        store_create(&folder, &topology)?
    };
    let poses = (bodies > 0).then(|| poses(&folder, &simulation, arguments.resume)).transpose()?;
    let style = style(&simulation, poses.as_ref(), &settings);
    #[cfg(feature = "viewer")]
    let maker = crate::viewer::picture_maker(arguments, &settings, simulation.scene(), &style)?;
    #[cfg(not(feature = "viewer"))]
    let maker = None;
    let (threads, resume) = (arguments.threads, arguments.resume);
    let solids = with_colliders.then(|| frame_solids(simulation.scene(), poses.clone()));
    let making = Making { style, maker, threads, resume };
    let mut outputs = Outputs::new(&folder, &topology, store, making, &settings)?;
    outputs.poses_set(poses);
    outputs.solids_set(solids);
    if arguments.resume {
        folder.scene_rewrite(&source.scene, &source.options)?;
    } else {
        folder.scene_write(&source.scene, &source.options)?;
    }
    settings.write(&folder.root)?;
    let mut reports = ReportWriter::open(&folder.report(), simulation.frame(), arguments.json)?;
    // From here on a signal waits for a checkpoint.
    signals.finish_work(true);
    // A run that a signal ended before its first frame was done has the start already.
    if !arguments.resume {
        let (state, normals) = simulation.state_and_normals()?;
        outputs.write(0, state, normals)?;
    }

    let start = Instant::now();
    let mut summary =
        Summary::new(simulation.model().particle_count(), passages(simulation.model()));
    let mut progress = Progress::new(simulation.frame(), u64::from(simulation.scene().frames));
    let audit = arguments.audit.then(|| SceneAudit::new(simulation.model()));
    let contact_files = arguments.contacts.map(|format| {
        ContactFiles::new(&folder, format, simulation.model(), simulation.frame() + 1)
    });
    let contact_files = contact_files.transpose()?;
    let mut ended = Ok(());
    while ended.is_ok() && !simulation.is_finished() && signals.requested().is_none() {
        let extras = (audit.as_ref(), contact_files.as_ref());
        ended =
            frame(&mut simulation, extras, &mut outputs, &mut reports, &mut summary, &mut progress);
        if ended.is_ok() {
            ended = feedback.add(&mut simulation);
        }
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
    // What is made from here on can be made again.
    signals.finish_work(false);
    let mut lines = summary.lines(start.elapsed());
    lines.extend(summary.solver.choice(simulation.scene()));
    if ended.is_ok() {
        lines.extend(seams_line(&mut simulation)?);
        if can_tear(&simulation) {
            let edges = simulation.model().tears().edges().len();
            lines.push(format!("tears        {} of {edges} edges", simulation.torn_edges()));
        }
    }
    // Frames before an error are worth having here, too.
    if let Err(failure) = feedback.write(&source.scene) {
        ended = ended.and(Err(failure));
    }
    if let Some(signal) = signals.requested().filter(|_| ended.is_ok()) {
        lines.push(interrupted(&simulation, &outputs, arguments));
        summary::print(&lines, arguments.json)?;
        return Err(Failure::Interrupted(signal));
    }
    // The frames before an error are worth having; the error itself counts more than another one
    // that follows from it.
    match outputs.finish(&folder) {
        Ok(files) => lines.push(files),
        Err(failure) => ended = ended.and(Err(failure)),
    }
    summary::print(&lines, arguments.json)?;
    ended
}

/// Whether some cloth can tear.
fn can_tear(simulation: &Simulation) -> bool {
    !simulation.model().tears().is_empty()
}

/// What became of the seams, if there are any.
fn seams_line(simulation: &mut Simulation) -> Result<Option<String>, Failure> {
    let model = Arc::clone(simulation.model());
    let seams = model.seams();
    let count = seams.stitches().len();
    Ok(simulation.seam_report()?.map(|report| {
        let SeamReport { is_welded, welded, seam, gap, place: [x, y, z], broken } = report;
        let mend = if !is_welded && seams.weld_time().is_some() {
            "; they are welded below 1 mm, where nothing is caught between: give more time or stiffness, or move the panels"
        } else {
            ""
        };
        let welded = match is_welded {
            true => "welded".to_owned(),
            false if seams.weld_time().is_none() => "held".to_owned(),
            false if welded > 0 => format!("{welded} welded"),
            false => "not welded".to_owned(),
        };
        let broken = if broken > 0 { format!(", {broken} of them broken") } else { String::new() };
        format!(
            "seams        {count} stitches, {welded}{broken}, the widest {:.3} mm of {seam:?} at [{x:.3}, {y:.3}, {z:.3}] m{mend}",
            1e3 * gap
        )
    }))
}

/// Where the run goes if nothing else is there, or the run that it continues.
fn folder(arguments: &RunArguments, source: &SceneSource) -> Result<RunFolder, Failure> {
    let folder = RunFolder::new(arguments.out.as_deref(), &source.scene.name);
    if arguments.resume {
        let folder = if arguments.out.is_none() { folder.latest() } else { folder };
        // Before the work of compiling it.
        if folder.checkpoint().exists() {
            let (scene, options) = (&source.scene, &source.options);
            let accepted = arguments.accept_changes;
            if let Some(changes) = folder.changes_check(scene, options, accepted)? {
                say::note(format_args!("goes on with a scene that changed: {changes}"));
            }
            say::detail(format_args!("goes on with the run in `{}`", folder.root.display()));
        }
        return Ok(folder);
    }
    if arguments.out.is_some() && !arguments.overwrite {
        folder.check_free()?;
    }
    if let Some(path) = &source.path {
        folder.check_apart(path)?;
    }
    Ok(folder)
}

/// What to tell somebody who ended the run.
fn interrupted(simulation: &Simulation, outputs: &Outputs<'_>, arguments: &RunArguments) -> String {
    let command = if arguments.overwrite { "--resume in place of --overwrite" } else { "--resume" };
    let mut line = format!(
        "interrupted after frame {} of {}; the same command with {command} continues",
        simulation.frame(),
        simulation.scene().frames,
    );
    let made = outputs.made_at_end();
    if !made.is_empty() {
        line = format!("{line}, and makes {made} at its end");
    }
    line
}

/// Where rigid bodies are in each frame, which nothing else tells.
fn poses(folder: &RunFolder, simulation: &Simulation, resume: bool) -> Result<PoseLog, Failure> {
    let colliders = simulation.colliders();
    Ok(if resume {
        PoseLog::resume(&folder.poses(), colliders, simulation.frame() + 1)?
    } else {
        PoseLog::create(&folder.poses(), colliders.len())?
    })
}

/// The scene, compiled, and the backend for it.
fn scene_and_backend(
    source: &SceneSource,
    arguments: &RunArguments,
) -> Result<(CompiledScene, Box<dyn Backend>), Failure> {
    let options = BackendOptions {
        threads: arguments.threads,
        adapter: arguments.adapter.clone(),
        stage_times: arguments.json,
    };
    if arguments.backend != AUTO {
        // A wrong name is told before a large scene is compiled.
        let backend = hushed(|| backend_open(&arguments.backend, &options))?;
        say::detail(format_args!("backend: {} ({})", backend.info().name, backend.info().device));
        return Ok((source.compile(arguments.threads)?, backend));
    }
    let scene = source.compile(arguments.threads)?;
    let choice = hushed(|| backend_choose(scene.simulated(), &scene.config, &options))?;
    say::note(format_args!("backend: {}", choice.reason));
    Ok((scene, choice.backend))
}

/// Computes a frame and writes it.
fn frame(
    simulation: &mut Simulation,
    (audit, contact_files): (Option<&SceneAudit>, Option<&ContactFiles>),
    outputs: &mut Outputs<'_>,
    reports: &mut ReportWriter,
    summary: &mut Summary,
    progress: &mut Progress,
) -> Result<(), Failure> {
    simulation.step()?;
    let frame = simulation.frame();
    let (state, normals) = simulation.state_and_normals()?;
    outputs.write(frame, state, normals)?;
    if let Some(files) = contact_files {
        files.write(frame, &simulation.contacts()?)?;
    }
    let report = StepReport { audit: simulation.audit()?, ..simulation.report().clone() };
    let intersections = audit.map(|audit| simulation.intersections(audit)).transpose()?;
    let seams = simulation.seam_report()?;
    let edges_torn = can_tear(simulation).then(|| simulation.torn_edges());
    let (intersections_now, seams) = (intersections.as_ref(), seams.as_ref());
    let asked = report::Asked { intersections: intersections_now, seams, edges_torn };
    reports.write(frame, &report, asked)?;
    summary.add(frame, &report);
    if let (Some(audit), Some(found)) = (audit, &intersections) {
        summary.intersections.add(audit, frame, found);
    }
    progress.frame(frame, summary, &report);
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
        if let Some(from) = &scene.start {
            let checkpoint = RunFolder::new(Some(from), &scene.name).checkpoint();
            let state = Checkpoint::read_start(&checkpoint, &scene.model)?;
            return Ok(Simulation::start_from(scene, backend, &state)?);
        }
        return Ok(Simulation::new(scene, backend)?);
    }
    let checkpoint = Checkpoint::read(&folder.checkpoint(), &scene.model, scene.config.precision)?;
    Ok(Simulation::resume(scene, backend, &checkpoint)?)
}

fn style(simulation: &Simulation, poses: Option<&PoseLog>, settings: &RunSettings) -> PictureStyle {
    let size = settings.picture_size;
    let style = match poses {
        Some(poses) => picture_style_moving(simulation.scene(), poses.clone()),
        None => picture_style(simulation.scene()),
    };
    let overlays = settings.overlays.apply(simulation.model(), style.overlays.clone());
    PictureStyle { width: size.width, height: size.height, overlays, ..style }
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
