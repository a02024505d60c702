//! NUMERICS §5, `matrix_apply`: the product of the matrix with a vector, spring by spring.

use cloth_core::Real;

use super::{
    matrix::Matrix,
    spring_factors::{Factors, GROUP, Group, across},
};
use crate::{
    memory::{FieldView, LANES, Lanes, lanes, lanes_mut},
    springs::{Neighbours, SpringColumns},
};

/// The rows of A of the particles from `first` on, as many as `to` has, times a vector, for a model
/// of `count` particles; the products are those of contacts with the vector.
#[inline(always)]
pub(super) fn rows<T: Real>(
    matrix: &Matrix<T>,
    springs: &SpringColumns<T>,
    (vector, products): (FieldView<'_, T>, &[[T; 3]]),
    (first, count): (usize, usize),
    to: &mut [&mut [T]; 3],
) {
    let end = (first + to[0].len()) / LANES;
    let mut packet_index = first / LANES;
    while packet_index < end {
        let local = packet_index * LANES - first;
        let is_plain =
            matrix.contacts.is_empty() && matrix.rows.is_empty() && matrix.elements.is_none();
        let whole = if is_plain { matrix.factors.group(packet_index) } else { None };
        match whole {
            Some(whole) => {
                let sums = group(matrix, &whole, vector, first + local);
                for (number, sum) in sums.iter().enumerate() {
                    for axis in 0..3 {
                        *lanes_mut(to[axis], local + number * LANES) = sum[axis];
                    }
                }
                packet_index += GROUP;
            }
            None => {
                let sum = packet(matrix, springs, (vector, products), first + local, count);
                for axis in 0..3 {
                    *lanes_mut(to[axis], local) = sum[axis];
                }
                packet_index += 1;
            }
        }
    }
}

/// [`GROUP`] packets that have the same offsets.
#[inline(always)]
fn group<T: Real>(
    matrix: &Matrix<T>,
    Group { offsets, roots, along: [first_along, second_along] }: &Group<'_, T>,
    vector: FieldView<'_, T>,
    first: usize,
) -> [[Lanes<T>; 3]; GROUP] {
    let mut sums = [[[T::ZERO; LANES]; 3]; GROUP];
    for number in 0..GROUP {
        let at = (first + number * LANES) as isize;
        sums[number] = base(matrix, vector.packet(at), at);
    }
    let position = FieldView::new(&matrix.factors.position);
    let own = vector.range(first as isize, GROUP * LANES);
    let own_at = position.range(first as isize, GROUP * LANES);
    let along = first_along.iter().zip(*second_along);
    for ((&offset, roots), along) in offsets.iter().zip(*roots).zip(along) {
        let along = [along.0, along.1];
        let neighbour = first as isize + offset as isize;
        let other = vector.range(neighbour, GROUP * LANES);
        let other_at = position.range(neighbour, GROUP * LANES);
        for number in 0..GROUP {
            let at = number * LANES;
            let ends = [packet_of(own_at, at), packet_of(other_at, at)];
            let vectors = [packet_of(own, at), packet_of(other, at)];
            let factors = Factors { root: &roots[number].0, along: &along[number].0 };
            column(&mut sums[number], factors, ends, vectors);
        }
    }
    sums
}

/// The rows of the packet that starts at particle `first`.
#[inline(always)]
fn packet<T: Real>(
    matrix: &Matrix<T>,
    springs: &SpringColumns<T>,
    (vector, products): (FieldView<'_, T>, &[[T; 3]]),
    first: usize,
    count: usize,
) -> [Lanes<T>; 3] {
    let at = first as isize;
    let position = FieldView::new(&matrix.factors.position);
    let (own, own_at) = (vector.packet(at), position.packet(at));
    let mut sum = base(matrix, own, at);
    let columns = springs.packet(first / LANES).iter();
    for (kind, factors) in columns.zip(matrix.factors.packet(first / LANES)) {
        match &kind.neighbours {
            Neighbours::Offset(offset) => {
                let neighbour = at + *offset as isize;
                let ends = [own_at, position.packet(neighbour)];
                column(&mut sum, factors, ends, [own, vector.packet(neighbour)]);
            }
            Neighbours::Indices(indices) => {
                let (other, other_at) = (vector.gather(indices), position.gather(indices));
                let ends = [own_at, other_at.each_ref()];
                column(&mut sum, factors, ends, [own, other.each_ref()]);
            }
        }
    }
    if !matrix.contacts.is_empty() {
        for lane in 0..LANES.min(count - first) {
            contacts(matrix, &mut sum, vector, first, lane);
        }
    }
    if !matrix.rows.is_empty() {
        for lane in 0..LANES.min(count - first) {
            if let Some(product) = matrix.rows.times(first + lane, products) {
                (0..3).for_each(|axis| sum[axis][lane] += product[axis]);
            }
        }
    }
    if let Some(elements) = &matrix.elements {
        let product = elements.packet_times(first / LANES, vector);
        for axis in 0..3 {
            for lane in 0..LANES {
                sum[axis][lane] += product[axis][lane];
            }
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
fn packet_of<T: Real>([x, y, z]: [&[T]; 3], start: usize) -> [&Lanes<T>; 3] {
    [lanes(x, start), lanes(y, start), lanes(z, start)]
}

/// Positions of the ends of springs, or vectors there.
type Ends<'a, T> = [[&'a Lanes<T>; 3]; 2];

/// Adds the springs of a column: their factors, positions of their ends, vectors of their ends.
#[inline(always)]
fn column<T: Real>(
    sum: &mut [Lanes<T>; 3],
    Factors { root, along }: Factors<'_, T>,
    [[xi, yi, zi], [xj, yj, zj]]: Ends<'_, T>,
    [[ai, bi, ci], [aj, bj, cj]]: Ends<'_, T>,
) {
    for lane in 0..LANES {
        let (a, b, c) = (ai[lane] - aj[lane], bi[lane] - bj[lane], ci[lane] - cj[lane]);
        let x = root[lane] * (xj[lane] - xi[lane]);
        let y = root[lane] * (yj[lane] - yi[lane]);
        let z = root[lane] * (zj[lane] - zi[lane]);
        let g = across(along[lane], [x, y, z]);
        let product = x * a + y * b + z * c;
        sum[0][lane] += g * a + x * product;
        sum[1][lane] += g * b + y * product;
        sum[2][lane] += g * c + z * product;
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
