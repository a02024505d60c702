//! The stages of the engine by name, and the sources of their GPU kernels.
//!
//! A stage has one name everywhere: a method of `cloth_core::Kernels`, a module of the CPU backend,
//! `wgsl/<stage>.wgsl` and `cuda/<stage>.cu` in this package, an equivalence test. [`STAGES`] is the
//! list that all of them are held against. [`WGSL_MODULES`] has the sources for wgpu; a stage of several
//! passes has a module for each, `<stage>_<pass>`. [`CUDA_MODULES`] has those for CUDA, whose passes share a file.

mod cuda;
mod wgsl;

pub use cuda::{CUDA_MODULES, CudaModule, CudaOptionError, cuda_compiler_options};
pub use wgsl::{
    ComposeError, WGSL_MODULES, WgslBinding, WgslBindingKind, WgslModule, wgsl_bindings,
};
/// A stage of the numerics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stage {
    /// Its name.
    pub name: &'static str,
    /// Section of NUMERICS.md that has its formula.
    pub section: u32,
}

/// All stages: those of the explicit substep in its order, then those of the implicit and
/// semi-implicit one, then what looks at the state.
pub const STAGES: &[Stage] = &[
    Stage { name: "control_forces", section: 3 },
    Stage { name: "field_forces", section: 3 },
    Stage { name: "procedural_forces", section: 3 },
    Stage { name: "spring_forces", section: 2 },
    Stage { name: "membrane_forces", section: 11 },
    Stage { name: "bending_forces", section: 12 },
    Stage { name: "aerodynamic_forces", section: 3 },
    Stage { name: "contact_candidates", section: 8 },
    Stage { name: "contact_forces", section: 8 },
    Stage { name: "integrate_explicit", section: 4 },
    Stage { name: "contact_impulses", section: 8 },
    Stage { name: "strain_limit", section: 4 },
    Stage { name: "stretch_limit", section: 4 },
    Stage { name: "collider_response", section: 7 },
    Stage { name: "state_keep", section: 5 },
    Stage { name: "state_restore", section: 5 },
    Stage { name: "spring_linearise", section: 5 },
    Stage { name: "membrane_linearise", section: 11 },
    Stage { name: "bending_linearise", section: 12 },
    Stage { name: "contact_linearise", section: 5 },
    Stage { name: "implicit_assemble", section: 5 },
    Stage { name: "collider_constraints", section: 5 },
    Stage { name: "constraint_release", section: 5 },
    Stage { name: "constraint_impulses", section: 5 },
    Stage { name: "constraint_filter", section: 5 },
    Stage { name: "constraint_project", section: 5 },
    Stage { name: "matrix_apply", section: 5 },
    Stage { name: "preconditioner_build", section: 5 },
    Stage { name: "preconditioner_apply", section: 5 },
    Stage { name: "conjugate_gradient", section: 5 },
    Stage { name: "jacobi", section: 5 },
    Stage { name: "direct_solve", section: 5 },
    Stage { name: "velocity_add", section: 5 },
    Stage { name: "position_advance", section: 5 },
    Stage { name: "position_from_kept", section: 5 },
    Stage { name: "vector_dot", section: 5 },
    Stage { name: "vector_combine", section: 5 },
    Stage { name: "vector_fill", section: 5 },
    Stage { name: "semi_implicit_factorise", section: 6 },
    Stage { name: "semi_implicit_solve", section: 6 },
    Stage { name: "torque_correct", section: 6 },
    Stage { name: "vertex_normals", section: 9 },
    Stage { name: "measure", section: 10 },
];

/// Stages that no WGSL module computes, as no GPU gains from them.
pub const WGSL_STAGES_MISSING: &[&str] = &["direct_solve"];

/// Stages that are copies of buffers: no kernel computes them.
pub const COPIED_STAGES: &[&str] = &["state_keep", "state_restore"];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stage_is_in_its_section_of_the_numerics() {
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/cloth-core");
        let numerics = std::fs::read_to_string(format!("{root}/NUMERICS.md")).unwrap();
        let kernels = ["mod", "implicit", "semi_implicit"]
            .map(|file| std::fs::read_to_string(format!("{root}/src/kernels/{file}.rs")).unwrap());
        let kernels = kernels.concat();
        for stage in STAGES {
            let heading = format!("\n## {} ", stage.section);
            let start = numerics.find(&heading).unwrap_or_else(|| panic!("no section {heading:?}"));
            let section = &numerics[start + 1..];
            let section = &section[..section.find("\n## ").unwrap_or(section.len())];
            let name = stage.name;
            assert!(section.contains(&format!("`{name}`")), "{name} is not in its section");
            assert!(kernels.contains(&format!("fn {name}(")), "{name} is not a method of Kernels");
        }
    }
}
