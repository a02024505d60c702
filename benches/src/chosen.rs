//! The backends that criterion measures.

use std::env;

use cloth::{Backend, wgpu::WgpuBackend};

/// A backend of this machine.
pub struct ChosenBackend {
    /// Its name.
    pub name: &'static str,
    /// The backend itself.
    pub backend: Box<dyn Backend>,
    /// Whether it is a GPU that the processor plays, which is worth small sizes only.
    pub is_emulated: bool,
}

/// All backends of this machine but the reference, or those that the variable `CLOTH_BACKENDS` names, separated by commas.
#[must_use]
pub fn chosen_backends() -> Vec<ChosenBackend> {
    let chosen = env::var("CLOTH_BACKENDS").ok();
    let is_chosen = |name: &str| match &chosen {
        Some(names) => names.split(',').any(|chosen| chosen == name),
        None => name != "reference",
    };
    let backends = cloth::backends().into_iter().filter(|info| is_chosen(info.name));
    backends
        .filter_map(|info| {
            let backend = cloth::backend_create(info.name, None).ok()?;
            let is_emulated =
                info.name == "wgpu" && WgpuBackend::new(None).is_ok_and(|gpu| gpu.is_processor());
            Some(ChosenBackend { name: info.name, backend, is_emulated })
        })
        .collect()
}

impl ChosenBackend {
    /// These sizes, or one that suits a GPU that the processor plays.
    #[must_use]
    pub fn sides(&self, all: &[u32]) -> Vec<u32> {
        if self.is_emulated { vec![32] } else { all.to_vec() }
    }
}
