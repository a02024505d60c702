//! Every WGSL module is valid, with every set of its options. No GPU is needed.

use cloth_kernels::{WGSL_MODULES, WgslBindingKind, WgslModule, wgsl_bindings};
use naga::valid::{Capabilities, ValidationFlags, Validator};

#[test]
fn every_module_is_valid() {
    for module in WGSL_MODULES {
        for options in module.option_sets() {
            let text = module.compose(&options).unwrap();
            let parsed = naga::front::wgsl::parse_str(&text).unwrap_or_else(|error| {
                panic!("{}", error.emit_to_string_with_path(&text, module.name))
            });
            let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
            if let Err(error) = validator.validate(&parsed) {
                panic!("{}", error.emit_to_string_with_path(&text, module.name));
            }
        }
    }
}

/// What WebGPU promises: storage buffers of a stage.
const STORAGE_BUFFERS: usize = 8;

#[test]
fn stages_run_where_few_buffers_can_be_bound() {
    for name in [
        "contact_certify",
        "contact_forces_triangles",
        "contact_geometry",
        "contact_pairs_ahead",
        "contact_pairs_boxes",
        "contact_pairs_list",
        "contact_pairs_moved",
        "contact_pairs_tree",
        "membrane_forces",
        "membrane_forces_gather",
        "bending_forces",
        "bending_forces_gather",
        "measure_fabric",
        "membrane_linearise",
        "bending_linearise",
        "implicit_assemble_fabric",
        "implicit_assemble_fabric_rows",
    ] {
        let module = WgslModule::find(name).unwrap();
        let bindings = wgsl_bindings(&module.compose(&[]).unwrap());
        let storage = bindings.iter().filter(|binding| binding.kind != WgslBindingKind::Uniform);
        assert!(storage.count() <= STORAGE_BUFFERS, "{name}: {bindings:?}");
    }
}
