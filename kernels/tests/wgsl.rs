//! Every WGSL module is valid, with every set of its options. No GPU is needed.

use cloth_kernels::WGSL_MODULES;
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
