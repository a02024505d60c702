//! NUMERICS §2: springs with dampers.

use cloth_core::Real;

use crate::{
    elasticity::{Elasticity, Linear},
    memory::{LANES, Lanes, Motion, lanes},
    springs::{Column, Neighbours, SpringColumns},
};

/// Positions and velocities of all particles, with margins.
#[derive(Clone, Copy)]
pub(crate) struct MotionView<'a, T> {
    pub(crate) x: [&'a [T]; 3],
    pub(crate) v: [&'a [T]; 3],
    pub(crate) margin: usize,
}

impl<'a, T: Real> MotionView<'a, T> {
    pub(crate) fn new(motion: &'a Motion<T>) -> Self {
        Self {
            x: motion.position.padded(),
            v: motion.velocity.padded(),
            margin: motion.position.margin(),
        }
    }

    /// Position of the particles of a packet.
    #[inline(always)]
    pub(crate) fn position(&self, first: usize) -> [&'a Lanes<T>; 3] {
        let [x, y, z] = self.x;
        let at = self.margin + first;
        [lanes(x, at), lanes(y, at), lanes(z, at)]
    }

    /// Velocity of the particles of a packet.
    #[inline(always)]
    pub(crate) fn velocity(&self, first: usize) -> [&'a Lanes<T>; 3] {
        let [u, v, w] = self.v;
        let at = self.margin + first;
        [lanes(u, at), lanes(v, at), lanes(w, at)]
    }
}

/// What is done with each column of a packet. A trait rather than a closure, as only a method can be
/// forced inline, without which it would not be compiled for the processor's vector instructions.
pub(crate) trait ColumnVisitor<T> {
    /// `elasticity` is that of the column, `neighbours` are their positions and velocities.
    fn visit(
        &mut self,
        column: &Column<T>,
        elasticity: &impl Elasticity<T>,
        neighbours: PacketView<'_, T>,
    );
}

/// Shows the columns of the packet that starts at particle `first` to a visitor, in order.
#[inline(always)]
pub(crate) fn visit_columns<T: Real>(
    springs: &SpringColumns<T>,
    motion: MotionView<'_, T>,
    first: usize,
    visitor: &mut impl ColumnVisitor<T>,
) {
    // Two loops, so that the sums of a visitor stay in registers where no spring buckles.
    if springs.can_buckle() {
        visit_columns_of::<T, true>(springs, motion, first, visitor);
    } else {
        visit_columns_of::<T, false>(springs, motion, first, visitor);
    }
}

#[inline(always)]
fn visit_columns_of<T: Real, const CAN_BUCKLE: bool>(
    springs: &SpringColumns<T>,
    motion: MotionView<'_, T>,
    first: usize,
    visitor: &mut impl ColumnVisitor<T>,
) {
    for column in springs.packet(first / LANES) {
        match &column.neighbours {
            Neighbours::Offset(offset) => {
                let start = (motion.margin + first).wrapping_add_signed(*offset as isize);
                let [x, y, z] = motion.x;
                let [u, v, w] = motion.v;
                let x = [lanes(x, start), lanes(y, start), lanes(z, start)];
                let v = [lanes(u, start), lanes(v, start), lanes(w, start)];
                visit_column::<T, CAN_BUCKLE>(column, (x, v), visitor);
            }
            Neighbours::Indices(indices) => {
                let mut x = [[T::ZERO; LANES]; 3];
                let mut v = [[T::ZERO; LANES]; 3];
                for lane in 0..LANES {
                    let at = motion.margin + indices[lane] as usize;
                    for axis in 0..3 {
                        x[axis][lane] = motion.x[axis][at];
                        v[axis][lane] = motion.v[axis][at];
                    }
                }
                visit_column::<T, CAN_BUCKLE>(column, (x.each_ref(), v.each_ref()), visitor);
            }
        }
    }
}

/// Shows one column to a visitor, compiled for each elasticity.
#[inline(always)]
fn visit_column<T: Real, const CAN_BUCKLE: bool>(
    column: &Column<T>,
    neighbours: PacketView<'_, T>,
    visitor: &mut impl ColumnVisitor<T>,
) {
    match &column.buckling {
        Some(buckling) if CAN_BUCKLE => visitor.visit(column, &**buckling, neighbours),
        _ => visitor.visit(column, &Linear, neighbours),
    }
}

/// Adds the forces of the springs of a packet.
#[inline(always)]
pub(crate) fn packet<T: Real>(
    springs: &SpringColumns<T>,
    motion: MotionView<'_, T>,
    first: usize,
    force: &mut [Lanes<T>; 3],
) {
    let mut sum =
        ForceSum { motion: (motion.position(first), motion.velocity(first)), force: *force };
    visit_columns(springs, motion, first, &mut sum);
    *force = sum.force;
}

/// A spring of one lane, seen from its particle in the packet.
pub(crate) struct Spring<T> {
    /// From the particle to its neighbour \[m\].
    pub(crate) difference: [T; 3],
    /// Length beyond the rest length \[m\].
    pub(crate) stretch: T,
    /// Force along the spring \[N\], zero in a lane without one.
    pub(crate) tension: T,
    /// 1 / length \[1/m\], bounded for coinciding particles.
    pub(crate) inverse_length: T,
}

impl<T: Real> Spring<T> {
    /// The spring of `lane` in a column with this elasticity, between a packet and the neighbours in
    /// that column, both with position and velocity.
    #[inline(always)]
    pub(crate) fn new(
        column: &Column<T>,
        elasticity: &impl Elasticity<T>,
        ([xi, yi, zi], [ui, vi, wi]): PacketView<'_, T>,
        ([xj, yj, zj], [uj, vj, wj]): PacketView<'_, T>,
        lane: usize,
    ) -> Self {
        let dx = xj[lane] - xi[lane];
        let dy = yj[lane] - yi[lane];
        let dz = zj[lane] - zi[lane];
        let length = (dx * dx + dy * dy + dz * dz).sqrt();
        let inverse_length = T::ONE / length.maximum(T::LENGTH_MIN);
        let rate =
            ((uj[lane] - ui[lane]) * dx + (vj[lane] - vi[lane]) * dy + (wj[lane] - wi[lane]) * dz)
                * inverse_length;
        let stretch = length - column.rest_length[lane];
        // A lane without a spring has stiffness and damping zero.
        let tension =
            elasticity.tension(lane, column.stiffness[lane], stretch) + column.damping[lane] * rate;
        Self { difference: [dx, dy, dz], stretch, tension, inverse_length }
    }

    /// Force on the particle \[N\].
    #[inline(always)]
    pub(crate) fn force(&self) -> [T; 3] {
        let scale = self.tension * self.inverse_length;
        let [dx, dy, dz] = self.difference;
        [scale * dx, scale * dy, scale * dz]
    }
}

/// Position and velocity of a packet.
pub(crate) type PacketView<'a, T> = ([&'a Lanes<T>; 3], [&'a Lanes<T>; 3]);

/// Position, velocity and force of a packet.
struct ForceSum<'a, T> {
    motion: PacketView<'a, T>,
    force: [Lanes<T>; 3],
}

impl<T: Real> ColumnVisitor<T> for ForceSum<'_, T> {
    #[inline(always)]
    fn visit(
        &mut self,
        column: &Column<T>,
        elasticity: &impl Elasticity<T>,
        neighbours: PacketView<'_, T>,
    ) {
        for lane in 0..LANES {
            let [fx, fy, fz] =
                Spring::new(column, elasticity, self.motion, neighbours, lane).force();
            self.force[0][lane] += fx;
            self.force[1][lane] += fy;
            self.force[2][lane] += fz;
        }
    }
}
