//! The stages of NUMERICS.md as traits: what a backend computes.

mod implicit;
mod semi_implicit;

use std::sync::Arc;

pub use implicit::{
    ConstraintStatistics, ImplicitKernels, LinearOutcome, LinearStart, LinearVector, MatrixBlock,
    NewtonStart,
};
pub use semi_implicit::SemiImplicitKernels;

use crate::{
    ContactResponse, ForceControl, ImplicitSettings, Measures, MidpointSettings, Model, PinAction,
    Result, SolverConfig, SolverReport, StageTime, State,
    contact::{Candidate, Contacts, Ghost},
    stepper::{self, FramePlan, Substep},
};

/// The stages from which steppers are put together, one method each, on memory that the backend
/// owns.
///
/// A backend holds the position x, velocity v, force f and inverse mass w of every particle. Stages
/// that gather from neighbours read one buffer and write another; which buffer is which stays inside
/// the backend. The method, the CPU function, the WGSL file, the CUDA file and the equivalence test
/// of a stage have the same name, and NUMERICS.md has its formula.
///
/// The stages that only one integrator needs are in [`ImplicitKernels`] and
/// [`SemiImplicitKernels`]. The composite stage [`explicit_substep`](Self::explicit_substep) has a default made of the small
/// ones. A backend overrides it where fusing them pays, and must then give the same bits as the
/// default does.
pub trait Kernels: ImplicitKernels + SemiImplicitKernels {
    /// The model.
    fn model(&self) -> &Arc<Model>;

    /// The settings.
    fn config(&self) -> &SolverConfig;

    /// Copies positions, velocities and held flags in.
    ///
    /// # Errors
    /// What the device reports.
    fn state_write(&mut self, state: &State) -> Result<()>;

    /// Copies positions, velocities and held flags out.
    ///
    /// # Errors
    /// What the device reports.
    fn state_read(&mut self, out: &mut State) -> Result<()>;

    /// Copies the forces \[N\] out, as the last force stage left them.
    ///
    /// # Errors
    /// What the device reports.
    fn forces_read(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()>;

    /// Holds or releases particles. A held particle keeps the velocity it is given, whatever forces
    /// act on it.
    ///
    /// # Errors
    /// What the device reports.
    fn pins_write(&mut self, pins: &[PinWrite]) -> Result<()>;

    /// Hands over all that is known of a frame before it starts.
    ///
    /// # Errors
    /// What the device reports.
    fn frame_begin(&mut self, plan: &FramePlan) -> Result<()>;

    /// Puts forces on single particles in place of those given before; particles ascending, each once. Anchors that are
    /// where particles are take their present positions.
    ///
    /// # Errors
    /// What the device reports.
    fn control_forces_write(&mut self, forces: &[ForceControl]) -> Result<()>;

    /// Whether there are any.
    fn has_control_forces(&self) -> bool;

    /// NUMERICS §3: what these forces do to the velocities in a substep, for all integrators but the implicit one, whose matrix has them.
    ///
    /// # Errors
    /// What the device reports.
    fn control_forces(&mut self, substep: &Substep) -> Result<()>;

    /// Gives the particles of these forces the velocities that they had before the last `control_forces`, if it came after the last
    /// `control_forces_write`. It follows where `state_restore` takes a substep back, which may have kept the state after
    /// them.
    ///
    /// # Errors
    /// What the device reports.
    fn control_forces_restore(&mut self) -> Result<()>;

    /// NUMERICS §3: sets f to gravity, uniform fields and drag.
    ///
    /// # Errors
    /// What the device reports.
    fn field_forces(&mut self) -> Result<()>;

    /// NUMERICS §3: adds the forces of procedural fields to f.
    ///
    /// # Errors
    /// What the device reports.
    fn procedural_forces(&mut self, substep: &Substep) -> Result<()>;

    /// NUMERICS §2: adds the forces of springs and their dampers to f.
    ///
    /// # Errors
    /// What the device reports.
    fn spring_forces(&mut self) -> Result<()>;

    /// NUMERICS §11: adds the forces of stretched and sheared triangles of fabric, and of their dampers, to f.
    ///
    /// # Errors
    /// What the device reports; `Unsupported` by a backend that has none.
    fn membrane_forces(&mut self) -> Result<()>;

    /// NUMERICS §12: adds the forces of folded triangles of fabric, and of their dampers, to f.
    ///
    /// # Errors
    /// What the device reports; `Unsupported` by a backend that has none.
    fn bending_forces(&mut self) -> Result<()>;

    /// NUMERICS §3: adds the force of the air to f.
    ///
    /// # Errors
    /// What the device reports.
    fn aerodynamic_forces(&mut self, substep: &Substep) -> Result<()>;

    /// NUMERICS §8: makes sure that every pair that can be in contact now is in the candidate list.
    ///
    /// # Errors
    /// `Overflow` or `OutOfMemory` if the list cannot grow.
    fn contact_candidates(&mut self) -> Result<()>;

    /// NUMERICS §15: makes sure that every pair of a vertex and a triangle, and of two edges, that can touch now or meet in this
    /// substep is in the candidate list.
    ///
    /// # Errors
    /// `Overflow` if there are more than can be counted; `Unsupported` by a backend without contact of triangles.
    fn contact_pairs(&mut self, substep: &Substep) -> Result<()>;

    /// NUMERICS §15: finds out which of these touch, where, and how far they have slipped. `start` says whether particles are
    /// where the substep starts, or at an iterate of its end.
    ///
    /// # Errors
    /// `Unsupported` by a backend without contact of triangles.
    fn contact_geometry(&mut self, substep: &Substep, start: NewtonStart) -> Result<()>;

    /// NUMERICS §15: shortens the ways of particles since the last `start_keep` until it is proven that no two features meet, and
    /// takes what is left of them from the velocities. Ways that are prescribed are gone first, and take cloth near them along:
    /// the stage `contact_carry`.
    ///
    /// # Errors
    /// `Pinched` if prescribed ways go through cloth that cannot make way; `Unsupported` by a backend without contact of triangles.
    fn contact_certify(&mut self, substep: &Substep) -> Result<()>;

    /// NUMERICS §15: the same for an iterate of the end of the substep, which friction does not remember. Returns how many particles it
    /// has put elsewhere.
    ///
    /// # Errors
    /// As [`Self::contact_certify`].
    fn contact_certify_iterate(&mut self, substep: &Substep) -> Result<u64>;

    /// NUMERICS §15: notes that particles have been proven to get where they are in an iterate of the end of the substep. Until the next
    /// `start_keep` certificates go on from here, with bodies where they end.
    ///
    /// # Errors
    /// What the device reports.
    fn iterate_keep(&mut self) -> Result<()>;

    /// Whether the last `contact_geometry` has found any contact between triangles. A backend that does not know may always say so, at the
    /// cost of time.
    fn triangles_touch(&self) -> bool {
        true
    }

    /// All contacts between triangles as the last `contact_geometry` and `contact_forces` have found them, ascending by key. `out`
    /// is emptied first. A backend without contact of triangles has none.
    ///
    /// # Errors
    /// What the device reports.
    fn contacts_read(&mut self, out: &mut Contacts) -> Result<()> {
        out.contacts.clear();
        Ok(())
    }

    /// The list of pairs of features of triangles from which `contact_pairs` and `contact_certify` work, ascending: for tests and
    /// tools. `out` is emptied first. A backend that keeps no list has none.
    ///
    /// # Errors
    /// What the device reports.
    fn contact_list_read(&mut self, out: &mut Vec<Candidate>) -> Result<()> {
        out.clear();
        Ok(())
    }

    /// NUMERICS §8, §15: adds the force of all pairs in contact to f, that of the penalty response or of triangles.
    ///
    /// # Errors
    /// What the device reports.
    fn contact_forces(&mut self) -> Result<()>;

    /// NUMERICS §4: symplectic Euler, v += h w f, then x += h v.
    ///
    /// # Errors
    /// What the device reports.
    fn integrate_explicit(&mut self, substep: &Substep) -> Result<()>;

    /// NUMERICS §8: momentum exchange and separation of all pairs in contact.
    ///
    /// # Errors
    /// What the device reports.
    fn contact_impulses(&mut self, substep: &Substep) -> Result<()>;

    /// NUMERICS §4: number of colours of the springs that are strain limited; 0 without a limit.
    fn strain_limit_colours(&self) -> usize;

    /// NUMERICS §4: shortens the over-long springs of one colour.
    ///
    /// # Errors
    /// What the device reports.
    fn strain_limit(&mut self, substep: &Substep, colour: usize) -> Result<()>;

    /// NUMERICS §4: number of colours of the triangles of fabric that are limited; 0 without a limit.
    fn stretch_limit_colours(&self) -> usize;

    /// NUMERICS §4: shortens the over-stretched triangles of one colour.
    ///
    /// # Errors
    /// What the device reports.
    fn stretch_limit(&mut self, substep: &Substep, colour: usize) -> Result<()>;

    /// NUMERICS §4: all sweeps over the colours of springs and of triangles. A backend whose blocks can wait for each other does
    /// them in one launch, with the same result as by default.
    ///
    /// # Errors
    /// Those of the stages.
    fn strain_limit_sweeps(&mut self, substep: &Substep) -> Result<()> {
        stepper::strain_limit_sweeps(self, substep)
    }

    /// NUMERICS §7: notes where particles are at the start of a substep. The next `collider_response` then finds
    /// those that a collider has passed meanwhile.
    ///
    /// # Errors
    /// What the device reports.
    fn start_keep(&mut self) -> Result<()>;

    /// NUMERICS §7: contact with all colliders, from where particles were at the last `start_keep`; if it did not come
    /// after the last response, from where they are.
    ///
    /// # Errors
    /// What the device reports.
    fn collider_response(&mut self, substep: &Substep) -> Result<()>;

    /// NUMERICS §7: the impulses of `collider_response` and `constraint_impulses` on all particles since
    /// the last call, one for each collider, if the model asks for them. `out` is resized.
    ///
    /// # Errors
    /// What the device reports; `Unsupported` by a backend that does not sum them.
    fn collider_impulses(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()>;

    /// NUMERICS §9: vertex normals; `out` is resized to length n.
    ///
    /// # Errors
    /// What the device reports.
    fn vertex_normals(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()>;

    /// NUMERICS §10: figures of the present state, colliders as at the end of the last frame begun.
    ///
    /// # Errors
    /// What the device reports.
    fn measure(&mut self) -> Result<Measures>;

    /// Counts of the contact stages since the last call.
    ///
    /// # Errors
    /// What the device reports.
    fn contact_statistics(&mut self) -> Result<ContactStatistics>;

    /// Goes on with another model, as [`Solver::stitches_set`](crate::Solver::stitches_set).
    ///
    /// # Errors
    /// What the device reports.
    fn stitches_set(&mut self, _: &Arc<Model>) -> Result<bool> {
        Ok(false)
    }

    /// What bodies have pinched, ascending by particle; `out` is resized.
    fn ghosts_read(&mut self, out: &mut Vec<Ghost>) {
        out.clear();
    }

    /// Takes in what is pinched from now on.
    fn ghosts_write(&mut self, _: &[Ghost]) {}

    /// All pairs (i, j), i < j, in contact now, ascending, less those that the response leaves out:
    /// for tests and tools.
    ///
    /// # Errors
    /// What the device reports.
    fn contact_pairs_read(&mut self, out: &mut Vec<[u32; 2]>) -> Result<()>;

    /// Wall time by stage since the last call.
    fn stage_times(&mut self) -> Vec<StageTime>;

    /// Composite: one explicit substep. See [`stepper::explicit`](crate::stepper::explicit).
    ///
    /// # Errors
    /// Those of the stages it is made of.
    fn explicit_substep(&mut self, substep: &Substep) -> Result<()> {
        stepper::explicit::substep(self, substep)
    }

    /// Composite: one implicit substep, booked in `report`. Returns whether it could be done. See
    /// [`stepper::implicit`](crate::stepper::implicit).
    ///
    /// A backend whose device decides how solves go on need not wait for it: it books nothing, returns
    /// that it could be done, and says in [`deferred_outcome`](Self::deferred_outcome) what came of it.
    ///
    /// # Errors
    /// Those of the stages it is made of.
    fn implicit_substep(
        &mut self,
        substep: &Substep,
        settings: &ImplicitSettings,
        report: &mut SolverReport,
    ) -> Result<bool> {
        stepper::implicit::substep(self, substep, settings, report)
    }

    /// Composite: one substep of the midpoint integrator, booked in `report`. Returns whether it could be done. See
    /// [`stepper::midpoint`](crate::stepper::midpoint). A backend overrides it if its host must not wait within a batch.
    ///
    /// # Errors
    /// Those of the stages it is made of.
    fn midpoint_substep(
        &mut self,
        substep: &Substep,
        settings: &MidpointSettings,
        report: &mut SolverReport,
    ) -> Result<bool> {
        stepper::midpoint::substep(self, substep, settings, report)
    }

    /// What came of substeps since the last call that were recorded without waiting for them. Waits
    /// for the device.
    ///
    /// # Errors
    /// What the device reports.
    fn deferred_outcome(&mut self) -> Result<DeferredOutcome> {
        Ok(DeferredOutcome::default())
    }

    /// Runs `work` as one batch: one thread pool entry, one submission, one graph. Nothing in
    /// `work` may read results back.
    fn batch<R: Send>(&mut self, work: impl FnOnce(&mut Self) -> R + Send) -> R
    where
        Self: Sized,
    {
        work(self)
    }

    /// Whether contact acts through forces between points, the penalty response.
    fn contact_is_penalty(&self) -> bool {
        self.model()
            .self_contact()
            .is_some_and(|contact| matches!(contact.response, ContactResponse::Penalty { .. }))
    }

    /// Whether contact acts through impulses between points.
    fn contact_is_impulse(&self) -> bool {
        self.model()
            .self_contact()
            .is_some_and(|contact| matches!(contact.response, ContactResponse::Impulse { .. }))
    }
}

/// What a collider did to all particles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColliderImpulse {
    /// Sum of the impulses \[kg m/s\].
    pub linear: [f64; 3],
    /// Sum of their moments about the origin of the world \[kg m^2/s\].
    pub angular: [f64; 3],
}

impl ColliderImpulse {
    /// An impulse \[kg m/s\] at a place \[m\].
    #[must_use]
    pub fn at([x, y, z]: [f64; 3], linear: [f64; 3]) -> Self {
        let [a, b, c] = linear;
        Self { linear, angular: [y * c - z * b, z * a - x * c, x * b - y * a] }
    }
}

impl std::ops::AddAssign for ColliderImpulse {
    fn add_assign(&mut self, other: Self) {
        for axis in 0..3 {
            self.linear[axis] += other.linear[axis];
            self.angular[axis] += other.angular[axis];
        }
    }
}

/// A change to one particle, resolved to what a kernel needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PinWrite {
    /// The particle.
    pub particle: u32,
    /// Whether it is held from now on.
    pub held: bool,
    /// New position \[m\], or `None` to leave it.
    pub position: Option<[f64; 3]>,
    /// New velocity \[m/s\], or `None` to leave it.
    pub velocity: Option<[f64; 3]>,
}

impl PinWrite {
    /// The change at the start of a frame of `duration` \[s\], for a particle that is now at
    /// `position` \[m\].
    #[must_use]
    pub fn at_frame_start(
        particle: u32,
        action: &PinAction,
        position: [f64; 3],
        duration: f64,
    ) -> Self {
        let (held, velocity) = match action {
            PinAction::Hold => (true, Some([0.0; 3])),
            PinAction::MoveTo(target) => {
                (true, Some(std::array::from_fn(|k| (target[k] - position[k]) / duration)))
            }
            PinAction::MoveBy(way) => (true, Some(way.map(|way| way / duration))),
            PinAction::Release => (false, None),
        };
        Self { particle, held, position: None, velocity }
    }
}

/// What came of substeps that a backend recorded without waiting for its device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeferredOutcome {
    /// What their solvers did, to be added to what was booked when they were recorded.
    pub report: SolverReport,
    /// Number, as in [`Substep::step`], of the one whose linear solve broke down, if any did. The state
    /// is that of its start, and no later one was done.
    pub broken: Option<u64>,
}

/// Counts of the contact stages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ContactStatistics {
    /// Pairs in contact at the last substep.
    pub contacts: u64,
    /// Entries of the candidate list, pairs of particles or of groups of them.
    pub candidates: u64,
    /// Times the list was built.
    pub rebuilds: u32,
    /// Particles whose way was shortened so that triangles do not meet, all substeps together.
    pub truncated: u64,
    /// Pairs of features that cannot be proven to be apart since they were given, in the last substep: cloth that goes through
    /// cloth from the start. They are left out of the proof.
    pub exempt: u64,
    /// Particles that bodies have pinched, and that are left inside of them ([`Pinch::Ghost`](crate::Pinch::Ghost)).
    pub ghosts: u64,
}
