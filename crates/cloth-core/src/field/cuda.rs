//! Programs for CUDA C.

use crate::Precision;

use super::{FieldProgram, node::Unary, shader::Dialect};

struct Cuda {
    precision: Precision,
}

impl Dialect for Cuda {
    fn number(&self, value: f64) -> String {
        match self.precision {
            Precision::F32 => format!("{:e}f", value as f32),
            Precision::F64 => format!("{value:e}"),
        }
    }

    fn binding(&self, is_condition: bool) -> &'static str {
        match (is_condition, self.precision) {
            (true, _) => "const bool",
            (false, Precision::F32) => "const float",
            (false, Precision::F64) => "const double",
        }
    }

    fn select(&self, condition: &str, a: &str, b: &str) -> String {
        format!("({condition}) ? {a} : {b}")
    }

    fn built_in(&self, function: Unary) -> &'static str {
        match (function, self.precision) {
            (Unary::SquareRoot, Precision::F32) => "sqrtf",
            (Unary::SquareRoot, Precision::F64) => "sqrt",
            (_, Precision::F32) => "fabsf",
            (_, Precision::F64) => "fabs",
        }
    }

    fn noise(&self, [x, y, z]: &[String; 3]) -> String {
        format!("field_noise({x}, {y}, {z})")
    }

    fn product_sum(&self, _: &str, _: &str, _: &str) -> Option<String> {
        None
    }
}

impl FieldProgram {
    /// The program as a CUDA device function, which needs [`Self::cuda_library`], in either precision
    /// (`float3` and `float` for single):
    ///
    /// ```c
    /// __device__ double3 name(double3 x, double3 v, double t, double m, double id, double dt)
    /// ```
    ///
    /// It returns the force \[N\]. Compiled without contraction (`--fmad=false`) and with IEEE
    /// division and square root, it gives the bits of the CPU.
    #[must_use]
    pub fn cuda(&self, name: &str, precision: Precision) -> String {
        let (body, [x, y, z]) = self.body(&Cuda { precision });
        let scalar = match precision {
            Precision::F32 => "float",
            Precision::F64 => "double",
        };
        format!(
            "static __device__ __forceinline__ {scalar}3 {name}({scalar}3 x, {scalar}3 v, {scalar} t, \
             {scalar} m, {scalar} id, {scalar} dt) {{\n\
             {body}    return make_{scalar}3({x}, {y}, {z});\n}}\n"
        )
    }

    /// Functions that all programs call, in both precisions; to be in a module once. All names start
    /// with `field_`.
    #[must_use]
    pub const fn cuda_library() -> &'static str {
        include_str!("library.cu")
    }
}
