//! What is known of a frame before it starts.

use crate::{Model, Pose};

/// A frame, divided into substeps, with all that varies from one to the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FramePlan {
    /// The substeps in order.
    pub substeps: Vec<Substep>,
    /// Colliders at the end of each substep: entry s c + k is collider k of c in substep s. If no
    /// collider moves in this frame there is one set for all substeps.
    pub colliders: Vec<ColliderState>,
    /// Number of colliders, c.
    pub collider_count: usize,
}

/// One substep of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Substep {
    /// Place in the frame, from 0.
    pub index: usize,
    /// Substeps since the start of the simulation, this one included.
    pub step: u64,
    /// Simulated time at its start \[s\].
    pub time: f64,
    /// Its length h \[s\].
    pub length: f64,
    /// Wind velocity \[m/s\], gusts included.
    pub wind_velocity: [f64; 3],
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
}

impl FramePlan {
    /// The colliders at the end of substep `index`.
    #[must_use]
    pub fn colliders_at(&self, index: usize) -> &[ColliderState] {
        let sets = self.colliders.len() / self.collider_count.max(1);
        let set = index.min(sets.saturating_sub(1));
        &self.colliders[set * self.collider_count..(set + 1) * self.collider_count]
    }

    /// Plans a frame of `duration` \[s\] from `time` \[s\] on, after `step` substeps, in which
    /// colliders go from poses `from` to poses `to`. Memory of an earlier plan is used again.
    #[expect(
        clippy::too_many_arguments,
        reason = "all that a frame depends on, called in one place"
    )]
    pub fn refill(
        &mut self,
        model: &Model,
        (time, step): (f64, u64),
        duration: f64,
        time_step: f64,
        wind_velocity: [f64; 3],
        from: &[Pose],
        to: &[Pose],
    ) {
        self.substeps.clear();
        let mut start = time;
        for (index, length) in substep_lengths(duration, time_step).enumerate() {
            let middle = start + 0.5 * length;
            self.substeps.push(Substep {
                index,
                step: step + index as u64 + 1,
                time: start,
                length,
                wind_velocity: model
                    .air()
                    .map_or([0.0; 3], |air| air.wind_at(wind_velocity, middle)),
            });
            start += length;
        }
        self.collider_count = from.len();
        self.colliders.clear();
        let sets = if from == to { 1 } else { self.substeps.len() };
        for set in 0..sets {
            let end = self.substeps.get(set).map_or(time, |s| s.time + s.length);
            let fraction = if set + 1 == sets { 1.0 } else { (end - time) / duration };
            for (from, to) in from.iter().zip(to) {
                let (linear_velocity, angular_velocity) = from.velocities_to(to, duration);
                let pose = from.interpolate(to, fraction);
                self.colliders.push(ColliderState {
                    translation: pose.translation,
                    rotation: pose.rotation_rows(),
                    linear_velocity,
                    angular_velocity,
                });
            }
        }
    }
}

/// Lengths of the substeps of a frame \[s\]: as many of `time_step` as fit, and a shorter last one
/// for the rest (NUMERICS §4). A rest below a millionth of a step is rounding, not a step.
pub fn substep_lengths(duration: f64, time_step: f64) -> impl Iterator<Item = f64> {
    let exact = duration / time_step;
    let count = if exact - exact.floor() < 1e-6 { exact.floor() } else { exact.ceil() }.max(1.0);
    let last = duration - (count - 1.0) * time_step;
    let count = count as u64;
    (1..=count).map(move |number| if number == count { last } else { time_step })
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn a_step_longer_than_the_frame_is_the_frame() {
        let lengths: Vec<f64> = substep_lengths(0.01, 0.5).collect();
        assert_eq!(lengths, [0.01]);
    }
}
