//! Contact of triangles where a device keeps the list of pairs: it tells whether the list is complete, finds the pairs that may touch
//! and those of which nothing proves that they do not meet, and applies forces and rows. What touches and what that does is
//! decided here, by the functions of all backends, and so is how far ways are shortened.

mod list;
mod moved;
mod search;
mod sent;
mod task;

pub use list::DeviceList;
pub use moved::{MOVED_NUMBERS, Moved};
pub use task::{
    EDGES, GROUP, MotionVector, NO_TRIANGLE, PAIR_WORDS, PAIRS_MAX, PairAnswer, PairDevice,
    PairLook, PairTask, TASK_MARKED, TASK_NEW, TRIANGLE_WORDS, WaysFrom, pairs_of, surface_words,
};

use rayon::prelude::*;

use crate::{
    ColliderImpulse, ContactStatistics, Model, NewtonStart, Pinch, Real, Result, State,
    schwarz::{ContactRow, ContactRows},
    stepper::{FramePlan, Substep},
};

use super::{
    BodyImpulses, BodyMotion, CertifiedWays, Certifier, ContactEquation, ContactLaw, ContactMotion,
    ContactSet, ContactStencil, ContactSurface, Ghost, UnprovenPair, certificate_distance,
};
use list::Look;
use search::DeviceSearch;
use sent::SentWays;

/// What the device says of the ways of a substep.
enum Proof<T> {
    /// All pairs are proven, or what is not finite is for others to say.
    Given,
    /// Some are not, those that it has found if it was asked.
    Missing(Option<Look<T>>),
}

/// Pairs that a thread of the host looks at, at least.
const TASK: usize = 256;

/// Contact of the triangles of a model on a device.
#[derive(Debug)]
pub struct DeviceContact<T> {
    surface: ContactSurface,
    /// The contacts, and what friction remembers.
    pub set: ContactSet<T>,
    certifier: Certifier<T>,
    /// The list.
    pub list: DeviceList<T>,
    /// The ways that certificates have given it.
    sent: SentWays<T>,
    /// Pairs that may touch at the present positions.
    near: Vec<UnprovenPair>,
    /// Whether the device has contacts.
    pub has_contacts: bool,
    /// What contacts were last found among, and where there were none.
    found: Vec<Option<ContactStencil<T>>>,
    truncated: u64,
    motion: HostMotion<T>,
    /// Where the nodes of bodies are, whose numbers come behind those of particles.
    bodies: BodyMotion<T>,
    /// Whether the nodes that the device has start where a certificate that goes on does. Nothing if it does not have them.
    nodes: Option<bool>,
    impulses: BodyImpulses,
    particles: usize,
    /// Whether certificates go on from an iterate, not from the start of the substep.
    goes_on: bool,
}

/// What contacts follow from, as it was last read.
#[derive(Debug)]
struct HostMotion<T> {
    position: Vec<[T; 4]>,
    velocity: Vec<[T; 4]>,
    start: Vec<[T; 4]>,
    /// Where a certificate goes on from.
    iterate: Vec<[T; 4]>,
    /// What a certificate works on.
    ways: HostWays<T>,
}

/// Ways of all particles and nodes of bodies.
#[derive(Debug)]
struct HostWays<T> {
    start: Vec<[T; 3]>,
    end: Vec<[T; 3]>,
    first: Vec<[T; 3]>,
}

impl<T: Real> HostMotion<T> {
    fn ends_read(&mut self, device: &mut impl PairDevice<T>) -> Result<()> {
        let Self { position, start, .. } = self;
        device.motion_read(&mut [(MotionVector::Position, position), (MotionVector::Start, start)])
    }
}

impl<T: Real> DeviceContact<T> {
    /// That of a model, if its triangles touch.
    #[must_use]
    pub fn new(model: &Model, pinch: Pinch) -> Option<Self> {
        let contact = *model.self_contact().filter(|contact| contact.is_of_triangles())?;
        let surface = ContactSurface::new(model, &contact);
        let (count, nodes) = (model.particle_count(), surface.node_count());
        Some(Self {
            list: DeviceList::new(&surface),
            set: ContactSet::with_nodes(count, nodes),
            certifier: Certifier::with_nodes(count, nodes)
                .with_ghosts(pinch == Pinch::Ghost)
                .with_stretch_limits(model)
                .with_planes(model, &surface),
            bodies: BodyMotion::of_bodies(surface.bodies().to_vec(), model),
            impulses: BodyImpulses::new(model),
            particles: count,
            goes_on: false,
            nodes: None,
            sent: SentWays::new(),
            near: Vec::new(),
            has_contacts: false,
            found: Vec::new(),
            truncated: 0,
            motion: HostMotion {
                position: Vec::new(),
                velocity: Vec::new(),
                start: Vec::new(),
                iterate: Vec::new(),
                ways: HostWays { start: Vec::new(), end: Vec::new(), first: Vec::new() },
            },
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
    pub fn state_given(&mut self, model: &Model, state: &State) {
        self.bodies.state_write(model, state);
        self.certifier.positions_given();
        self.certifier.ghosts_set(&state.ghosts);
        self.set.slips_write(&state.slips);
        self.near.clear();
    }

    /// A frame begins.
    pub fn frame_begin(&mut self, plan: &FramePlan) {
        self.bodies.frame_begin(plan);
    }

    /// `start_keep`.
    pub const fn start_keep(&mut self) {
        self.goes_on = false;
    }

    /// `iterate_keep`: the device has noted where particles are.
    pub const fn iterate_keep(&mut self) {
        self.goes_on = true;
    }

    /// `state_keep`.
    pub fn keep(&mut self) {
        self.certifier.keep();
        self.set.keep();
        self.bodies.keep();
        self.impulses.keep();
    }

    /// `state_restore`.
    pub fn restore(&mut self) {
        self.certifier.restore();
        self.set.restore();
        self.bodies.restore();
        self.impulses.restore();
    }

    /// `stitches_set`.
    pub fn stitches_set(&mut self, model: &Model) -> bool {
        self.surface.stitches_set(model)
    }

    /// What bodies have pinched.
    #[must_use]
    pub fn ghosts(&self) -> &[Ghost] {
        self.certifier.ghosts()
    }

    /// `ghosts_write`.
    pub fn ghosts_set(&mut self, ghosts: &[Ghost]) {
        self.certifier.ghosts_set(ghosts);
    }

    /// Adds what bodies did to cloth since the last call to the sums of their colliders.
    pub fn impulses_take(&mut self, out: &mut [ColliderImpulse]) {
        self.impulses.take(out);
    }

    /// Puts the nodes of bodies where they are in a substep, or in what is left of it where a certificate `goes_on`.
    fn bodies_put(
        &mut self,
        model: &Model,
        device: &mut impl PairDevice<T>,
        substep: &Substep,
        goes_on: bool,
    ) -> Result<()> {
        if self.bodies.is_empty() {
            return Ok(());
        }
        if self.bodies.substep_begin(model, substep.index) || self.sent.replaced_take() {
            self.nodes = None;
        }
        let has_start = self.nodes.is_some_and(|there| there == goes_on || !self.bodies.moves());
        if !has_start {
            let of = |nodes: &[[T; 3]]| -> Vec<_> {
                nodes.iter().map(|&[x, y, z]| [x, y, z, T::ZERO]).collect()
            };
            let end = self.nodes.is_none().then(|| of(self.bodies.end()));
            device.nodes_write(&of(self.bodies.way_start(goes_on)), end.as_deref())?;
            self.nodes = Some(goes_on);
        }
        Ok(())
    }

    /// What the contacts add to the matrix.
    #[must_use]
    pub fn rows(&self) -> ContactRows<T> {
        let (offsets, places) = self.set.rows();
        let states = self.set.states().iter().enumerate();
        let contacts = states.map(|(contact, state)| {
            // Speeds of bodies belong to the right-hand side.
            let ContactEquation { particles, weights, .. } =
                self.set.equation(contact, &self.bodies, T::ONE);
            ContactRow { particles, weights, rows: state.action.rows }
        });
        ContactRows { contacts: contacts.collect(), offsets: offsets.into(), places: places.into() }
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
    pub fn pairs(
        &mut self,
        model: &Model,
        device: &mut impl PairDevice<T>,
        substep: &Substep,
    ) -> Result<()> {
        self.bodies_put(model, device, substep, false)?;
        let Self { list, bodies, .. } = self;
        let length = T::from_f64(substep.length);
        // Contacts are asked for with bodies at the start and at the end: particles are where they are in both.
        let moves = bodies.moves();
        list.task.length = if moves { T::ZERO } else { length };
        self.near.clear();
        let distance = list.task.distance;
        let mut look = list.look(device, PairLook::Near, WaysFrom::Velocities)?;
        if !look.is_finite() {
            // Whoever looks for divergence says so.
            return Ok(());
        }
        let holds = match moves {
            true => list.holds_for(&look, distance),
            false => list.holds_at_start(&look, distance),
        };
        if !holds {
            if moves {
                list.task.length = length;
                list.look(device, PairLook::Moved, WaysFrom::Velocities)?;
            }
            list.build(device)?;
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
        let length = law.length();
        if self.near.is_empty() && !self.surface.has_planes() {
            self.set.clear();
            return self.contacts_write(device, length, newton);
        }
        let Self { surface, set, motion, near, bodies, particles, certifier, found, .. } = self;
        device.motion_read(&mut [
            (MotionVector::Position, &mut motion.position),
            (MotionVector::Velocity, &mut motion.velocity),
            (MotionVector::Start, &mut motion.start),
        ])?;
        let (bodies, particles) = (&*bodies, *particles as u32);
        let nodes = match newton {
            NewtonStart::StepStart => bodies.start(),
            NewtonStart::Iterate => bodies.end(),
        };
        let of = |i: u32, all: &[[T; 4]], nodes: &[[T; 3]]| match i.checked_sub(particles) {
            Some(node) => nodes[node as usize],
            None => vector(&all[i as usize]),
        };
        let position = |i: u32| of(i, &motion.position, nodes);
        let start = |i: u32| of(i, &motion.start, bodies.start());
        let all = near.par_iter().with_min_len(TASK);
        let all = all.map(|pair| surface.contact(pair.candidate, position));
        all.collect_into_vec(found);
        surface.plane_contacts(position, start, found);
        certifier.acting_keep(found);
        let motion = ContactMotion {
            position,
            velocity: |i: u32| match i < particles {
                true => vector(&motion.velocity[i as usize]),
                false => bodies.velocity(i, length),
            },
            start,
            inverse_mass: |i: u32| motion.position.get(i as usize).map_or(T::ZERO, |x| x[3]),
        };
        set.find(&law, found, &motion, newton);
        self.contacts_write(device, length, newton)
    }

    fn contacts_write(
        &mut self,
        device: &mut impl PairDevice<T>,
        length: T,
        newton: NewtonStart,
    ) -> Result<()> {
        if self.touches() || self.has_contacts {
            self.has_contacts = self.touches();
            let Self { set, bodies, .. } = self;
            device.contacts_write(set, |contact| set.equation(contact, bodies, length), newton)?;
        }
        Ok(())
    }

    /// `contact_certify`: shortens the ways of particles that are free, where the device has no proof.
    ///
    /// # Errors
    /// Those of the device, and of [`Certifier::certify`].
    pub fn certify(
        &mut self,
        model: &Model,
        device: &mut impl PairDevice<T>,
        substep: &Substep,
        held: &[bool],
    ) -> Result<()> {
        self.bodies_put(model, device, substep, self.goes_on)?;
        let mut proof = self.proof(device)?;
        let limits_stretch = self.certifier.limits_stretch();
        if !matches!(proof, Proof::Given) || self.touches() || limits_stretch {
            self.motion.ends_read(device)?;
        }
        if matches!(proof, Proof::Given) && limits_stretch {
            let Self { certifier, motion, .. } = self;
            let [start, end] = [&motion.start, &motion.position];
            let at = |all: &[[T; 4]], i: u32| vector(&all[i as usize]);
            if certifier.overstretches(|i| at(start, i), |i| at(end, i)) {
                proof = Proof::Missing(None);
            }
        }
        if let Proof::Missing(first) = proof {
            let length = T::from_f64(substep.length);
            let shortened = self.shorten(device, (first, length), held, true);
            self.truncated += shortened.map_err(|error| self.bodies.error_name(model, error))?;
        }
        let Self { set, motion, bodies, impulses, particles, .. } = self;
        let particles = *particles as u32;
        let of = |i: u32, all: &[[T; 4]], nodes: &[[T; 3]]| match i.checked_sub(particles) {
            Some(node) => nodes[node as usize],
            None => vector(&all[i as usize]),
        };
        let position = |i| of(i, &motion.position, bodies.end());
        set.settle(position, |i| of(i, &motion.start, bodies.start()));
        // Rounded as the processor has it.
        let length = T::from_f64(substep.length).to_f64();
        set.body_impulses((bodies, impulses), position, length);
        bodies.substep_end();
        Ok(())
    }

    /// `contact_certify` of an iterate. Returns how many particles have changed.
    ///
    /// # Errors
    /// As [`Self::certify`].
    pub fn certify_iterate(
        &mut self,
        model: &Model,
        device: &mut impl PairDevice<T>,
        substep: &Substep,
        held: &[bool],
    ) -> Result<u64> {
        self.bodies_put(model, device, substep, self.goes_on)?;
        let Proof::Missing(first) = self.proof(device)? else { return Ok(0) };
        self.motion.ends_read(device)?;
        let length = T::from_f64(substep.length);
        let shortened = self.shorten(device, (first, length), held, false);
        shortened.map_err(|error| self.bodies.error_name(model, error))
    }

    /// Whether the device proves all pairs, and nothing else is to be looked at. What is not finite is left to whoever looks for
    /// divergence.
    fn proof(&mut self, device: &mut impl PairDevice<T>) -> Result<Proof<T>> {
        if self.certifier.must_look() {
            return Ok(Proof::Missing(None));
        }
        let list = &mut self.list;
        let mut from = if self.goes_on { WaysFrom::Iterate } else { WaysFrom::Substep };
        list.task.flags = 0;
        list.task.delta = list.task.delta.maximum(certificate_distance(T::ZERO));
        loop {
            let look = list.look(device, PairLook::Unproven, from)?;
            from = WaysFrom::Device;
            if !look.is_finite() {
                return Ok(Proof::Given);
            }
            let largest = look.moved[0].largest().maximum(look.moved[1].largest());
            let delta = certificate_distance(largest);
            if delta > list.task.delta {
                // A little more, as they go on.
                list.task.delta = certificate_distance(T::from_f64(1.1) * largest);
                continue;
            }
            if list.holds_for(&look, list.task.delta + list.task.delta) {
                let is_given = look.found.is_empty();
                return Ok(if is_given { Proof::Given } else { Proof::Missing(Some(look)) });
            }
            list.build(device)?;
        }
    }

    /// Shortens ways, on the host, with the pairs that the device finds or has found in a `first` look, at the end of a substep, which bodies feel,
    /// or for an iterate. Returns how many.
    fn shorten(
        &mut self,
        device: &mut impl PairDevice<T>,
        (first, length): (Option<Look<T>>, T),
        held: &[bool],
        is_end: bool,
    ) -> Result<u64> {
        let Self { motion, list, certifier, bodies, impulses, sent, .. } = self;
        if self.goes_on {
            device.motion_read(&mut [(MotionVector::Iterate, &mut motion.iterate)])?;
        }
        let HostMotion { position, velocity, start, iterate, ways } = motion;
        let from = if self.goes_on { &*iterate } else { &*start };
        let put = |all: &mut Vec<[T; 3]>, own: &[[T; 4]], nodes: &[[T; 3]]| {
            all.clear();
            all.extend(own.iter().map(vector));
            all.extend_from_slice(nodes);
        };
        put(&mut ways.start, from, bodies.way_start(self.goes_on));
        put(&mut ways.end, position, bodies.end());
        if is_end {
            put(&mut ways.first, start, bodies.start());
        }
        sent.forget();
        let mut search = DeviceSearch { device: &mut *device, list, first, sent, lacks: false };
        let is_held = |i: u32| held.get(i as usize).is_none_or(|held| *held);
        let HostWays { start, end, first } = ways;
        let certified = CertifiedWays { start, end, first: is_end.then_some(&**first) };
        let changed = certifier.certify_with(&mut search, certified, is_held, &*bodies)?;
        if changed == 0 {
            return Ok(0);
        }
        device.motion_read(&mut [(MotionVector::Velocity, velocity)])?;
        let moved = position.iter_mut().zip(velocity.iter_mut()).zip(&*end).enumerate();
        for (i, ((wanted, velocity), end)) in moved.filter(|(i, _)| !held[*i]) {
            if vector(wanted) == *end {
                continue;
            }
            let change: [T; 3] = std::array::from_fn(|k| (end[k] - wanted[k]) / length);
            for (velocity, change) in velocity.iter_mut().zip(change) {
                *velocity += change;
            }
            wanted[..3].copy_from_slice(end);
            let body = certifier.body_at(i).filter(|_| is_end);
            if let Some(collider) = body.and_then(|node| bodies.collider_of(node)) {
                let linear = change.map(|change| (velocity[3] * change).to_f64());
                impulses.add(collider, end.map(T::to_f64), linear);
            }
        }
        device.motion_write(position, velocity)?;
        Ok(changed)
    }

    /// Counts since the last call.
    pub fn statistics_take(&mut self) -> ContactStatistics {
        ContactStatistics {
            contacts: self.set.stencils().len() as u64,
            candidates: u64::from(self.list.task.pair_count),
            exempt: self.certifier.exempt().len() as u64,
            ghosts: self.certifier.ghosts().len() as u64,
            truncated: std::mem::take(&mut self.truncated),
            rebuilds: std::mem::take(&mut self.list.rebuilds),
        }
    }
}

/// The part of a position or velocity that is one.
const fn vector<T: Copy>(&[x, y, z, _]: &[T; 4]) -> [T; 3] {
    [x, y, z]
}
