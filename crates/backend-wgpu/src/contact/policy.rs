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

/// Entries of the list for each particle at first.
const ENTRIES_PER_PARTICLE: u32 = 12;
/// Size of a cell in units of the contact distance.
const CELL: f64 = 3.0;
/// How far a particle may stray from its expected way, in units of the contact distance.
const ALLOWANCE: f64 = 0.25;
/// Share of the allowances after which the list is built at the next opportunity.
const STALE: f32 = 0.4;
/// Share of the reach that rounding cannot use up.
const REACH_SAFETY: f64 = 0.99;
/// Substeps that a list is made for, at least.
const HORIZON: u32 = 16;
/// Longest interval between two opportunities to build the list \[substep\].
const INTERVAL_MAX: u32 = 8;
/// Good frames after which a longer interval is tried.
const PATIENCE: u32 = 24;

/// What the host decides about contact.
#[derive(Debug)]
pub(crate) struct ContactPolicy {
    distance: f64,
    time_step: f64,
    pub(crate) sizes: ContactSizes,
    /// Substeps from one opportunity to build the list to the next.
    pub(crate) interval: u32,
    good_frames: u32,
    drift: [f64; 3],
    /// The constants changed: a list made with the old ones is worthless.
    pub(crate) changed: bool,
}

impl ContactPolicy {
    pub(crate) fn new(model: &Model, contact: &SelfContact, time_step: f64) -> Self {
        let particles = model.particle_count() as u32;
        let sizes = ContactSizes {
            cells: particles.next_power_of_two().max(SCAN_BLOCK),
            entries: particles.saturating_mul(ENTRIES_PER_PARTICLE).max(1024),
        };
        Self {
            distance: contact.distance,
            time_step,
            sizes,
            interval: 4,
            good_frames: 0,
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
            stale_fraction: STALE,
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
        if self.good_frames >= PATIENCE && self.interval < INTERVAL_MAX {
            self.good_frames = 0;
            self.interval *= 2;
            self.changed = true;
        }
    }

    /// A list was used too long; `attempts` is how often this frame was tried.
    pub(crate) fn list_was_broken(&mut self, attempts: u32) {
        self.good_frames = 0;
        // An interval of one cannot fail: the list is then built for the very positions it is used for.
        self.interval = if attempts > 1 { 1 } else { (self.interval / 2).max(1) };
        self.changed = true;
    }

    /// More entries were needed than there are; the new capacity.
    ///
    /// # Errors
    /// `Overflow` if no buffer of this device, at most `max` bytes, can hold them.
    pub(crate) fn entries_grow(&mut self, status: &Status, max: u64) -> Result<u32> {
        let needed = u64::from(status.contact_entries);
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
