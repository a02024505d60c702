//! A program as a function of a C-like language, one statement for each operation.

use std::fmt::Write;

use super::{
    FieldProgram,
    node::{Binary, Input, Logic, Node, NodeIndex, Unary},
};

/// What differs between the languages.
pub(super) trait Dialect {
    /// A literal.
    fn number(&self, value: f64) -> String;
    /// Start of a statement that names a value.
    fn binding(&self, is_condition: bool) -> &'static str;
    /// `a` if `condition`, else `b`.
    fn select(&self, condition: &str, a: &str, b: &str) -> String;
    /// Square root and absolute value.
    fn built_in(&self, function: Unary) -> &'static str;
    /// The call of noise.
    fn noise(&self, operands: &[String; 3]) -> String;
    /// a b + c in one operation, where the language leaves compilers a choice unless it is said.
    fn product_sum(&self, a: &str, b: &str, c: &str) -> Option<String>;
}

impl FieldProgram {
    /// The statements of the body, and the names of the three components of the result.
    pub(super) fn body(&self, dialect: &impl Dialect) -> (String, [String; 3]) {
        let name = |index: NodeIndex| format!("r{index}");
        let mut text = String::new();
        for (index, node) in self.nodes.iter().enumerate() {
            let value = match *node {
                Node::Constant(bits) => dialect.number(f64::from_bits(bits)),
                Node::Input(input) => input_name(input).to_owned(),
                Node::Unary(function, a) => unary(dialect, function, &name(a)),
                Node::Binary(function, operands) => self
                    .product_sum(dialect, function, operands)
                    .unwrap_or_else(|| binary(dialect, function, &operands.map(name))),
                Node::Logic(logic, operands) => {
                    let [a, b] = operands.map(name);
                    format!("{a} {} {b}", logic_symbol(logic))
                }
                Node::Not(a) => format!("!{}", name(a)),
                Node::Select(operands) => {
                    let [condition, a, b] = operands.map(name);
                    dialect.select(&condition, &a, &b)
                }
                Node::Noise(operands) => dialect.noise(&operands.map(name)),
            };
            let binding = dialect.binding(node.is_condition());
            // Writing to a string cannot fail.
            let _ = writeln!(text, "    {binding} r{index} = {value};");
        }
        (text, self.outputs.map(name))
    }

    /// A sum of which one part is a product, if the dialect says how products are added.
    fn product_sum(
        &self,
        dialect: &impl Dialect,
        function: Binary,
        [a, b]: [NodeIndex; 2],
    ) -> Option<String> {
        let sign = match function {
            Binary::Add => "",
            Binary::Subtract => "-",
            _ => return None,
        };
        if let Some([p, q]) = self.product(b) {
            return dialect.product_sum(&format!("{sign}{p}"), &q, &format!("r{a}"));
        }
        let [p, q] = self.product(a)?;
        dialect.product_sum(&p, &q, &format!("{sign}r{b}"))
    }

    /// The factors of a node, if it is a product or the opposite of one.
    pub(super) fn product(&self, index: NodeIndex) -> Option<[String; 2]> {
        let mut node = self.nodes[usize::from(index)];
        let mut sign = "";
        while let Node::Unary(Unary::Negate, inner) = node {
            sign = if sign.is_empty() { "-" } else { "" };
            node = self.nodes[usize::from(inner)];
        }
        match node {
            Node::Binary(Binary::Multiply, [p, q]) => {
                Some([format!("{sign}r{p}"), format!("r{q}")])
            }
            _ => None,
        }
    }

    /// The components of the result as nodes.
    pub(super) const fn output_nodes(&self) -> [NodeIndex; 3] {
        self.outputs
    }
}

const fn input_name(input: Input) -> &'static str {
    const AXES: [[&str; 3]; 2] = [["x.x", "x.y", "x.z"], ["v.x", "v.y", "v.z"]];
    match input {
        Input::Position(axis) => AXES[0][axis as usize],
        Input::Velocity(axis) => AXES[1][axis as usize],
        Input::Time => "t",
        Input::Mass => "m",
        Input::Particle => "id",
        Input::TimeStep => "dt",
    }
}

fn unary(dialect: &impl Dialect, function: Unary, a: &str) -> String {
    match function {
        Unary::Negate => format!("-{a}"),
        Unary::Absolute | Unary::SquareRoot => format!("{}({a})", dialect.built_in(function)),
        Unary::Sine => format!("field_sine({a})"),
        Unary::Cosine => format!("field_cosine({a})"),
        Unary::Exponential => format!("field_exponential({a})"),
        Unary::Logarithm => format!("field_logarithm({a})"),
    }
}

fn binary(dialect: &impl Dialect, function: Binary, [a, b]: &[String; 2]) -> String {
    match function {
        Binary::Add => format!("{a} + {b}"),
        Binary::Subtract => format!("{a} - {b}"),
        Binary::Multiply => format!("{a} * {b}"),
        Binary::Divide => format!("{a} / {b}"),
        Binary::Power => format!("field_power({a}, {b})"),
        // As comparisons, so that NaN is treated as on the CPU.
        Binary::Minimum => dialect.select(&format!("{a} < {b}"), a, b),
        Binary::Maximum => dialect.select(&format!("{a} > {b}"), a, b),
    }
}

const fn logic_symbol(logic: Logic) -> &'static str {
    match logic {
        Logic::Less => "<",
        Logic::LessEqual => "<=",
        Logic::Equal => "==",
        Logic::NotEqual => "!=",
        Logic::And => "&&",
        Logic::Or => "||",
    }
}
