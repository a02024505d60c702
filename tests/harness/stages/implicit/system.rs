//! NUMERICS §5: matrix and right-hand side.

use std::collections::BTreeMap;

use cloth_core::{ContactResponse, Field, Model, NewtonStart};

use super::{
    super::{
        LENGTH_MIN, ONE, Particles, ZERO, contact_pairs, spring_tension, spring_tension_derivative,
    },
    TrackedMatrix, air_jacobians,
};
use crate::tracked::{Tracked, TrackedVector};

/// What a spring, or a pair in contact, adds to the system.
#[derive(Clone, Copy, Debug)]
pub struct Term {
    /// The two particles, the smaller index first.
    pub particles: [usize; 2],
    /// h^2 T / l.
    pub e: Tracked,
    /// What u leaves of the stiffness along the spring.
    pub g: Tracked,
    /// The direction with its weight.
    pub u: TrackedVector,
    /// c of a spring; none for a pair in contact.
    pub damping: Option<Tracked>,
}

/// max(0, value); zero without doubt if rounding cannot change the sign.
fn positive(value: Tracked, epsilon: f64) -> Tracked {
    if value.value < 0.0 && !value.is_close(ZERO, epsilon) { ZERO } else { value.max(ZERO) }
}

/// `spring_linearise`: the terms of all springs, in their order. Marks the particles of a spring for
/// which rounding decides whether it has buckled.
#[must_use]
pub fn spring_terms(
    model: &Model,
    particles: &mut Particles,
    length: f64,
    epsilon: f64,
) -> Vec<Term> {
    let h = Tracked::rounded(length);
    let term = |spring: cloth_core::Spring| {
        let kind = model.springs().kinds()[spring.kind as usize];
        let damping = Tracked::rounded(kind.damping);
        let [i, j] = spring.particles.map(|particle| particle as usize);
        let difference = particles.positions[j] - particles.positions[i];
        let distance = difference.length();
        let divisor = distance.max(LENGTH_MIN);
        let tension = spring_tension(&kind, distance, epsilon);
        let (slope, uncertain) = spring_tension_derivative(&kind, distance, epsilon);
        if uncertain {
            particles.uncertain[i] = true;
            particles.uncertain[j] = true;
        }
        let e = h * h * tension / divisor;
        let along = h * h * slope + h * damping;
        let rest = positive(along - positive(e, epsilon), epsilon);
        let root = if rest.value > 0.0 { rest.sqrt() } else { ZERO };
        let u = difference.divided(divisor).scaled(root);
        let g = positive(along - u.dot(u), epsilon);
        Term { particles: [i, j], e, g, u, damping: Some(damping) }
    };
    model.springs().iter().map(term).collect()
}

/// `contact_linearise`: the terms of all pairs in contact, in their order. Marks the particles for
/// which rounding decides whether they are.
#[must_use]
pub fn contact_terms(
    model: &Model,
    particles: &mut Particles,
    length: f64,
    epsilon: f64,
) -> Vec<Term> {
    let Some(contact) = model.self_contact() else { return Vec::new() };
    let ContactResponse::Penalty { stiffness, damping } = contact.response else {
        return Vec::new();
    };
    let [h, stiffness, damping] = [length, stiffness, damping].map(Tracked::rounded);
    let root = (h * h * stiffness + h * damping).sqrt();
    let smallest = Tracked::rounded(1e-14);
    let found = contact_pairs(model, particles, epsilon);
    let mut uncertain: Vec<usize> = found.uncertain.iter().flatten().map(|&i| i as usize).collect();
    let mut terms = Vec::new();
    for pair in found.pairs {
        let [i, j] = pair.map(|particle| particle as usize);
        let difference = particles.positions[i] - particles.positions[j];
        let squared = difference.dot(difference);
        if squared.is_close(smallest, epsilon) {
            uncertain.extend([i, j]);
        }
        if squared.value > smallest.value {
            let u = difference.divided(difference.length()).scaled(root);
            terms.push(Term { particles: [i, j], e: ZERO, g: ZERO, u, damping: None });
        }
    }
    uncertain.into_iter().for_each(|particle| particles.uncertain[particle] = true);
    terms
}

/// A y = b.
#[derive(Clone, Debug)]
pub struct LinearSystem {
    /// Springs, then pairs in contact.
    pub terms: Vec<Term>,
    /// B without friction: mass, drag, air.
    base: Vec<TrackedMatrix>,
    /// What friction has added to B and D since, and taken out again, in this order.
    frictions: Vec<Vec<TrackedMatrix>>,
    /// b.
    pub right_side: Vec<TrackedVector>,
}

impl LinearSystem {
    /// `implicit_assemble`, with f as all forces but those of springs. `velocities_start` are those
    /// of the start of the substep; they matter for an iterate alone.
    #[must_use]
    pub fn assemble(
        model: &Model,
        particles: &Particles,
        terms: Vec<Term>,
        forces: &[TrackedVector],
        (length, wind_velocity): (f64, [f64; 3]),
        (start, velocities_start): (NewtonStart, &[TrackedVector]),
    ) -> Self {
        let h = Tracked::rounded(length);
        let mut rate = TrackedVector::ZERO;
        for field in model.fields() {
            if let Field::Drag { rate: more } = field {
                rate += TrackedVector::rounded(*more);
            }
        }
        let jacobians = air_jacobians(model, particles, wind_velocity);
        let masses = model.masses().iter().map(|&mass| Tracked::rounded(mass));
        let base = masses.clone().zip(jacobians).map(|(mass, jacobian)| {
            TrackedMatrix::of_diagonal(rate.0.map(|r| mass * (ONE + h * r))) + jacobian.scaled(h)
        });
        let mut right_side: Vec<_> = forces.iter().map(|force| force.scaled(h)).collect();
        if start == NewtonStart::Iterate {
            for (i, mass) in masses.clone().enumerate() {
                let change = particles.velocities[i] - velocities_start[i];
                right_side[i] -= change.scaled(mass);
            }
        }
        let frictions = vec![Vec::new(); particles.len()];
        let mut system = Self { terms, base: base.collect(), frictions, right_side };
        system.add_terms(model, particles, h, start);
        system
    }

    fn add_terms(&mut self, model: &Model, particles: &Particles, h: Tracked, start: NewtonStart) {
        let share = stiffness_share(model, h);
        for term in &self.terms {
            let [i, j] = term.particles;
            let w = particles.velocities[j] - particles.velocities[i];
            let along = term.u.dot(w);
            let push = match (term.damping, start) {
                (Some(_), NewtonStart::StepStart) => w.scaled(term.g) + term.u.scaled(along),
                (Some(damping), NewtonStart::Iterate) => {
                    let square = term.u.dot(term.u);
                    if square.value > 0.0 {
                        term.u.scaled(h * damping / square * along)
                    } else {
                        TrackedVector::ZERO
                    }
                }
                (None, NewtonStart::StepStart) => term.u.scaled(along).scaled(share),
                (None, NewtonStart::Iterate) => continue,
            };
            let difference = particles.positions[j] - particles.positions[i];
            let pull =
                term.damping.map_or(TrackedVector::ZERO, |_| difference.scaled(term.e / h)) + push;
            self.right_side[i] += pull;
            self.right_side[j] -= pull;
        }
    }

    /// Adds the drag c \[kg\] of a contact that slides: c P to B and D, -c P (v - u) to b, v - u being
    /// `relative` and P the projector on the plane of `normal`.
    pub fn add_drag(
        &mut self,
        particle: usize,
        drag: Tracked,
        normal: TrackedVector,
        relative: TrackedVector,
    ) {
        let across = TrackedMatrix::outer(normal, normal);
        let plane = (TrackedMatrix::diagonal(ONE) + across.negated()).scaled(drag);
        self.frictions[particle].push(plane);
        self.right_side[particle] -= plane.apply(relative);
    }

    /// A diagonal block with what friction has done to it.
    fn with_friction(&self, particle: usize, block: TrackedMatrix) -> TrackedMatrix {
        self.frictions[particle].iter().fold(block, |block, &friction| block + friction)
    }

    /// All blocks, by row and column.
    #[must_use]
    pub fn blocks(&self) -> BTreeMap<[usize; 2], TrackedMatrix> {
        let mut blocks: BTreeMap<_, _> =
            self.base.iter().enumerate().map(|(i, &base)| ([i, i], base)).collect();
        for Term { particles: [i, j], g, u, .. } in &self.terms {
            let block = TrackedMatrix::diagonal(*g) + TrackedMatrix::outer(*u, *u);
            for (place, block) in [
                ([*i, *i], block),
                ([*j, *j], block),
                ([*i, *j], block.negated()),
                ([*j, *i], block.negated()),
            ] {
                *blocks.entry(place).or_default() += block;
            }
        }
        for ([row, column], block) in &mut blocks {
            if row == column {
                *block = self.with_friction(*row, *block);
            }
        }
        blocks
    }

    /// A p, spring by spring.
    #[must_use]
    pub fn apply(&self, p: &[TrackedVector]) -> Vec<TrackedVector> {
        let base = self.base.iter().zip(p).enumerate();
        let mut image: Vec<_> =
            base.map(|(i, (&base, &p))| self.with_friction(i, base).apply(p)).collect();
        for Term { particles: [i, j], g, u, .. } in &self.terms {
            let difference = p[*i] - p[*j];
            let part = difference.scaled(*g) + u.scaled(u.dot(difference));
            image[*i] += part;
            image[*j] -= part;
        }
        image
    }

    /// A p, from blocks.
    #[must_use]
    pub fn apply_blocks(&self, p: &[TrackedVector]) -> Vec<TrackedVector> {
        let mut image = vec![TrackedVector::ZERO; p.len()];
        for ([row, column], block) in self.blocks() {
            image[row] += block.apply(p[column]);
        }
        image
    }
}

/// rho, the share of a contact term that comes from the stiffness.
fn stiffness_share(model: &Model, h: Tracked) -> Tracked {
    match model.self_contact().map(|contact| contact.response) {
        Some(ContactResponse::Penalty { stiffness, damping }) => {
            let stiffness = h * Tracked::rounded(stiffness);
            stiffness / (stiffness + Tracked::rounded(damping))
        }
        Some(ContactResponse::Impulse { .. }) | None => ZERO,
    }
}
