//! Procedural fields as a part of kernels.

use std::fmt::Write;

use cloth_core::{FieldProgram, Model};

/// Name of the part that [`part`] takes the place of.
pub(crate) const PART: &str = "procedural";

/// What keeps compilers from computing a sum of products with common factors in another way than
/// NUMERICS has it, which would be another one in the fused substep than in the single stage.
const ROUNDED: &str = "
// The same number, of which a compiler does not know how it came about.
fn field_rounded(value: vec3f) -> vec3f {
    return bitcast<vec3f>(bitcast<vec3<u32>>(value) ^ vec3<u32>(model.zero));
}

";

/// The WGSL part that adds the forces of all procedural fields of a model, in their order; `None` without
/// any.
pub(crate) fn part(model: &Model) -> Option<String> {
    model.has_procedural_fields().then(|| {
        let programs: Vec<&FieldProgram> = model.field_programs().map(AsRef::as_ref).collect();
        part_of(&programs)
    })
}

fn part_of(programs: &[&FieldProgram]) -> String {
    let mut text = FieldProgram::wgsl_library().to_owned() + ROUNDED;
    let mut calls = String::new();
    for (number, program) in programs.iter().enumerate() {
        let name = format!("field_program_{number}");
        text += &program.wgsl(&name);
        // Writing to a string cannot fail.
        let _ = writeln!(
            calls,
            "    sum = field_rounded({name}(sum, position, velocity, substep.clock, mass, id, substep.length));"
        );
    }
    let _ = write!(
        text,
        "fn procedural_force(force: vec3f, particle: u32, position: vec3f, velocity: vec3f, mass: f32) -> vec3f {{\n    \
         let id = f32(particle);\n    var sum = field_rounded(force);\n{calls}    return sum;\n}}\n"
    );
    text
}

#[cfg(test)]
mod tests {
    use cloth_kernels::WgslModule;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    use super::*;

    #[test]
    fn kernels_with_programs_are_valid() {
        let sources = ["m * vec3(noise(x), sin(t), exp(-dot(v, v)))", "-v * dt * id"];
        let programs = sources.map(|source| FieldProgram::compile(source).unwrap());
        let part = part_of(&programs.each_ref());
        for name in ["procedural_forces", "explicit_substep"] {
            let module = WgslModule::find(name).unwrap();
            let text = module.compose_with(&[], &[(PART, &part)]).unwrap();
            let parsed = naga::front::wgsl::parse_str(&text)
                .unwrap_or_else(|error| panic!("{}", error.emit_to_string(&text)));
            let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
            validator.validate(&parsed).unwrap();
            assert!(text.contains("field_program_1(sum"));
        }
    }
}
