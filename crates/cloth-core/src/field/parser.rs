//! From text to a typed graph, in one pass: a value has a type as soon as it is read, and deep nesting
//! is the only recursion.

use std::collections::HashMap;

use super::{
    FieldAxes, FieldError,
    node::{Binary, Graph, Input, Logic, Node, NodeError, NodeIndex, Unary},
    token::{Token, tokens},
};

/// Longest text \[bytes\].
pub(super) const SOURCE_MAX: usize = 16 << 10;
/// Deepest nesting of brackets, calls, signs and powers.
pub(super) const DEPTH_MAX: u32 = 64;
/// Largest integer that a power is multiplied out for.
const POWER_MAX: f64 = 16.0;

/// A typed value.
#[derive(Clone, Copy, Debug)]
pub(super) enum Value {
    Condition(NodeIndex),
    Scalar(NodeIndex),
    Vector([NodeIndex; 3]),
}

impl Value {
    pub(super) const fn type_name(self) -> &'static str {
        match self {
            Self::Condition(_) => "a condition",
            Self::Scalar(_) => "a scalar",
            Self::Vector(_) => "a vec3",
        }
    }
}

pub(super) type Parsed<T> = Result<T, FieldError>;

/// The text on the way to its graph.
pub(super) struct Parser<'a> {
    source: &'a str,
    tokens: Vec<(Token<'a>, usize)>,
    next: usize,
    depth: u32,
    names: HashMap<&'a str, Value>,
    graph: Graph,
    axes: FieldAxes,
}

/// Words with a meaning of their own.
const KEYWORDS: [&str; 4] = ["let", "and", "or", "not"];

/// The graph of `source` and the three components of its value.
pub(super) fn parse(source: &str, axes: FieldAxes) -> Parsed<(Graph, [NodeIndex; 3])> {
    if source.len() > SOURCE_MAX {
        let problem =
            format!("the expression has {} bytes: at most {SOURCE_MAX} are read", source.len());
        return Err(FieldError::at(source, 0, problem));
    }
    let mut parser = Parser {
        source,
        tokens: tokens(source)?,
        next: 0,
        depth: 0,
        names: HashMap::new(),
        graph: Graph::default(),
        axes,
    };
    while parser.accept_name("let") {
        parser.definition()?;
    }
    let start = parser.offset();
    let value = parser.expression()?;
    if parser.peek() != Token::End {
        return Err(parser.unexpected("the end of the expression"));
    }
    match value {
        Value::Vector(nodes) => Ok((parser.graph, nodes)),
        other => Err(FieldError::at(
            source,
            start,
            format!(
                "the expression is {}, but a force is a vec3: write vec3(..., ..., ...)",
                other.type_name()
            ),
        )),
    }
}

impl<'a> Parser<'a> {
    fn peek(&self) -> Token<'a> {
        self.tokens[self.next].0
    }

    pub(super) fn offset(&self) -> usize {
        self.tokens[self.next].1
    }

    fn accept(&mut self, symbol: &'static str) -> bool {
        let found = self.peek() == Token::Symbol(symbol);
        self.next += usize::from(found);
        found
    }

    fn accept_name(&mut self, name: &str) -> bool {
        let found = matches!(self.peek(), Token::Name(word) if word == name);
        self.next += usize::from(found);
        found
    }

    fn expect(&mut self, symbol: &'static str) -> Parsed<()> {
        if self.accept(symbol) { Ok(()) } else { Err(self.unexpected(&format!("`{symbol}`"))) }
    }

    pub(super) fn error(&self, offset: usize, problem: impl Into<String>) -> FieldError {
        FieldError::at(self.source, offset, problem)
    }

    fn unexpected(&self, wanted: &str) -> FieldError {
        let found = match self.peek() {
            Token::Number(number) => format!("the number {number}"),
            Token::Name(name) => format!("`{name}`"),
            Token::Symbol(symbol) => format!("`{symbol}`"),
            Token::End => "the end".to_owned(),
        };
        self.error(self.offset(), format!("expected {wanted}, found {found}"))
    }

    /// Goes one level deeper for `read`.
    fn nested<T>(&mut self, read: impl FnOnce(&mut Self) -> Parsed<T>) -> Parsed<T> {
        if self.depth == DEPTH_MAX {
            let problem = format!("nested deeper than {DEPTH_MAX} levels: name parts with `let`");
            return Err(self.error(self.offset(), problem));
        }
        self.depth += 1;
        let result = read(self);
        self.depth -= 1;
        result
    }

    pub(super) fn node(&mut self, offset: usize, node: Node) -> Parsed<NodeIndex> {
        self.graph.add(node).map_err(|error| {
            let problem = match error {
                NodeError::TooMany => "the expression has too many operations: make it shorter",
                NodeError::DivisionByZero => "division by zero",
                NodeError::NotFinite => "this part has no finite value",
            };
            self.error(offset, problem)
        })
    }

    fn definition(&mut self) -> Parsed<()> {
        let offset = self.offset();
        let Token::Name(name) = self.peek() else { return Err(self.unexpected("a new name")) };
        self.next += 1;
        let taken = KEYWORDS.contains(&name)
            || self.names.contains_key(name)
            || INPUTS.iter().any(|(input, _)| *input == name)
            || super::call::is_function(name)
            || name == "pi";
        if taken {
            return Err(self.error(offset, format!("`{name}` has a meaning already: rename it")));
        }
        self.expect("=")?;
        let value = self.expression()?;
        self.expect(";")?;
        self.names.insert(name, value);
        Ok(())
    }

    /// `or` binds least.
    pub(super) fn expression(&mut self) -> Parsed<Value> {
        self.nested(|parser| {
            parser.logic("or", Logic::Or, |p| p.logic("and", Logic::And, Self::negation))
        })
    }

    fn logic(
        &mut self,
        word: &str,
        logic: Logic,
        operand: impl Fn(&mut Self) -> Parsed<Value>,
    ) -> Parsed<Value> {
        let mut left = operand(self)?;
        loop {
            let offset = self.offset();
            if !self.accept_name(word) {
                return Ok(left);
            }
            let right = operand(self)?;
            let (Value::Condition(a), Value::Condition(b)) = (left, right) else {
                return Err(self.mismatch(offset, word, left, right, "joins two conditions"));
            };
            left = Value::Condition(self.node(offset, Node::Logic(logic, [a, b]))?);
        }
    }

    fn negation(&mut self) -> Parsed<Value> {
        let offset = self.offset();
        if !self.accept_name("not") {
            return self.comparison();
        }
        match self.nested(Self::negation)? {
            Value::Condition(a) => Ok(Value::Condition(self.node(offset, Node::Not(a))?)),
            other => {
                let problem = format!("`not` takes a condition, not {}", other.type_name());
                Err(self.error(offset, problem))
            }
        }
    }

    fn comparison(&mut self) -> Parsed<Value> {
        let left = self.sum()?;
        let offset = self.offset();
        // The flag says that the operands change places.
        let found = [
            ("<=", Logic::LessEqual, false),
            (">=", Logic::LessEqual, true),
            ("<", Logic::Less, false),
            (">", Logic::Less, true),
            ("==", Logic::Equal, false),
            ("!=", Logic::NotEqual, false),
        ]
        .into_iter()
        .find(|(symbol, ..)| self.accept(symbol));
        let Some((symbol, logic, swapped)) = found else { return Ok(left) };
        let right = self.sum()?;
        let (Value::Scalar(a), Value::Scalar(b)) = (left, right) else {
            return Err(self.mismatch(offset, symbol, left, right, "compares two scalars"));
        };
        let operands = if swapped { [b, a] } else { [a, b] };
        Ok(Value::Condition(self.node(offset, Node::Logic(logic, operands))?))
    }

    fn sum(&mut self) -> Parsed<Value> {
        let mut left = self.product()?;
        loop {
            let offset = self.offset();
            let (symbol, function) = if self.accept("+") {
                ("+", Binary::Add)
            } else if self.accept("-") {
                ("-", Binary::Subtract)
            } else {
                return Ok(left);
            };
            let right = self.product()?;
            left = match (left, right) {
                (Value::Scalar(_), Value::Scalar(_)) | (Value::Vector(_), Value::Vector(_)) => {
                    self.binary(offset, function, left, right)?
                }
                _ => {
                    let rule = "takes two scalars or two vec3";
                    return Err(self.mismatch(offset, symbol, left, right, rule));
                }
            };
        }
    }

    fn product(&mut self) -> Parsed<Value> {
        let mut left = self.sign()?;
        loop {
            let offset = self.offset();
            let (symbol, function) = if self.accept("*") {
                ("*", Binary::Multiply)
            } else if self.accept("/") {
                ("/", Binary::Divide)
            } else {
                return Ok(left);
            };
            let right = self.sign()?;
            let rule = match (left, right, function) {
                (Value::Condition(_), ..) | (_, Value::Condition(_), _) => "takes no condition",
                (Value::Vector(_), Value::Vector(_), Binary::Multiply) => {
                    "is not defined for two vec3: use dot or cross"
                }
                (_, Value::Vector(_), Binary::Divide) => "divides by a scalar",
                _ => {
                    left = self.binary(offset, function, left, right)?;
                    continue;
                }
            };
            return Err(self.mismatch(offset, symbol, left, right, rule));
        }
    }

    fn sign(&mut self) -> Parsed<Value> {
        let offset = self.offset();
        if !self.accept("-") {
            return self.power();
        }
        let value = self.nested(Self::sign)?;
        self.unary(offset, "-", Unary::Negate, value)
    }

    fn power(&mut self) -> Parsed<Value> {
        let base = self.member()?;
        let offset = self.offset();
        if !self.accept("^") {
            return Ok(base);
        }
        let exponent = self.nested(Self::sign)?;
        let (Value::Scalar(a), Value::Scalar(b)) = (base, exponent) else {
            return Err(self.mismatch(offset, "^", base, exponent, "takes two scalars"));
        };
        let node = match self.graph.constant(b) {
            Some(b) if b.fract() == 0.0 && b.abs() <= POWER_MAX => {
                self.integer_power(offset, a, b)?
            }
            _ => self.node(offset, Node::Binary(Binary::Power, [a, b]))?,
        };
        Ok(Value::Scalar(node))
    }

    /// Powers by multiplication are right for any base, and more accurate.
    fn integer_power(&mut self, offset: usize, a: NodeIndex, b: f64) -> Parsed<NodeIndex> {
        let mut remaining = b.abs() as u32;
        let mut square = a;
        let mut product = None;
        while remaining > 0 {
            if remaining & 1 == 1 {
                product = Some(match product {
                    None => square,
                    Some(product) => {
                        self.node(offset, Node::Binary(Binary::Multiply, [product, square]))?
                    }
                });
            }
            remaining >>= 1;
            if remaining > 0 {
                square = self.node(offset, Node::Binary(Binary::Multiply, [square, square]))?;
            }
        }
        let one = self.node(offset, Node::constant(1.0))?;
        match product {
            None => Ok(one),
            Some(product) if b < 0.0 => {
                self.node(offset, Node::Binary(Binary::Divide, [one, product]))
            }
            Some(product) => Ok(product),
        }
    }

    fn member(&mut self) -> Parsed<Value> {
        let mut value = self.primary()?;
        while self.accept(".") {
            let offset = self.offset();
            let component = ["x", "y", "z"].into_iter().position(|name| self.accept_name(name));
            value = match (value, component) {
                (Value::Vector(nodes), Some(component)) => Value::Scalar(nodes[component]),
                (Value::Vector(_), None) => return Err(self.unexpected("x, y or z")),
                (other, _) => {
                    let problem = format!("{} has no components", other.type_name());
                    return Err(self.error(offset, problem));
                }
            };
        }
        Ok(value)
    }

    fn primary(&mut self) -> Parsed<Value> {
        let offset = self.offset();
        match self.peek() {
            Token::Number(number) => {
                self.next += 1;
                Ok(Value::Scalar(self.node(offset, Node::constant(number))?))
            }
            Token::Symbol("(") => {
                self.next += 1;
                let value = self.expression()?;
                self.expect(")")?;
                Ok(value)
            }
            Token::Name(name) if !KEYWORDS.contains(&name) => {
                self.next += 1;
                if self.accept("(") { self.call(offset, name) } else { self.named(offset, name) }
            }
            _ => Err(self.unexpected("a value")),
        }
    }

    fn call(&mut self, offset: usize, name: &'a str) -> Parsed<Value> {
        let mut arguments = Vec::new();
        if !self.accept(")") {
            loop {
                let at = self.offset();
                arguments.push((self.expression()?, at));
                if !self.accept(",") {
                    break;
                }
            }
            self.expect(")")?;
        }
        self.function(offset, name, &arguments)
    }

    fn named(&mut self, offset: usize, name: &str) -> Parsed<Value> {
        if let Some(&value) = self.names.get(name) {
            return Ok(value);
        }
        if name == "pi" {
            let pi = self.node(offset, Node::constant(std::f64::consts::PI))?;
            return Ok(Value::Scalar(pi));
        }
        match INPUTS.iter().find(|(input, _)| *input == name) {
            Some((_, [single])) => Ok(Value::Scalar(self.node(offset, Node::Input(*single))?)),
            Some((_, components)) => {
                let mut nodes = [0; 3];
                for (node, axis) in nodes.iter_mut().zip(self.axes.order()) {
                    let component = components[usize::from(axis)];
                    *node = self.node(offset, Node::Input(component))?;
                }
                Ok(Value::Vector(nodes))
            }
            None => {
                let known: Vec<_> = INPUTS.iter().map(|(input, _)| *input).collect();
                let hint = if super::call::is_function(name) {
                    format!("`{name}` is a function: write {name}(...)")
                } else {
                    format!("`{name}` is not known: there are {}, pi", known.join(", "))
                };
                Err(self.error(offset, hint))
            }
        }
    }

    fn mismatch(
        &self,
        offset: usize,
        symbol: &str,
        left: Value,
        right: Value,
        rule: &str,
    ) -> FieldError {
        let (left, right) = (left.type_name(), right.type_name());
        self.error(offset, format!("`{symbol}` {rule}, found {left} and {right}"))
    }
}

const INPUTS: &[(&str, &[Input])] = &[
    ("x", &[Input::Position(0), Input::Position(1), Input::Position(2)]),
    ("v", &[Input::Velocity(0), Input::Velocity(1), Input::Velocity(2)]),
    ("t", &[Input::Time]),
    ("m", &[Input::Mass]),
    ("id", &[Input::Particle]),
    ("dt", &[Input::TimeStep]),
];
