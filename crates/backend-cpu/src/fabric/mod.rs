//! Triangles of fabric: their tables, and what they do to particles (NUMERICS §11, §12).

mod bending;
mod element_blocks;
mod folds;
mod stretch_limit;

use cloth_core::{
    Error, Incidence, InteractionKind, LinearSettings, MatrixForm, Model, NewtonStart,
    Preconditioner, Real, Result, SolverConfig,
    fabric::membrane::{self, Law, MembraneTangent, RestState},
};
use rayon::prelude::*;

use crate::memory::{BLOCK, LANES, Motion};

use self::{bending::Patches, folds::Folds};
pub(crate) use element_blocks::ElementBlocks;
pub(crate) use stretch_limit::StretchLimiter;

/// Refuses settings for which fabric has no matrix of the form that they need.
pub(crate) fn check(model: &Model, config: &SolverConfig) -> Result<()> {
    model.check_integrator(config, "cpu")?;
    if !model.has_fabric() {
        return Ok(());
    }
    let unsupported = |what: String| {
        let feature = format!("triangles of fabric with {what}");
        Err(Error::Unsupported { backend: "cpu", feature })
    };
    match config.integrator.linear() {
        Some(linear) => {
            let LinearSettings { preconditioner, matrix, .. } = linear;
            if *preconditioner == Preconditioner::IncompleteCholesky {
                return unsupported(format!("the preconditioner {preconditioner} (it has block)"));
            }
            if *matrix == MatrixForm::Assembled {
                return unsupported(format!("the matrix form {matrix} (it has matrix-free)"));
            }
            Ok(())
        }
        None => Ok(()),
    }
}

/// Triangles in one task.
const TASK: usize = 256;

/// The triangles of fabric of a model, and what was last computed of each.
#[derive(Debug)]
pub(crate) struct Fabric<T> {
    laws: Vec<FabricLaw<T>>,
    membranes: Vec<MembraneTriangle<T>>,
    patches: Patches<T>,
    folds: Folds<T>,
    /// Triangles around each particle.
    around: Incidence,
    /// Forces, or impulses of an implicit step, on the corners of each triangle.
    membrane: Vec<[[T; 3]; 3]>,
    membrane_tangents: Vec<MembraneTangent<T>>,
}

#[derive(Clone, Copy, Debug)]
struct FabricLaw<T> {
    law: Law<T>,
    damping: T,
}

#[derive(Clone, Copy, Debug)]
struct MembraneTriangle<T> {
    particles: [u32; 3],
    fabric: u32,
    rest: RestState<T>,
}

/// Energies \[J\] and the largest stretch of triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FabricFigures {
    /// Energy of the membranes and of the folds.
    pub(crate) energy: f64,
    /// The largest principal stretch less 1, -1 for none, and a particle of that triangle.
    pub(crate) strain_max: (f64, u32),
    /// Sum of the absolute values of the larger principal stretches less 1, and their number.
    pub(crate) strain_sum: [f64; 2],
}

impl Default for FabricFigures {
    fn default() -> Self {
        Self { energy: 0.0, strain_max: (-1.0, 0), strain_sum: [0.0; 2] }
    }
}

impl<T: Real> Fabric<T> {
    /// The tables of a model that has fabric.
    ///
    /// # Errors
    /// `Invalid` for a law that makes no sense, which a model never has.
    pub(crate) fn new(model: &Model) -> Result<Option<Self>> {
        let elements = model.elements();
        if elements.is_empty() {
            return Ok(None);
        }
        let law = |fabric: &cloth_core::fabric::Fabric| {
            let law = Law::new(fabric, "a cloth").map_err(|e| Error::Invalid(e.into()))?;
            Ok(FabricLaw { law, damping: T::from_f64(fabric.damping[0]) })
        };
        let triangles = elements.triangles();
        let (interactions, count) = (model.interactions(), model.particle_count());
        let membranes = interactions.list(InteractionKind::Membrane);
        let zero = [T::ZERO; 3];
        Ok(Some(Self {
            laws: elements.fabrics().iter().map(law).collect::<Result<_>>()?,
            membranes: triangles
                .iter()
                .map(|triangle| MembraneTriangle {
                    particles: triangle.particles,
                    fabric: triangle.fabric,
                    rest: triangle.rest.rounded(),
                })
                .collect(),
            patches: Patches::new(model),
            folds: Folds::new(model),
            around: membranes.map_or_else(Incidence::default, |list| Incidence::new(list, count)),
            membrane: vec![[zero; 3]; triangles.len()],
            membrane_tangents: Vec::new(),
        }))
    }

    /// Computes the forces of all stretched triangles.
    pub(crate) fn membrane_forces(&mut self, motion: &Motion<T>) {
        let laws = &self.laws;
        let all = self.membrane.par_iter_mut().zip(&self.membranes).with_min_len(TASK);
        all.for_each(|(forces, triangle)| {
            let FabricLaw { law, damping } = &laws[triangle.fabric as usize];
            let [x, v] = at(motion, triangle.particles);
            *forces = membrane::triangle_forces(x, v, &triangle.rest, law, *damping);
        });
    }

    /// Computes the forces of all folded triangles.
    pub(crate) fn bending_forces(&mut self, motion: &Motion<T>, arch: pulp::Arch) {
        self.folds.look(motion, arch);
        self.patches.moments_find(self.folds.states(), arch);
        self.folds.push(self.patches.moments());
    }

    /// Linearises all triangles for a substep of `length` \[s\].
    pub(crate) fn membrane_linearise(&mut self, motion: &Motion<T>, length: T, start: NewtonStart) {
        let (laws, from_start) = (&self.laws, start == NewtonStart::StepStart);
        let tangents = self.membranes.par_iter().with_min_len(TASK).map(|triangle| {
            let FabricLaw { law, damping } = &laws[triangle.fabric as usize];
            let [x, v] = at(motion, triangle.particles);
            MembraneTangent::new((x, v), &triangle.rest, law, *damping, length, from_start)
        });
        tangents.collect_into_vec(&mut self.membrane_tangents);
    }

    /// Linearises all folds for a substep of `length` \[s\].
    pub(crate) fn bending_linearise(
        &mut self,
        motion: &Motion<T>,
        (length, start): (T, NewtonStart),
        arch: pulp::Arch,
    ) {
        self.folds.look(motion, arch);
        self.patches.impulses_find(self.folds.states(), (length, start), arch);
        self.folds.push(self.patches.moments());
        self.folds.linearise(length);
    }

    /// Sum of the forces of stretched triangles on a particle \[N\].
    #[inline(always)]
    pub(crate) fn membrane_force(&self, particle: usize) -> [T; 3] {
        gather(self.around.row(particle), self.membrane.as_flattened())
    }

    /// Sum of the forces of folded triangles on a particle \[N\], or of their impulses in an implicit step \[N s\].
    #[inline(always)]
    pub(crate) fn bending_force(&self, particle: usize) -> [T; 3] {
        gather(self.folds.around.row(particle), self.folds.forces_of_all())
    }

    /// Energies and stretches.
    pub(crate) fn figures(&self, motion: &Motion<T>, arch: pulp::Arch) -> FabricFigures {
        let bent = self.patches.energies(&self.folds.states_in(motion, arch), arch);
        let one = |(triangle, bent): (&MembraneTriangle<T>, &T)| {
            let [x, _] = at(motion, triangle.particles);
            let law = &self.laws[triangle.fabric as usize].law;
            let strain = membrane::strain(membrane::deformation(x, &triangle.rest));
            let stored = law.response(strain).energy.to_f64() * triangle.rest.area.to_f64();
            let [stretch, _] = membrane::principal_stretches(strain);
            (stored + bent.to_f64(), stretch.to_f64() - 1.0, triangle.particles[0])
        };
        let all: Vec<(f64, f64, u32)> =
            self.membranes.par_iter().zip(&bent).with_min_len(TASK).map(one).collect();
        let mut figures = FabricFigures::default();
        // Sums as those over particles: by blocks, and within them by places.
        for block in all.chunks(BLOCK) {
            let mut sums = [[0.0; LANES]; 2];
            for (k, &(energy, strain, particle)) in block.iter().enumerate() {
                sums[0][k % LANES] += energy;
                sums[1][k % LANES] += strain.abs();
                if strain > figures.strain_max.0 {
                    figures.strain_max = (strain, particle);
                }
            }
            let [energy, strain] = sums.map(|lanes| lanes.into_iter().fold(0.0, |a, b| a + b));
            figures.energy += energy;
            figures.strain_sum[0] += strain;
            figures.strain_sum[1] += block.len() as f64;
        }
        figures
    }
}

/// Positions and velocities of particles.
#[inline(always)]
fn at<T: Real, const N: usize>(motion: &Motion<T>, particles: [u32; N]) -> [[[T; 3]; N]; 2] {
    [
        particles.map(|particle| motion.position.get(particle as usize)),
        particles.map(|particle| motion.velocity.get(particle as usize)),
    ]
}

/// The sum of some vectors in their order.
#[inline(always)]
fn gather<T: Real>(places: &[u32], vectors: &[[T; 3]]) -> [T; 3] {
    let mut sum = [T::ZERO; 3];
    for &place in places {
        for (sum, entry) in sum.iter_mut().zip(vectors[place as usize]) {
            *sum += entry;
        }
    }
    sum
}
