//! From the frames of a run to any format.

use cloth::{
    PoseLog, frame_solids,
    io::{
        ContainerOptions, Frame, FrameFormat, FrameSequenceWriter, FrameStore, PictureStyle,
        container_write,
    },
    picture_style,
    scene::CompiledScene,
    topology,
};

use crate::{
    arguments::{ConvertArguments, Extra},
    failure::Failure,
    memory,
    run_folder::RunFolder,
    say,
};

use super::{extension, parent_create};

pub(super) fn convert(arguments: &ConvertArguments) -> Result<(), Failure> {
    let format = format(arguments)?;
    let with_colliders = Extra::colliders(&arguments.with, &[format])?;
    let (scene, options) = RunFolder::scene_read(&arguments.input, &arguments.mesh_root)?;
    memory::check(&scene, &options)?;
    let compiled = scene.compile(&options)?;
    let folder = RunFolder::new(Some(&arguments.input), &compiled.name);
    let topology = topology(&compiled);
    let store = FrameStore::open_read_only(&folder.store(), &topology)?;
    let solids = if with_colliders {
        Some(frame_solids(&compiled, poses(&compiled, &folder)?))
    } else {
        None
    };
    let size = arguments.picture_size;
    let style = picture_style(&compiled);
    let overlays = arguments.overlays.apply(&compiled.model, style.overlays.clone());
    let style = PictureStyle { width: size.width, height: size.height, overlays, ..style };
    if format.is_sequence() {
        let writer = FrameSequenceWriter::new(format, &arguments.output, folder.name(), &topology)?;
        let writer = writer.with_style(style).with_solids(solids);
        return sequence_write(writer, arguments, &store);
    }
    parent_create(&arguments.output)?;
    let frame_stride = arguments.frame_stride.map(std::num::NonZeroUsize::get);
    let options = ContainerOptions { frame_stride, style, solids, ..ContainerOptions::default() };
    let report = container_write(format, &arguments.output, &topology, &store, &options)?;
    for warning in report.warnings {
        say::warning(warning);
    }
    for note in report.notes {
        say::note(note);
    }
    Ok(())
}

/// Where the run had its rigid bodies, if it has any and kept it.
fn poses(scene: &CompiledScene, folder: &RunFolder) -> Result<Option<PoseLog>, Failure> {
    if scene.rigids.is_empty() || !folder.poses().exists() {
        return Ok(None);
    }
    let colliders = scene.model.colliders().len();
    Ok(Some(PoseLog::read(&folder.poses(), colliders).map_err(Failure::input)?))
}

/// The format that is asked for; of formats with one file per frame only by its name, as their
/// output is a folder.
fn format(arguments: &ConvertArguments) -> Result<FrameFormat, Failure> {
    if let Some(format) = arguments.format {
        return Ok(format);
    }
    let extension = extension(&arguments.output);
    let known = FrameFormat::ALL
        .into_iter()
        .find(|format| !format.is_sequence() && format.extension() == extension);
    known.ok_or_else(|| {
        Failure::Usage(format!(
            "the name `{}` does not say a format; use --format with one of: {}",
            arguments.output.display(),
            FrameFormat::ALL.map(FrameFormat::name).join(", ")
        ))
    })
}

fn sequence_write(
    mut writer: FrameSequenceWriter<'_>,
    arguments: &ConvertArguments,
    store: &FrameStore,
) -> Result<(), Failure> {
    let stride = arguments.frame_stride.map_or(1, std::num::NonZeroUsize::get);
    for index in (0..store.len()).step_by(stride) {
        let stored = store.frame(index)?;
        writer.write(&Frame::new(index as u64, stored.time, &stored.positions_f64()))?;
    }
    Ok(())
}
