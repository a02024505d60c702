//! The WGSL sources and the step that puts modules together from them.
//!
//! A module is one file `wgsl/<name>.wgsl` with one entry point, `main`. Lines that begin with `//!`
//! are instructions:
//!
//! - `//!include a b` is replaced by `wgsl/shared/a.wgsl` and `wgsl/shared/b.wgsl`, in that order;
//! - `//!if option` keeps the lines up to `//!end` only if the module is composed with that option,
//!   `//!if not option` only if it is not.
//!
//! There is nothing else to it: no nesting, no expressions. All resources are in group 0, and a
//! binding number belongs to one resource in all modules.

use std::{fmt, ops::Range};

/// A WGSL file that is a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WgslModule {
    /// Its name: that of a stage, or of a stage and one of its passes.
    pub name: &'static str,
    /// The options it knows.
    pub options: &'static [&'static str],
    source: &'static str,
}

macro_rules! modules {
    ($($name:literal $options:expr,)*) => {
        /// All modules.
        pub const WGSL_MODULES: &[WgslModule] = &[
            $(WgslModule {
                name: $name,
                options: &$options,
                source: include_str!(concat!("../wgsl/", $name, ".wgsl")),
            },)*
        ];
    };
}

modules! {
    "aerodynamic_forces" [],
    "bending_forces" [],
    "bending_forces_folds" [],
    "bending_forces_gather" [],
    "bending_forces_moments" [],
    "bending_linearise" [],
    "bending_linearise_moments" [],
    "collider_constraints" ["grids"],
    "collider_impulses" [],
    "collider_response" ["grids", "feedback", "start"],
    "conjugate_gradient_contacts" [],
    "conjugate_gradient_image" ["colliders", "fabric", "penalty", "triangles"],
    "conjugate_gradient_image_crowded" ["colliders", "fabric"],
    "conjugate_gradient_iteration" ["colliders"],
    "conjugate_gradient_step" ["colliders"],
    "constraint_filter" ["colliders"],
    "constraint_impulses" [],
    "constraint_project" ["colliders"],
    "constraint_release" [],
    "contact_candidates_boxes" [],
    "contact_candidates_groups" [],
    "contact_candidates_list" ["exclusions"],
    "contact_candidates_regions" [],
    "contact_certify" [],
    "contact_forces" [],
    "contact_forces_triangles" [],
    "contact_geometry" [],
    "contact_impulses" [],
    "contact_impulses_count" [],
    "contact_linearise" [],
    "contact_pairs_ahead" [],
    "contact_pairs_boxes" [],
    "contact_pairs_list" [],
    "contact_pairs_moved" [],
    "contact_pairs_tree" [],
    "control_forces" [],
    "control_forces_anchors" [],
    "control_forces_assemble" [],
    "control_forces_restore" [],
    "explicit_substep" ["air", "buckling", "fabric", "grids", "feedback", "penalty"],
    "explicit_substep_fabric" [],
    "field_forces" [],
    "implicit_assemble" ["air", "buckling", "colliders", "fabric", "penalty", "triangles"],
    "implicit_assemble_fabric" [],
    "implicit_assemble_fabric_rows" [],
    "integrate_explicit" [],
    "jacobi" [],
    "linear_begin" [],
    "linear_close" [],
    "linear_end" [],
    "linear_reference" [],
    "linear_residual" ["colliders", "fabric", "penalty", "triangles"],
    "linear_start" ["colliders"],
    "matrix_apply" ["fabric", "penalty", "triangles"],
    "measure" ["buckling", "contact", "grids"],
    "measure_fabric" [],
    "measure_total" [],
    "membrane_forces" [],
    "membrane_forces_gather" [],
    "membrane_linearise" [],
    "pins_write" [],
    "position_advance" [],
    "position_from_kept" [],
    "preconditioner_apply" ["colliders"],
    "preconditioner_apply_bottom" [],
    "preconditioner_apply_bottom_sums" [],
    "preconditioner_apply_end" ["colliders"],
    "preconditioner_apply_groups" [],
    "preconditioner_apply_restrict" [],
    "preconditioner_apply_smooth" [],
    "preconditioner_build" ["colliders"],
    "procedural_forces" [],
    "semi_implicit_factorise" ["buckling", "fabric"],
    "semi_implicit_solve" ["buckling", "fabric"],
    "spring_forces" ["buckling"],
    "spring_linearise" ["buckling"],
    "strain_limit" [],
    "stretch_limit" [],
    "torque_correct" [],
    "torque_correct_sums" [],
    "torque_correct_turn" [],
    "vector_combine" [],
    "vector_dot" [],
    "vector_dot_total" [],
    "vector_fill" [],
    "velocity_add" [],
    "vertex_normals" [],
}

macro_rules! shared {
    ($($name:literal)*) => {
        const SHARED: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("../wgsl/shared/", $name, ".wgsl"))),)*];
    };
}

shared! {
    "air" "air_add" "air_add_none" "air_jacobian" "air_jacobian_none" "arctangent" "assemble"
    "call" "cells" "certificate" "collider" "colour"
    "constraint" "constraint_change" "constraint_none" "contact_counts" "contact_exclusions"
    "contact_exclusions_none" "contact_force" "contact_kept" "contact_next"
    "contact_pair" "contact_partners" "contact_penalty" "contact_row" "contact_row_none" "contact_search"
    "contact_spill" "contact_table" "contact_terms" "contact_times" "contact_turn" "contact_wanted"
    "control_forces" "distance_grid" "distance_grid_none" "element_own" "element_own_none" "element_pull" "element_pull_none" "element_row"
    "element_row_none" "element_sums" "fabric" "fabric_add" "fabric_add_none"
    "fabric_gather" "fabric_tangents" "fabric_vectors" "feedback" "feedback_none" "field" "filter" "finite" "fold" "fold_apexes" "fold_moments" "fold_numbers" "fold_tables" "force" "group"
    "group_box" "group_boxes" "group_boxes_out" "group_check" "group_region" "group_rows" "integrate" "link_kinds" "links" "matrix"
    "matrix_diagonal" "matrix_entry" "matrix_row" "matrix_springs" "measure_sum" "membrane" "membrane_element" "membrane_motion" "membrane_store" "model" "motion" "motion_out"
    "particle_advance" "particle_force" "piece" "pair_box" "pair_boxes" "pair_each" "pair_found" "pair_list" "pair_references" "pair_results" "pair_task" "pair_way_box" "pair_ways" "plate"
    "position_start" "position_start_none" "preconditioner" "preconditioner_block" "procedural" "schwarz" "schwarz_factor" "schwarz_prolong" "schwarz_residual" "solve"
    "solve_begin" "solve_check" "solve_energy" "solve_image" "solve_outcome" "spring" "spring_batch" "spring_buckling" "spring_factor" "spring_linear"
    "status" "substep" "surface" "symmetric" "triangle_row" "triangle_row_none" "triangle_row_terms" "triangles" "vectors"
}

/// A resource that a module binds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WgslBinding {
    /// Number of the binding in group 0.
    pub number: u32,
    /// What it is.
    pub kind: WgslBindingKind,
    /// Name of the variable.
    pub name: String,
}

/// What a module binds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WgslBindingKind {
    /// A uniform buffer.
    Uniform,
    /// A storage buffer that is only read.
    StorageRead,
    /// A storage buffer that is written too.
    StorageWrite,
}

/// A source that does not follow the rules above.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ComposeError {
    module: String,
    reason: String,
}

impl fmt::Display for ComposeError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}.wgsl: {}", self.module, self.reason)
    }
}

impl std::error::Error for ComposeError {}

impl WgslModule {
    /// The module called `name`.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        WGSL_MODULES.iter().find(|module| module.name == name)
    }

    /// The WGSL text with these options.
    ///
    /// # Errors
    /// An option that the module does not know, a part that does not exist, an `if` without end.
    pub fn compose(&self, options: &[&str]) -> Result<String, ComposeError> {
        self.compose_with(options, &[])
    }

    /// The same with some parts, given by name and text, in place of those of this package: what
    /// a backend writes for a model, such as the programs of procedural fields.
    ///
    /// # Errors
    /// As [`Self::compose`].
    pub fn compose_with(
        &self,
        options: &[&str],
        parts: &[(&str, &str)],
    ) -> Result<String, ComposeError> {
        let fail = |reason: String| ComposeError { module: self.name.to_owned(), reason };
        if let Some(unknown) = options.iter().find(|option| !self.options.contains(option)) {
            return Err(fail(format!("there is no option `{unknown}`")));
        }
        let mut text = String::new();
        // Whether lines are kept, inside an `if`.
        let mut condition: Option<bool> = None;
        for line in self.source.lines() {
            let Some(instruction) = line.strip_prefix("//!") else {
                if condition != Some(false) {
                    text.push_str(line);
                    text.push('\n');
                }
                continue;
            };
            let mut words = instruction.split_whitespace();
            match words.next() {
                Some("include") if condition == Some(false) => {}
                Some("include") => {
                    for name in words {
                        let mut all = parts.iter().chain(SHARED);
                        let part = all.find(|(shared, _)| *shared == name);
                        let (_, part) = part.ok_or_else(|| fail(format!("no part `{name}`")))?;
                        text.push_str(part);
                    }
                }
                Some("if") if condition.is_none() => {
                    let first = words.next().unwrap_or_default();
                    let wanted = first != "not";
                    let option = if wanted { first } else { words.next().unwrap_or_default() };
                    if !self.options.contains(&option) {
                        return Err(fail(format!("`{option}` is not in the list of options")));
                    }
                    condition = Some(options.contains(&option) == wanted);
                }
                Some("end") if condition.is_some() => condition = None,
                _ => return Err(fail(format!("`{line}` makes no sense here"))),
            }
        }
        if condition.is_some() { Err(fail("an `if` has no `end`".into())) } else { Ok(text) }
    }

    /// Every set of options that the module can be composed with.
    #[must_use]
    pub fn option_sets(&self) -> Vec<Vec<&'static str>> {
        let sets: Range<u32> = 0..1 << self.options.len();
        sets.map(|set| {
            let chosen = self.options.iter().enumerate().filter(|(k, _)| set >> k & 1 == 1);
            chosen.map(|(_, option)| *option).collect()
        })
        .collect()
    }
}

/// The resources that a composed text declares, in the order of their numbers. Declarations are on
/// one line: `@group(0) @binding(N) var<...> name: type;`.
#[must_use]
pub fn wgsl_bindings(text: &str) -> Vec<WgslBinding> {
    let mut bindings: Vec<_> = text.lines().filter_map(binding_of_line).collect();
    bindings.sort_by_key(|binding| binding.number);
    bindings
}

fn binding_of_line(line: &str) -> Option<WgslBinding> {
    let rest = line.strip_prefix("@group(0) @binding(")?;
    let (number, rest) = rest.split_once(") var<")?;
    let (space, rest) = rest.split_once("> ")?;
    let (name, _) = rest.split_once(':')?;
    let kind = match space {
        "uniform" => WgslBindingKind::Uniform,
        "storage, read" => WgslBindingKind::StorageRead,
        "storage, read_write" => WgslBindingKind::StorageWrite,
        _ => return None,
    };
    Some(WgslBinding { number: number.parse().ok()?, kind, name: name.to_owned() })
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeSet, HashMap};

    use super::*;

    fn folder(name: &str) -> BTreeSet<String> {
        let folder = format!("{}/{name}", env!("CARGO_MANIFEST_DIR"));
        let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let files = files.filter(|file| file.extension().is_some_and(|e| e == "wgsl"));
        files.map(|file| file.file_stem().unwrap().to_str().unwrap().to_owned()).collect()
    }

    #[test]
    fn every_file_is_listed() {
        let listed = WGSL_MODULES.iter().map(|module| module.name.to_owned()).collect();
        assert_eq!(folder("wgsl"), listed);
        let listed = SHARED.iter().map(|(name, _)| (*name).to_owned()).collect();
        assert_eq!(folder("wgsl/shared"), listed);
    }

    #[test]
    fn every_stage_has_a_module_or_several_passes() {
        for stage in crate::STAGES {
            let pass = format!("{}_", stage.name);
            let found = WGSL_MODULES
                .iter()
                .any(|module| module.name == stage.name || module.name.starts_with(&pass));
            let is_known = crate::WGSL_STAGES_MISSING.contains(&stage.name)
                || crate::COPIED_STAGES.contains(&stage.name);
            assert_ne!(
                found, is_known,
                "{}: it has a module, or is known to have none",
                stage.name
            );
        }
    }

    #[test]
    fn a_number_belongs_to_one_resource() {
        let mut names: HashMap<u32, String> = HashMap::new();
        let mut numbers: HashMap<String, u32> = HashMap::new();
        for module in WGSL_MODULES {
            for options in module.option_sets() {
                let text = module.compose(&options).unwrap();
                let bindings = wgsl_bindings(&text);
                assert_eq!(bindings.len(), text.matches("@binding(").count(), "{}", module.name);
                for WgslBinding { number, name, .. } in bindings {
                    let known = names.entry(number).or_insert_with(|| name.clone());
                    assert_eq!(*known, name, "{}: binding {number}", module.name);
                    assert_eq!(*numbers.entry(name).or_insert(number), number);
                }
            }
        }
    }

    #[test]
    fn options_choose_lines_and_mistakes_are_found() {
        let module = WgslModule {
            name: "trial",
            options: &["a"],
            source: "x\n//!if a\ny\n//!include field\n//!end\nz\n",
        };
        assert_eq!(module.compose(&[]), Ok("x\nz\n".into()));
        assert!(module.compose(&["a"]).unwrap().contains("fn field_force"));
        assert!(module.compose(&["b"]).is_err());
        let module = WgslModule { source: "//!if not a\nx\n//!end\nz\n", ..module };
        assert_eq!(module.compose(&[]), Ok("x\nz\n".into()));
        assert_eq!(module.compose(&["a"]), Ok("z\n".into()));
        for source in ["//!if a", "//!end", "//!include nothing", "//!if b\n//!end", "//!else"] {
            assert!(WgslModule { source, ..module }.compose(&[]).is_err(), "{source}");
        }
    }
}
