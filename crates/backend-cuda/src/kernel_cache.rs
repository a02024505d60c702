//! The kernels of one solver, compiled when they are first used.

use std::{collections::HashMap, sync::Arc};

use cloth_core::{Error, Model, Result};
use cloth_kernels::CudaModule;

use crate::{
    compile::Target,
    device::{Device, Kernel},
    foreseen::Foreseen,
    images::Source,
    layout::CudaReal,
    procedural,
    solver_form::SolverForm,
};

/// Module, name, and option of the solver of linear systems.
type Key = (&'static str, &'static str, Option<&'static str>);

/// The kernels that were used so far, and what they are compiled for.
pub(crate) struct KernelCache {
    device: Arc<Device>,
    double: bool,
    fast: bool,
    /// The part of kernels that adds the forces of procedural fields, if there are any.
    procedural: Option<String>,
    /// Options of the general forms of the kernel of frames.
    pub(crate) frame_options: Vec<&'static str>,
    /// How the linear system is solved at present.
    pub(crate) solver: SolverForm,
    kernels: HashMap<Key, Kernel>,
}

impl KernelCache {
    /// None yet, of a model in precision `T`; `fast` is without the promise of the same bits as the CPU.
    pub(crate) fn new<T: CudaReal>(device: Arc<Device>, model: &Model, fast: bool) -> Self {
        Self {
            device,
            double: T::DOUBLE,
            fast,
            procedural: procedural::part::<T>(model),
            frame_options: Vec::new(),
            solver: SolverForm::General,
            kernels: HashMap::new(),
        }
    }

    /// Begins to compile modules that will be used, beside this thread.
    pub(crate) fn compile_ahead(&self, foreseen: &[Foreseen]) {
        // One that cannot be made has its error when it is used.
        let sources = foreseen.iter().filter_map(|&of| self.source(of).ok()).collect();
        self.device.ahead.start(&self.device.images, sources);
    }

    /// A kernel of a module, compiled if need be.
    ///
    /// # Errors
    /// `KernelCompile`; what the device reports.
    pub(crate) fn kernel(&mut self, module: &'static str, name: &'static str) -> Result<Kernel> {
        let solver = self.solver.option().filter(|_| SolverForm::MODULES.contains(&module));
        if let Some(kernel) = self.kernels.get(&(module, name, solver)) {
            return Ok(*kernel);
        }
        let source = self.source((module, solver))?;
        let kernel = self.device.kernel(&source, name)?;
        self.kernels.insert((module, name, solver), kernel);
        Ok(kernel)
    }

    /// The text of a module for the model.
    fn source(&self, (module, solver): Foreseen) -> Result<Source> {
        let Some(source) = CudaModule::find(module) else {
            let log = "there is no module of this name".to_owned();
            return Err(Error::KernelCompile { kernel: module, log });
        };
        let options: &[_] = match module {
            "explicit_substep" | "explicit_substep_stages" => &self.frame_options,
            _ => solver.as_slice(),
        };
        let has_procedural =
            module.starts_with("explicit_substep") || module == "procedural_forces";
        let procedural = self.procedural.as_deref().filter(|_| has_procedural);
        Source::new(source, &Target { double: self.double, fast: self.fast, options, procedural })
    }
}
