//! `cloth audit`, and what other commands say of triangles that intersect.

use std::{
    collections::HashMap,
    io::{Write, stdout},
    path::Path,
};

use cloth::{
    PoseLog, SceneAudit,
    audit::{Intersection, Intersections, Surface, intersections},
    collider_poses,
    io::{FrameStore, MESH_EXTENSIONS, mesh_read},
    topology,
};
use serde::Serialize;

use crate::{
    arguments::AuditArguments,
    failure::{Failure, ReadError},
    memory,
    run_folder::RunFolder,
    say::{self, Shown},
    units::count_text,
};

pub(crate) fn audit(arguments: &AuditArguments) -> Result<(), Failure> {
    let input = &arguments.input;
    if std::fs::metadata(input).map_err(ReadError::of(input))?.is_dir() {
        return frames(arguments);
    }
    let extension = input.extension().map(|e| e.to_string_lossy().to_lowercase());
    if extension.is_some_and(|extension| MESH_EXTENSIONS.contains(&extension.as_str())) {
        return mesh(arguments);
    }
    Err(Failure::Usage(format!(
        "`{}` cannot be audited; give the folder of a run or a mesh ({})",
        input.display(),
        MESH_EXTENSIONS.join(", ")
    )))
}

/// The frames of a run, as they are stored.
fn frames(arguments: &AuditArguments) -> Result<(), Failure> {
    let (scene, options) = RunFolder::scene_read(&arguments.input, &arguments.mesh_root)?;
    memory::check(&scene, &options)?;
    let scene = scene.compile(&options)?;
    let folder = RunFolder::new(Some(&arguments.input), &scene.name);
    let store = FrameStore::open_read_only(&folder.store(), &topology(&scene))?;
    let poses = (!scene.rigids.is_empty() && folder.poses().exists())
        .then(|| PoseLog::read(&folder.poses(), scene.model.colliders().len()))
        .transpose()?;
    let poses = collider_poses(&scene, poses);
    let audit = SceneAudit::new(&scene.model);
    let left_out: Vec<&str> = audit.left_out().collect();
    if !left_out.is_empty() {
        say::note(format_args!("planes, which are left out: {}", left_out.join(", ")));
    }
    let mut summary = IntersectionSummary::new();
    let mut out = Shown(stdout().lock());
    let stride = arguments.frame_stride.map_or(1, Into::into);
    let last = store.len().saturating_sub(1);
    for index in (0..store.len()).filter(|index| index % stride == 0 || *index == last) {
        let frame = store.frame(index)?;
        let found = audit.at(&frame.positions_f64(), &poses(frame.time), frame.time);
        line_write(&mut out, arguments.json, index as u64, &found, |pair| audit.describe(pair))?;
        summary.add(&audit, index as u64, &found);
    }
    drop(out);
    verdict(&arguments.input, &summary)
}

/// A mesh. Vertices in one place are one, as files hold some of them several times.
fn mesh(arguments: &AuditArguments) -> Result<(), Failure> {
    let mesh = mesh_read(&arguments.input)?;
    let mut first_at = HashMap::new();
    // -0 and 0 are one place.
    let key = |position: &[f64; 3]| position.map(|x| (x + 0.0).to_bits());
    let numbered = mesh.positions.iter().zip(0_u32..);
    let welded: Vec<u32> =
        numbered.map(|(position, i)| *first_at.entry(key(position)).or_insert(i)).collect();
    let triangles = mesh.triangles.iter().map(|triangle| triangle.map(|i| welded[i as usize]));
    let triangles: Vec<[u32; 3]> = triangles.collect();
    let found = intersections(&[Surface::cloth(&mesh.positions, &triangles)]);
    let describe = |pair: &Intersection| {
        let ([i, j], [x, y, z]) = (pair.triangles, pair.place);
        format!("triangles {i} and {j} near [{x:.4}, {y:.4}, {z:.4}] m")
    };
    let mut out = Shown(stdout().lock());
    line_write(&mut out, arguments.json, 0, &found, describe)?;
    drop(out);
    let mut summary = IntersectionSummary::new();
    summary.count(0, &found, describe);
    verdict(&arguments.input, &summary)
}

fn line_write(
    out: &mut impl Write,
    json: bool,
    frame: u64,
    found: &Intersections,
    describe: impl Fn(&Intersection) -> String,
) -> Result<(), Failure> {
    if json {
        let line = FrameLine { frame, counts: found.into() };
        let line = serde_json::to_string(&line).map_err(Failure::other)?;
        return Ok(writeln!(out, "{line}")?);
    }
    let first = found.first.as_ref().map(|pair| format!("; first {}", describe(pair)));
    let first = first.unwrap_or_default();
    Ok(writeln!(out, "frame {frame}: {}{first}", counts_text(found))?)
}

fn verdict(input: &Path, summary: &IntersectionSummary) -> Result<(), Failure> {
    match summary.problem() {
        Some(problem) => Err(Failure::Intersects(format!("`{}`: {problem}", input.display()))),
        None => Ok(()),
    }
}

/// The counts of a frame in words.
pub(crate) fn counts_text(found: &Intersections) -> String {
    let Intersections { within, between, bodies, crossings, unusable, .. } = found;
    let mut text = format!(
        "{} of triangles within cloths, {between} between cloths, {bodies} with bodies, {}",
        count_text(*within, "pair"),
        count_text(*crossings, "crossing edge"),
    );
    if *unusable > 0 {
        let unusable = count_text(*unusable, "triangle");
        text = format!("{text}; {unusable} left out, which have no finite positions");
    }
    text
}

/// Counts of a frame in JSON.
#[derive(Serialize)]
struct FrameLine {
    frame: u64,
    #[serde(flatten)]
    counts: IntersectionLine,
}

/// The same in the line of a report.
#[derive(Serialize)]
pub(crate) struct IntersectionLine {
    intersections_within: u64,
    intersections_between: u64,
    intersections_bodies: u64,
    intersections_edges: u64,
    intersections_unusable: u64,
    intersections_first: Option<[f64; 3]>,
}

impl From<&Intersections> for IntersectionLine {
    fn from(found: &Intersections) -> Self {
        Self {
            intersections_within: found.within,
            intersections_between: found.between,
            intersections_bodies: found.bodies,
            intersections_edges: found.crossings,
            intersections_unusable: found.unusable,
            intersections_first: found.first.map(|pair| pair.place),
        }
    }
}

/// What was found in the frames of a run.
#[derive(Default)]
pub(crate) struct IntersectionSummary {
    frames: u64,
    bad_frames: u64,
    pairs_max: u64,
    unusable_max: u64,
    /// The first frame with any, and what is there.
    first: Option<(u64, String)>,
}

impl IntersectionSummary {
    pub(crate) const fn new() -> Self {
        Self { frames: 0, bad_frames: 0, pairs_max: 0, unusable_max: 0, first: None }
    }

    /// Adds a frame of a scene.
    pub(crate) fn add(&mut self, audit: &SceneAudit, frame: u64, found: &Intersections) {
        self.count(frame, found, |pair| audit.describe(pair));
    }

    fn count(
        &mut self,
        frame: u64,
        found: &Intersections,
        describe: impl Fn(&Intersection) -> String,
    ) {
        self.frames += 1;
        self.bad_frames += u64::from(!found.is_clean());
        self.pairs_max = self.pairs_max.max(found.pairs());
        self.unusable_max = self.unusable_max.max(found.unusable);
        if let (None, Some(pair)) = (&self.first, &found.first) {
            self.first = Some((frame, describe(pair)));
        }
    }

    /// What is wrong, if something is.
    fn problem(&self) -> Option<String> {
        if let Some((frame, first)) = &self.first {
            return Some(format!(
                "triangles intersect in {} of {}, at most {}, first in frame {frame}: {first}",
                self.bad_frames,
                count_text(self.frames, "frame"),
                count_text(self.pairs_max, "pair"),
            ));
        }
        let unusable = count_text(self.unusable_max, "triangle");
        (self.bad_frames > 0).then(|| format!("{unusable} could not be looked at"))
    }

    /// The line of a summary, if there was an audit.
    pub(crate) fn line(&self) -> Option<String> {
        let problem = self.problem().map(|problem| format!("warning: {problem}"));
        let clean =
            || format!("audit: no triangles intersect in {}", count_text(self.frames, "frame"));
        (self.frames > 0).then(|| problem.unwrap_or_else(clean))
    }
}
