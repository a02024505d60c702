//! Functions of the language: what they take, and the operations that they become.

use super::{
    FieldError,
    node::{Binary, Node, NodeIndex, Unary},
    parser::{Parsed, Parser, Value},
};

/// Names and numbers of arguments.
const FUNCTIONS: &[(&str, usize)] = &[
    ("vec3", 3),
    ("select", 3),
    ("sin", 1),
    ("cos", 1),
    ("exp", 1),
    ("log", 1),
    ("sqrt", 1),
    ("abs", 1),
    ("min", 2),
    ("max", 2),
    ("clamp", 3),
    ("mix", 3),
    ("dot", 2),
    ("cross", 2),
    ("length", 1),
    ("normalize", 1),
    ("noise", 1),
];

/// Whether the language has a function of this name.
pub(super) fn is_function(name: &str) -> bool {
    FUNCTIONS.iter().any(|(function, _)| *function == name)
}

type Argument = (Value, usize);

impl Parser<'_> {
    /// Calls the function `name`, which is at `offset`.
    pub(super) fn function(
        &mut self,
        offset: usize,
        name: &str,
        arguments: &[Argument],
    ) -> Parsed<Value> {
        let Some(&(_, count)) = FUNCTIONS.iter().find(|(function, _)| *function == name) else {
            let known: Vec<_> = FUNCTIONS.iter().map(|(function, _)| *function).collect();
            let problem = format!("there is no function `{name}`, only {}", known.join(", "));
            return Err(self.error(offset, problem));
        };
        if arguments.len() != count {
            let plural = if count == 1 { "" } else { "s" };
            let found = arguments.len();
            let problem = format!("`{name}` takes {count} argument{plural}, found {found}");
            return Err(self.error(offset, problem));
        }
        match (name, arguments) {
            ("vec3", _) => {
                let mut nodes = [0; 3];
                for (node, argument) in nodes.iter_mut().zip(arguments) {
                    *node = self.scalar(name, argument)?;
                }
                Ok(Value::Vector(nodes))
            }
            ("select", &[(Value::Condition(condition), _), (a, _), (b, at)]) => {
                self.select(at, condition, a, b)
            }
            ("select", &[(other, at), ..]) => {
                let problem =
                    format!("`select` takes a condition first, not {}", other.type_name());
                Err(self.error(at, problem))
            }
            ("min", &[a, b]) => self.smaller_or_larger(offset, name, Binary::Minimum, a, b),
            ("max", &[a, b]) => self.smaller_or_larger(offset, name, Binary::Maximum, a, b),
            ("clamp", &[value, low, high]) => {
                let above = self.smaller_or_larger(offset, name, Binary::Maximum, value, low)?;
                self.smaller_or_larger(offset, name, Binary::Minimum, (above, value.1), high)
            }
            ("mix", &[a, b, share]) => {
                let share = Value::Scalar(self.scalar(name, &share)?);
                self.same_type(name, a, b)?;
                let way = self.binary(offset, Binary::Subtract, b.0, a.0)?;
                let way = self.binary(offset, Binary::Multiply, share, way)?;
                self.binary(offset, Binary::Add, a.0, way)
            }
            ("dot", [a, b]) => {
                let (a, b) = (self.vector(name, a)?, self.vector(name, b)?);
                Ok(Value::Scalar(self.dot(offset, a, b)?))
            }
            ("cross", [a, b]) => {
                let (a, b) = (self.vector(name, a)?, self.vector(name, b)?);
                let mut nodes = [0; 3];
                for (axis, node) in nodes.iter_mut().enumerate() {
                    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
                    let left =
                        self.node(offset, Node::Binary(Binary::Multiply, [a[next], b[last]]))?;
                    let right =
                        self.node(offset, Node::Binary(Binary::Multiply, [a[last], b[next]]))?;
                    *node = self.node(offset, Node::Binary(Binary::Subtract, [left, right]))?;
                }
                Ok(Value::Vector(nodes))
            }
            ("length", [a]) => {
                let a = self.vector(name, a)?;
                Ok(Value::Scalar(self.length(offset, a)?))
            }
            ("normalize", [a]) => {
                // As everywhere in the engine: no direction is zero, not NaN.
                let a = self.vector(name, a)?;
                let length = self.length(offset, a)?;
                let least = self.node(offset, Node::constant(1e-18))?;
                let length = self.node(offset, Node::Binary(Binary::Maximum, [length, least]))?;
                let one = self.node(offset, Node::constant(1.0))?;
                let inverse = self.node(offset, Node::Binary(Binary::Divide, [one, length]))?;
                let [vector, inverse] = [Value::Vector(a), Value::Scalar(inverse)];
                self.binary(offset, Binary::Multiply, vector, inverse)
            }
            ("noise", [a]) => {
                let a = self.vector(name, a)?;
                Ok(Value::Scalar(self.node(offset, Node::Noise(a))?))
            }
            (_, &[(value, at)]) => {
                let function = match name {
                    "sin" => Unary::Sine,
                    "cos" => Unary::Cosine,
                    "exp" => Unary::Exponential,
                    "log" => Unary::Logarithm,
                    "sqrt" => Unary::SquareRoot,
                    _ => Unary::Absolute,
                };
                self.unary(at, name, function, value)
            }
            _ => Err(self.error(offset, format!("`{name}` does not take these arguments"))),
        }
    }

    /// A function of one scalar, component by component for a vec3.
    pub(super) fn unary(
        &mut self,
        offset: usize,
        name: &str,
        function: Unary,
        value: Value,
    ) -> Parsed<Value> {
        match value {
            Value::Scalar(a) => Ok(Value::Scalar(self.node(offset, Node::Unary(function, a))?)),
            Value::Vector(mut nodes) => {
                for node in &mut nodes {
                    *node = self.node(offset, Node::Unary(function, *node))?;
                }
                Ok(Value::Vector(nodes))
            }
            Value::Condition(_) => {
                Err(self
                    .error(offset, format!("`{name}` takes a scalar or a vec3, not a condition")))
            }
        }
    }

    /// A function of two scalars, component by component where a vec3 is; a scalar beside it counts
    /// for all three.
    pub(super) fn binary(
        &mut self,
        offset: usize,
        function: Binary,
        left: Value,
        right: Value,
    ) -> Parsed<Value> {
        let component = |value: Value, axis: usize| match value {
            Value::Vector(nodes) => nodes[axis],
            Value::Scalar(node) | Value::Condition(node) => node,
        };
        let mut nodes = [0; 3];
        let is_vector = matches!(left, Value::Vector(_)) || matches!(right, Value::Vector(_));
        let count = if is_vector { 3 } else { 1 };
        for (axis, node) in nodes.iter_mut().enumerate().take(count) {
            let operands = [component(left, axis), component(right, axis)];
            *node = self.node(offset, Node::Binary(function, operands))?;
        }
        Ok(if is_vector { Value::Vector(nodes) } else { Value::Scalar(nodes[0]) })
    }

    fn smaller_or_larger(
        &mut self,
        offset: usize,
        name: &str,
        function: Binary,
        a: Argument,
        b: Argument,
    ) -> Parsed<Value> {
        for (value, at) in [a, b] {
            if matches!(value, Value::Condition(_)) {
                return Err(self.error(at, format!("`{name}` takes no condition")));
            }
        }
        if matches!((a.0, b.0), (Value::Scalar(_), Value::Vector(_))) {
            self.same_type(name, a, b)?;
        }
        self.binary(offset, function, a.0, b.0)
    }

    fn same_type(&self, name: &str, a: Argument, b: Argument) -> Parsed<()> {
        match (a.0, b.0) {
            (Value::Scalar(_), Value::Scalar(_)) | (Value::Vector(_), Value::Vector(_)) => Ok(()),
            (left, right) => {
                let (left, right) = (left.type_name(), right.type_name());
                let problem = format!(
                    "`{name}` takes two scalars or two vec3 here, found {left} and {right}"
                );
                Err(self.error(b.1, problem))
            }
        }
    }

    fn select(&mut self, offset: usize, condition: NodeIndex, a: Value, b: Value) -> Parsed<Value> {
        match (a, b) {
            (Value::Scalar(a), Value::Scalar(b)) => {
                Ok(Value::Scalar(self.node(offset, Node::Select([condition, a, b]))?))
            }
            (Value::Vector(a), Value::Vector(b)) => {
                let mut nodes = [0; 3];
                for axis in 0..3 {
                    let node = Node::Select([condition, a[axis], b[axis]]);
                    nodes[axis] = self.node(offset, node)?;
                }
                Ok(Value::Vector(nodes))
            }
            (a, b) => {
                let (a, b) = (a.type_name(), b.type_name());
                let problem =
                    format!("`select` chooses between two scalars or two vec3, found {a} and {b}");
                Err(self.error(offset, problem))
            }
        }
    }

    /// (x x' + y y') + z z'.
    fn dot(
        &mut self,
        offset: usize,
        a: [NodeIndex; 3],
        b: [NodeIndex; 3],
    ) -> Result<NodeIndex, FieldError> {
        let mut products = [0; 3];
        for axis in 0..3 {
            let node = Node::Binary(Binary::Multiply, [a[axis], b[axis]]);
            products[axis] = self.node(offset, node)?;
        }
        let [x, y, z] = products;
        let sum = self.node(offset, Node::Binary(Binary::Add, [x, y]))?;
        self.node(offset, Node::Binary(Binary::Add, [sum, z]))
    }

    fn length(&mut self, offset: usize, a: [NodeIndex; 3]) -> Result<NodeIndex, FieldError> {
        let square = self.dot(offset, a, a)?;
        self.node(offset, Node::Unary(Unary::SquareRoot, square))
    }

    fn scalar(&self, name: &str, &(value, offset): &Argument) -> Parsed<NodeIndex> {
        match value {
            Value::Scalar(node) => Ok(node),
            other => {
                let problem = format!("`{name}` takes a scalar here, not {}", other.type_name());
                Err(self.error(offset, problem))
            }
        }
    }

    fn vector(&self, name: &str, &(value, offset): &Argument) -> Parsed<[NodeIndex; 3]> {
        match value {
            Value::Vector(nodes) => Ok(nodes),
            other => {
                let problem = format!("`{name}` takes a vec3 here, not {}", other.type_name());
                Err(self.error(offset, problem))
            }
        }
    }
}
