//! Procedural fields as a part of kernels.

use std::fmt::Write;

use cloth_core::{FieldProgram, Model, Precision};

use crate::layout::CudaReal;

/// Name of the part that [`part`] takes the place of.
pub(crate) const PART: &str = "procedural";

/// The CUDA part that adds the forces of all procedural fields of a model, in their order; `None` without
/// any.
pub(crate) fn part<T: CudaReal>(model: &Model) -> Option<String> {
    model.has_procedural_fields().then(|| {
        let programs: Vec<&FieldProgram> = model.field_programs().map(AsRef::as_ref).collect();
        part_of(&programs, if T::DOUBLE { Precision::F64 } else { Precision::F32 })
    })
}

/// The same for some programs.
pub(crate) fn part_of(programs: &[&FieldProgram], precision: Precision) -> String {
    let scalar = match precision {
        Precision::F32 => "float",
        Precision::F64 => "double",
    };
    let mut text = FieldProgram::cuda_library().to_owned();
    let mut calls = String::new();
    for (number, program) in programs.iter().enumerate() {
        let name = format!("field_program_{number}");
        text += &program.cuda(&name, precision);
        // Writing to a string cannot fail.
        let _ = writeln!(
            calls,
            "    more = {name}(place, motion, substep.time, mass, (real)i, substep.length);\n    \
             sum = sum + make_vec3(more.x, more.y, more.z);"
        );
    }
    let _ = write!(
        text,
        "__device__ __forceinline__ vec3 procedural_force(const SubstepData& substep, uint i, const vec3& x, \
         const vec3& v, real mass, const vec3& force) {{\n    \
         const {scalar}3 place = make_{scalar}3(x.x, x.y, x.z), motion = make_{scalar}3(v.x, v.y, v.z);\n    \
         {scalar}3 more;\n    vec3 sum = force;\n{calls}    return sum;\n}}\n"
    );
    text
}
