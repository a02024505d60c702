//! Where the particles and springs of one cloth come from.

use crate::{ModelError, TriangleMesh};

use super::{SpringClass, SpringCoefficients};

/// Source of the particles and springs of one cloth.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// A rectangular patch.
    Grid(GridPatch),
    /// Any triangle mesh: edges become stretch springs, the two vertices opposite to an inner edge
    /// are joined by a bend spring.
    Mesh(TriangleMesh),
    /// Particles and springs without a surface: yarns, ropes, test rigs.
    Network(SpringNetwork),
}

/// A rectangular patch of `columns` x `rows` particles. Particle (column i, row j) has index
/// j columns + i and starts at origin + i spacing\[0\] column_axis + j spacing\[1\] row_axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridPatch {
    /// Particles along the column axis, at least 2.
    pub columns: u32,
    /// Particles along the row axis, at least 2.
    pub rows: u32,
    /// Distance of neighbouring particles along both axes \[m\]; also their rest length.
    pub spacing: [f64; 2],
    /// Position of particle 0 \[m\].
    pub origin: [f64; 3],
    /// Direction in which the column index grows, of unit length.
    pub column_axis: [f64; 3],
    /// Direction in which the row index grows, of unit length.
    pub row_axis: [f64; 3],
    /// Which neighbours are joined by springs.
    pub stencil: Stencil,
}

/// The neighbours of a grid particle that it is joined to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stencil {
    /// 4 stretch, 4 shear on the diagonals, 4 bend skipping one particle.
    Neighbours12,
    /// All of the surrounding 5 x 5 block: beside the twelve, the eight knight's moves and the four
    /// far diagonals, both as bend springs.
    Neighbours24,
}

/// Particles and springs given one by one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpringNetwork {
    /// Particle positions \[m\].
    pub positions: Vec<[f64; 3]>,
    /// The springs; every pair at most once.
    pub springs: Vec<NetworkSpring>,
}

/// One spring of a [`SpringNetwork`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NetworkSpring {
    /// The two particles.
    pub particles: [u32; 2],
    /// What the spring is for; selects stiffness and damping of the material.
    pub class: SpringClass,
    /// Rest length \[m\], or `None` for the distance at the start.
    pub rest_length: Option<f64>,
    /// Stiffness and damping of this spring, or `None` for those of its class.
    pub coefficients: Option<SpringCoefficients>,
}

impl Geometry {
    /// Number of particles.
    #[must_use]
    pub fn particle_count(&self) -> u64 {
        match self {
            Self::Grid(patch) => u64::from(patch.columns) * u64::from(patch.rows),
            Self::Mesh(mesh) => mesh.positions.len() as u64,
            Self::Network(network) => network.positions.len() as u64,
        }
    }

    /// Mean distance of neighbouring particles \[m\]: of a grid its spacing, of a mesh the mean
    /// length of the sides of its triangles, of a network the mean length of its springs.
    #[must_use]
    pub fn spacing(&self) -> f64 {
        let mean = |pairs: &mut dyn Iterator<Item = [u32; 2]>, positions: &[[f64; 3]]| {
            let (sum, count) = pairs
                .filter_map(|[a, b]| {
                    let a = glam::DVec3::from(*positions.get(a as usize)?);
                    Some(a.distance((*positions.get(b as usize)?).into()))
                })
                .fold((0.0, 0_u64), |(sum, count), length| (sum + length, count + 1));
            sum / count.max(1) as f64
        };
        match self {
            Self::Grid(patch) => 0.5 * (patch.spacing[0] + patch.spacing[1]),
            Self::Mesh(mesh) => mean(
                &mut mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]),
                &mesh.positions,
            ),
            Self::Network(network) => {
                mean(&mut network.springs.iter().map(|spring| spring.particles), &network.positions)
            }
        }
    }
}

impl Stencil {
    /// Half of the stencil, the offsets (column, row) that lead to a larger particle index, sorted
    /// by that index; the other half are their negatives.
    #[must_use]
    pub const fn upper_offsets(self) -> &'static [([i32; 2], SpringClass)] {
        use SpringClass::{Bend, Shear, Stretch};
        match self {
            Self::Neighbours12 => &[
                ([1, 0], Stretch),
                ([2, 0], Bend),
                ([-1, 1], Shear),
                ([0, 1], Stretch),
                ([1, 1], Shear),
                ([0, 2], Bend),
            ],
            Self::Neighbours24 => &[
                ([1, 0], Stretch),
                ([2, 0], Bend),
                ([-2, 1], Bend),
                ([-1, 1], Shear),
                ([0, 1], Stretch),
                ([1, 1], Shear),
                ([2, 1], Bend),
                ([-2, 2], Bend),
                ([-1, 2], Bend),
                ([0, 2], Bend),
                ([1, 2], Bend),
                ([2, 2], Bend),
            ],
        }
    }
}

impl GridPatch {
    /// A patch of `counts` (columns, rows) particles that are `spacing` \[m\] apart, in the plane z = 0 with its middle at
    /// the origin: columns along x, rows along y.
    #[must_use]
    pub fn new(counts: [u32; 2], spacing: f64) -> Self {
        let [columns, rows] = counts;
        let patch = Self::horizontal(columns, spacing, 0.0);
        Self { columns, rows, ..patch }.with_centre([0.0; 3])
    }

    /// The same patch with its middle at `centre` \[m\].
    #[must_use]
    pub fn with_centre(mut self, centre: [f64; 3]) -> Self {
        let [u, v] = self.half_size();
        self.origin =
            std::array::from_fn(|k| centre[k] - u * self.column_axis[k] - v * self.row_axis[k]);
        self
    }

    /// The same patch along other axes, which have unit length and are at a right angle; its middle stays.
    #[must_use]
    pub fn with_axes(mut self, column_axis: [f64; 3], row_axis: [f64; 3]) -> Self {
        let centre = self.centre();
        (self.column_axis, self.row_axis) = (column_axis, row_axis);
        self.with_centre(centre)
    }

    /// The middle of the patch \[m\].
    #[must_use]
    pub fn centre(&self) -> [f64; 3] {
        let [u, v] = self.half_size();
        std::array::from_fn(|k| self.origin[k] + u * self.column_axis[k] + v * self.row_axis[k])
    }

    /// From the first particle to the middle along both axes \[m\].
    fn half_size(&self) -> [f64; 2] {
        let half = |count: u32, spacing: f64| 0.5 * f64::from(count.saturating_sub(1)) * spacing;
        [half(self.columns, self.spacing[0]), half(self.rows, self.spacing[1])]
    }

    /// A square patch in the plane z = `height` \[m\], centred on the z axis.
    #[must_use]
    pub fn horizontal(particles_per_side: u32, spacing: f64, height: f64) -> Self {
        let half = 0.5 * f64::from(particles_per_side.saturating_sub(1)) * spacing;
        Self {
            columns: particles_per_side,
            rows: particles_per_side,
            spacing: [spacing; 2],
            origin: [-half, -half, height],
            column_axis: [1.0, 0.0, 0.0],
            row_axis: [0.0, 1.0, 0.0],
            stencil: Stencil::Neighbours12,
        }
    }

    /// Index of the particle at (column, row) within the cloth.
    #[must_use]
    pub const fn particle(&self, column: u32, row: u32) -> u32 {
        row * self.columns + column
    }

    /// Position of the particle at (column, row) \[m\].
    #[must_use]
    pub fn position(&self, column: u32, row: u32) -> [f64; 3] {
        let [u, v] = [f64::from(column) * self.spacing[0], f64::from(row) * self.spacing[1]];
        std::array::from_fn(|k| self.origin[k] + u * self.column_axis[k] + v * self.row_axis[k])
    }

    /// Rest length of the spring across `offset` (columns, rows) \[m\].
    #[must_use]
    pub fn rest_length(&self, offset: [i32; 2]) -> f64 {
        let [u, v] =
            [f64::from(offset[0]) * self.spacing[0], f64::from(offset[1]) * self.spacing[1]];
        (u * u + v * v).sqrt()
    }

    /// The two triangles of every cell, counter-clockwise seen against column axis x row axis.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        (0..self.rows.saturating_sub(1)).flat_map(move |row| {
            (0..self.columns.saturating_sub(1)).flat_map(move |column| {
                let [a, b] = [self.particle(column, row), self.particle(column + 1, row)];
                let [c, d] = [a + self.columns, b + self.columns];
                [[a, b, d], [a, d, c]]
            })
        })
    }

    /// Checks counts, spacing and axes; `cloth` is whose patch it is, for the error.
    ///
    /// # Errors
    /// The first of them that makes no sense.
    pub fn validate(&self, cloth: &str) -> Result<(), ModelError> {
        use crate::error::{finite_all, in_range, positive};
        if self.columns < 2 || self.rows < 2 {
            return Err(ModelError::GridTooSmall {
                cloth: cloth.into(),
                columns: self.columns,
                rows: self.rows,
            });
        }
        for spacing in self.spacing {
            positive(|| format!("spacing of cloth {cloth:?}"), spacing)?;
        }
        finite_all(|| format!("origin of cloth {cloth:?}"), &self.origin)?;
        for (name, axis) in [("column", self.column_axis), ("row", self.row_axis)] {
            let length = glam::DVec3::from(axis).length();
            in_range(
                || format!("length of the {name} axis of cloth {cloth:?}"),
                length,
                [1.0 - 1e-6, 1.0 + 1e-6],
            )?;
        }
        let cosine = glam::DVec3::from(self.column_axis).dot(self.row_axis.into());
        in_range(|| format!("cosine between the axes of cloth {cloth:?}"), cosine, [-1e-6, 1e-6])?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patch_is_where_its_middle_is_asked_for() {
        let patch = GridPatch::new([5, 3], 0.5).with_centre([1.0, 2.0, 3.0]);
        assert_eq!(patch.position(0, 0), [0.0, 1.5, 3.0]);
        assert_eq!(patch.position(4, 2), [2.0, 2.5, 3.0]);
        let upright = patch.with_axes([0.0, 1.0, 0.0], [0.0, 0.0, -1.0]);
        assert_eq!(upright.centre(), [1.0, 2.0, 3.0]);
        assert_eq!(upright.position(0, 0), [1.0, 1.0, 3.5]);
        assert_eq!(GridPatch::new([4, 4], 0.5).origin, GridPatch::horizontal(4, 0.5, 0.0).origin);
    }
}
