//! NUMERICS §15: contact of triangles, by all pairs of features.

use cloth_core::{
    Model, NewtonStart, Result, SelfContact, SolverConfig,
    contact::{
        Certifier, ContactLaw, ContactMotion, ContactSet, ContactSurface, PairSearch, UnprovenPair,
        Ways,
    },
    stepper::Substep,
};

use crate::{ElementBlock, Elements, Matrix, Particles, Vector};

/// Contact of the triangles of a model.
pub(crate) struct TriangleContact {
    contact: SelfContact,
    surface: ContactSurface,
    /// Number of all pairs of features that share no particle, too many to keep.
    candidates: u64,
    pub(crate) set: ContactSet<f64>,
    pub(crate) certifier: Certifier<f64>,
    pub(crate) truncated: u64,
    newton: NewtonStart,
}

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
    pub(crate) fn new(model: &Model) -> Option<Self> {
        let contact = *model.self_contact().filter(|contact| contact.is_of_triangles())?;
        let surface = ContactSurface::new(model, &contact);
        let count = model.particle_count();
        Some(Self {
            candidates: surface.candidates().count() as u64,
            set: ContactSet::new(count),
            certifier: Certifier::new(count),
            truncated: 0,
            newton: NewtonStart::StepStart,
            surface,
            contact,
        })
    }

    pub(crate) const fn candidate_count(&self) -> u64 {
        self.candidates
    }

    /// `contact_geometry`.
    pub(crate) fn geometry(
        &mut self,
        (particles, start): (&Particles<f64>, &[Vector<f64>]),
        config: &SolverConfig,
        substep: &Substep,
        newton: NewtonStart,
    ) {
        self.newton = newton;
        let position = |i: u32| particles.positions[i as usize].0;
        let found = self.surface.candidates();
        let found = found.filter_map(|candidate| self.surface.contact(candidate, position));
        let law = ContactLaw::new(&self.contact, &config.integrator, substep.length);
        let found = found.collect();
        self.set.stencils_set(law, found);
        let motion = ContactMotion {
            position,
            velocity: |i: u32| particles.velocities[i as usize].0,
            start: |i: u32| start[i as usize].0,
            inverse_mass: |i: u32| particles.inverse_masses[i as usize],
        };
        let count = self.set.stencils().len();
        let states = (0..count).filter_map(|c| self.set.state(c, &motion, newton)).collect();
        self.set.states_set(states);
    }

    /// `contact_forces`.
    pub(crate) fn forces(&self, forces: &mut [Vector<f64>]) {
        for (stencil, state) in self.set.stencils().iter().zip(self.set.states()) {
            for (particle, weight) in stencil.particles.iter().zip(stencil.weights) {
                forces[*particle as usize] += Vector(state.action.force).scaled(weight);
            }
        }
    }

    /// `contact_linearise`: blocks w_a w_b S, and at the start of a substep what S takes from the right-hand side.
    pub(crate) fn linearise(&self, particles: &Particles<f64>) -> Elements<f64> {
        let mut blocks = Vec::new();
        let mut right_side = vec![Vector::ZERO; particles.len()];
        for (stencil, state) in self.set.stencils().iter().zip(self.set.states()) {
            let [xx, yy, zz, xy, xz, yz] = state.action.rows;
            let rows = Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]].map(Vector));
            let velocity = stencil.relative(|i| particles.velocities[i as usize].0);
            let ends = || stencil.particles.into_iter().zip(stencil.weights);
            for (row, a) in ends().filter(|(_, a)| *a != 0.0) {
                let row = row as usize;
                if self.newton == NewtonStart::StepStart {
                    right_side[row] -= rows.apply(Vector(velocity)).scaled(a);
                }
                for (column, b) in ends().filter(|(_, b)| *b != 0.0) {
                    let block = rows.scaled(a * b);
                    blocks.push(ElementBlock { row, column: column as usize, block });
                }
            }
        }
        (blocks, right_side)
    }

    /// `contact_certify`.
    pub(crate) fn certify(
        &mut self,
        particles: &mut Particles<f64>,
        start: &[Vector<f64>],
        length: f64,
    ) -> Result<()> {
        let from: Vec<_> = start.iter().map(|x| x.0).collect();
        let mut end: Vec<_> = particles.positions.iter().map(|x| x.0).collect();
        let mut search = AllPairs(&self.surface);
        let is_held = |i: u32| particles.is_held(i as usize);
        self.truncated += self.certifier.certify(&mut search, &from, &mut end, is_held)?;
        for (i, end) in end.into_iter().map(Vector).enumerate() {
            if end != particles.positions[i] && !particles.is_held(i) {
                let change = end - particles.positions[i];
                particles.velocities[i] += change.divided(length);
                particles.positions[i] = end;
            }
        }
        let position = |i: u32| particles.positions[i as usize].0;
        self.set.settle(position, |i| from[i as usize]);
        Ok(())
    }
}
