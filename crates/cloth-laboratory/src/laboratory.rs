//! Where experiments are made, and what they make models of.

use std::sync::Arc;

use cloth_core::{
    Aerodynamics, Backend, Cloth, Error, FabricMaterial, Geometry, Kernels, Model, ModelBuilder,
    Precision, RestSource, Result, SolverConfig, State, TriangleMesh, fabric::Fabric,
};

/// Where experiments are made.
#[derive(Clone, Copy)]
pub struct Laboratory<'a> {
    /// What computes.
    pub backend: &'a dyn Backend,
    /// In which precision.
    pub precision: Precision,
    /// How much is done.
    pub thoroughness: Thoroughness,
    /// What is wrong with the laboratory on purpose.
    pub flaw: Flaw,
}

/// How much is done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Thoroughness {
    /// Every case on every mesh.
    #[default]
    Full,
    /// Every experiment once, with few cases, for continuous integration.
    Quick,
}

/// What is wrong with a laboratory on purpose: an experiment that does not notice proves nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Flaw {
    /// Changes every fabric before a piece is cut from it; what is expected is that of the fabric as it was.
    pub fabric: Option<fn(&mut Fabric)>,
    /// By how much patterns are larger than what was cut, 0 for as large.
    pub pattern_growth: f64,
    /// Whether motion is integrated by backward Euler, which loses energy.
    pub is_damped: bool,
    /// By which share all friction is less than what is expected of it.
    pub slipperiness: f64,
}

impl Laboratory<'_> {
    /// Whether every case is to be done on every mesh.
    pub(crate) fn is_full(&self) -> bool {
        self.thoroughness == Thoroughness::Full
    }

    /// Whether computations are in double precision.
    pub(crate) fn is_double(&self) -> bool {
        self.precision == Precision::F64
    }

    /// A model of one piece of a fabric, some of its particles held.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(crate) fn model(
        &self,
        mesh: TriangleMesh,
        mut fabric: Fabric,
        gravity: [f64; 3],
        is_held: impl Fn([f64; 3]) -> bool,
    ) -> Result<Arc<Model>> {
        if let Some(change) = self.flaw.fabric {
            change(&mut fabric);
        }
        let held = (0..).zip(&mesh.positions).filter(|&(_, &x)| is_held(x));
        let pins = held.map(|(particle, _)| particle).collect();
        let material = FabricMaterial {
            fabric,
            rest: RestSource::Pattern { scale: 1.0 + self.flaw.pattern_growth },
            aerodynamics: Aerodynamics::default(),
            imperfection: 0.0,
        };
        let cloth = Cloth {
            name: "specimen".into(),
            geometry: Geometry::Mesh(mesh),
            material: material.into(),
            pins,
            velocity: [0.0; 3],
        };
        let model = ModelBuilder::new().gravity(gravity).cloth(cloth).build();
        Ok(Arc::new(model.map_err(Error::Invalid)?))
    }

    /// The stages of the backend for a model, and the settings that they are made with.
    ///
    /// # Errors
    /// `Unsupported` by a backend without fabric.
    pub(crate) fn kernels(&self, model: &Arc<Model>) -> Result<Box<dyn Kernels>> {
        let config = SolverConfig { precision: self.precision, ..SolverConfig::default() };
        self.backend.create_kernels(Arc::clone(model), &config)
    }

    /// The mean first Piola stress along the length at rest \[N/m\], in x and y, of a flat piece at these positions: by the virtual work of the
    /// forces at its border, which are all that there are.
    ///
    /// # Errors
    /// What the backend reports.
    pub(crate) fn mean_stress(
        &self,
        model: &Arc<Model>,
        positions: Vec<[f64; 3]>,
        along: usize,
    ) -> Result<[f64; 2]> {
        let forces = self.forces(model, positions)?;
        let area: f64 =
            model.elements().triangles().iter().map(|triangle| triangle.rest.area).sum();
        let sum = |k: usize| {
            let work = model.positions().iter().zip(&forces).map(|(x, f)| f[k] * x[along]);
            -work.sum::<f64>() / area
        };
        Ok([sum(0), sum(1)])
    }

    /// Forces of stretched and folded triangles on all particles \[N\] at these positions \[m\].
    ///
    /// # Errors
    /// What the backend reports.
    pub(crate) fn forces(
        &self,
        model: &Arc<Model>,
        positions: Vec<[f64; 3]>,
    ) -> Result<Vec<[f64; 3]>> {
        let mut kernels = self.kernels(model)?;
        let state = State { positions, ..model.initial_state() };
        kernels.state_write(&state)?;
        let [mut before, mut after] = [Vec::new(), Vec::new()];
        kernels.field_forces()?;
        kernels.forces_read(&mut before)?;
        kernels.membrane_forces()?;
        kernels.bending_forces()?;
        kernels.forces_read(&mut after)?;
        let change = |(a, b): (&[f64; 3], &[f64; 3])| std::array::from_fn(|k| b[k] - a[k]);
        Ok(before.iter().zip(&after).map(change).collect())
    }
}
