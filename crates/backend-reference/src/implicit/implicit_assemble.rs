//! NUMERICS §5, `implicit_assemble` and `matrix_apply`.

use std::collections::BTreeMap;

use cloth_core::{ContactResponse, Model, NewtonStart};

use super::Term;
use crate::{
    Matrix, Number, Particles, Vector, aerodynamic_forces::air_jacobians, field_forces::field_sums,
};

/// A y = b.
#[derive(Clone, Debug, Default)]
pub struct LinearSystem<N> {
    /// Springs, then pairs in contact.
    pub terms: Vec<Term<N>>,
    /// Those of triangles of fabric.
    pub elements: Vec<ElementBlock<N>>,
    /// B without friction: mass, drag, air.
    base: Vec<Matrix<N>>,
    /// What friction has added to B and D since, and taken out again, in this order.
    frictions: Vec<Vec<Matrix<N>>>,
    /// b.
    pub right_side: Vec<Vector<N>>,
}

impl<N: Number> LinearSystem<N> {
    /// Adds to the diagonal of the block of a particle, and to its right-hand side.
    pub fn add(&mut self, particle: usize, diagonal: N, impulse: Vector<N>) {
        self.base[particle] += Matrix::diagonal(diagonal);
        self.right_side[particle] += impulse;
    }
}

/// What a triangle of fabric adds to a block of the matrix.
#[derive(Clone, Copy, Debug)]
pub struct ElementBlock<N> {
    /// Particle of the rows.
    pub row: usize,
    /// Particle of the columns.
    pub column: usize,
    /// What it adds.
    pub block: Matrix<N>,
    /// Whether it acts between particles alone, so that a translation of all meets no resistance.
    pub is_internal: bool,
}

/// What triangles of fabric add: blocks, and right-hand sides of all particles.
pub type Elements<N> = (Vec<ElementBlock<N>>, Vec<Vector<N>>);

/// What a system is linearised about.
#[derive(Clone, Copy, Debug)]
pub struct Linearisation<'a, N> {
    /// Length of the substep \[s\].
    pub length: f64,
    /// Wind velocity \[m/s\].
    pub wind_velocity: [f64; 3],
    /// The start of the substep, or an iterate.
    pub start: NewtonStart,
    /// Velocities at the start of the substep \[m/s\]; they matter for an iterate alone.
    pub velocities_start: &'a [Vector<N>],
}

/// Matrix and right-hand side, with f as all forces but those of springs, and without the friction of contacts with colliders,
/// for which there is [`Constraints::add_drags`](super::Constraints::add_drags).
#[must_use]
pub fn implicit_assemble<N: Number>(
    model: &Model,
    particles: &Particles<N>,
    (terms, elements): (Vec<Term<N>>, &[Elements<N>]),
    forces: &[Vector<N>],
    about: &Linearisation<'_, N>,
) -> LinearSystem<N> {
    let h = N::rounded(about.length);
    let (_, rate) = field_sums::<N>(model);
    let jacobians = air_jacobians(model, particles, about.wind_velocity);
    let masses = model.masses().iter().map(|&mass| N::rounded(mass));
    let base = masses.clone().zip(jacobians).map(|(mass, jacobian)| {
        Matrix::of_diagonal(rate.0.map(|r| mass * (N::ONE + h * r))) + jacobian.scaled(h)
    });
    let mut right_side: Vec<_> = forces.iter().map(|force| force.scaled(h)).collect();
    if about.start == NewtonStart::Iterate {
        for (i, mass) in masses.clone().enumerate() {
            let change = particles.velocities[i] - about.velocities_start[i];
            right_side[i] -= change.scaled(mass);
        }
    }
    let share = stiffness_share(model, h);
    for term in &terms {
        let [i, j] = term.particles;
        let w = particles.velocities[j] - particles.velocities[i];
        let push = term.push(w, h, about.start, share);
        let difference = particles.positions[j] - particles.positions[i];
        let pull = difference.scaled(term.e / h) + push;
        right_side[i] += pull;
        right_side[j] -= pull;
    }
    for (_, impulses) in elements {
        right_side.iter_mut().zip(impulses).for_each(|(b, impulse)| *b += *impulse);
    }
    let elements = elements.iter().flat_map(|(blocks, _)| blocks).copied().collect();
    let frictions = vec![Vec::new(); particles.len()];
    LinearSystem { base: base.collect(), terms, elements, frictions, right_side }
}

impl<N: Number> Term<N> {
    /// g I + u u^T.
    fn block(&self) -> Matrix<N> {
        Matrix::diagonal(self.g) + Matrix::outer(self.u, self.u)
    }

    /// What the right-hand side has of it for velocities that differ by w.
    fn push(&self, w: Vector<N>, h: N, start: NewtonStart, share: N) -> Vector<N> {
        let along = self.u.dot(w);
        match (self.damping, start) {
            (Some(_), NewtonStart::StepStart) => w.scaled(self.g) + self.u.scaled(along),
            (Some(damping), NewtonStart::Iterate) => {
                let square = self.u.dot(self.u);
                if square.value() > 0.0 {
                    self.u.scaled(h * damping / square * along)
                } else {
                    Vector::ZERO
                }
            }
            (None, NewtonStart::StepStart) => self.u.scaled(along).scaled(share),
            (None, NewtonStart::Iterate) => Vector::ZERO,
        }
    }
}

/// rho, the share of a contact term that comes from the stiffness.
fn stiffness_share<N: Number>(model: &Model, h: N) -> N {
    match model.self_contact().map(|contact| contact.response) {
        Some(ContactResponse::Penalty { stiffness, damping }) => {
            let stiffness = h * N::rounded(stiffness);
            stiffness / (stiffness + N::rounded(damping))
        }
        _ => N::ZERO,
    }
}

impl<N: Number> LinearSystem<N> {
    /// Adds the drag c \[kg\] of a contact that slides: c P to B and D, -c P (v - u) to b, v - u being
    /// `relative` and P the projector on the plane of `normal`.
    pub(super) fn add_drag(
        &mut self,
        particle: usize,
        drag: N,
        normal: Vector<N>,
        relative: Vector<N>,
    ) {
        let across = Matrix::outer(normal, normal);
        let plane = (Matrix::diagonal(N::ONE) + across.negated()).scaled(drag);
        self.frictions[particle].push(plane);
        self.right_side[particle] -= plane.apply(relative);
    }

    /// A diagonal block with what friction has done to it.
    fn with_friction(&self, particle: usize, block: Matrix<N>) -> Matrix<N> {
        self.frictions[particle].iter().fold(block, |block, &friction| block + friction)
    }

    /// D, the diagonal blocks.
    #[must_use]
    pub fn diagonal(&self) -> Vec<Matrix<N>> {
        let mut blocks = self.base.clone();
        for term in &self.terms {
            let block = term.block();
            term.particles.into_iter().for_each(|particle| blocks[particle] += block);
        }
        for element in self.elements.iter().filter(|element| element.row == element.column) {
            blocks[element.row] += element.block;
        }
        blocks.into_iter().enumerate().map(|(i, block)| self.with_friction(i, block)).collect()
    }

    /// All blocks that can differ from zero, by row and column.
    #[must_use]
    pub fn blocks(&self) -> BTreeMap<[usize; 2], Matrix<N>> {
        let diagonal = self.diagonal().into_iter().enumerate();
        let mut blocks: BTreeMap<_, _> = diagonal.map(|(i, block)| ([i, i], block)).collect();
        for term in &self.terms {
            let ([i, j], block) = (term.particles, term.block().negated());
            for place in [[i, j], [j, i]] {
                *blocks.entry(place).or_default() += block;
            }
        }
        for ElementBlock { row, column, block, .. } in &self.elements {
            if row != column {
                *blocks.entry([*row, *column]).or_default() += *block;
            }
        }
        blocks
    }

    /// `matrix_apply`: A p, spring by spring.
    #[must_use]
    pub fn apply(&self, p: &[Vector<N>]) -> Vec<Vector<N>> {
        let base = self.base.iter().zip(p).enumerate();
        let mut image: Vec<_> =
            base.map(|(i, (&base, &p))| self.with_friction(i, base).apply(p)).collect();
        for Term { particles: [i, j], g, u, .. } in &self.terms {
            let difference = p[*i] - p[*j];
            let part = difference.scaled(*g) + u.scaled(u.dot(difference));
            image[*i] += part;
            image[*j] -= part;
        }
        for ElementBlock { row, column, block, is_internal } in &self.elements {
            let of = if *is_internal { p[*column] - p[*row] } else { p[*column] };
            image[*row] += block.apply(of);
        }
        image
    }

    /// `matrix_apply`: A p, from blocks.
    #[must_use]
    pub fn apply_blocks(&self, p: &[Vector<N>]) -> Vec<Vector<N>> {
        let mut image = vec![Vector::ZERO; p.len()];
        for ([row, column], block) in self.blocks() {
            image[row] += block.apply(p[column]);
        }
        image
    }
}
