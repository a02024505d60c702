//! NUMERICS §5, `spring_linearise` and `contact_linearise`.

use cloth_core::{ContactResponse, Model, Spring};

use crate::{
    Number, Particles, Vector,
    buckling::{spring_tension, spring_tension_derivative},
    contact::has_normal,
    particles::length_min,
};

/// What a spring, or a pair in contact, adds to the system: the block g I + u u^T.
#[derive(Clone, Copy, Debug)]
pub struct Term<N> {
    /// The two particles, the smaller index first.
    pub particles: [usize; 2],
    /// h^2 T / l.
    pub e: N,
    /// What u leaves of the stiffness along the spring.
    pub g: N,
    /// The direction with its weight.
    pub u: Vector<N>,
    /// c of a spring; none for a pair in contact.
    pub damping: Option<N>,
}

/// max(0, value); zero without doubt if rounding cannot change the sign.
fn positive<N: Number>(value: N, epsilon: f64) -> N {
    if value.value() < 0.0 && !value.is_close(N::ZERO, epsilon) {
        N::ZERO
    } else {
        value.max(N::ZERO)
    }
}

/// The terms of all springs, in their order, for a substep of `length` \[s\].
#[must_use]
pub fn spring_linearise<N: Number>(
    model: &Model,
    particles: &mut Particles<N>,
    length: f64,
) -> Vec<Term<N>> {
    let (h, epsilon) = (N::rounded(length), particles.epsilon);
    let term = |spring: Spring| {
        let kind = model.springs().kinds()[spring.kind as usize];
        let damping = N::rounded(kind.damping);
        let [i, j] = spring.particles.map(|particle| particle as usize);
        let difference = particles.positions[j] - particles.positions[i];
        let distance = difference.length();
        let divisor = distance.max(length_min());
        let tension = spring_tension(&kind, distance, epsilon);
        let (slope, uncertain) = spring_tension_derivative(&kind, distance, epsilon);
        if uncertain {
            [i, j].into_iter().for_each(|particle| particles.uncertain[particle] = true);
        }
        let e = h * h * tension / divisor;
        let along = h * h * slope + h * damping;
        let rest = positive(along - positive(e, epsilon), epsilon);
        let root = if rest.value() > 0.0 { rest.sqrt() } else { N::ZERO };
        let u = difference.divided(divisor).scaled(root);
        let g = positive(along - u.dot(u), epsilon);
        Term { particles: [i, j], e, g, u, damping: Some(damping) }
    };
    model.springs().iter().map(term).collect()
}

/// The terms of these pairs in contact.
#[must_use]
pub fn contact_linearise<N: Number>(
    model: &Model,
    particles: &mut Particles<N>,
    pairs: &[[u32; 2]],
    length: f64,
) -> Vec<Term<N>> {
    let Some(contact) = model.self_contact() else { return Vec::new() };
    let ContactResponse::Penalty { stiffness, damping } = contact.response else {
        return Vec::new();
    };
    let [h, stiffness, damping] = [length, stiffness, damping].map(N::rounded);
    let root = (h * h * stiffness + h * damping).sqrt();
    let mut terms = Vec::new();
    for pair in pairs {
        let [i, j] = pair.map(|particle| particle as usize);
        let difference = particles.positions[i] - particles.positions[j];
        if has_normal(particles, [i, j], difference) {
            let u = difference.divided(difference.length()).scaled(root);
            terms.push(Term { particles: [i, j], e: N::ZERO, g: N::ZERO, u, damping: None });
        }
    }
    terms
}
