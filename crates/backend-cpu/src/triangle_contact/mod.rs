//! NUMERICS §15: contact between triangles, forces and proof.
//!
//! [`groups`] are triangles that lie close together, with what belongs to them side by side ([`packet`]) and a [`tree`] of boxes around them;
//! [`pairs`] is the list of pairs of features that may touch or meet, which [`search`] finds, with the proof that
//! it is complete, [`proofs`] the certificate of many of them at once. What a contact is and does, and how ways are certified, is in `cloth_core::contact`.

mod batch;
mod bounds;
mod groups;
mod near;
mod packet;
mod pairs;
mod proofs;
mod search;
mod tree;

use self::{
    bounds::Ends,
    groups::Groups,
    pairs::{ListSearch, PairList, ways_read},
};
use crate::memory::{FieldView, Masses, Motion, VectorField};
use cloth_core::{
    ColliderImpulse, ContactStatistics, Error, ImplicitSettings, Integrator, LinearSettings,
    MatrixForm, Model, NewtonStart, Pinch, Preconditioner, Real, Result, SolverConfig, State,
    contact::{
        BodyImpulses, BodyMotion, Candidate, CertifiedWays, Certifier, ContactLaw, ContactMotion,
        ContactSet, ContactSlip, ContactSurface, Contacts, Ghost,
    },
    stepper::FramePlan,
};

/// Refuses settings for which contact of triangles has no matrix of the form that they need.
pub(crate) fn check(model: &Model, config: &SolverConfig) -> Result<()> {
    let Integrator::Implicit(ImplicitSettings { linear, .. }) = &config.integrator else {
        return Ok(());
    };
    if !model.has_triangle_contact() {
        return Ok(());
    }
    let unsupported = |what: String| {
        let feature = format!("contact of triangles with {what}");
        Err(Error::Unsupported { backend: "cpu", feature })
    };
    let LinearSettings { preconditioner, matrix, .. } = linear;
    if *preconditioner == Preconditioner::IncompleteCholesky {
        return unsupported(format!("the preconditioner {preconditioner} (it has block)"));
    }
    if *matrix == MatrixForm::Assembled {
        return unsupported(format!("the matrix form {matrix} (it has matrix-free)"));
    }
    Ok(())
}

/// Contact of the triangles of a model.
#[derive(Debug)]
pub(crate) struct TriangleContact<T> {
    surface: ContactSurface,
    /// Those of cloths and of bodies.
    groups: [Groups<T>; 2],
    list: PairList<T>,
    marked_list: PairList<T>,
    set: ContactSet<T>,
    certifier: Certifier<T>,
    bodies: BodyMotion<T>,
    impulses: BodyImpulses,
    /// Present positions of particles, and of nodes of bodies behind them \[m\].
    position: Vec<[T; 3]>,
    /// Another set of positions: those at the start of a substep, or where particles will be.
    other: Vec<[T; 3]>,
    /// Those at the start of a substep, where a certificate goes on from an iterate.
    first: Vec<[T; 3]>,
    /// The ways of a search, vertex by vertex.
    ends: Vec<Ends<T>>,
    newton: NewtonStart,
    statistics: ContactStatistics,
    arch: pulp::Arch,
}

/// Where a substep starts, and the iterate that a certificate goes on from, if there is one.
type Starts<'a, T> = (&'a VectorField<T>, Option<&'a VectorField<T>>);

impl<T: Real> TriangleContact<T> {
    /// That of a model, if its triangles touch.
    pub(crate) fn new(model: &Model, pinch: Pinch, arch: pulp::Arch) -> Option<Self> {
        let contact = *model.self_contact().filter(|contact| contact.is_of_triangles())?;
        let surface = ContactSurface::new(model, &contact);
        let (count, nodes) = (model.particle_count(), surface.node_count());
        Some(Self {
            groups: [Groups::of_cloths(&surface), Groups::of_bodies(&surface)],
            list: PairList::new(surface.reach()),
            marked_list: PairList::new(surface.reach()),
            set: ContactSet::with_nodes(count, nodes),
            certifier: Certifier::with_nodes(count, nodes)
                .with_ghosts(pinch == Pinch::Ghost)
                .with_stretch_limits(model)
                .with_planes(model, &surface),
            bodies: BodyMotion::of_bodies(surface.bodies().to_vec(), model),
            impulses: BodyImpulses::new(model),
            position: Vec::new(),
            other: Vec::new(),
            first: Vec::new(),
            ends: Vec::new(),
            newton: NewtonStart::StepStart,
            statistics: ContactStatistics::default(),
            surface,
            arch,
        })
    }

    /// `contact_pairs`: completes the list for contacts at these positions, and in what is likely to follow.
    pub(crate) fn pairs(
        &mut self,
        model: &Model,
        motion: &Motion<T>,
        (index, length): (usize, T),
    ) -> Result<()> {
        self.bodies.substep_begin(model, index);
        let reach = T::from_f64(self.surface.reach());
        read(&motion.position, self.bodies.end(), &mut self.position);
        let holds_at_end = !self.bodies.moves() || self.list.holds(&self.position, reach);
        read(&motion.position, self.bodies.start(), &mut self.position);
        if !(holds_at_end && self.list.holds(&self.position, reach)) {
            read(&motion.velocity, self.bodies.end(), &mut self.other);
            let particles = motion.position.count();
            for (other, x) in self.other[..particles].iter_mut().zip(&self.position) {
                *other = std::array::from_fn(|k| x[k] + length * other[k]);
            }
            let sets = [&*self.position, &*self.other];
            ways_read(sets, &mut self.ends);
            let sets = (sets, &*self.ends);
            self.list.build((&self.surface, &mut self.groups), sets, None, self.arch)?;
        }
        Ok(())
    }

    /// `contact_geometry`, after `pairs` of the same positions: contacts and what they do.
    pub(crate) fn geometry(
        &mut self,
        (motion, start): (&Motion<T>, &VectorField<T>),
        (inverse_mass, length): (&[T], f64),
        (model, config): (&Model, &SolverConfig),
        newton: NewtonStart,
    ) {
        self.newton = newton;
        let bodies = &self.bodies;
        let (now, particles) = match newton {
            NewtonStart::StepStart => (bodies.start(), motion.position.count()),
            NewtonStart::Iterate => (bodies.end(), motion.position.count()),
        };
        self.position[particles..].copy_from_slice(now);
        let law = ContactLaw::of(model, config, length);
        let (velocity, start) = (FieldView::new(&motion.velocity), FieldView::new(start));
        let (position, step) = (&self.position, T::from_f64(length));
        let is_particle = |i: u32| (i as usize) < particles;
        let start = |i: u32| match is_particle(i) {
            true => start.get(i as usize),
            false => bodies.start()[i as usize - particles],
        };
        let mut found = self.list.contacts(&self.surface, position, self.arch);
        self.surface.plane_contacts(|i: u32| position[i as usize], start, &mut found);
        self.certifier.acting_keep(&mut found);
        let motion = ContactMotion {
            position: |i: u32| position[i as usize],
            velocity: |i: u32| match is_particle(i) {
                true => velocity.get(i as usize),
                false => bodies.velocity(i, step),
            },
            start,
            inverse_mass: |i: u32| if is_particle(i) { inverse_mass[i as usize] } else { T::ZERO },
        };
        self.set.find(&law, &found, &motion, newton);
        self.statistics.contacts = self.set.stencils().len() as u64;
    }

    /// Whether anything touches.
    pub(crate) fn any(&self) -> bool {
        !self.set.stencils().is_empty()
    }

    /// The force on a particle \[N\], if it touches anything.
    #[inline(always)]
    pub(crate) fn force(&self, particle: usize) -> Option<[T; 3]> {
        self.set.touches(particle).then(|| self.set.force_on(particle))
    }

    /// The contacts, where bodies go, and what the present system is linearised about.
    pub(crate) const fn set(&self) -> (&ContactSet<T>, &BodyMotion<T>, NewtonStart) {
        (&self.set, &self.bodies, self.newton)
    }

    /// `contact_certify`: shortens the ways from `start` of particles that are free, and ends the substep.
    pub(crate) fn certify(
        &mut self,
        model: &Model,
        (motion, starts): (&mut Motion<T>, Starts<'_, T>),
        masses: &Masses<T>,
        (index, length): (usize, T),
    ) -> Result<()> {
        let step = (index, length);
        let changed = self.ways_shorten(model, (motion, starts), masses, step, true)?;
        self.statistics.truncated += changed;
        let Self { position, other, set, bodies, impulses, .. } = self;
        read(starts.0, bodies.start(), other);
        set.settle(|i| position[i as usize], |i| other[i as usize]);
        set.body_impulses((bodies, impulses), |i| position[i as usize], length.to_f64());
        bodies.substep_end();
        Ok(())
    }

    /// `contact_certify` of an iterate, or of the end of a substep, which bodies feel. Returns how many particles have changed.
    pub(crate) fn ways_shorten(
        &mut self,
        model: &Model,
        (motion, (start, proven)): (&mut Motion<T>, Starts<'_, T>),
        masses: &Masses<T>,
        (index, length): (usize, T),
        is_end: bool,
    ) -> Result<u64> {
        let Self { surface, groups, list, marked_list, .. } = self;
        let Self { position, other, first, ends, certifier, arch, .. } = self;
        let (bodies, impulses) = (&mut self.bodies, &mut self.impulses);
        bodies.substep_begin(model, index);
        read(proven.unwrap_or(start), bodies.way_start(proven.is_some()), other);
        read(&motion.position, bodies.end(), position);
        let mut search = ListSearch { surface, groups, list, marked_list, ends, arch: *arch };
        let particles = start.count();
        let is_held = |i: u32| i as usize >= particles || masses.is_held(i as usize);
        if is_end && proven.is_some() {
            read(start, bodies.start(), first);
        }
        let first = if proven.is_some() { &*first } else { &*other };
        let ways = CertifiedWays { start: other, end: position, first: is_end.then_some(first) };
        let changed = certifier.certify_with(&mut search, ways, is_held, bodies);
        let changed = changed.map_err(|error| bodies.error_name(model, error))?;
        if changed > 0 {
            for (i, end) in position[..particles].iter().enumerate() {
                let wanted = motion.position.get(i);
                if *end != wanted && !masses.is_held(i) {
                    let v = motion.velocity.get(i);
                    let change: [T; 3] = std::array::from_fn(|k| (end[k] - wanted[k]) / length);
                    motion.velocity.set(i, std::array::from_fn(|k| v[k] + change[k]));
                    motion.position.set(i, *end);
                    let body = certifier.body_at(i).filter(|_| is_end);
                    if let Some(collider) = body.and_then(|node| bodies.collider_of(node)) {
                        let mass = masses.mass[i];
                        let linear = change.map(|change| (mass * change).to_f64());
                        impulses.add(collider, end.map(T::to_f64), linear);
                    }
                }
            }
        }
        Ok(changed)
    }

    /// A frame begins.
    pub(crate) fn frame_begin(&mut self, plan: &FramePlan) {
        self.bodies.frame_begin(plan);
    }

    /// Adds what bodies did to cloth since the last call to the sums of their colliders.
    pub(crate) fn impulses_take(&mut self, out: &mut [ColliderImpulse]) {
        self.impulses.take(out);
    }

    /// A state has been given from outside.
    pub(crate) fn state_write(&mut self, model: &Model, state: &State) {
        self.bodies.state_write(model, state);
        self.certifier.positions_given();
        self.certifier.ghosts_set(&state.ghosts);
        self.set.slips_write(&state.slips);
    }

    /// How far contacts have slipped.
    pub(crate) fn slips_read(&self, out: &mut Vec<ContactSlip>) {
        self.set.slips_read(out);
    }

    /// `stitches_set`.
    pub(crate) fn stitches_set(&mut self, model: &Model) -> bool {
        self.surface.stitches_set(model)
    }

    /// What bodies have pinched.
    pub(crate) fn ghosts(&self) -> &[Ghost] {
        self.certifier.ghosts()
    }

    /// `ghosts_write`.
    pub(crate) fn ghosts_set(&mut self, ghosts: &[Ghost]) {
        self.certifier.ghosts_set(ghosts);
    }

    /// `state_keep`.
    pub(crate) fn keep(&mut self) {
        self.certifier.keep();
        self.set.keep();
        self.bodies.keep();
        self.impulses.keep();
    }

    /// `state_restore`.
    pub(crate) fn restore(&mut self) {
        self.certifier.restore();
        self.set.restore();
        self.bodies.restore();
        self.impulses.restore();
    }

    pub(crate) fn contacts_read(&self, out: &mut Contacts) {
        self.set.read(out);
    }

    /// The pairs of the list, ascending.
    pub(crate) fn list_read(&self, out: &mut Vec<Candidate>) {
        out.extend(self.list.pairs().map(|pair| pair.candidate));
        out.sort_unstable();
    }

    /// Counts since the last call.
    pub(crate) fn statistics(&mut self) -> ContactStatistics {
        ContactStatistics {
            candidates: self.list.len(),
            rebuilds: std::mem::take(&mut self.list.rebuilds),
            truncated: std::mem::take(&mut self.statistics.truncated),
            exempt: self.certifier.exempt().len() as u64,
            ghosts: self.certifier.ghosts().len() as u64,
            ..self.statistics
        }
    }
}

/// Vectors of particles one by one, and those of nodes of bodies behind them.
fn read<T: Real>(field: &VectorField<T>, bodies: &[[T; 3]], out: &mut Vec<[T; 3]>) {
    let view = FieldView::new(field);
    out.clear();
    out.extend((0..field.count()).map(|i| view.get(i)));
    out.extend_from_slice(bodies);
}
