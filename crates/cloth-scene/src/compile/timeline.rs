//! From keyframes and events to a timeline.

use std::collections::{BTreeMap, HashMap};

use cloth_core::Model;

use crate::{
    Scene, SceneAction, SceneError, SceneEvent, SceneRotation, Timeline,
    error::SceneUnknown,
    timeline::{ColliderKey, ColliderTrack, PinMove, PinTrack},
};

use super::{
    Check,
    collider::{rotation_check, shape_rotation},
    pins::{NAMED_MAX, PinSets},
};

pub(super) fn compile(
    scene: &Scene,
    check: &Check<'_>,
    model: &Model,
    pin_sets: &[PinSets],
) -> Result<Timeline, SceneError> {
    let colliders = collider_tracks(scene, check)?;
    let mut pins = BTreeMap::new();
    let numbers = scene.cloths.iter().enumerate().map(|(number, cloth)| (&*cloth.name, number));
    let events = Events { scene, check, model, pin_sets, cloths: numbers.collect() };
    let mut named = 0_u64;
    // In the order of time, so that a move can be refused that comes after the release.
    let mut order: Vec<(usize, &SceneEvent)> = scene.events.iter().enumerate().collect();
    order.sort_by(|a, b| a.1.time.total_cmp(&b.1.time));
    for (index, event) in order {
        named = named.saturating_add(events.apply(index, event, &mut pins)?);
        if named > NAMED_MAX {
            let problem = format!(
                "makes {named} particles that all events name together, each as often as it is named: \
                 at most {NAMED_MAX} are possible; name fewer pins in each event"
            );
            return Err(check.error(&format!("event[{index}].pins"), &problem));
        }
    }
    let pins = pins.into_values().filter(|pin| !pin.is_empty());
    Ok(Timeline::new(scene.simulation.frames_per_second, pins.collect(), colliders))
}

fn collider_tracks(scene: &Scene, check: &Check<'_>) -> Result<Vec<ColliderTrack>, SceneError> {
    let mut tracks = Vec::new();
    for (index, collider) in scene.colliders.iter().enumerate() {
        if collider.motion.is_empty() {
            continue;
        }
        let mut key = ColliderKey {
            time: 0.0,
            translation: collider.translation,
            rotation: collider.rotation.unwrap_or(SceneRotation::NONE),
        };
        let mut keys = vec![key];
        for (number, frame) in collider.motion.iter().enumerate() {
            let path = format!("collider[{index}].motion[{number}]");
            let time_path = format!("{path}.time");
            check.positive(&time_path, frame.time)?;
            if frame.time <= key.time {
                let problem = "is not later than the keyframe before: sort them by time";
                return Err(check.error(&time_path, problem));
            }
            if let Some(translation) = frame.translation {
                check.finite(&format!("{path}.translation"), &translation)?;
                key.translation = translation;
            }
            if let Some(rotation) = frame.rotation {
                rotation_check(check, &format!("{path}.rotation"), &rotation)?;
                key.rotation = rotation;
            }
            key.time = frame.time;
            keys.push(key);
        }
        tracks.push(ColliderTrack {
            // There are fewer colliders than a file has bytes.
            collider: u32::try_from(index).unwrap_or(u32::MAX),
            shape_rotation: shape_rotation(&collider.shape),
            keys,
        });
    }
    Ok(tracks)
}

/// What events act on.
struct Events<'a> {
    scene: &'a Scene,
    check: &'a Check<'a>,
    model: &'a Model,
    pin_sets: &'a [PinSets],
    /// The numbers of the cloths by name.
    cloths: HashMap<&'a str, usize>,
}

impl Events<'_> {
    /// Adds an event to the tracks of its pins; how many particles it names.
    fn apply(
        &self,
        index: usize,
        event: &SceneEvent,
        tracks: &mut BTreeMap<u32, PinTrack>,
    ) -> Result<u64, SceneError> {
        let Self { scene, check, model, pin_sets, .. } = self;
        let key = format!("event[{index}]");
        check.not_negative(&format!("{key}.time"), event.time)?;
        if let SceneAction::Move { offset, duration } = &event.action {
            check.finite(&format!("{key}.action.move.offset"), offset)?;
            check.positive(&format!("{key}.action.move.duration"), *duration)?;
        }
        let cloth = self.cloths.get(event.cloth.as_str()).copied();
        let (range, sets) = cloth
            .and_then(|index| Some((&model.cloths().get(index)?.particles, pin_sets.get(index)?)))
            .ok_or_else(|| {
                let known = scene.cloths.iter().map(|cloth| cloth.name.clone()).collect();
                let place = check.place(&format!("{key}.cloth"));
                SceneUnknown::error(place, "cloth", &event.cloth, known)
            })?;
        let mut named = 0;
        for pin in &event.pins {
            let mut found = false;
            let particles = sets.resolve(check, &format!("{key}.pins"), pin)?;
            named += particles.len() as u64;
            if named > NAMED_MAX {
                break;
            }
            for particle in particles {
                let Some(particle) = particle.checked_add(range.start) else { continue };
                if !range.contains(&particle) {
                    continue;
                }
                let is_pin = model.pins().binary_search(&particle).is_ok();
                let Some(start) = model.positions().get(particle as usize) else { continue };
                let track = tracks
                    .entry(particle)
                    .or_insert_with(|| PinTrack::new(particle, *start, is_pin));
                let time = event.time;
                found |= match event.action {
                    SceneAction::Release => track.release(time),
                    SceneAction::Hold => {
                        track.hold(time);
                        true
                    }
                    SceneAction::Move { offset, duration } => {
                        track.push(PinMove { time, duration, offset })
                    }
                };
            }
            if !found {
                let (cloth, time) = (&event.cloth, event.time);
                let problem = match event.action {
                    SceneAction::Hold => {
                        let count = range.len();
                        format!(
                            "names {pin}, and cloth {cloth:?} has {count} vertices: they count from 0"
                        )
                    }
                    SceneAction::Move { .. } | SceneAction::Release => format!(
                        "names {pin}, but no pin of cloth {cloth:?} is held there at {time} s: pin it, or hold it by an event before"
                    ),
                };
                return Err(check.error(&format!("{key}.pins"), &problem));
            }
        }
        Ok(named)
    }
}
