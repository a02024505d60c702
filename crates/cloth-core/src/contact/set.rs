//! The contacts of a substep, with what they remember of the last one.

use rayon::prelude::*;

use crate::{NewtonStart, Real};

use super::{
    BodyImpulses, BodyMotion, Contact, ContactAction, ContactKey, ContactLaw, ContactSlip,
    ContactStencil, Contacts, particle_contacts::ParticleContacts, sub,
};

/// Contacts in a task.
const TASK: usize = 256;

/// Contacts that a thread puts in order.
const COPIED: usize = 8192;

/// Fewer are sorted by one thread.
const SORTED_ALONE: usize = 16384;

/// Contacts of a particle from which on a device works out all contacts before it adds up rows.
const CROWD: u32 = 32;

/// All contacts of a substep, ascending by key, and friction's memory from one substep to the next.
#[derive(Clone, Debug)]
pub struct ContactSet<T> {
    stencils: Vec<ContactStencil<T>>,
    /// The key of each, above its place in what was found.
    order: Vec<u128>,
    /// What each does.
    states: Vec<ContactState<T>>,
    rows: ParticleContacts,
    memory: Memory<T>,
    kept: Memory<T>,
    /// Numbers from here on are nodes of bodies, not particles.
    particles: u32,
}

/// What friction remembers: slips by key, ascending.
type Memory<T> = Vec<(ContactKey, [T; 3])>;

/// How far a contact had slipped when the substep started \[m\]. `cursor` is where the memory was read last, for a contact before this one.
fn slip_of<T: Real>(
    memory: &[(ContactKey, [T; 3])],
    cursor: &mut Option<usize>,
    key: ContactKey,
) -> [T; 3] {
    let at = cursor.get_or_insert_with(|| memory.partition_point(|(other, _)| *other < key));
    while memory.get(*at).is_some_and(|(other, _)| *other < key) {
        *at += 1;
    }
    memory.get(*at).filter(|(other, _)| *other == key).map_or([T::ZERO; 3], |(_, slip)| *slip)
}

/// What a contact does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactState<T> {
    /// How far it had slipped when the substep started \[m\].
    pub slip_start: [T; 3],
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

impl<T: Real> ContactState<T> {
    /// What a contact does in this motion. It had slipped by `before` when the substep started; each of its particles has some `crowd` of contacts; numbers from
    /// `particles` on are nodes of bodies.
    #[inline(always)]
    fn of<X, V, S, M>(
        stencil: &ContactStencil<T>,
        (law, start): (&ContactLaw<T>, NewtonStart),
        motion: &ContactMotion<X, V, S, M>,
        before: [T; 3],
        (crowd, particles): (impl Fn(u32) -> u32, u32),
    ) -> Self
    where
        X: Fn(u32) -> [T; 3],
        V: Fn(u32) -> [T; 3],
        S: Fn(u32) -> [T; 3],
        M: Fn(u32) -> T,
    {
        let (mut inverse, mut largest, mut with_body) = (T::ZERO, 1, false);
        for (particle, weight) in stencil.particles.into_iter().zip(stencil.weights) {
            if weight != T::ZERO {
                with_body |= particle >= particles;
                inverse += weight * weight * (motion.inverse_mass)(particle);
                largest = largest.max(crowd(particle));
            }
        }
        let mass = if inverse > T::ZERO { T::ONE / inverse } else { T::ZERO };
        let velocity = stencil.relative(&motion.velocity);
        let way = |i: u32| sub((motion.position)(i), (motion.start)(i));
        let moved = stencil.relative(way);
        let slip: [T; 3] = std::array::from_fn(|k| before[k] + moved[k]);
        let slip = stencil.tangential(slip);
        let action = law.action(stencil, (mass, largest), (velocity, slip), (start, with_body));
        Self { slip_start: before, slip, action }
    }
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
            stencils: Vec::new(),
            order: Vec::new(),
            states: Vec::new(),
            rows: ParticleContacts::new(count),
            memory: Vec::new(),
            kept: Vec::new(),
        }
    }

    /// No contacts any more; what friction remembers stays.
    pub fn clear(&mut self) {
        self.stencils.clear();
        self.states.clear();
        self.rows.clear();
    }

    /// Takes in all contacts that were `found`, in any order, and works out what they do in this motion by this law.
    ///
    /// All of them are a few thousand numbers in most steps: what threads do for them is in one piece, as to wake them takes as long.
    pub fn find<X, V, S, M>(
        &mut self,
        law: &ContactLaw<T>,
        found: &[Option<ContactStencil<T>>],
        motion: &ContactMotion<X, V, S, M>,
        start: NewtonStart,
    ) where
        X: Fn(u32) -> [T; 3] + Sync,
        V: Fn(u32) -> [T; 3] + Sync,
        S: Fn(u32) -> [T; 3] + Sync,
        M: Fn(u32) -> T + Sync,
    {
        // Stencils are large: their numbers are sorted, each with the key above it.
        let keys = found.iter().enumerate();
        let key = |(at, stencil): (usize, &Option<ContactStencil<T>>)| {
            stencil.as_ref().map(|stencil| stencil.key.number() << 32 | at as u128)
        };
        self.order.clear();
        self.order.extend(keys.filter_map(key));
        match self.order.len() {
            0..SORTED_ALONE => self.order.sort_unstable(),
            _ => self.order.par_sort_unstable(),
        }
        let Self { stencils, order, states, rows, memory, particles, .. } = self;
        let stencil = |&key: &u128| found[key as u32 as usize].unwrap_or(ContactStencil::NONE);
        order.par_iter().with_min_len(COPIED).map(stencil).collect_into_vec(stencils);
        rows.link(stencils);
        let (rows, memory, particles) = (&*rows, &**memory, *particles);
        let shares = law.shares_particles();
        let crowd = |particle: u32| match particle < particles && shares {
            true => rows.of(particle as usize).len() as u32,
            false => 1,
        };
        let all = stencils.par_iter().with_min_len(TASK);
        let all = all.map_init(
            || None,
            |cursor, stencil| {
                let before = slip_of(memory, cursor, stencil.key);
                ContactState::of(stencil, (law, start), motion, before, (crowd, particles))
            },
        );
        all.collect_into_vec(states);
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

    /// Where the contacts of each particle begin, and the end; then these: 4 c + a for place a of contact c.
    #[must_use]
    pub fn rows(&self) -> (&[u32], &[u32]) {
        self.rows.get()
    }

    /// Whether some particle is in so many contacts that devices better work out each contact once before they add up the rows of the matrix: with one
    /// more step for all threads, but without a long row that all wait for. (On an H200 an iteration of `conjugate_gradient` takes two thirds of the time
    /// through CUDA and half of it through wgpu for the scene `stack`, with 56 contacts; for `drape`, with 20, as long and a tenth more.)
    #[must_use]
    pub fn is_crowded(&self) -> bool {
        let offsets = &self.rows.get().0[..=self.particles as usize];
        offsets.windows(2).any(|row| row[1] - row[0] > CROWD)
    }

    /// The contacts of a particle, ascending, with its weight in each.
    #[inline(always)]
    pub fn of(&self, particle: usize) -> impl Iterator<Item = (usize, T)> + '_ {
        self.rows.of(particle).iter().map(|&place| {
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
        for (contact, weight) in self.of(particle) {
            let force = self.states[contact].action.force;
            for axis in 0..3 {
                sum[axis] += weight * force[axis];
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
        let contacts = self.stencils.par_iter().zip(&self.states);
        memory.par_extend(contacts.with_min_len(TASK).filter_map(|(stencil, state)| {
            let moved = stencil.relative(|i| sub(position(i), start(i)));
            let slip: [T; 3] = std::array::from_fn(|k| state.slip_start[k] + moved[k]);
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
        let found = [(4, [4, 0, 1, 2]), (3, [3, 1, 0, 2])].map(|(first, all)| stencil(first, all));
        let zero = |_| [0.0; 3];
        let motion =
            ContactMotion { position: zero, velocity: zero, start: zero, inverse_mass: |_| 1.0 };
        set.find(&law, &[Some(found[0]), None, Some(found[1])], &motion, NewtonStart::StepStart);
        let found: Vec<_> = (0..6).map(|i| set.of(i).collect::<Vec<_>>()).collect();
        assert_eq!(found[0], [(0, -0.5), (1, -0.5)]);
        assert_eq!(found[1], [(0, -0.5), (1, -0.5)]);
        assert_eq!((found[2].len(), found[5].len()), (0, 0));
        assert_eq!((&found[3][..], &found[4][..]), (&[(0, 1.0)][..], &[(1, 1.0)][..]));
        assert!(set.touches(3) && !set.touches(2));
    }
}
