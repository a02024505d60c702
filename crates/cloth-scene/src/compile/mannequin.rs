//! Mannequins, and their poses over time.

use std::sync::Arc;

use cloth_core::{BodySurface, ColliderShape, TriangleMesh};
use cloth_mannequin::{Mannequin, MannequinError, Measures, Pose, Swing};
use cloth_rigid::DistanceGridPlan;

use crate::{SceneError, SceneMannequin, SceneMannequinPose, SceneMannequinSwing};

use super::{
    Check, animation,
    solid::{self, Plans},
};

/// Length of edges \[m\] where none is given.
const EDGE: f64 = 0.02;
/// Meshes for a second where no number is given.
const RATE: f64 = 30.0;

/// The mannequin that `described` is; errors are about `key`.
pub(super) fn compile(
    check: &Check<'_>,
    key: &str,
    name: &str,
    described: &SceneMannequin,
    plans: &mut Plans,
) -> Result<ColliderShape, SceneError> {
    let cells = described.cells.unwrap_or(solid::CELLS);
    solid::cells_check(check, key, cells)?;
    let rate = described.rate.unwrap_or(RATE);
    check.positive(&format!("{key}.rate"), rate)?;
    let poses = poses(check, key, described)?;
    if sets(described) > u64::from(animation::FRAMES_MAX) {
        let problem = format!(
            "makes {} meshes of its motion: give at most {} for all of it",
            sets(described),
            animation::FRAMES_MAX
        );
        return Err(check.error(&format!("{key}.rate"), &problem));
    }
    let edge = described.edge.unwrap_or(EDGE);
    let mannequin =
        Mannequin::new(&measures(described), edge).map_err(|error| wrong(check, key, &error))?;
    let start = poses.first().map_or(0.0, |(time, _)| *time);
    let times = (0..sets(described)).map(|set| start + set as f64 / rate);
    let sets: Vec<Vec<[f64; 3]>> =
        times.map(|time| mannequin.posed(&pose_at(&poses, time))).collect();
    let triangles = mannequin.triangles().to_vec();
    if plans.of_triangles() {
        return Ok(ColliderShape::Surface(Arc::new(BodySurface { triangles, sets, rate, start })));
    }
    let mesh =
        |positions| TriangleMesh { positions, triangles: triangles.clone(), ..Default::default() };
    let meshes: Vec<TriangleMesh> = sets.into_iter().map(mesh).collect();
    let size = (cells, solid::MARGIN);
    let plan = match &meshes[..] {
        [mesh] => DistanceGridPlan::new(name, mesh, size),
        meshes => {
            DistanceGridPlan::sequence(name, meshes, rate, size).map(|plan| plan.waiting(start))
        }
    };
    Ok(plans.draft(key, plan.map_err(|error| solid::place(check, key, &error))?))
}

/// Vertices that it has, about.
pub(super) fn vertices(described: &SceneMannequin) -> u64 {
    Mannequin::vertices_about(&measures(described), described.edge.unwrap_or(EDGE))
}

/// Meshes that its motion takes.
pub(super) fn sets(described: &SceneMannequin) -> u64 {
    let ends = described.pose.first().zip(described.pose.last());
    let span = ends.map_or(0.0, |(first, last)| last.time - first.time);
    ((span * described.rate.unwrap_or(RATE)).ceil() as u64).saturating_add(1)
}

fn measures(described: &SceneMannequin) -> Measures {
    let SceneMannequin { height, neck, chest, waist, hips, shoulders, .. } = described;
    let usual = Measures::of_height(height.unwrap_or(Measures::default().height));
    Measures {
        height: usual.height,
        neck: neck.unwrap_or(usual.neck),
        chest: chest.unwrap_or(usual.chest),
        waist: waist.unwrap_or(usual.waist),
        hips: hips.unwrap_or(usual.hips),
        shoulders: shoulders.unwrap_or(usual.shoulders),
    }
}

fn wrong(check: &Check<'_>, key: &str, error: &MannequinError) -> SceneError {
    check.error(&format!("{key}.{}", error.what()), &error.to_string())
}

/// The poses with their times \[s\], all angles filled in.
fn poses(
    check: &Check<'_>,
    key: &str,
    described: &SceneMannequin,
) -> Result<Vec<(f64, Pose)>, SceneError> {
    let mut poses: Vec<(f64, Pose)> = Vec::new();
    for (number, given) in described.pose.iter().enumerate() {
        let key = format!("{key}.pose[{number}]");
        check.not_negative(&format!("{key}.time"), given.time)?;
        let before = poses.last().copied();
        if let Some((time, _)) = before
            && given.time <= time
        {
            let problem =
                format!("is {}, and the pose before is at {time}: give a later time", given.time);
            return Err(check.error(&format!("{key}.time"), &problem));
        }
        let before = before.map_or_else(Pose::default, |(_, pose)| pose);
        poses.push((given.time, pose(check, &key, given, before)?));
    }
    Ok(poses)
}

/// One pose: what is not given is as before.
fn pose(
    check: &Check<'_>,
    key: &str,
    given: &SceneMannequinPose,
    mut pose: Pose,
) -> Result<Pose, SceneError> {
    let within = |name: &str, degrees: f64, [least, most]: [f64; 2]| {
        if (least..=most).contains(&degrees) {
            return Ok(degrees);
        }
        let problem = format!("is {degrees}: give {least} to {most} degrees");
        Err(check.error(&format!("{key}.{name}"), &problem))
    };
    let swing = |name: &str, given: SceneMannequinSwing| {
        Ok::<_, SceneError>(Swing {
            raise: within(&format!("{name}.raise"), given.raise, [0.0, 170.0])?,
            forwards: within(&format!("{name}.forwards"), given.forwards, [-90.0, 135.0])?,
        })
    };
    let [left, right] = &mut pose.shoulders;
    let [hip_left, hip_right] = &mut pose.hips;
    for (name, given, limb) in [
        ("shoulder_left", given.shoulder_left, left),
        ("shoulder_right", given.shoulder_right, right),
        ("hip_left", given.hip_left, hip_left),
        ("hip_right", given.hip_right, hip_right),
    ] {
        if let Some(given) = given {
            *limb = swing(name, given)?;
        }
    }
    let [left, right] = &mut pose.elbows;
    let [knee_left, knee_right] = &mut pose.knees;
    for (name, given, range, joint) in [
        ("elbow_left", given.elbow_left, [0.0, 140.0], left),
        ("elbow_right", given.elbow_right, [0.0, 140.0], right),
        ("knee_left", given.knee_left, [0.0, 140.0], knee_left),
        ("knee_right", given.knee_right, [0.0, 140.0], knee_right),
        ("head", given.head, [-90.0, 90.0], &mut pose.head),
    ] {
        if let Some(given) = given {
            *joint = within(name, given, range)?;
        }
    }
    Ok(pose)
}

/// The pose at a time \[s\].
fn pose_at(poses: &[(f64, Pose)], time: f64) -> Pose {
    let after = poses.partition_point(|(at, _)| *at <= time);
    let before = after.checked_sub(1).and_then(|before| poses.get(before));
    match (before, poses.get(after)) {
        (Some((from, a)), Some((to, b))) => {
            let part = (time - from) / (to - from);
            a.between(b, part * part * (3.0 - 2.0 * part))
        }
        (Some((_, pose)), None) | (None, Some((_, pose))) => *pose,
        (None, None) => Pose::default(),
    }
}
