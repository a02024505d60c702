//! The typed expression as a graph of scalar operations.

use std::collections::HashMap;

use crate::field::functions;

/// Place of a node in its graph.
pub(super) type NodeIndex = u16;

/// What an expression can read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Input {
    /// Component of the position \[m\].
    Position(u8),
    /// Component of the velocity \[m/s\].
    Velocity(u8),
    /// Time at the start of the substep \[s\].
    Time,
    /// Mass \[kg\].
    Mass,
    /// Index of the particle in the model.
    Particle,
    /// Length of the substep \[s\].
    TimeStep,
}

/// Functions of one scalar.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Unary {
    Negate,
    Absolute,
    SquareRoot,
    Sine,
    Cosine,
    Exponential,
    Logarithm,
}

/// Functions of two scalars.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Minimum,
    Maximum,
}

/// Functions that give or take conditions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Logic {
    Less,
    LessEqual,
    Equal,
    NotEqual,
    And,
    Or,
}

/// One operation. Operands come before it in the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Node {
    /// A number, as the bits of its double precision.
    Constant(u64),
    Input(Input),
    Unary(Unary, NodeIndex),
    Binary(Binary, [NodeIndex; 2]),
    Logic(Logic, [NodeIndex; 2]),
    Not(NodeIndex),
    /// The second if the first holds, else the third.
    Select([NodeIndex; 3]),
    Noise([NodeIndex; 3]),
}

impl Node {
    /// A number.
    pub(super) const fn constant(value: f64) -> Self {
        Self::Constant(value.to_bits())
    }

    /// Whether its value is a condition.
    pub(super) const fn is_condition(self) -> bool {
        matches!(self, Self::Logic(..) | Self::Not(_))
    }

    /// The nodes that it reads.
    pub(super) fn operands(&self) -> &[NodeIndex] {
        match self {
            Self::Constant(_) | Self::Input(_) => &[],
            Self::Unary(_, operand) | Self::Not(operand) => std::slice::from_ref(operand),
            Self::Binary(_, operands) | Self::Logic(_, operands) => operands,
            Self::Select(operands) | Self::Noise(operands) => operands,
        }
    }
}

/// Most nodes of a graph.
pub(super) const NODES_MAX: usize = 4096;

/// Nodes in the order of computation; equal ones exist once.
#[derive(Clone, Debug, Default)]
pub(super) struct Graph {
    nodes: Vec<Node>,
    known: HashMap<Node, NodeIndex>,
}

/// Why a node cannot be added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NodeError {
    /// There are [`NODES_MAX`] already.
    TooMany,
    /// A divisor is the constant zero.
    DivisionByZero,
    /// A constant part is infinite or not a number.
    NotFinite,
}

impl Graph {
    /// The value of a node that is a constant.
    pub(super) fn constant(&self, index: NodeIndex) -> Option<f64> {
        match self.nodes[usize::from(index)] {
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// Adds a node, or finds it; what is made of constants alone is computed now, in double precision.
    pub(super) fn add(&mut self, node: Node) -> Result<NodeIndex, NodeError> {
        let node = self.folded(node)?;
        if let Some(&index) = self.known.get(&node) {
            return Ok(index);
        }
        let index = self.nodes.len();
        if index >= NODES_MAX {
            return Err(NodeError::TooMany);
        }
        self.nodes.push(node);
        self.known.insert(node, index as NodeIndex);
        Ok(index as NodeIndex)
    }

    fn folded(&self, node: Node) -> Result<Node, NodeError> {
        if let Node::Binary(Binary::Divide, [_, divisor]) = node
            && self.constant(divisor) == Some(0.0)
        {
            return Err(NodeError::DivisionByZero);
        }
        let value = match node {
            Node::Unary(function, a) => self.constant(a).map(|a| functions::unary(function, a)),
            Node::Binary(function, [a, b]) => self
                .constant(a)
                .zip(self.constant(b))
                .map(|(a, b)| functions::binary(function, a, b)),
            _ => None,
        };
        match value {
            Some(value) if value.abs() <= f64::from(f32::MAX) => Ok(Node::constant(value)),
            Some(_) => Err(NodeError::NotFinite),
            None => Ok(node),
        }
    }

    /// The nodes that `outputs` need, in order, and where the outputs are then.
    pub(super) fn needed(&self, outputs: [NodeIndex; 3]) -> (Vec<Node>, [NodeIndex; 3]) {
        let mut needed = vec![false; self.nodes.len()];
        outputs.iter().for_each(|&output| needed[usize::from(output)] = true);
        for (index, node) in self.nodes.iter().enumerate().rev() {
            if needed[index] {
                node.operands().iter().for_each(|&operand| needed[usize::from(operand)] = true);
            }
        }
        let mut places = vec![0; self.nodes.len()];
        let mut nodes = Vec::new();
        for (index, &node) in self.nodes.iter().enumerate().filter(|(index, _)| needed[*index]) {
            places[index] = nodes.len() as NodeIndex;
            let at = |operand: NodeIndex| places[usize::from(operand)];
            nodes.push(match node {
                Node::Constant(_) | Node::Input(_) => node,
                Node::Unary(function, a) => Node::Unary(function, at(a)),
                Node::Not(a) => Node::Not(at(a)),
                Node::Binary(function, operands) => Node::Binary(function, operands.map(at)),
                Node::Logic(function, operands) => Node::Logic(function, operands.map(at)),
                Node::Select(operands) => Node::Select(operands.map(at)),
                Node::Noise(operands) => Node::Noise(operands.map(at)),
            });
        }
        (nodes, outputs.map(|output| places[usize::from(output)]))
    }
}
