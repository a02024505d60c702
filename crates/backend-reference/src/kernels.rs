//! All stages on the memory of one solver.

mod implicit;
mod semi_implicit;

use std::sync::Arc;

use cloth_core::{
    ColliderImpulse, Colouring, ContactStatistics, ForceControl, Integrator, Kernels, LinearVector,
    Measures, Model, NewtonStart, PinWrite, Preconditioner, Result, SolverConfig, SpringColouring,
    StageTime, State,
    contact::{Contacts, Ghost},
    stepper::{self, FramePlan, Substep},
};

use crate::{
    Constraints, Elements, Impulse, LinearSystem, Matrix, Particles, Schwarz, Term, Vector,
    aerodynamic_forces, bending_forces, check_precision, collider_response, contact_candidates,
    contact_forces, contact_impulses, control_forces, field_forces, integrate_explicit, measure,
    membrane_forces, procedural_forces, semi_implicit::Factorisations, spring_forces, strain_limit,
    stretch_limit, triangle_contact::TriangleContact, vertex_normals,
};

/// The stages on plain vectors.
pub struct ReferenceKernels {
    model: Arc<Model>,
    config: SolverConfig,
    colouring: SpringColouring,
    triangle_colouring: Colouring,
    plan: FramePlan,
    particles: Particles<f64>,
    forces: Vec<Vector<f64>>,
    controls: Controls,
    /// Pairs in contact when they were last looked for.
    pairs: Vec<[u32; 2]>,
    contacts: ContactStatistics,
    triangles: Option<TriangleContact>,
    /// Positions of `iterate_keep`, if it has come after `start_keep`.
    proven: Option<Vec<Vector<f64>>>,
    /// Positions of `start_keep`, and whether a response has not used them yet.
    start: (Vec<Vector<f64>>, bool),
    impulses: Vec<Impulse<f64>>,
    kept: Kept,
    linear: Linear,
    factorisations: Factorisations,
    non_finite_step: Option<u64>,
}

/// What `state_keep` has kept.
#[derive(Clone, Default)]
struct Kept {
    positions: Vec<Vector<f64>>,
    velocities: Vec<Vector<f64>>,
    /// Those of an iterate of Newton's method.
    iterate: Vec<Vector<f64>>,
    impulses: Vec<Impulse<f64>>,
}

/// Forces on single particles.
#[derive(Default)]
struct Controls {
    forces: Vec<ForceControl>,
    /// Positions of all particles when they were given \[m\].
    given: Vec<[f64; 3]>,
    /// Velocities before the last kick, if there was one.
    before: Option<Vec<Vector<f64>>>,
}

/// The linear system of an implicit substep.
struct Linear {
    springs: Vec<Term<f64>>,
    contacts: Vec<Term<f64>>,
    /// Those of triangles of fabric.
    elements: Vec<Elements<f64>>,
    system: LinearSystem<f64>,
    constraints: Constraints<f64>,
    constrained: u64,
    released: u64,
    /// D, and whether the preconditioner takes all of it.
    preconditioner: (Vec<Matrix<f64>>, Preconditioner),
    /// If that is the preconditioner.
    schwarz: Option<Schwarz>,
    vectors: [Vec<Vector<f64>>; LinearVector::ALL.len()],
}

impl ReferenceKernels {
    /// The stages for a model, in its initial state.
    ///
    /// # Errors
    /// [`Invalid`](cloth_core::Error) for the settings; `Unsupported` in single precision.
    pub fn new(model: Arc<Model>, config: &SolverConfig) -> Result<Self> {
        config.validate()?;
        check_precision(config.precision)?;
        let count = model.particle_count();
        let classes = config.strain_limit.as_ref().map_or(&[][..], |limit| &limit.classes);
        let particles = Particles::new(&model, &model.initial_state(), f64::EPSILON);
        let zero = || vec![Vector::ZERO; count];
        Ok(Self {
            colouring: SpringColouring::greedy(model.springs(), count, classes),
            triangle_colouring: match config.strain_limit {
                Some(_) => Colouring::of_triangles(model.elements().triangles(), count),
                None => Colouring::default(),
            },
            plan: FramePlan::default(),
            forces: zero(),
            controls: Controls::default(),
            pairs: Vec::new(),
            contacts: ContactStatistics::default(),
            triangles: TriangleContact::new(&model, config.pinch),
            proven: None,
            start: (Vec::new(), false),
            impulses: vec![Impulse::default(); model.colliders().len()],
            kept: Kept::default(),
            linear: Linear {
                springs: Vec::new(),
                contacts: Vec::new(),
                elements: Vec::new(),
                system: LinearSystem::default(),
                constraints: Constraints::of_pins(&particles),
                constrained: 0,
                released: 0,
                preconditioner: (Vec::new(), Preconditioner::default()),
                schwarz: None,
                vectors: std::array::from_fn(|_| zero()),
            },
            factorisations: Factorisations::default(),
            non_finite_step: None,
            particles,
            config: config.resolved(&model, None),
            model,
        })
    }

    fn is_finite(&self) -> bool {
        let Particles { positions, velocities, .. } = &self.particles;
        positions.iter().chain(velocities).all(|vector| vector.0.iter().all(|c| c.is_finite()))
    }
}

impl Kernels for ReferenceKernels {
    fn model(&self) -> &Arc<Model> {
        &self.model
    }

    fn config(&self) -> &SolverConfig {
        &self.config
    }

    fn state_write(&mut self, state: &State) -> Result<()> {
        state.validate(&self.model)?;
        self.particles = Particles::new(&self.model, state, f64::EPSILON);
        self.linear.constraints.pins_update(&self.particles);
        self.non_finite_step = None;
        self.start.1 = false;
        if let Some(triangles) = &mut self.triangles {
            triangles.certifier.positions_given();
            triangles.certifier.ghosts_set(&state.ghosts);
            triangles.set.slips_write(&state.slips);
            triangles.bodies.state_write(&self.model, state);
        }
        Ok(())
    }

    fn state_read(&mut self, out: &mut State) -> Result<()> {
        let particles = &self.particles;
        out.positions = particles.positions.iter().map(|x| x.0).collect();
        out.velocities = particles.velocities.iter().map(|v| v.0).collect();
        out.held = (0..particles.len()).map(|i| u8::from(particles.is_held(i))).collect();
        if let Some(triangles) = &self.triangles {
            triangles.set.slips_read(&mut out.slips);
        }
        self.ghosts_read(&mut out.ghosts);
        Ok(())
    }

    fn forces_read(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        *out = self.forces.iter().map(|force| force.0).collect();
        Ok(())
    }

    fn pins_write(&mut self, pins: &[PinWrite]) -> Result<()> {
        for pin in pins {
            let i = pin.particle as usize;
            self.particles.inverse_masses[i] =
                if pin.held { 0.0 } else { self.model.masses()[i].recip() };
            if let Some(position) = pin.position {
                self.particles.positions[i] = Vector(position);
            }
            if let Some(velocity) = pin.velocity {
                self.particles.velocities[i] = Vector(velocity);
            }
        }
        self.linear.constraints.pins_update(&self.particles);
        Ok(())
    }

    fn frame_begin(&mut self, plan: &FramePlan) -> Result<()> {
        self.plan = plan.clone();
        if let Some(triangles) = &mut self.triangles {
            triangles.bodies.frame_begin(plan);
        }
        Ok(())
    }

    fn control_forces_write(&mut self, forces: &[ForceControl]) -> Result<()> {
        let given = self.particles.positions.iter().map(|x| x.0).collect();
        self.controls = Controls { forces: forces.to_vec(), given, before: None };
        Ok(())
    }

    fn has_control_forces(&self) -> bool {
        !self.controls.forces.is_empty()
    }

    fn control_forces(&mut self, substep: &Substep) -> Result<()> {
        let Controls { forces, given, before } = &mut self.controls;
        *before = Some(self.particles.velocities.clone());
        control_forces(&self.model, &mut self.particles, forces, given, substep);
        Ok(())
    }

    fn control_forces_restore(&mut self) -> Result<()> {
        let Controls { forces, before: Some(before), .. } = &self.controls else { return Ok(()) };
        for particle in forces.iter().map(|force| force.particle as usize) {
            self.particles.velocities[particle] = before[particle];
        }
        Ok(())
    }

    fn field_forces(&mut self) -> Result<()> {
        self.forces = field_forces(&self.model, &self.particles);
        Ok(())
    }

    fn procedural_forces(&mut self, substep: &Substep) -> Result<()> {
        procedural_forces(&self.model, &self.particles, substep, &mut self.forces);
        Ok(())
    }

    fn spring_forces(&mut self) -> Result<()> {
        spring_forces(&self.model, &self.particles, &mut self.forces);
        Ok(())
    }

    fn membrane_forces(&mut self) -> Result<()> {
        membrane_forces(&self.model, &self.particles, &mut self.forces);
        Ok(())
    }

    fn bending_forces(&mut self) -> Result<()> {
        bending_forces(&self.model, &self.particles, &mut self.forces);
        Ok(())
    }

    fn aerodynamic_forces(&mut self, substep: &Substep) -> Result<()> {
        aerodynamic_forces(&self.model, &self.particles, substep, &mut self.forces);
        Ok(())
    }

    fn contact_candidates(&mut self) -> Result<()> {
        self.pairs = contact_candidates(&self.model, &self.particles).pairs;
        let count = self.pairs.len() as u64;
        let rebuilds = self.contacts.rebuilds + 1;
        self.contacts = ContactStatistics {
            contacts: count,
            candidates: count,
            rebuilds,
            ..ContactStatistics::default()
        };
        Ok(())
    }

    /// All pairs of features are candidates, always.
    fn contact_pairs(&mut self, _: &Substep) -> Result<()> {
        Ok(())
    }

    fn contact_geometry(&mut self, substep: &Substep, start: NewtonStart) -> Result<()> {
        if let Some(triangles) = &mut self.triangles {
            let from =
                if self.start.0.is_empty() { &self.particles.positions } else { &self.start.0 };
            let settings = (&self.config, substep);
            triangles.geometry(&self.model, (&self.particles, from), settings, start);
            let found = triangles.set.stencils().len() as u64;
            self.contacts.contacts = found;
            self.contacts.candidates = triangles.candidate_count();
        }
        Ok(())
    }

    fn contact_certify(&mut self, substep: &Substep) -> Result<()> {
        if let Some(triangles) = &mut self.triangles {
            let starts = (&*self.start.0, self.proven.as_deref());
            triangles.certify(&self.model, &mut self.particles, starts, substep)?;
        }
        Ok(())
    }

    fn contact_certify_iterate(&mut self, substep: &Substep) -> Result<u64> {
        let Some(triangles) = &mut self.triangles else { return Ok(0) };
        let starts = (&*self.start.0, self.proven.as_deref());
        triangles.ways_shorten(&self.model, &mut self.particles, starts, substep, false)
    }

    fn iterate_keep(&mut self) -> Result<()> {
        self.proven = Some(self.particles.positions.clone());
        Ok(())
    }

    fn triangles_touch(&self) -> bool {
        self.triangles.as_ref().is_some_and(|triangles| !triangles.set.stencils().is_empty())
    }

    fn contacts_read(&mut self, out: &mut Contacts) -> Result<()> {
        out.contacts.clear();
        if let Some(triangles) = &self.triangles {
            triangles.set.read(out);
        }
        Ok(())
    }

    fn contact_forces(&mut self) -> Result<()> {
        if let Some(triangles) = &self.triangles {
            triangles.forces(&mut self.forces);
            return Ok(());
        }
        contact_forces(&self.model, &mut self.particles, &self.pairs, &mut self.forces);
        Ok(())
    }

    fn integrate_explicit(&mut self, substep: &Substep) -> Result<()> {
        integrate_explicit(&mut self.particles, &self.forces, substep.length);
        Ok(())
    }

    fn contact_impulses(&mut self, substep: &Substep) -> Result<()> {
        contact_impulses(&self.model, &mut self.particles, &self.pairs, substep.length);
        Ok(())
    }

    fn strain_limit_colours(&self) -> usize {
        self.colouring.len()
    }

    fn strain_limit(&mut self, substep: &Substep, colour: usize) -> Result<()> {
        let Some(limit) = &self.config.strain_limit else { return Ok(()) };
        let springs = self.colouring.colour(colour);
        strain_limit(&self.model, &mut self.particles, springs, limit.ratio, substep.length);
        Ok(())
    }

    fn stretch_limit_colours(&self) -> usize {
        self.triangle_colouring.len()
    }

    fn stretch_limit(&mut self, substep: &Substep, colour: usize) -> Result<()> {
        let Some(limit) = &self.config.strain_limit else { return Ok(()) };
        let triangles = self.triangle_colouring.colour(colour);
        stretch_limit(&self.model, &mut self.particles, triangles, limit.ratio, substep.length);
        Ok(())
    }

    fn start_keep(&mut self) -> Result<()> {
        self.start = (self.particles.positions.clone(), true);
        self.proven = None;
        Ok(())
    }

    fn collider_response(&mut self, substep: &Substep) -> Result<()> {
        let is_fresh = std::mem::take(&mut self.start.1);
        let start = is_fresh.then_some((&self.start.0[..], substep.length));
        let colliders = self.plan.colliders_at(substep.index);
        let (particles, impulses) = (&mut self.particles, &mut self.impulses);
        collider_response(&self.model, particles, colliders, start, impulses);
        Ok(())
    }

    fn collider_impulses(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()> {
        let asked = self.model.collider_impulses();
        out.clear();
        out.extend(self.impulses.iter_mut().map(|sum| {
            let [linear, angular] = std::mem::take(sum).map(|sum| sum.0);
            if asked { ColliderImpulse { linear, angular } } else { ColliderImpulse::default() }
        }));
        if let Some(triangles) = &mut self.triangles {
            triangles.impulses.take(out);
        }
        Ok(())
    }

    fn vertex_normals(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        let normals = vertex_normals(&self.model, &mut self.particles);
        *out = normals.into_iter().map(|normal| normal.0).collect();
        Ok(())
    }

    fn measure(&mut self) -> Result<Measures> {
        let colliders = self.plan.colliders_at(usize::MAX);
        let figures = measure(&self.model, &self.particles, colliders);
        let is_finite = |i: usize| {
            let [x, v] = [self.particles.positions[i], self.particles.velocities[i]];
            x.0.iter().chain(&v.0).all(|component| component.is_finite())
        };
        let non_finite = (0..self.particles.len()).find(|&i| !is_finite(i));
        Ok(Measures {
            non_finite_particle: non_finite.map(|particle| particle as u32),
            non_finite_step: self.non_finite_step,
            strain_max: figures.strain_max,
            strain_mean: figures.strain_mean,
            strain_particle: figures.strain_particle,
            penetration_max: figures.penetration_max,
            energy_kinetic: figures.energy_kinetic,
            energy_elastic: figures.energy_elastic,
            energy_potential: figures.energy_potential,
            momentum: figures.momentum.0,
            momentum_drift: figures.momentum_drift,
        })
    }

    fn contact_statistics(&mut self) -> Result<ContactStatistics> {
        let rebuilds = std::mem::take(&mut self.contacts.rebuilds);
        let counts = ContactStatistics { rebuilds, ..self.contacts };
        Ok(self.triangles.as_mut().map_or(counts, |triangles| ContactStatistics {
            truncated: std::mem::take(&mut triangles.truncated),
            exempt: triangles.certifier.exempt().len() as u64,
            ghosts: triangles.certifier.ghosts().len() as u64,
            ..counts
        }))
    }

    fn stitches_set(&mut self, model: &Arc<Model>) -> Result<bool> {
        let has_constant_matrix = matches!(self.config.integrator, Integrator::SemiImplicit(_));
        let triangles = self.triangles.as_mut();
        if has_constant_matrix || !triangles.is_none_or(|all| all.surface.stitches_set(model)) {
            return Ok(false);
        }
        self.model = Arc::clone(model);
        Ok(true)
    }

    fn ghosts_read(&mut self, out: &mut Vec<Ghost>) {
        out.clear();
        out.extend(
            self.triangles.iter().flat_map(|triangles| triangles.certifier.ghosts()).cloned(),
        );
    }

    fn ghosts_write(&mut self, ghosts: &[Ghost]) {
        if let Some(triangles) = &mut self.triangles {
            triangles.certifier.ghosts_set(ghosts);
        }
    }

    fn contact_pairs_read(&mut self, out: &mut Vec<[u32; 2]>) -> Result<()> {
        self.contact_candidates()?;
        out.clone_from(&self.pairs);
        Ok(())
    }

    /// None: no clock stands between the stages.
    fn stage_times(&mut self) -> Vec<StageTime> {
        Vec::new()
    }

    /// The stages, until a number is not finite.
    fn explicit_substep(&mut self, substep: &Substep) -> Result<()> {
        if self.non_finite_step.is_none() {
            stepper::explicit::substep(self, substep)?;
            self.non_finite_step = (!self.is_finite()).then_some(substep.step);
        }
        Ok(())
    }
}
