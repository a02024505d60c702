//! NUMERICS §5, `matrix_apply`: the product of the matrix with a vector, spring by spring.

use cloth_core::Real;

use super::{matrix::Matrix, spring_factors::Term};
use crate::{
    memory::{FieldView, LANES, Lanes, lanes, lanes_mut},
    springs::{Neighbours, SpringColumns},
};

/// Packets of a run that are worked on together: enough to hide what it takes to find the numbers of
/// a term, few enough that all sums stay in registers.
const GROUP: usize = 4;

/// The rows of A of the particles from `first` on, as many as `to` has, times a vector, for a model
/// of `count` particles.
#[inline(always)]
pub(super) fn rows<T: Real>(
    matrix: &Matrix<T>,
    springs: &SpringColumns<T>,
    vector: FieldView<'_, T>,
    (first, count): (usize, usize),
    to: &mut [&mut [T]; 3],
) {
    let end = (first + to[0].len()) / LANES;
    let mut packet_index = first / LANES;
    while packet_index < end {
        let local = packet_index * LANES - first;
        match matrix.factors.run(packet_index, end) {
            Some((length, terms)) if length >= GROUP && matrix.contacts.is_empty() => {
                let sums = group(matrix, terms, vector, first + local);
                for (number, sum) in sums.iter().enumerate() {
                    for axis in 0..3 {
                        *lanes_mut(to[axis], local + number * LANES) = sum[axis];
                    }
                }
                packet_index += GROUP;
            }
            _ => {
                let sum = packet(matrix, springs, vector, first + local, count);
                for axis in 0..3 {
                    *lanes_mut(to[axis], local) = sum[axis];
                }
                packet_index += 1;
            }
        }
    }
}

/// [`GROUP`] packets of a run.
#[inline(always)]
fn group<T: Real>(
    matrix: &Matrix<T>,
    terms: &[Term],
    vector: FieldView<'_, T>,
    first: usize,
) -> [[Lanes<T>; 3]; GROUP] {
    let mut sums = [[[T::ZERO; LANES]; 3]; GROUP];
    for number in 0..GROUP {
        let at = (first + number * LANES) as isize;
        sums[number] = base(matrix, vector.packet(at), at);
    }
    let own = vector.range(first as isize, GROUP * LANES);
    for &term in terms {
        let (u, g) = matrix.factors.term(term, first, GROUP * LANES);
        let other = vector.range(first as isize + term.offset as isize, GROUP * LANES);
        for number in 0..GROUP {
            let at = number * LANES;
            let u = [lanes(u[0], at), lanes(u[1], at), lanes(u[2], at)];
            let own = [lanes(own[0], at), lanes(own[1], at), lanes(own[2], at)];
            let other = [lanes(other[0], at), lanes(other[1], at), lanes(other[2], at)];
            spring(&mut sums[number], (u, lanes(g, at)), own, other);
        }
    }
    sums
}

/// The rows of the packet that starts at particle `first`.
#[inline(always)]
fn packet<T: Real>(
    matrix: &Matrix<T>,
    springs: &SpringColumns<T>,
    vector: FieldView<'_, T>,
    first: usize,
    count: usize,
) -> [Lanes<T>; 3] {
    let at = first as isize;
    let own = vector.packet(at);
    let mut sum = base(matrix, own, at);
    let places = matrix.factors.packet(first / LANES)..;
    for (column, place) in springs.packet(first / LANES).iter().zip(places) {
        let factors = matrix.factors.at(place, first);
        match &column.neighbours {
            Neighbours::Offset(offset) => {
                spring(&mut sum, factors, own, vector.packet(at + *offset as isize));
            }
            Neighbours::Indices(indices) => {
                spring(&mut sum, factors, own, vector.gather(indices).each_ref());
            }
        }
    }
    if !matrix.contacts.is_empty() {
        for lane in 0..LANES.min(count - first) {
            contacts(matrix, &mut sum, vector, first, lane);
        }
    }
    sum
}

/// B times the vector.
#[inline(always)]
fn base<T: Real>(matrix: &Matrix<T>, own: [&Lanes<T>; 3], at: isize) -> [Lanes<T>; 3] {
    let diagonal = FieldView::new(&matrix.base.diagonal).packet(at);
    let mut sum = [[T::ZERO; LANES]; 3];
    for axis in 0..3 {
        for lane in 0..LANES {
            sum[axis][lane] = diagonal[axis][lane] * own[axis][lane];
        }
    }
    if let Some(field) = &matrix.base.off_diagonal {
        let [xy, xz, yz] = FieldView::new(field).packet(at);
        let [x, y, z] = own;
        for lane in 0..LANES {
            sum[0][lane] += xy[lane] * y[lane] + xz[lane] * z[lane];
            sum[1][lane] += xy[lane] * x[lane] + yz[lane] * z[lane];
            sum[2][lane] += xz[lane] * x[lane] + yz[lane] * y[lane];
        }
    }
    sum
}

#[inline(always)]
fn spring<T: Real>(
    sum: &mut [Lanes<T>; 3],
    ([ux, uy, uz], g): ([&Lanes<T>; 3], &Lanes<T>),
    [xi, yi, zi]: [&Lanes<T>; 3],
    [xj, yj, zj]: [&Lanes<T>; 3],
) {
    for lane in 0..LANES {
        let (a, b, c) = (xi[lane] - xj[lane], yi[lane] - yj[lane], zi[lane] - zj[lane]);
        let along = ux[lane] * a + uy[lane] * b + uz[lane] * c;
        sum[0][lane] += g[lane] * a + ux[lane] * along;
        sum[1][lane] += g[lane] * b + uy[lane] * along;
        sum[2][lane] += g[lane] * c + uz[lane] * along;
    }
}

#[inline(always)]
fn contacts<T: Real>(
    matrix: &Matrix<T>,
    sum: &mut [Lanes<T>; 3],
    vector: FieldView<'_, T>,
    first: usize,
    lane: usize,
) {
    let own = vector.get(first + lane);
    for pair in matrix.contacts.of(first + lane) {
        let other = vector.get(pair.partner);
        let u = pair.u;
        let along =
            u[0] * (own[0] - other[0]) + u[1] * (own[1] - other[1]) + u[2] * (own[2] - other[2]);
        for axis in 0..3 {
            sum[axis][lane] += u[axis] * along;
        }
    }
}
