//! What is known of a frame before it starts.

use crate::{GridSets, Model, Pose};

/// A frame as a whole, however it is divided.
#[derive(Clone, Copy, Debug)]
pub struct FrameSpan<'a> {
    /// Simulated time at its start \[s\].
    pub time: f64,
    /// Its length \[s\].
    pub duration: f64,
    /// Wind velocity without gusts \[m/s\].
    pub wind_velocity: [f64; 3],
    /// Offset of the anchors of forces at its start and at its end \[m\].
    pub anchor_offset: [[f64; 3]; 2],
    /// Poses of the colliders at its start.
    pub from: &'a [Pose],
    /// Poses at its end, reached at constant velocity.
    pub to: &'a [Pose],
}

/// A frame, or what is left of one when the time step changes, divided into substeps, with all that
/// varies from one to the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FramePlan {
    /// The substeps in order.
    pub substeps: Vec<Substep>,
    /// Colliders at the end of each substep: entry s c + k is collider k of c in substep s. If no
    /// collider moves in the frame there is one set for all substeps.
    pub colliders: Vec<ColliderState>,
    /// Number of colliders, c.
    pub collider_count: usize,
}

/// One substep of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Substep {
    /// Place in the plan, from 0.
    pub index: usize,
    /// Substeps since the start of the simulation, this one included.
    pub step: u64,
    /// Simulated time at its start \[s\].
    pub time: f64,
    /// Its length h \[s\].
    pub length: f64,
    /// Wind velocity \[m/s\], gusts included.
    pub wind_velocity: [f64; 3],
    /// Offset of the anchors of forces at its end \[m\].
    pub anchor_offset: [f64; 3],
}

/// A collider at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColliderState {
    /// Origin of its frame \[m\].
    pub translation: [f64; 3],
    /// Rotation local to world, row by row.
    pub rotation: [[f64; 3]; 3],
    /// Linear velocity \[m/s\].
    pub linear_velocity: [f64; 3],
    /// Angular velocity \[rad/s\].
    pub angular_velocity: [f64; 3],
    /// The samples of a grid.
    pub sets: GridSets,
}

impl FramePlan {
    /// The colliders at the end of substep `index`.
    #[must_use]
    pub fn colliders_at(&self, index: usize) -> &[ColliderState] {
        let sets = self.colliders.len() / self.collider_count.max(1);
        let set = index.min(sets.saturating_sub(1));
        &self.colliders[set * self.collider_count..(set + 1) * self.collider_count]
    }

    /// Plans what is left of a frame after `elapsed` \[s\] of it, `step` substeps after the start of the
    /// simulation, in substeps of `time_step` \[s\]. Colliders go on as if the frame had never been
    /// divided. Memory of an earlier plan is used again.
    pub fn refill(
        &mut self,
        model: &Model,
        span: &FrameSpan<'_>,
        (elapsed, step): (f64, u64),
        time_step: f64,
    ) {
        self.substeps.clear();
        let mut start = span.time + elapsed;
        let [offset, offset_end] = span.anchor_offset;
        let lengths = substep_lengths(span.duration - elapsed, time_step);
        for (index, length) in lengths.enumerate() {
            let middle = start + 0.5 * length;
            let share = (start + length - span.time) / span.duration;
            self.substeps.push(Substep {
                index,
                step: step + index as u64 + 1,
                time: start,
                length,
                wind_velocity: model
                    .air()
                    .map_or([0.0; 3], |air| air.wind_at(span.wind_velocity, middle)),
                anchor_offset: std::array::from_fn(|k| {
                    offset[k] + share * (offset_end[k] - offset[k])
                }),
            });
            start += length;
        }
        if let Some(last) = self.substeps.last_mut() {
            last.anchor_offset = offset_end;
        }
        self.collider_count = span.from.len();
        self.colliders.clear();
        let changes = model.colliders().iter().any(|collider| collider.shape.changes());
        let rests = span.from == span.to && !changes;
        let sets = if rests { 1 } else { self.substeps.len() };
        for set in 0..sets {
            let end = self.substeps.get(set).map_or(span.time, |s| s.time + s.length);
            // The last set is that of the end of the frame, to the bit: who goes on from there starts with it.
            let is_last = set + 1 == sets;
            let end = if is_last { span.time + span.duration } else { end };
            let fraction = (end - span.time) / span.duration;
            for ((from, to), collider) in span.from.iter().zip(span.to).zip(model.colliders()) {
                let (linear_velocity, angular_velocity) = from.velocities_to(to, span.duration);
                let pose = if is_last { *to } else { from.interpolate(to, fraction) };
                self.colliders.push(ColliderState {
                    translation: pose.translation,
                    rotation: pose.rotation_rows(),
                    linear_velocity,
                    angular_velocity,
                    sets: collider.shape.sets_at(end),
                });
            }
        }
    }
}

/// A rest shorter than this share of a step is no step of its own.
const SLIVER: f64 = 0.01;

/// Lengths of the substeps of a frame \[s\]: as many of `time_step` as fit, and a shorter last one
/// for the rest (NUMERICS §4). A rest below a hundredth of a step goes to the one before: strain
/// limiting divides a length by the step, and would make a great velocity of it.
pub fn substep_lengths(duration: f64, time_step: f64) -> impl Iterator<Item = f64> {
    let exact = duration / time_step;
    let count = if exact - exact.floor() < SLIVER { exact.floor() } else { exact.ceil() }.max(1.0);
    let last = duration - (count - 1.0) * time_step;
    let count = count as u64;
    (1..=count).map(move |number| if number == count { last } else { time_step })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Cloth, Collider, ColliderShape, Geometry, GridPatch, MaterialPreset, ModelBuilder,
    };

    /// Colliders and anchors move over the whole frame, however often what is left of it is planned again.
    #[test]
    fn a_plan_for_the_rest_of_a_frame_goes_on_with_what_moves() {
        let ball = Collider {
            name: "ball".into(),
            shape: ColliderShape::Sphere { radius: 0.1 },
            pose: Pose::from_translation([0.0; 3]),
            friction: 0.0,
            restitution: 0.0,
        };
        let cloth = Cloth {
            name: "patch".into(),
            geometry: Geometry::Grid(GridPatch::horizontal(2, 0.1, 1.0)),
            material: MaterialPreset::ALL[0].material(0.1).into(),
            pins: vec![],
            velocity: [0.0; 3],
        };
        let model = ModelBuilder::new().cloth(cloth).collider(ball).build().unwrap();
        let [from, to] = [[0.0; 3], [0.8, 0.0, 0.0]].map(Pose::from_translation);
        let span = FrameSpan {
            time: 3.0,
            duration: 0.4,
            wind_velocity: [0.0; 3],
            anchor_offset: [[0.0; 3], [0.0, 4.0, 0.0]],
            from: &[from],
            to: &[to],
        };
        let mut plan = FramePlan::default();
        plan.refill(&model, &span, (0.1, 7), 0.1);
        let found: Vec<_> = plan.substeps.iter().map(|s| (s.index, s.step, s.time)).collect();
        let times = [3.1, 3.2, 3.3];
        for (k, ((index, step, time), wanted)) in found.into_iter().zip(times).enumerate() {
            assert_eq!((index, step), (k, 8 + k as u64));
            assert!((time - wanted).abs() < 1e-12);
            let collider = plan.colliders_at(k)[0];
            let place = 2.0 * (wanted + 0.1 - 3.0);
            assert!((collider.translation[0] - place).abs() < 1e-12, "{k}: {collider:?}");
            assert!((collider.linear_velocity[0] - 2.0).abs() < 1e-12);
            let offset = 10.0 * (wanted + 0.1 - 3.0);
            assert!((plan.substeps[k].anchor_offset[1] - offset).abs() < 1e-12, "{k}");
        }
        assert_eq!(plan.colliders_at(2)[0].translation, to.translation, "exactly, at the end");
        assert_eq!(plan.substeps[2].anchor_offset, [0.0, 4.0, 0.0], "exactly, at the end");
    }

    #[test]
    fn a_thirtieth_at_a_kilohertz_has_34_substeps() {
        let lengths: Vec<f64> = substep_lengths(1.0 / 30.0, 1e-3).collect();
        assert_eq!(lengths.len(), 34);
        assert!((lengths[33] - (1.0 / 30.0 - 0.033)).abs() < 1e-15);
        assert!((lengths.iter().sum::<f64>() - 1.0 / 30.0).abs() < 1e-15);
    }

    #[test]
    fn an_exact_division_has_no_sliver() {
        let lengths: Vec<f64> = substep_lengths(1.0 / 60.0, 1.0 / 1020.0).collect();
        assert_eq!(lengths.len(), 17);
        assert!(lengths.iter().all(|length| (length * 1020.0 - 1.0).abs() < 1e-9));
    }

    #[test]
    fn a_time_step_cut_off_after_some_digits_makes_no_sliver() {
        let lengths: Vec<f64> = substep_lengths(1.0 / 60.0, 0.008_333_3).collect();
        assert_eq!(lengths.len(), 2);
        assert!((lengths.iter().sum::<f64>() - 1.0 / 60.0).abs() < 1e-15);
        let lengths: Vec<f64> = substep_lengths(0.102, 0.01).collect();
        assert_eq!(lengths.len(), 11, "a fifth of a step is one");
    }

    #[test]
    fn a_step_longer_than_the_frame_is_the_frame() {
        let lengths: Vec<f64> = substep_lengths(0.01, 0.5).collect();
        assert_eq!(lengths, [0.01]);
    }
}
