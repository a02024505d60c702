//! The contract between an application and whatever computes for it.

use std::sync::Arc;

use crate::{
    ColliderImpulse, Control, Kernels, Model, Pose, Precision, Result, SolverConfig, State,
    StepReport, contact::Contacts,
};

/// A way to compute: a CPU, a GPU through some interface. Object safe, chosen at run time.
pub trait Backend: Send + Sync {
    /// What it is and what it can do.
    fn info(&self) -> &BackendInfo;

    /// Makes a solver for a model, in the state [`Model::initial_state`]. All memory is taken here.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error) for the settings; `Unsupported`, `LimitExceeded` or
    /// `OutOfMemory` where the backend cannot hold or compute the model.
    fn create_solver(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Solver>>;

    /// Makes bare kernels, for tests that run single stages and for steppers of one's own.
    ///
    /// # Errors
    /// As for [`Self::create_solver`].
    fn create_kernels(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Kernels>>;

    /// A handle of its own on the same device, for whoever has to make solvers later; `None` of a backend that has none to give.
    fn share(&self) -> Option<Box<dyn Backend>> {
        None
    }

    /// Which of its forms of each kernel with several this backend takes for a model, and why not a faster one.
    fn forms(&self, model: &Model, config: &SolverConfig) -> Vec<FormChoice> {
        let _ = (model, config);
        Vec::new()
    }
}

/// The form of a kernel that serves a model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FormChoice {
    /// What is computed: the name of a stage.
    pub phase: &'static str,
    /// The form, in words.
    pub form: &'static str,
    /// The faster forms, each with the first thing that rules it out.
    pub ruled_out: Vec<(&'static str, String)>,
}

/// What a backend is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BackendInfo {
    /// Name by which it is chosen, such as `cpu`.
    pub name: &'static str,
    /// The device, in words.
    pub device: String,
    /// Precisions it computes in.
    pub precisions: Vec<Precision>,
    /// Further facts for a list of backends: threads, instruction sets, limits.
    pub details: Vec<(&'static str, String)>,
}

/// A simulation in progress. It owns all memory that the steps need; nothing is allocated in a step
/// unless contacts outgrow their buffers.
pub trait Solver: Send {
    /// The model it works on.
    fn model(&self) -> &Arc<Model>;

    /// Poses of all colliders at the end of the last frame begun.
    fn colliders(&self) -> &[Pose];

    /// Replaces the state. Wind and forces that a control has set go on.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error) if it does not fit the model.
    fn upload(&mut self, state: &State) -> Result<()>;

    /// Sets what holds from the next frame on.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error) if an index or number makes no sense.
    fn set_control(&mut self, control: &Control) -> Result<()>;

    /// Starts to advance by one frame; may return before it is done.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error) for a frame of no length; what the device reports.
    fn advance(&mut self, frame: Frame) -> Result<()>;

    /// Waits for the frame, and says what was done.
    ///
    /// # Errors
    /// [`Error::Diverged`](crate::Error) if the state left the range in which it means anything;
    /// the state can still be downloaded. What the device reports.
    fn synchronize(&mut self) -> Result<StepReport>;

    /// Copies the state out; `out` is resized as needed.
    ///
    /// # Errors
    /// What the device reports.
    fn download(&mut self, out: &mut State) -> Result<()>;

    /// Goes on with `model`, which differs from its own in the lengths, stiffness and widths of stitches alone
    /// ([`Model::sewn_at`]). Returns whether it can; if not, another solver has to.
    ///
    /// # Errors
    /// What the device reports.
    fn stitches_set(&mut self, model: &Arc<Model>) -> Result<bool> {
        let _ = model;
        Ok(false)
    }

    /// Position \[m\] of a particle, the origin for one that does not exist. That of a particle which is held at rest is
    /// known; for any other the whole state is read.
    ///
    /// # Errors
    /// What the device reports.
    fn particle_position(&mut self, particle: u32) -> Result<[f64; 3]>;

    /// What each collider did to the cloths since the last call, if the model asks for it; `out` is
    /// resized. With the implicit integrator the momentum of the cloths changes by these impulses and
    /// those of the fields but for what its linear solver leaves (NUMERICS §5).
    ///
    /// # Errors
    /// [`Error::Unsupported`](crate::Error) by a backend that does not sum them; what the device
    /// reports.
    fn collider_impulses(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()>;

    /// Computes vertex normals of the present state: unit vectors, area weighted, zero for a
    /// particle without triangles. `out` is resized to length n.
    ///
    /// # Errors
    /// What the device reports.
    fn normals(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()>;

    /// The contacts between triangles as the last substep has found them, ascending by key; `out` is emptied first.
    /// There are none without contact of triangles.
    ///
    /// # Errors
    /// What the device reports.
    fn contacts_read(&mut self, out: &mut Contacts) -> Result<()> {
        out.contacts.clear();
        Ok(())
    }
}

/// A solver whose kind is known at run time alone is a solver like any other.
impl<S: Solver + ?Sized> Solver for Box<S> {
    fn model(&self) -> &Arc<Model> {
        (**self).model()
    }

    fn colliders(&self) -> &[Pose] {
        (**self).colliders()
    }

    fn upload(&mut self, state: &State) -> Result<()> {
        (**self).upload(state)
    }

    fn set_control(&mut self, control: &Control) -> Result<()> {
        (**self).set_control(control)
    }

    fn advance(&mut self, frame: Frame) -> Result<()> {
        (**self).advance(frame)
    }

    fn synchronize(&mut self) -> Result<StepReport> {
        (**self).synchronize()
    }

    fn download(&mut self, out: &mut State) -> Result<()> {
        (**self).download(out)
    }

    fn stitches_set(&mut self, model: &Arc<Model>) -> Result<bool> {
        (**self).stitches_set(model)
    }

    fn particle_position(&mut self, particle: u32) -> Result<[f64; 3]> {
        (**self).particle_position(particle)
    }

    fn collider_impulses(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()> {
        (**self).collider_impulses(out)
    }

    fn normals(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        (**self).normals(out)
    }

    fn contacts_read(&mut self, out: &mut Contacts) -> Result<()> {
        (**self).contacts_read(out)
    }
}

/// A span of time to advance by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Its length \[s\].
    pub duration: f64,
}

impl Frame {
    /// The frame of a sequence with this many frames per second.
    #[must_use]
    pub fn per_second(frames: f64) -> Self {
        Self { duration: frames.recip() }
    }
}
