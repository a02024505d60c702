//! One cloth, before it becomes part of a model.

use super::{Aerodynamics, Geometry, GridPatch, Material, MaterialPreset};
use crate::{TriangleMesh, fabric::Fabric};

/// One cloth, before it becomes part of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Cloth {
    /// Name, unique among the cloths of a model.
    pub name: String,
    /// Particles and springs.
    pub geometry: Geometry,
    /// What it is made of.
    pub material: ClothMaterial,
    /// Particles held in place from the start, as indices within this cloth.
    pub pins: Vec<u32>,
    /// Velocity of all its particles at the start \[m/s\].
    pub velocity: [f64; 3],
}

/// What a cloth is made of: what holds its particles together, mass, thickness, and how the air acts on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClothMaterial {
    /// Springs: between the neighbours in a grid, along the edges of a mesh, or one by one. How the cloth stretches and bends depends
    /// on how it is meshed.
    Springs(Material),
    /// Triangles that stretch and bend as measured in the laboratory, however the cloth is meshed.
    Fabric(FabricMaterial),
}

/// A cloth of triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FabricMaterial {
    /// How it stretches and bends, what it weighs, and how thick it is.
    pub fabric: Fabric,
    /// What shape it has without forces.
    pub rest: RestSource,
    /// Coefficients of the force of the air.
    pub aerodynamics: Aerodynamics,
    /// How far folds at rest are off what `rest` says, at random between this and its negative \[rad\]. No fabric is perfectly flat; one that
    /// is would not know to which side to buckle, and is pressed together within its plane instead. With 0 it is what an experiment wants.
    pub imperfection: f64,
}

impl FabricMaterial {
    /// An imperfection that nobody sees \[rad\]: a hundredth of a millimetre over a width of a centimetre.
    pub const IMPERFECTION: f64 = 1e-3;
}

/// What shape a cloth of triangles has without forces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RestSource {
    /// The flat pattern that it was cut from: the texture coordinates of a mesh times `scale` \[m\], u along the warp; of a grid, its
    /// columns and rows.
    Pattern {
        /// Length of a unit of the coordinates \[m\].
        scale: f64,
    },
    /// The shape in which it starts, folds included.
    Start {
        /// Direction of the warp, of any length, as it lies in each triangle. If there is none, it is the axis of the world along which the mesh
        /// is longest, and in triangles on which that stands up by more than 60 degrees the next one.
        warp: Option<[f64; 3]>,
    },
}

impl RestSource {
    /// Length of a unit of the pattern's coordinates \[m\]; 1 where there is none.
    pub(super) const fn scale(&self) -> f64 {
        match self {
            Self::Pattern { scale } => *scale,
            Self::Start { .. } => 1.0,
        }
    }
}

impl From<Material> for ClothMaterial {
    fn from(material: Material) -> Self {
        Self::Springs(material)
    }
}

impl From<FabricMaterial> for ClothMaterial {
    fn from(material: FabricMaterial) -> Self {
        Self::Fabric(material)
    }
}

impl ClothMaterial {
    /// The springs, unless it is fabric.
    #[must_use]
    pub const fn springs(&self) -> Option<Material> {
        match self {
            Self::Springs(material) => Some(*material),
            Self::Fabric(_) => None,
        }
    }

    /// The springs to change, unless it is fabric.
    #[must_use]
    pub const fn springs_mut(&mut self) -> Option<&mut Material> {
        match self {
            Self::Springs(material) => Some(material),
            Self::Fabric(_) => None,
        }
    }

    /// Coefficients of the force of the air.
    #[must_use]
    pub const fn aerodynamics(&self) -> Aerodynamics {
        match self {
            Self::Springs(material) => material.aerodynamics,
            Self::Fabric(material) => material.aerodynamics,
        }
    }

    /// Thickness \[m\].
    #[must_use]
    pub const fn thickness(&self) -> f64 {
        match self {
            Self::Springs(material) => material.thickness,
            Self::Fabric(material) => material.fabric.thickness,
        }
    }
}

impl Cloth {
    /// A rectangular patch of a fabric, at rest and not held anywhere.
    ///
    /// ```
    /// use cloth_core::{Cloth, GridPatch, MaterialPreset, ModelBuilder};
    ///
    /// # fn main() -> Result<(), cloth_core::ModelError> {
    /// let patch = GridPatch::new([31, 21], 0.02).with_centre([0.0, 0.0, 1.0]);
    /// let towel = Cloth::grid("towel", patch, &MaterialPreset::RIB_KNIT)
    ///     .with_pins([patch.particle(0, 20), patch.particle(30, 20)]);
    /// let model = ModelBuilder::new().cloth(towel).build()?;
    /// assert_eq!((model.particle_count(), model.pins().len()), (651, 2));
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn grid(name: impl Into<String>, patch: GridPatch, fabric: &MaterialPreset) -> Self {
        Self::new(name.into(), Geometry::Grid(patch), fabric)
    }

    /// A triangle mesh of a fabric, at rest and not held anywhere. Its springs have the stiffness of the fabric for the
    /// mean length of its edges.
    ///
    /// ```
    /// use cloth_core::{Cloth, MaterialPreset, ModelBuilder, TriangleMesh};
    ///
    /// # fn main() -> Result<(), cloth_core::ModelError> {
    /// let mesh = TriangleMesh {
    ///     positions: vec![[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.1, 0.0], [0.0, 0.1, 0.0]],
    ///     triangles: vec![[0, 1, 2], [0, 2, 3]],
    ///     ..TriangleMesh::default()
    /// };
    /// let rag = Cloth::mesh("rag", mesh, &MaterialPreset::DENIM).with_velocity([0.0, 0.0, 1.0]);
    /// let model = ModelBuilder::new().cloth(rag).build()?;
    /// assert_eq!(model.springs().len(), 6, "five edges, and one across the inner edge");
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn mesh(name: impl Into<String>, mesh: TriangleMesh, fabric: &MaterialPreset) -> Self {
        Self::new(name.into(), Geometry::Mesh(mesh), fabric)
    }

    /// A rectangular patch of a fabric by its laboratory numbers, at rest and not held anywhere. Its warp runs along the columns, and
    /// the diagonals of its cells alternate; [`GridPatch::mesh`] with [`Self::fabric_mesh`] has other meshings.
    ///
    /// ```
    /// use cloth_core::{Cloth, GridPatch, ModelBuilder, fabric::{BendingSheet, FabricSheet}};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// // A strip that hangs down by 41.5 degrees when 5 cm of it are over the edge.
    /// let sheet = FabricSheet {
    ///     area_density: 0.15,
    ///     bending: [Some(BendingSheet::Overhang(0.05)), None, None],
    ///     ..FabricSheet::default()
    /// };
    /// let (poplin, _) = sheet.fit("poplin")?;
    /// let patch = GridPatch::new([31, 21], 0.02).with_centre([0.0, 0.0, 1.0]);
    /// let towel = Cloth::fabric("towel", patch, poplin.with_usual_damping());
    /// let model = ModelBuilder::new().cloth(towel).build()?;
    /// assert_eq!(model.elements().triangles().len(), 1200);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn fabric(name: impl Into<String>, patch: GridPatch, fabric: Fabric) -> Self {
        let rest = RestSource::Pattern { scale: 1.0 };
        Self::of_fabric(name.into(), Geometry::Grid(patch), fabric, rest)
    }

    /// A triangle mesh of a fabric by its laboratory numbers, at rest and not held anywhere. `rest` says where its pattern comes from,
    /// [`TriangleMesh::grain`] turns the warp.
    #[must_use]
    pub fn fabric_mesh(
        name: impl Into<String>,
        mesh: TriangleMesh,
        fabric: Fabric,
        rest: RestSource,
    ) -> Self {
        Self::of_fabric(name.into(), Geometry::Mesh(mesh), fabric, rest)
    }

    fn of_fabric(name: String, geometry: Geometry, fabric: Fabric, rest: RestSource) -> Self {
        let aerodynamics = Aerodynamics::default();
        let imperfection = FabricMaterial::IMPERFECTION;
        let material = FabricMaterial { fabric, rest, aerodynamics, imperfection }.into();
        Self { name, geometry, material, pins: Vec::new(), velocity: [0.0; 3] }
    }

    fn new(name: String, geometry: Geometry, fabric: &MaterialPreset) -> Self {
        // A mesh without edges has none; the model refuses it for what it is.
        let spacing = Some(geometry.spacing()).filter(|&spacing| spacing > 0.0).unwrap_or(1.0);
        let material = fabric.material(spacing).into();
        Self { name, geometry, material, pins: Vec::new(), velocity: [0.0; 3] }
    }

    /// Holds these particles in place from the start, beside those held already.
    #[must_use]
    pub fn with_pins(mut self, pins: impl IntoIterator<Item = u32>) -> Self {
        self.pins.extend(pins);
        self
    }

    /// Lets all particles start with a velocity \[m/s\].
    #[must_use]
    pub const fn with_velocity(mut self, velocity: [f64; 3]) -> Self {
        self.velocity = velocity;
        self
    }

    /// Makes it of a material of one's own.
    #[must_use]
    pub fn with_material(mut self, material: impl Into<ClothMaterial>) -> Self {
        self.material = material.into();
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ModelBuilder, ModelError};

    #[test]
    fn a_cloth_has_the_material_of_its_spacing() {
        let patch = GridPatch::new([4, 3], 0.05);
        let cloth =
            Cloth::grid("patch", patch, &MaterialPreset::DENIM).with_pins([1]).with_pins([2]);
        assert_eq!(cloth.material, MaterialPreset::DENIM.material(0.05).into());
        assert_eq!((cloth.pins, cloth.velocity), (vec![1, 2], [0.0; 3]));
    }

    #[test]
    fn a_mesh_without_triangles_is_refused_as_that() {
        let mesh = TriangleMesh { positions: vec![[0.0; 3]], ..TriangleMesh::default() };
        let cloth = Cloth::mesh("nothing", mesh, &MaterialPreset::DENIM);
        let error = ModelBuilder::new().cloth(cloth).build().unwrap_err();
        assert!(matches!(error, ModelError::MeshEmpty { triangles: 0, .. }), "{error}");
    }
}
