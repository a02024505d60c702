//! How long and how often: the sizes behind the candidate list.

use cloth_core::{Error, Model, Result, SelfContact};

use crate::{
    dispatch::SCAN_BLOCK,
    layout::{Contact, Status},
};

/// Capacities of the buffers of contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactSizes {
    /// Cells of the table, a power of two.
    pub(crate) cells: u32,
    /// Entries of the candidate list.
    pub(crate) entries: u32,
}

/// Entries that every particle has in the list (`ROW` in `contact_candidates_list.wgsl`).
pub(crate) const ROW: u32 = 16;
/// Further entries at first, for each particle, for those with more candidates.
const SPILLED_PER_PARTICLE: u32 = 4;
/// Size of a cell in units of the contact distance. This and the next were chosen for the fewest builds of a
/// patch of 96 x 96 particles that falls over a ball: four in a frame of 17 substeps, ten candidates a particle.
const CELL: f64 = 5.0;
/// How far a particle may stray from its expected way, in units of the contact distance.
const ALLOWANCE: f64 = 0.75;
/// Share of the reach that rounding cannot use up.
const REACH_SAFETY: f64 = 0.99;
/// Substeps that a list is made for, at least.
const HORIZON: u32 = 16;
/// Longest interval between two opportunities to build the list \[substep\].
const INTERVAL_MAX: u32 = 8;
/// Good frames after which a longer interval is tried: so many at first, twice as many after each trial
/// that failed, up to the largest number; the first number again after that many good frames.
const PATIENCE: [u32; 2] = [2, 8];

/// What the host decides about contact.
#[derive(Debug)]
pub(crate) struct ContactPolicy {
    distance: f64,
    time_step: f64,
    pub(crate) sizes: ContactSizes,
    /// Substeps from one opportunity to build the list to the next.
    pub(crate) interval: u32,
    good_frames: u32,
    patience: u32,
    drift: [f64; 3],
    /// The constants changed: a list made with the old ones is worthless.
    pub(crate) changed: bool,
}

impl ContactPolicy {
    pub(crate) fn new(model: &Model, contact: &SelfContact, time_step: f64) -> Self {
        let particles = model.particle_count() as u32;
        let sizes = ContactSizes {
            cells: particles.next_power_of_two().max(SCAN_BLOCK),
            entries: particles.saturating_mul(ROW + SPILLED_PER_PARTICLE).max(1024),
        };
        Self {
            distance: contact.distance,
            time_step,
            sizes,
            interval: 4,
            good_frames: 0,
            patience: PATIENCE[0],
            drift: [0.0; 3],
            changed: true,
        }
    }

    /// The constants of `shared/contact_list.wgsl`.
    pub(crate) fn constants(&self) -> Contact {
        let cell = CELL * self.distance;
        let reach = 0.5 * (cell - self.distance) * REACH_SAFETY;
        let horizon = f64::from(HORIZON.max(2 * self.interval)) * self.time_step;
        let allowance = ALLOWANCE * self.distance;
        Contact {
            drift: self.drift.map(|component| component as f32),
            velocity_max: (reach / (f64::from(self.interval) * self.time_step)) as f32,
            allowance: allowance as f32,
            reach: reach as f32,
            horizon: (1.001 * horizon) as f32,
            cells_per_metre: cell.recip() as f32,
            list_distance: (1.001 * (self.distance + 2.0 * allowance)) as f32,
            cell_mask: self.sizes.cells - 1,
            list_capacity: self.sizes.entries,
            lead: (f64::from(self.interval) * self.time_step) as f32,
        }
    }

    /// Takes the velocity of the centre of mass \[m/s\] as that of everything, if it differs from the
    /// one in use by so much that particles would leave their reach.
    pub(crate) fn drift_suggest(&mut self, velocity: [f64; 3]) {
        let far = 0.1 * self.distance / (f64::from(self.interval) * self.time_step);
        let differs = velocity.iter().zip(&self.drift).any(|(new, old)| (new - old).abs() > far);
        if differs && velocity.iter().all(|component| component.is_finite()) {
            self.drift = velocity;
            self.changed = true;
        }
    }

    /// A frame was good.
    pub(crate) fn frame_was_good(&mut self) {
        self.good_frames += 1;
        if self.good_frames >= PATIENCE[1] {
            self.patience = PATIENCE[0];
        }
        if self.good_frames >= self.patience && self.interval < INTERVAL_MAX {
            self.good_frames = 0;
            self.interval *= 2;
            self.changed = true;
        }
    }

    /// A list was used too long; `attempts` is how often this frame was tried.
    pub(crate) fn list_was_broken(&mut self, attempts: u32) {
        self.good_frames = 0;
        if attempts == 1 {
            self.patience = (2 * self.patience).min(PATIENCE[1]);
        }
        // An interval of one cannot fail: the list is then built for the very positions it is used for.
        self.interval = if attempts > 1 { 1 } else { (self.interval / 2).max(1) };
        self.changed = true;
    }

    /// More entries were needed than there are; the new capacity.
    ///
    /// # Errors
    /// `Overflow` if no buffer of this device, at most `max` bytes, can hold them.
    pub(crate) fn entries_grow(&mut self, status: &Status, max: u64) -> Result<u32> {
        let needed = u64::from(status.contact_needed);
        let possible = (max / 4).min(u64::from(u32::MAX));
        if needed > possible {
            return Err(Error::Overflow {
                buffer: "contact candidates",
                needed,
                capacity: possible,
            });
        }
        self.sizes.entries = (needed + needed / 2).min(possible) as u32;
        self.changed = true;
        Ok(self.sizes.entries)
    }
}

#[cfg(test)]
mod tests {
    use cloth_core::{
        Cloth, ContactResponse, Geometry, GridPatch, MaterialPreset, ModelBuilder, SelfContact,
    };

    use super::*;

    fn policy() -> ContactPolicy {
        let response = ContactResponse::Penalty { stiffness: 1.0, damping: 0.0 };
        let contact = SelfContact { distance: 0.01, response };
        let cloth = Cloth {
            name: "cloth".into(),
            geometry: Geometry::Grid(GridPatch::horizontal(4, 0.02, 0.0)),
            material: MaterialPreset::ALL[0].material(0.02),
            pins: vec![],
            velocity: [0.0; 3],
        };
        let model = ModelBuilder::new().cloth(cloth).self_contact(contact).build().unwrap();
        ContactPolicy::new(&model, &contact, 1e-3)
    }

    #[test]
    fn a_frame_that_fails_again_is_tried_with_a_list_for_every_use() {
        let mut policy = policy();
        policy.list_was_broken(1);
        assert_eq!(policy.interval, 2);
        policy.list_was_broken(2);
        assert_eq!(policy.interval, 1);
    }

    #[test]
    fn good_frames_bring_long_intervals_back_sooner_or_later() {
        let mut policy = policy();
        let frames_until = |policy: &mut ContactPolicy, interval: u32| {
            (1..1000).find(|_| {
                policy.frame_was_good();
                policy.interval == interval
            })
        };
        policy.list_was_broken(1);
        policy.list_was_broken(2);
        let first = frames_until(&mut policy, 4);
        policy.list_was_broken(1);
        policy.list_was_broken(2);
        let second = frames_until(&mut policy, 4);
        assert!(first < second, "{first:?} {second:?}");
        assert!(frames_until(&mut policy, INTERVAL_MAX).is_some());
    }

    #[test]
    fn a_list_that_no_buffer_can_hold_is_an_error() {
        let mut policy = policy();
        let status = |contact_needed| Status { contact_needed, ..Status::default() };
        assert_eq!(policy.entries_grow(&status(2000), 1 << 20), Ok(3000));
        let expected =
            Error::Overflow { buffer: "contact candidates", needed: 2000, capacity: 1000 };
        assert_eq!(policy.entries_grow(&status(2000), 4000), Err(expected));
    }
}
