//! The contacts of a substep, with what they remember of the last one.

use rayon::prelude::*;

use crate::{NewtonStart, Real};

use super::{
    BodyImpulses, BodyMotion, Contact, ContactAction, ContactKey, ContactLaw, ContactSlip,
    ContactStencil, Contacts, particle_contacts::ParticleContacts, sub,
};

/// Contacts in a task.
const TASK: usize = 256;

/// Fewer are sorted by one thread.
const SORTED_ALONE: usize = 4096;

/// All contacts of a substep, ascending by key, and friction's memory from one substep to the next.
#[derive(Clone, Debug)]
pub struct ContactSet<T> {
    law: Option<ContactLaw<T>>,
    stencils: Vec<ContactStencil<T>>,
    /// How far each had slipped when the substep started \[m\].
    slips_start: Vec<[T; 3]>,
    /// How far it has slipped, and what it does.
    states: Vec<ContactState<T>>,
    rows: ParticleContacts,
    memory: Memory<T>,
    kept: Memory<T>,
    /// Numbers from here on are nodes of bodies, not particles.
    particles: u32,
}

/// What friction remembers: slips by key, ascending.
type Memory<T> = Vec<(ContactKey, [T; 3])>;

/// What a contact does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactState<T> {
    /// How far it has slipped \[m\].
    pub slip: [T; 3],
    /// Its forces.
    pub action: ContactAction<T>,
}

/// A contact in the equations of particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactEquation<T> {
    /// Its particles. Nodes of bodies, which no equation is about, are another particle, with weight 0.
    pub particles: [u32; 4],
    /// Their weights.
    pub weights: [T; 4],
    /// S sum w_b v_b of the nodes of bodies.
    pub carried: [T; 3],
}

/// What the state of a contact follows from, besides its geometry.
pub struct ContactMotion<X, V, S, M> {
    /// Present positions \[m\].
    pub position: X,
    /// Present velocities \[m/s\].
    pub velocity: V,
    /// Positions at the start of the substep \[m\].
    pub start: S,
    /// Inverse masses \[1/kg\], 0 while held.
    pub inverse_mass: M,
}

impl<T: Real> ContactSet<T> {
    /// No contacts, of so many particles.
    #[must_use]
    pub fn new(count: usize) -> Self {
        Self::with_nodes(count, count)
    }

    /// No contacts, of so many particles, and of so many particles and nodes of bodies together.
    #[must_use]
    pub fn with_nodes(particles: usize, count: usize) -> Self {
        Self {
            particles: particles as u32,
            law: None,
            stencils: Vec::new(),
            slips_start: Vec::new(),
            states: Vec::new(),
            rows: ParticleContacts::new(count),
            memory: Vec::new(),
            kept: Vec::new(),
        }
    }

    /// Takes in all contacts, in any order, which act by this law.
    pub fn stencils_set(&mut self, law: ContactLaw<T>, stencils: Vec<ContactStencil<T>>) {
        // Stencils are large: their numbers are sorted, each with the key above it.
        let keys = stencils.par_iter().enumerate().with_min_len(TASK);
        let keys = keys.map(|(at, stencil)| stencil.key.number() << 32 | at as u128);
        let mut order: Vec<_> = keys.collect();
        match order.len() {
            0..SORTED_ALONE => order.sort_unstable(),
            _ => order.par_sort_unstable(),
        }
        let order = order.par_iter().with_min_len(TASK);
        order.map(|&at| stencils[at as u32 as usize]).collect_into_vec(&mut self.stencils);
        self.law = Some(law);
        self.states.clear();
        let memory = &*self.memory;
        let slips = self.stencils.par_chunks(TASK).flat_map_iter(|stencils| {
            let first = memory.partition_point(|(key, _)| *key < stencils[0].key);
            let mut memory = memory[first..].iter().peekable();
            stencils.iter().map(move |stencil| {
                while memory.next_if(|(key, _)| *key < stencil.key).is_some() {}
                match memory.peek() {
                    Some((key, slip)) if *key == stencil.key => *slip,
                    _ => [T::ZERO; 3],
                }
            })
        });
        self.slips_start.clear();
        self.slips_start.par_extend(slips);
        self.rows.link(&self.stencils);
    }

    /// Whether a number is that of a particle, not of a node of a body.
    #[inline(always)]
    #[must_use]
    pub const fn is_particle(&self, node: u32) -> bool {
        node < self.particles
    }

    /// The contacts.
    #[must_use]
    pub fn stencils(&self) -> &[ContactStencil<T>] {
        &self.stencils
    }

    #[inline(always)]
    fn state<X, V, S, M>(
        &self,
        contact: usize,
        law: &ContactLaw<T>,
        motion: &ContactMotion<X, V, S, M>,
        start: NewtonStart,
    ) -> ContactState<T>
    where
        X: Fn(u32) -> [T; 3],
        V: Fn(u32) -> [T; 3],
        S: Fn(u32) -> [T; 3],
        M: Fn(u32) -> T,
    {
        let stencil = &self.stencils[contact];
        let (mut inverse, mut crowd) = (T::ZERO, 1);
        for (particle, weight) in stencil.particles.into_iter().zip(stencil.weights) {
            if weight != T::ZERO {
                inverse += weight * weight * (motion.inverse_mass)(particle);
                // What cannot move has any number of them.
                if particle < self.particles {
                    crowd = crowd.max(self.places_of(particle as usize).len() as u32);
                }
            }
        }
        let mass = if inverse > T::ZERO { T::ONE / inverse } else { T::ZERO };
        let velocity = stencil.relative(&motion.velocity);
        let way = |i: u32| sub((motion.position)(i), (motion.start)(i));
        let moved = stencil.relative(way);
        let before = self.slips_start[contact];
        let slip: [T; 3] = std::array::from_fn(|k| before[k] + moved[k]);
        let slip = stencil.tangential(slip);
        let action = law.action(stencil, (mass, crowd), (velocity, slip), start);
        ContactState { slip, action }
    }

    /// What a contact is in the equations of particles, in a substep of `length` \[s\].
    #[must_use]
    pub fn equation(
        &self,
        contact: usize,
        bodies: &BodyMotion<T>,
        length: T,
    ) -> ContactEquation<T> {
        let stencil = &self.stencils[contact];
        let is_particle = |node: &u32| self.is_particle(*node);
        let mut equation = ContactEquation {
            particles: stencil.particles,
            weights: stencil.weights,
            carried: [T::ZERO; 3],
        };
        let own = stencil.particles.into_iter().find(is_particle);
        let Some(own) = own.filter(|_| !stencil.particles.iter().all(is_particle)) else {
            return equation;
        };
        let [x, y, z] = stencil.relative(|node: u32| match is_particle(&node) {
            true => [T::ZERO; 3],
            false => bodies.velocity(node, length),
        });
        let [xx, yy, zz, xy, xz, yz] = self.states[contact].action.rows;
        equation.carried =
            [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z];
        for (particle, weight) in equation.particles.iter_mut().zip(&mut equation.weights) {
            if !is_particle(particle) {
                (*particle, *weight) = (own, T::ZERO);
            }
        }
        equation
    }

    /// Works out what all contacts do in this motion.
    pub fn states_find<X, V, S, M>(
        &mut self,
        motion: &ContactMotion<X, V, S, M>,
        start: NewtonStart,
    ) where
        X: Fn(u32) -> [T; 3] + Sync,
        V: Fn(u32) -> [T; 3] + Sync,
        S: Fn(u32) -> [T; 3] + Sync,
        M: Fn(u32) -> T + Sync,
    {
        let Some(law) = self.law else { return };
        let mut states = std::mem::take(&mut self.states);
        let all = (0..self.stencils.len()).into_par_iter().with_min_len(TASK);
        all.map(|contact| self.state(contact, &law, motion, start)).collect_into_vec(&mut states);
        self.states = states;
    }

    /// The pairs of different groups that a contact couples, one of whose particles is in each; some may be there more than once.
    #[must_use]
    pub fn coupled(&self, group_of: impl Fn(u32) -> u32 + Sync) -> Vec<[u32; 2]> {
        let chunks = self.stencils.par_chunks(TASK).map(|stencils| {
            let mut pairs = Vec::new();
            for ContactStencil { particles, weights, .. } in stencils {
                let acts = |k: &usize| weights[*k] != T::ZERO && self.is_particle(particles[*k]);
                for first in (0..4).filter(acts) {
                    for second in (first + 1..4).filter(acts) {
                        let pair = [particles[first], particles[second]].map(&group_of);
                        // Most are of the groups of the one before.
                        if pair[0] != pair[1] && pairs.last() != Some(&pair) {
                            pairs.push(pair);
                        }
                    }
                }
            }
            pairs.sort_unstable();
            pairs.dedup();
            pairs
        });
        chunks.flatten_iter().collect()
    }

    /// What all contacts do.
    #[must_use]
    pub fn states(&self) -> &[ContactState<T>] {
        &self.states
    }

    #[inline(always)]
    fn places_of(&self, particle: usize) -> &[u32] {
        self.rows.of(particle)
    }

    /// Where the contacts of each particle begin, and the end; then these: 4 c + a for place a of contact c.
    #[must_use]
    pub fn rows(&self) -> (&[u32], &[u32]) {
        self.rows.get()
    }

    /// The contacts of a particle, ascending, with its weight in each.
    #[inline(always)]
    pub fn of(&self, particle: usize) -> impl Iterator<Item = (usize, T)> + '_ {
        self.places_of(particle).iter().map(|&place| {
            let contact = place as usize / 4;
            (contact, self.stencils[contact].weights[place as usize % 4])
        })
    }

    /// Whether a particle has contacts.
    #[inline(always)]
    #[must_use]
    pub fn touches(&self, particle: usize) -> bool {
        !self.rows.of(particle).is_empty()
    }

    /// The force of all contacts on a particle \[N\].
    #[inline(always)]
    #[must_use]
    pub fn force_on(&self, particle: usize) -> [T; 3] {
        let mut sum = [T::ZERO; 3];
        if self.states.len() == self.stencils.len() {
            for (contact, weight) in self.of(particle) {
                let force = self.states[contact].action.force;
                for axis in 0..3 {
                    sum[axis] += weight * force[axis];
                }
            }
        }
        sum
    }

    /// Ends a substep: remembers how far contacts have slipped now that particles are at `position`, less where friction gave way.
    pub fn settle(
        &mut self,
        position: impl Fn(u32) -> [T; 3] + Sync,
        start: impl Fn(u32) -> [T; 3] + Sync,
    ) {
        let mut memory = std::mem::take(&mut self.memory);
        memory.clear();
        let contacts = self.stencils.par_iter().zip(&self.slips_start).zip(&self.states);
        memory.par_extend(contacts.with_min_len(TASK).filter_map(|((stencil, before), state)| {
            let moved = stencil.relative(|i| sub(position(i), start(i)));
            let slip: [T; 3] = std::array::from_fn(|k| before[k] + moved[k]);
            let slip = state.action.slip_left(stencil, stencil.tangential(slip));
            (slip != [T::ZERO; 3]).then_some((stencil.key, slip))
        }));
        self.memory = memory;
    }

    /// Adds what each collider gave to cloth \[kg m/s\] in a substep of `length` \[s\] that ended with particles and nodes at `position`
    /// \[m\].
    pub fn body_impulses(
        &self,
        (bodies, impulses): (&BodyMotion<T>, &mut BodyImpulses),
        position: impl Fn(u32) -> [T; 3],
        length: f64,
    ) {
        if !impulses.is_asked() {
            return;
        }
        for (stencil, state) in self.stencils.iter().zip(&self.states) {
            let collider = |i: usize| bodies.collider_of(stencil.particles[i]);
            let (first, last) = (collider(0), collider(3));
            let Some(collider) = first.or(last) else { continue };
            // Weights of the cloth are positive if it is the first feature, and the force is one on the first.
            let sign = if last.is_some() { 1.0 } else { -1.0 };
            let mut place = [0.0; 3];
            for (&particle, weight) in stencil.particles.iter().zip(stencil.weights) {
                if particle < self.particles && weight != T::ZERO {
                    let x = position(particle);
                    for axis in 0..3 {
                        place[axis] += weight.abs().to_f64() * x[axis].to_f64();
                    }
                }
            }
            let linear = state.action.force.map(|force| sign * length * force.to_f64());
            impulses.add(collider, place, linear);
        }
    }

    /// Takes in how far contacts have slipped in a state from outside.
    pub fn slips_write(&mut self, slips: &[ContactSlip]) {
        self.memory.clear();
        self.memory.extend(slips.iter().map(|slip| (slip.key, slip.slip.map(T::from_f64))));
        self.memory.sort_unstable_by_key(|(key, _)| *key);
    }

    /// How far contacts have slipped, ascending by key; `out` is resized.
    pub fn slips_read(&self, out: &mut Vec<ContactSlip>) {
        out.clear();
        let all = self.memory.iter();
        out.extend(all.map(|&(key, slip)| ContactSlip { key, slip: slip.map(T::to_f64) }));
    }

    /// Keeps what friction remembers, for a substep that may be taken back.
    pub fn keep(&mut self) {
        self.kept.clone_from(&self.memory);
    }

    /// Takes it back.
    pub fn restore(&mut self) {
        self.memory.clone_from(&self.kept);
    }

    /// The contacts as whoever looks at a simulation sees them.
    pub fn read(&self, out: &mut Contacts) {
        out.contacts.clear();
        let of = |(stencil, state): (&ContactStencil<T>, &ContactState<T>)| Contact {
            key: stencil.key,
            particles: stencil.particles,
            weights: stencil.weights.map(T::to_f64),
            gap: stencil.gap.to_f64(),
            reach: stencil.reach.to_f64(),
            normal: stencil.normal.map(T::to_f64),
            force: state.action.normal_force.to_f64(),
            friction: state.action.friction.map(T::to_f64),
            slip: state.slip.map(T::to_f64),
            sticks: state.action.sticks,
        };
        out.contacts.extend(self.stencils.iter().zip(&self.states).map(of));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ContactKind;

    #[test]
    fn a_particle_finds_its_contacts_in_order() {
        let stencil = |first: u32, particles: [u32; 4]| ContactStencil {
            key: ContactKey { kind: ContactKind::VertexFace, first, second: 0 },
            particles,
            weights: [1.0, -0.5, -0.5, 0.0],
            normal: [0.0, 0.0, 1.0],
            gap: 1e-3,
            reach: 2e-3,
            friction: 0.0,
        };
        let law = ContactLaw::new(&crate::Integrator::Explicit, 1e-3, 1e-3);
        let mut set = ContactSet::<f64>::new(6);
        set.stencils_set(law, vec![stencil(4, [4, 0, 1, 2]), stencil(3, [3, 1, 0, 2])]);
        let found: Vec<_> = (0..6).map(|i| set.of(i).collect::<Vec<_>>()).collect();
        assert_eq!(found[0], [(0, -0.5), (1, -0.5)]);
        assert_eq!(found[1], [(0, -0.5), (1, -0.5)]);
        assert_eq!((found[2].len(), found[5].len()), (0, 0));
        assert_eq!((&found[3][..], &found[4][..]), (&[(0, 1.0)][..], &[(1, 1.0)][..]));
        assert!(set.touches(3) && !set.touches(2));
    }
}
