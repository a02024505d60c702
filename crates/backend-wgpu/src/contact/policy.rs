//! How long and how often: the sizes behind the list of groups.

use cloth_core::{Error, Model, Result, SelfContact};

use crate::{
    dispatch::GROUP,
    layout::{Contact, Status},
};

/// Capacities of the buffers of contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactSizes {
    /// Groups of particles.
    pub(crate) groups: u32,
    /// Groups that each row of the list has room for, a multiple of four.
    pub(crate) near: u32,
    /// Cells of each of two tables, a power of two.
    pub(crate) cells: u32,
    /// Entries of the rows of particles.
    pub(crate) entries: u32,
}

impl ContactSizes {
    /// Words of four numbers of all rows of the list (`group_row` in `shared/group.wgsl`).
    pub(crate) const fn row_words(&self) -> u64 {
        self.groups as u64 * (2 + self.near as u64 / 4)
    }

    /// Whether the model has so few groups that their number does not matter.
    pub(crate) const fn is_small(&self) -> bool {
        self.groups <= GROUPS_WIDE
    }
}

/// Entries that every particle has a place for (`KEPT` in `shared/contact_spill.wgsl`).
const ROW: u32 = 16;
/// Further entries at first, for each particle, for those with more partners.
const SPILLED_PER_PARTICLE: u32 = 4;
/// Groups that a row of the list has room for at first.
const NEAR: u32 = 32;
/// Cells that a region is put into at most (`COVER_MAX` in `shared/cells.wgsl`).
pub(crate) const COVER_MAX: u32 = 27;
/// Cells of a table for each group, at least.
const CELLS_PER_GROUP: u32 = 4;
/// What is added to a region on all sides, in units of the contact distance.
const MARGIN: f64 = 2.0;
/// Most groups for which a pass takes hardly more time than any pass, however little it does. Such models
/// have longer regions and fewer opportunities to build the list. Measured on an H200: with 800 groups
/// regions for 48 substeps and an opportunity every 32 take 8 % less than 32 and 16, which took 12 to 16 % less than 20 and
/// 8; with 32,768, regions for 48 substeps doubled the time of a frame.
pub(crate) const GROUPS_WIDE: u32 = 1024;

/// How long a list is made for.
#[derive(Clone, Copy, Debug)]
struct Span {
    /// Substeps that regions are made for.
    horizon: f64,
    /// Longest interval between two opportunities to build the list \[substep\].
    interval_max: u32,
}

const SPAN: Span = Span { horizon: 20.0, interval_max: 8 };
const SPAN_SMALL: Span = Span { horizon: 48.0, interval_max: 32 };

/// Good frames after which a longer interval is tried: so many at first, twice as many after each trial
/// that failed, up to the largest number; the first number again after that many good frames.
const PATIENCE: [u32; 2] = [2, 8];

/// What the host decides about contact.
#[derive(Debug)]
pub(crate) struct ContactPolicy {
    distance: f64,
    time_step: f64,
    /// Longest side of the groups at rest, on average \[m\].
    group_side: f64,
    pub(crate) sizes: ContactSizes,
    /// Substeps from one opportunity to build the list to the next.
    pub(crate) interval: u32,
    good_frames: u32,
    patience: u32,
    /// The constants changed: a list made with the old ones is worthless.
    pub(crate) changed: bool,
}

impl ContactPolicy {
    /// For particles in groups of `members`.
    pub(crate) fn new(
        model: &Model,
        contact: &SelfContact,
        time_step: f64,
        members: &[u32],
    ) -> Self {
        let particles = model.particle_count() as u32;
        let groups = (members.len() / GROUP as usize) as u32;
        let sizes = ContactSizes {
            groups,
            near: NEAR,
            cells: (CELLS_PER_GROUP * groups).next_power_of_two(),
            entries: particles.saturating_mul(ROW + SPILLED_PER_PARTICLE).max(1024),
        };
        Self {
            distance: contact.distance,
            time_step,
            group_side: model.group_side(members, GROUP as usize),
            sizes,
            interval: 4,
            good_frames: 0,
            patience: PATIENCE[0],
            changed: true,
        }
    }

    /// As [`ContactSizes::is_small`].
    pub(crate) const fn is_small(&self) -> bool {
        self.sizes.is_small()
    }

    const fn span(&self) -> Span {
        if self.is_small() { SPAN_SMALL } else { SPAN }
    }

    /// The constants of `shared/group.wgsl`.
    pub(crate) fn constants(&self) -> Contact {
        let margin = MARGIN * self.distance;
        // Most regions then touch two cells along each axis at most.
        let cell = self.group_side + 2.0 * margin + self.distance;
        Contact {
            group_count: self.sizes.groups,
            group_capacity: self.sizes.near,
            cell_mask: self.sizes.cells - 1,
            entries_capacity: self.sizes.entries,
            margin: margin as f32,
            horizon: (self.span().horizon * self.time_step) as f32,
            lead: (f64::from(self.interval) * self.time_step) as f32,
            cells_per_metre: cell.recip() as f32,
        }
    }

    /// A frame was good.
    pub(crate) fn frame_was_good(&mut self) {
        self.good_frames += 1;
        if self.good_frames >= PATIENCE[1] {
            self.patience = PATIENCE[0];
        }
        if self.good_frames >= self.patience && self.interval < self.span().interval_max {
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
        // An interval of one cannot fail: all groups are then in their regions whenever the list is used.
        self.interval = if attempts > 1 { 1 } else { (self.interval / 2).max(1) };
        self.changed = true;
    }

    /// Rows did not fit: decides on more room for them. `max` is the size of the largest buffer of this device
    /// \[byte\].
    ///
    /// # Errors
    /// `Overflow` if no buffer can hold them.
    pub(crate) fn grow(&mut self, status: &Status, max: u64) -> Result<()> {
        let overflow = |buffer, needed: u64, capacity: u64| {
            if needed > capacity {
                Err(Error::Overflow { buffer, needed, capacity })
            } else {
                Ok(())
            }
        };
        let needed = u64::from(status.contact_needed);
        if needed > u64::from(self.sizes.entries) {
            let possible = (max / 4).min(u64::from(u32::MAX));
            overflow("contact candidates", needed, possible)?;
            self.sizes.entries = (needed + needed / 2).min(possible) as u32;
        }
        let groups = u64::from(self.sizes.groups);
        let needed = u64::from(status.contact_group_needed);
        if needed > u64::from(self.sizes.near) {
            let possible = 4 * (max / 16 / groups).saturating_sub(2).min(u64::from(u32::MAX / 8));
            overflow("groups near each other", needed, possible)?;
            self.sizes.near = (needed + needed / 2).next_multiple_of(4).min(possible) as u32;
        }
        self.changed = true;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use cloth_core::{
        Cloth, ContactResponse, Geometry, GridPatch, MaterialPreset, ModelBuilder, SelfContact,
    };

    use super::*;

    fn policy() -> ContactPolicy {
        policy_of(4)
    }

    fn policy_of(side: u32) -> ContactPolicy {
        let response = ContactResponse::Penalty { stiffness: 1.0, damping: 0.0 };
        let contact = SelfContact { distance: 0.01, response };
        let cloth = Cloth {
            name: "cloth".into(),
            geometry: Geometry::Grid(GridPatch::horizontal(side, 0.02, 0.0)),
            material: MaterialPreset::ALL[0].material(0.02).into(),
            pins: vec![],
            velocity: [0.0; 3],
        };
        let model = ModelBuilder::new().cloth(cloth).self_contact(contact).build().unwrap();
        ContactPolicy::new(&model, &contact, 1e-3, &model.particle_groups(GROUP as usize))
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
    fn lists_are_made_for_longer_where_groups_are_few() {
        // 1024 groups of 32, and 1036.
        for (side, horizon, interval_max) in [(181, 48e-3, 32), (182, 20e-3, 8)] {
            let mut policy = policy_of(side);
            assert_eq!(policy.is_small(), side == 181);
            assert!((policy.constants().horizon - horizon).abs() < 1e-8);
            (0..100).for_each(|_| policy.frame_was_good());
            assert_eq!(policy.interval, interval_max);
        }
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
        assert!(frames_until(&mut policy, SPAN_SMALL.interval_max).is_some());
    }

    #[test]
    fn rows_that_no_buffer_can_hold_are_an_error() {
        let mut policy = policy();
        let entries = |contact_needed| Status { contact_needed, ..Status::default() };
        assert_eq!(policy.grow(&entries(2000), 1 << 20), Ok(()));
        assert_eq!(policy.sizes.entries, 3000);
        let expected =
            Error::Overflow { buffer: "contact candidates", needed: 4000, capacity: 1000 };
        assert_eq!(policy.grow(&entries(4000), 4000), Err(expected));
        let near = |contact_group_needed| Status { contact_group_needed, ..Status::default() };
        assert_eq!(policy.grow(&near(33), 1 << 20), Ok(()));
        assert_eq!(policy.sizes.near, 52);
        // A group has room for as many rows of sixteen bytes as fit, less two.
        let expected =
            Error::Overflow { buffer: "groups near each other", needed: 100, capacity: 92 };
        assert_eq!(policy.grow(&near(100), 25 * 16), Err(expected));
    }
}
