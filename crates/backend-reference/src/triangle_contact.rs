//! NUMERICS §15: contact of triangles, by all pairs of features.

use cloth_core::{
    Model, NewtonStart, Pinch, Result, SolverConfig,
    contact::{
        BodyImpulses, BodyMotion, CertifiedWays, Certifier, ContactLaw, ContactMotion, ContactSet,
        ContactSurface, PairSearch, UnprovenPair, Ways,
    },
    stepper::Substep,
};

use crate::{ElementBlock, Elements, Matrix, Particles, Vector};

/// Contact of the triangles of a model.
pub(crate) struct TriangleContact {
    pub(crate) surface: ContactSurface,
    /// Number of all pairs of features that share no particle, too many to keep.
    candidates: u64,
    pub(crate) set: ContactSet<f64>,
    pub(crate) certifier: Certifier<f64>,
    pub(crate) bodies: BodyMotion<f64>,
    pub(crate) impulses: BodyImpulses,
    pub(crate) truncated: u64,
    newton: NewtonStart,
}

/// Where a substep starts, and the iterate that a certificate goes on from, if there is one.
type Starts<'a> = (&'a [Vector<f64>], Option<&'a [Vector<f64>]>);

/// Looks at all pairs.
struct AllPairs<'a>(&'a ContactSurface);

impl PairSearch<f64> for AllPairs<'_> {
    fn unproven(
        &mut self,
        ways: &Ways<'_, f64>,
        marked: Option<&[bool]>,
        out: &mut Vec<UnprovenPair>,
    ) -> Result<()> {
        out.extend(self.0.candidates().filter_map(|candidate| {
            let particles = self.0.particles(candidate);
            let is_marked =
                marked.is_none_or(|marked| particles.iter().any(|&i| marked[i as usize]));
            let pair = UnprovenPair { candidate, particles };
            let asked = (ways.delta, ways.is_new);
            (is_marked && pair.is_unproven(ways.start, ways.end, asked)).then_some(pair)
        }));
        Ok(())
    }
}

impl TriangleContact {
    pub(crate) fn new(model: &Model, pinch: Pinch) -> Option<Self> {
        let contact = *model.self_contact().filter(|contact| contact.is_of_triangles())?;
        let surface = ContactSurface::new(model, &contact);
        let (count, nodes) = (model.particle_count(), surface.node_count());
        Some(Self {
            candidates: surface.candidates().count() as u64,
            set: ContactSet::with_nodes(count, nodes),
            certifier: Certifier::with_nodes(count, nodes)
                .with_ghosts(pinch == Pinch::Ghost)
                .with_stretch_limits(model)
                .with_planes(model, &surface),
            bodies: BodyMotion::of_bodies(surface.bodies().to_vec(), model),
            impulses: BodyImpulses::new(model),
            truncated: 0,
            newton: NewtonStart::StepStart,
            surface,
        })
    }

    pub(crate) const fn candidate_count(&self) -> u64 {
        self.candidates
    }

    /// `contact_geometry`.
    pub(crate) fn geometry(
        &mut self,
        model: &Model,
        (particles, start): (&Particles<f64>, &[Vector<f64>]),
        (config, substep): (&SolverConfig, &Substep),
        newton: NewtonStart,
    ) {
        self.newton = newton;
        self.bodies.substep_begin(model, substep.index);
        let (bodies, count) = (&self.bodies, particles.len());
        let is_particle = |i: u32| (i as usize) < count;
        let now = match newton {
            NewtonStart::StepStart => bodies.start(),
            NewtonStart::Iterate => bodies.end(),
        };
        let position = |i: u32| match is_particle(i) {
            true => particles.positions[i as usize].0,
            false => now[i as usize - count],
        };
        let found = self.surface.candidates();
        let found = found.map(|candidate| self.surface.contact(candidate, position));
        let mut found: Vec<_> = found.collect();
        let start = |i: u32| match is_particle(i) {
            true => start[i as usize].0,
            false => bodies.start()[i as usize - count],
        };
        self.surface.plane_contacts(position, start, &mut found);
        self.certifier.acting_keep(&mut found);
        let law = ContactLaw::of(model, config, substep.length);
        let motion = ContactMotion {
            position,
            velocity: |i: u32| match is_particle(i) {
                true => particles.velocities[i as usize].0,
                false => bodies.velocity(i, substep.length),
            },
            start,
            inverse_mass: |i: u32| {
                if is_particle(i) { particles.inverse_masses[i as usize] } else { 0.0 }
            },
        };
        self.set.find(&law, &found, &motion, newton);
    }

    /// `contact_forces`.
    pub(crate) fn forces(&self, forces: &mut [Vector<f64>]) {
        for (stencil, state) in self.set.stencils().iter().zip(self.set.states()) {
            for (particle, weight) in stencil.particles.iter().zip(stencil.weights) {
                if let Some(force) = forces.get_mut(*particle as usize) {
                    *force += Vector(state.action.force).scaled(weight);
                }
            }
        }
    }

    /// `contact_linearise`: blocks w_a w_b S, and at the start of a substep what S takes from the right-hand side.
    pub(crate) fn linearise(&self, particles: &Particles<f64>, length: f64) -> Elements<f64> {
        let mut blocks = Vec::new();
        let mut right_side = vec![Vector::ZERO; particles.len()];
        for (stencil, state) in self.set.stencils().iter().zip(self.set.states()) {
            let [xx, yy, zz, xy, xz, yz] = state.action.rows;
            let rows = Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]].map(Vector));
            let is_particle = |i: u32| (i as usize) < particles.len();
            let velocity = stencil.relative(|i| match is_particle(i) {
                true => particles.velocities[i as usize].0,
                false => self.bodies.velocity(i, length),
            });
            // No equation is about a body.
            let ends = || {
                let all = stencil.particles.into_iter().zip(stencil.weights);
                all.filter(|&(i, weight)| is_particle(i) && weight != 0.0)
            };
            for (row, a) in ends() {
                let row = row as usize;
                if self.newton == NewtonStart::StepStart {
                    right_side[row] -= rows.apply(Vector(velocity)).scaled(a);
                }
                for (column, b) in ends() {
                    let block = rows.scaled(a * b);
                    let column = column as usize;
                    blocks.push(ElementBlock { row, column, block, is_internal: false });
                }
            }
        }
        (blocks, right_side)
    }

    /// `contact_certify`.
    pub(crate) fn certify(
        &mut self,
        model: &Model,
        particles: &mut Particles<f64>,
        (start, proven): Starts<'_>,
        substep: &Substep,
    ) -> Result<()> {
        let starts = (start, proven);
        self.truncated += self.ways_shorten(model, particles, starts, substep, true)?;
        let (count, nodes) = (particles.len(), self.bodies.end());
        let position = |i: u32| match (i as usize).checked_sub(count) {
            Some(node) => nodes[node],
            None => particles.positions[i as usize].0,
        };
        let nodes_start = self.bodies.start();
        self.set.settle(position, |i| match (i as usize).checked_sub(count) {
            Some(node) => nodes_start[node],
            None => start[i as usize].0,
        });
        self.set.body_impulses((&self.bodies, &mut self.impulses), position, substep.length);
        self.bodies.substep_end();
        Ok(())
    }

    /// `contact_certify` of an iterate, or of the end of a substep, which bodies feel. Returns how many particles have changed.
    pub(crate) fn ways_shorten(
        &mut self,
        model: &Model,
        particles: &mut Particles<f64>,
        (start, proven): Starts<'_>,
        substep: &Substep,
        is_end: bool,
    ) -> Result<u64> {
        let (length, count) = (substep.length, particles.len());
        self.bodies.substep_begin(model, substep.index);
        let mut from: Vec<_> = proven.unwrap_or(start).iter().map(|x| x.0).collect();
        from.extend(self.bodies.way_start(proven.is_some()));
        let mut end: Vec<_> = particles.positions.iter().map(|x| x.0).collect();
        end.extend(self.bodies.end());
        let mut search = AllPairs(&self.surface);
        let is_held = |i: u32| i as usize >= count || particles.is_held(i as usize);
        let mut first: Vec<_> = start.iter().map(|x| x.0).collect();
        first.extend(self.bodies.start());
        let ways = CertifiedWays { start: &from, end: &mut end, first: is_end.then_some(&*first) };
        let changed = self.certifier.certify_with(&mut search, ways, is_held, &self.bodies);
        let changed = changed.map_err(|error| self.bodies.error_name(model, error))?;
        for (i, &end) in end[..count].iter().enumerate() {
            if Vector(end) != particles.positions[i] && !particles.is_held(i) {
                let change = (Vector(end) - particles.positions[i]).divided(length);
                particles.velocities[i] += change;
                particles.positions[i] = Vector(end);
                let body = self.certifier.body_at(i).filter(|_| is_end);
                if let Some(collider) = body.and_then(|node| self.bodies.collider_of(node)) {
                    let mass = particles.inverse_masses[i].recip();
                    self.impulses.add(collider, end, change.scaled(mass).0);
                }
            }
        }
        Ok(changed)
    }
}
