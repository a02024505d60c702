//! Contact of triangles where a device keeps the list of pairs: it tells whether the list is complete, finds the pairs that may touch
//! and those of which nothing proves that they do not meet, and applies forces and rows. What touches and what that does is
//! decided here, by the functions of all backends, and so is how far ways are shortened.

mod list;
mod moved;
mod search;
mod task;

pub use list::DeviceList;
pub use moved::{MOVED_NUMBERS, Moved};
pub use task::{
    EDGES, GROUP, NO_TRIANGLE, PAIR_WORDS, PAIRS_MAX, PairAnswer, PairDevice, PairLook, PairTask,
    TASK_MARKED, TASK_NEW, TRIANGLE_WORDS, WaysFrom, pairs_of, surface_words,
};

use crate::{ContactStatistics, Model, NewtonStart, Real, Result, stepper::Substep};

use super::{
    Certifier, ContactLaw, ContactMotion, ContactSet, ContactSurface, UnprovenPair,
    certificate_distance,
};
use search::DeviceSearch;

/// Contact of the triangles of a model on a device.
#[derive(Debug)]
pub struct DeviceContact<T> {
    surface: ContactSurface,
    /// The contacts, and what friction remembers.
    pub set: ContactSet<T>,
    certifier: Certifier<T>,
    /// The list.
    pub list: DeviceList<T>,
    /// Pairs that may touch at the present positions.
    near: Vec<UnprovenPair>,
    /// Whether the device has contacts.
    pub has_contacts: bool,
    truncated: u64,
    motion: HostMotion<T>,
}

/// What contacts follow from, as it was last read.
#[derive(Debug)]
struct HostMotion<T> {
    position: Vec<[T; 4]>,
    velocity: Vec<[T; 4]>,
    start: Vec<[T; 4]>,
}

impl<T: Real> DeviceContact<T> {
    /// That of a model, if its triangles touch.
    #[must_use]
    pub fn new(model: &Model) -> Option<Self> {
        let contact = *model.self_contact().filter(|contact| contact.is_of_triangles())?;
        let surface = ContactSurface::new(model, &contact);
        let count = model.particle_count();
        Some(Self {
            list: DeviceList::new(model, &contact, &surface),
            set: ContactSet::new(count),
            certifier: Certifier::new(count),
            near: Vec::new(),
            has_contacts: false,
            truncated: 0,
            motion: HostMotion { position: Vec::new(), velocity: Vec::new(), start: Vec::new() },
            surface,
        })
    }

    /// The surface as kernels read it.
    #[must_use]
    pub fn surface_words(&self) -> Vec<u32> {
        surface_words(&self.surface, self.list.task.group_count)
    }

    /// Boxes around the triangles and the nodes of the tree.
    #[must_use]
    pub const fn box_count(&self) -> usize {
        (GROUP + 2) * self.list.task.group_count as usize
    }

    /// A state has been given from outside.
    pub fn state_given(&mut self, slips: &[super::ContactSlip]) {
        self.certifier.positions_given();
        self.set.slips_write(slips);
        self.near.clear();
    }

    /// Whether the last [`Self::geometry`] has found contacts.
    #[must_use]
    pub fn touches(&self) -> bool {
        !self.set.stencils().is_empty()
    }

    /// `contact_pairs`: completes the list for contacts at the present positions, and finds the pairs that may touch.
    ///
    /// # Errors
    /// Those of the device.
    pub fn pairs(&mut self, device: &mut impl PairDevice<T>, substep: &Substep) -> Result<()> {
        let list = &mut self.list;
        list.task.length = T::from_f64(substep.length);
        self.near.clear();
        let distance = list.task.distance;
        let mut look = list.look(device, PairLook::Near, WaysFrom::Velocities)?;
        if !look.is_finite() {
            // Whoever looks for divergence says so.
            return Ok(());
        }
        if !list.holds_at_start(&look, distance) {
            list.build(device, true)?;
            look = list.look(device, PairLook::Near, WaysFrom::Device)?;
        }
        self.near = look.found;
        Ok(())
    }

    /// `contact_geometry`, after `contact_pairs` of the same positions: contacts and what they do.
    ///
    /// # Errors
    /// Those of the device.
    pub fn geometry(
        &mut self,
        device: &mut impl PairDevice<T>,
        law: ContactLaw<T>,
        newton: NewtonStart,
    ) -> Result<()> {
        if self.near.is_empty() {
            self.set.stencils_set(law, Vec::new());
            self.set.states_set(Vec::new());
            return self.contacts_write(device, newton);
        }
        let Self { surface, set, motion, near, .. } = self;
        device.ends_read(&mut motion.position, &mut motion.start)?;
        device.velocities_read(&mut motion.velocity)?;
        let position = |i: u32| vector(&motion.position[i as usize]);
        let found = near.iter().filter_map(|pair| surface.contact(pair.candidate, position));
        set.stencils_set(law, found.collect());
        let motion = ContactMotion {
            position,
            velocity: |i: u32| vector(&motion.velocity[i as usize]),
            start: |i: u32| vector(&motion.start[i as usize]),
            inverse_mass: |i: u32| motion.position[i as usize][3],
        };
        let all = 0..set.stencils().len();
        let states = all.filter_map(|contact| set.state(contact, &motion, newton)).collect();
        set.states_set(states);
        self.contacts_write(device, newton)
    }

    fn contacts_write(
        &mut self,
        device: &mut impl PairDevice<T>,
        newton: NewtonStart,
    ) -> Result<()> {
        if self.touches() || self.has_contacts {
            self.has_contacts = self.touches();
            device.contacts_write(&self.set, newton)?;
        }
        Ok(())
    }

    /// `contact_certify`: shortens the ways of particles that are free, where the device has no proof.
    ///
    /// # Errors
    /// Those of the device, and of [`Certifier::certify`].
    pub fn certify(
        &mut self,
        device: &mut impl PairDevice<T>,
        substep: &Substep,
        held: &[bool],
    ) -> Result<()> {
        let is_proven = self.is_proven(device)?;
        if !is_proven || self.touches() {
            device.ends_read(&mut self.motion.position, &mut self.motion.start)?;
        }
        if !is_proven {
            self.truncated += self.shorten(device, T::from_f64(substep.length), held)?;
        }
        let [position, start] = [&self.motion.position, &self.motion.start];
        self.set.settle(|i| vector(&position[i as usize]), |i| vector(&start[i as usize]));
        Ok(())
    }

    /// `contact_certify` of an iterate. Returns how many particles have changed.
    ///
    /// # Errors
    /// As [`Self::certify`].
    pub fn certify_iterate(
        &mut self,
        device: &mut impl PairDevice<T>,
        substep: &Substep,
        held: &[bool],
    ) -> Result<u64> {
        if self.is_proven(device)? {
            return Ok(0);
        }
        device.ends_read(&mut self.motion.position, &mut self.motion.start)?;
        self.shorten(device, T::from_f64(substep.length), held)
    }

    /// Whether the device proves all pairs, and nothing else is to be looked at. What is not finite is left to whoever looks for
    /// divergence.
    fn is_proven(&mut self, device: &mut impl PairDevice<T>) -> Result<bool> {
        if self.certifier.must_look() {
            return Ok(false);
        }
        let list = &mut self.list;
        let mut from = WaysFrom::Substep;
        list.task.flags = 0;
        list.task.delta = list.task.delta.maximum(certificate_distance(T::ZERO));
        loop {
            let look = list.look(device, PairLook::Unproven, from)?;
            from = WaysFrom::Device;
            if !look.is_finite() {
                return Ok(true);
            }
            let largest = look.moved[0].largest().maximum(look.moved[1].largest());
            let delta = certificate_distance(largest);
            if delta > list.task.delta {
                // A little more, as they go on.
                list.task.delta = certificate_distance(T::from_f64(1.1) * largest);
                continue;
            }
            if list.holds_for(&look, list.task.delta + list.task.delta) {
                return Ok(look.found.is_empty());
            }
            list.build(device, true)?;
        }
    }

    /// Shortens ways, on the host, with the pairs that the device finds. Returns how many.
    fn shorten(
        &mut self,
        device: &mut impl PairDevice<T>,
        length: T,
        held: &[bool],
    ) -> Result<u64> {
        let Self { motion, list, certifier, .. } = self;
        let start: Vec<_> = motion.start.iter().map(vector).collect();
        let mut end: Vec<_> = motion.position.iter().map(vector).collect();
        let mut search = DeviceSearch { device: &mut *device, list };
        let changed =
            certifier.certify(&mut search, &start, &mut end, |i: u32| held[i as usize])?;
        if changed == 0 {
            return Ok(0);
        }
        device.velocities_read(&mut motion.velocity)?;
        let moved = motion.position.iter_mut().zip(&mut motion.velocity).zip(&end).zip(held);
        for (((wanted, velocity), end), _) in moved.filter(|(_, held)| !**held) {
            if vector(wanted) != *end {
                for (k, &end) in end.iter().enumerate() {
                    velocity[k] += (end - wanted[k]) / length;
                    wanted[k] = end;
                }
            }
        }
        device.motion_write(&motion.position, &motion.velocity)?;
        Ok(changed)
    }

    /// Counts since the last call.
    pub fn statistics_take(&mut self) -> ContactStatistics {
        ContactStatistics {
            contacts: self.set.stencils().len() as u64,
            candidates: u64::from(self.list.task.pair_count),
            exempt: self.certifier.exempt().len() as u64,
            truncated: std::mem::take(&mut self.truncated),
            rebuilds: std::mem::take(&mut self.list.rebuilds),
        }
    }
}

/// The part of a position or velocity that is one.
const fn vector<T: Copy>(&[x, y, z, _]: &[T; 4]) -> [T; 3] {
    [x, y, z]
}
