//! Programs for WGSL.

use super::{FieldProgram, node::Unary, shader::Dialect};

struct Wgsl;

impl Dialect for Wgsl {
    fn number(&self, value: f64) -> String {
        // Subnormal literals are not portable, and devices compute with zero instead.
        let value = value as f32;
        format!("{:e}f", if value.is_normal() { value } else { 0.0 })
    }

    fn binding(&self, _: bool) -> &'static str {
        "let"
    }

    fn select(&self, condition: &str, a: &str, b: &str) -> String {
        format!("select({b}, {a}, {condition})")
    }

    fn built_in(&self, function: Unary) -> &'static str {
        if function == Unary::SquareRoot { "sqrt" } else { "abs" }
    }

    fn noise(&self, [x, y, z]: &[String; 3]) -> String {
        format!("field_noise(vec3<f32>({x}, {y}, {z}))")
    }

    fn product_sum(&self, a: &str, b: &str, c: &str) -> Option<String> {
        let plus = |text: &str| text.replacen("--", "", 1);
        Some(format!("fma({}, {}, {})", plus(a), plus(b), plus(c)))
    }
}

impl FieldProgram {
    /// The program as a WGSL function, which needs [`Self::wgsl_library`]:
    ///
    /// ```wgsl
    /// fn name(force: vec3<f32>, x: vec3<f32>, v: vec3<f32>, t: f32, m: f32, id: f32, dt: f32) -> vec3<f32>
    /// ```
    ///
    /// It returns `force` with that of the field added \[N\]. Products that are added to something, the
    /// given force included, are fused multiply-adds: WGSL would let compilers choose. `id` is exact
    /// up to 2^24 particles.
    #[must_use]
    pub fn wgsl(&self, name: &str) -> String {
        let (body, results) = self.body(&Wgsl);
        let mut sums = ["x", "y", "z"].map(|axis| format!("force.{axis}"));
        for ((sum, result), node) in sums.iter_mut().zip(results).zip(self.output_nodes()) {
            let fused = self.product(node).and_then(|[p, q]| Wgsl.product_sum(&p, &q, sum));
            *sum = fused.unwrap_or_else(|| format!("{sum} + {result}"));
        }
        let [x, y, z] = sums;
        format!(
            "fn {name}(force: vec3<f32>, x: vec3<f32>, v: vec3<f32>, t: f32, m: f32, id: f32, dt: f32) \
             -> vec3<f32> {{\n{body}    return vec3<f32>({x}, {y}, {z});\n}}\n"
        )
    }

    /// Functions that all programs call; to be in a module once. All names start with `field_`.
    #[must_use]
    pub const fn wgsl_library() -> &'static str {
        include_str!("library.wgsl")
    }
}
