//! The CUDA sources and how modules are made of them.
//!
//! A module is one file `cuda/<name>.cu` with one or more kernels. What they share is in
//! `cuda/shared`; all of it comes before each module, in the order of dependence. What serves one regular grid
//! alone is in `cuda/patch`. An option of a module
//! is the macro `CLOTH_<OPTION>`; every module also has `f64` (double precision) and `fast`.

use std::{collections::BTreeSet, fmt};

/// A CUDA file that is a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CudaModule {
    /// Its name: that of a stage, or of what is computed for several.
    pub name: &'static str,
    /// The options it knows beside those of all.
    pub options: &'static [&'static str],
    source: &'static str,
}

macro_rules! modules {
    ($($name:literal $(in $folder:literal)? $options:expr,)*) => {
        /// All modules.
        pub const CUDA_MODULES: &[CudaModule] = &[
            $(CudaModule {
                name: $name,
                options: &$options,
                source: include_str!(concat!("../cuda/", $($folder, "/",)? $name, ".cu")),
            },)*
        ];
    };
}

modules! {
    "aerodynamic_forces" [],
    "bending_forces" [],
    "bending_linearise" [],
    "collider_constraints" [],
    "collider_impulses" [],
    "collider_response" [],
    "conjugate_gradient" ["teams", "schwarz"],
    "constraint_filter" [],
    "constraint_impulses" [],
    "constraint_project" [],
    "constraint_release" [],
    "contact_candidates" [],
    "contact_certify" [],
    "contact_forces" [],
    "contact_geometry" [],
    "contact_impulses" [],
    "contact_linearise" [],
    "contact_pairs" [],
    "control_forces" [],
    "explicit_substep" ["penalty", "extras", "table", "grid", "many_registers", "stencil", "packed"],
    "explicit_substep_flat" in "patch" [],
    "explicit_substep_stages" ["penalty", "impulses", "limits", "fabric", "extras", "packed", "many_registers"],
    "field_forces" [],
    "implicit_assemble" [],
    "implicit_motion" [],
    "integrate_explicit" [],
    "jacobi" ["teams"],
    "matrix_apply" [],
    "measure" [],
    "membrane_forces" [],
    "membrane_linearise" [],
    "pins_write" [],
    "preconditioner_apply" [],
    "preconditioner_build" [],
    "preconditioner_build_schwarz" [],
    "procedural_forces" [],
    "semi_implicit_factorise" [],
    "semi_implicit_solve" [],
    "spring_forces" [],
    "spring_linearise" [],
    "strain_limit" [],
    "stretch_limit" [],
    "torque_correct" [],
    "vector_combine" [],
    "vector_dot" [],
    "vector_fill" [],
    "vertex_normals" [],
}

macro_rules! shared {
    ($($folder:literal: $($name:literal)*,)*) => {
        /// The parts of all modules, each after those it needs.
        const SHARED: &[(&str, &str)] =
            &[$($(($name, include_str!(concat!("../cuda/", $folder, "/", $name, ".cuh"))),)*)*];
    };
}

shared! {
    "shared": "ptx" "real" "solver" "spring" "field" "procedural" "fabric" "bending" "air" "collider" "contact" "group" "list" "limit" "sync" "meeting" "build"
    "substep" "frame",
    "patch": "stencil" "tile" "flat" "pairs" "strip" "tile_list" "around",
    "shared": "certificate" "triangles" "team" "contact_rows" "linear" "fabric_matrix" "sum" "schwarz" "solve" "constraint",
}

/// Options of every module.
const COMMON: [&str; 2] = ["f64", "fast"];

/// An option that a module does not know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CudaOptionError {
    module: &'static str,
    option: String,
}

impl fmt::Display for CudaOptionError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}.cu: there is no option `{}`", self.module, self.option)
    }
}

impl std::error::Error for CudaOptionError {}

impl CudaModule {
    /// The module called `name`.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        CUDA_MODULES.iter().find(|module| module.name == name)
    }

    /// The text of its file alone, without the parts that come before it.
    #[must_use]
    pub const fn file(&self) -> &'static str {
        self.source
    }

    /// The text with these options.
    ///
    /// # Errors
    /// An option that the module does not know.
    pub fn compose(&self, options: Vec<&str>) -> Result<String, CudaOptionError> {
        self.compose_with(options, &[])
    }

    /// The same with some of the shared parts, given by name and text, in place of those of this
    /// package: what a backend writes for a model, such as the programs of procedural fields.
    ///
    /// # Errors
    /// As [`Self::compose`].
    pub fn compose_with(
        &self,
        options: Vec<&str>,
        parts: &[(&str, &str)],
    ) -> Result<String, CudaOptionError> {
        let mut text = String::new();
        for option in options {
            if !(COMMON.contains(&option) || self.options.contains(&option)) {
                return Err(CudaOptionError { module: self.name, option: option.to_owned() });
            }
            text += &format!("#define CLOTH_{}\n", option.to_uppercase());
        }
        for (name, part) in SHARED {
            let given = parts.iter().find(|(given, _)| given == name);
            text += given.map_or(*part, |(_, given)| *given);
        }
        text += self.source;
        Ok(text)
    }

    /// Every set of options that backends use: `fast` is for single precision; the tiles of `grid` read their springs from the table, or, in single precision, have those of `stencil`; springs that
    /// are not in the table may be `packed`; kernels with `fabric` are in one form for all sizes, have all `extras` and springs of any kind, so that few
    /// of them are built.
    #[must_use]
    pub fn option_sets(&self) -> Vec<Vec<&'static str>> {
        let all: Vec<&str> = COMMON.iter().chain(self.options).copied().collect();
        let chosen = |set: u32| {
            let chosen = all.iter().enumerate().filter(|(k, _)| set >> k & 1 == 1);
            chosen.map(|(_, option)| *option).collect()
        };
        let is_used = |set: &Vec<&str>| {
            let has = |option| set.contains(&option);
            let single = has("fast") || has("stencil");
            !(has("f64") && single
                || has("schwarz") && has("teams")
                || has("grid") && !has("table")
                || has("stencil") && !has("grid")
                || has("packed") && has("table")
                || has("penalty") && has("impulses")
                || has("fabric") && (has("packed") || !has("extras") || has("many_registers"))
                || self.name == "explicit_substep_stages"
                    && !(has("impulses") || has("limits") || has("fabric")))
        };
        (0..1_u32 << all.len()).map(chosen).filter(is_used).collect()
    }

    /// A few of these sets: every two options are in them on and off in each way in which they ever are together.
    #[must_use]
    pub fn option_pairs(&self) -> Vec<Vec<&'static str>> {
        let all: Vec<&str> = COMMON.iter().chain(self.options).copied().collect();
        let pairs = |set: &Vec<&'static str>| -> BTreeSet<[(&'static str, bool); 2]> {
            let state = |k: usize| (all[k], set.contains(&all[k]));
            (0..all.len()).flat_map(|a| (0..a).map(move |b| [state(a), state(b)])).collect()
        };
        let mut sets = self.option_sets();
        let mut open: BTreeSet<_> = sets.iter().flat_map(&pairs).collect();
        let mut few = Vec::new();
        while !open.is_empty() {
            // The one with most that is new; the first of several.
            let new = |set| pairs(set).intersection(&open).count();
            let Some(best) = (0..sets.len()).rev().max_by_key(|&k| new(&sets[k])) else { break };
            let set = sets.swap_remove(best);
            open = &open - &pairs(&set);
            few.push(set);
        }
        few
    }
}

/// What NVRTC is told for an architecture such as `sm_90`.
///
/// Unless it is to be `fast`, arithmetic rounds as that of the CPU: no contraction to fused
/// multiply-adds, division and square root correctly rounded, numbers below the normal range kept.
#[must_use]
pub fn cuda_compiler_options(architecture: &str, fast: bool) -> Vec<String> {
    let arithmetic: &[&str] = if fast {
        &["--fmad=true", "--prec-div=false", "--prec-sqrt=false", "--ftz=true"]
    } else {
        &["--fmad=false", "--prec-div=true", "--prec-sqrt=true", "--ftz=false"]
    };
    let mut options = vec![format!("--gpu-architecture={architecture}"), "--std=c++17".into()];
    options.extend(arithmetic.iter().map(|&option| option.to_owned()));
    options
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str, extension: &str) -> BTreeSet<String> {
        let folder = format!("{}/{name}", env!("CARGO_MANIFEST_DIR"));
        let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let files = files.filter(|file| file.extension().is_some_and(|e| e == extension));
        files.map(|file| file.file_stem().unwrap().to_str().unwrap().to_owned()).collect()
    }

    #[test]
    fn every_file_is_listed() {
        let listed: BTreeSet<_> =
            CUDA_MODULES.iter().map(|module| module.name.to_owned()).collect();
        assert_eq!(&folder("cuda", "cu") | &folder("cuda/patch", "cu"), listed);
        let listed: BTreeSet<_> = SHARED.iter().map(|(name, _)| (*name).to_owned()).collect();
        assert_eq!(&folder("cuda/shared", "cuh") | &folder("cuda/patch", "cuh"), listed);
    }

    #[test]
    fn an_unknown_option_is_refused() {
        let module = CudaModule::find("explicit_substep").unwrap();
        assert!(
            module.compose(vec!["penalty", "f64"]).unwrap().contains("#define CLOTH_PENALTY\n")
        );
        assert!(module.compose(vec!["air"]).is_err());
        assert_eq!(module.option_sets().len(), 2 * 2 * 2 * (5 + 5 + 4));
        let stages = CudaModule::find("explicit_substep_stages").unwrap();
        assert_eq!(stages.option_sets().len(), 3 * (4 * 2 * 2 * 2 + 6));
        let solver = CudaModule::find("conjugate_gradient").unwrap();
        assert_eq!(solver.option_sets().len(), 3 * 3);
    }

    /// Two options that are wrong together are found by few sets.
    #[test]
    fn few_sets_have_all_pairs_of_options() {
        let stages = CudaModule::find("explicit_substep_stages").unwrap();
        let [few, all] = [stages.option_pairs(), stages.option_sets()];
        assert!(few.len() < all.len() / 5, "{} of {}", few.len(), all.len());
        let both =
            |sets: &[Vec<&str>], a, b| sets.iter().any(|set| set.contains(&a) && set.contains(&b));
        for (k, a) in stages.options.iter().enumerate() {
            for b in &stages.options[..k] {
                assert_eq!(both(&few, a, b), both(&all, a, b), "{a} {b}");
            }
            assert!(few.iter().any(|set| !set.contains(a)), "{a}");
        }
    }
}
