//! Expressions as programs for registers, each of which holds one number for every lane of a packet.

use crate::Real;

use super::{
    FieldProgram, functions,
    node::{Binary, Input, Logic, Node, NodeIndex, Unary},
    noise,
};

/// Registers that a program has: the inputs, its constants, and values on the way.
const COUNT: usize = 256;
/// x, v, m, id, t, dt.
const INPUT_COUNT: usize = 10;
/// Time and length of the substep, which all particles share.
const TIME: usize = 8;

/// What is computed; which registers it reads and writes is beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Operation {
    Unary(Unary),
    Binary(Binary),
    Logic(Logic),
    Not,
    Select,
    Noise,
}

/// One operation on whole registers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Instruction {
    operation: Operation,
    to: u8,
    from: [u8; 3],
}

pub(super) struct Allocation {
    pub(super) instructions: Vec<Instruction>,
    pub(super) outputs: [u8; 3],
    pub(super) constants: Vec<f64>,
}

/// Gives each node a register, and a register that is no longer read to the next one; `None` if there
/// are too few.
pub(super) fn allocate(nodes: &[Node], outputs: [NodeIndex; 3]) -> Option<Allocation> {
    let mut last_use = vec![0; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        node.operands().iter().for_each(|&operand| last_use[usize::from(operand)] = index);
    }
    outputs.iter().for_each(|&output| last_use[usize::from(output)] = usize::MAX);
    let constants: Vec<f64> = nodes
        .iter()
        .filter_map(|node| match node {
            Node::Constant(bits) => Some(f64::from_bits(*bits)),
            _ => None,
        })
        .collect();
    let mut fresh = INPUT_COUNT + constants.len();
    let mut next_constant = INPUT_COUNT;
    let mut free = Vec::new();
    let mut places = vec![0_u8; nodes.len()];
    let mut instructions = Vec::new();
    for (index, node) in nodes.iter().enumerate() {
        let operation = match *node {
            Node::Constant(_) => {
                places[index] = u8::try_from(next_constant).ok()?;
                next_constant += 1;
                continue;
            }
            Node::Input(input) => {
                places[index] = input_register(input);
                continue;
            }
            Node::Unary(function, _) => Operation::Unary(function),
            Node::Binary(function, _) => Operation::Binary(function),
            Node::Logic(logic, _) => Operation::Logic(logic),
            Node::Not(_) => Operation::Not,
            Node::Select(_) => Operation::Select,
            Node::Noise(_) => Operation::Noise,
        };
        let mut from = [0; 3];
        for (register, &operand) in from.iter_mut().zip(node.operands()) {
            *register = places[usize::from(operand)];
        }
        let mut operands = node.operands().to_vec();
        operands.sort_unstable();
        operands.dedup();
        for operand in operands {
            let computed =
                !matches!(nodes[usize::from(operand)], Node::Constant(_) | Node::Input(_));
            if computed && last_use[usize::from(operand)] == index {
                free.push(places[usize::from(operand)]);
            }
        }
        let to = match free.pop() {
            Some(register) => register,
            None => {
                let register = u8::try_from(fresh).ok()?;
                fresh += 1;
                register
            }
        };
        places[index] = to;
        instructions.push(Instruction { operation, to, from });
    }
    let outputs = outputs.map(|output| places[usize::from(output)]);
    Some(Allocation { instructions, outputs, constants })
}

const fn input_register(input: Input) -> u8 {
    match input {
        Input::Position(axis) => axis,
        Input::Velocity(axis) => 3 + axis,
        Input::Mass => 6,
        Input::Particle => 7,
        Input::Time => TIME as u8,
        Input::TimeStep => TIME as u8 + 1,
    }
}

/// What a program reads, for each lane of a packet.
#[derive(Clone, Copy, Debug)]
pub struct FieldInputs<'a, T, const LANES: usize> {
    /// Position \[m\].
    pub position: [&'a [T; LANES]; 3],
    /// Velocity \[m/s\].
    pub velocity: [&'a [T; LANES]; 3],
    /// Mass \[kg\].
    pub mass: &'a [T; LANES],
    /// Index of the particle in the first lane; the others follow.
    pub first: usize,
}

/// Memory of one program for one packet after the other.
pub struct FieldRegisters<T, const LANES: usize> {
    values: [[T; LANES]; COUNT],
}

impl<T: Real, const LANES: usize> FieldRegisters<T, LANES> {
    /// Registers without a program.
    #[inline(always)]
    #[must_use]
    pub fn new() -> Self {
        Self { values: [[T::ZERO; LANES]; COUNT] }
    }
}

impl<T: Real, const LANES: usize> Default for FieldRegisters<T, LANES> {
    fn default() -> Self {
        Self::new()
    }
}

/// 1 for true.
#[inline(always)]
fn condition<T: Real>(holds: bool) -> T {
    if holds { T::ONE } else { T::ZERO }
}

/// `function` lane by lane.
macro_rules! each {
    ($lanes:ident, |$lane:ident| $value:expr) => {{
        let mut result = [T::ZERO; $lanes];
        for $lane in 0..$lanes {
            result[$lane] = $value;
        }
        result
    }};
}

impl FieldProgram {
    /// Makes `registers` ready for [`Self::run`]: constants, `time` at the start of the substep \[s\]
    /// and its `length` \[s\].
    #[inline(always)]
    pub fn prepare<T: Real, const LANES: usize>(
        &self,
        registers: &mut FieldRegisters<T, LANES>,
        time: T,
        length: T,
    ) {
        registers.values[TIME] = [time; LANES];
        registers.values[TIME + 1] = [length; LANES];
        for (register, &constant) in registers.values[INPUT_COUNT..].iter_mut().zip(&self.constants)
        {
            *register = [T::from_f64(constant); LANES];
        }
    }

    /// The force on each particle of a packet \[N\].
    #[inline(always)]
    pub fn run<T: Real, const LANES: usize>(
        &self,
        registers: &mut FieldRegisters<T, LANES>,
        inputs: &FieldInputs<'_, T, LANES>,
    ) -> [[T; LANES]; 3] {
        let values = &mut registers.values;
        for axis in 0..3 {
            values[axis] = *inputs.position[axis];
            values[3 + axis] = *inputs.velocity[axis];
        }
        values[6] = *inputs.mass;
        values[7] = each!(LANES, |lane| T::from_f64((inputs.first + lane) as f64));
        for instruction in &self.instructions {
            let [a, b, c] = instruction.from.map(|register| values[usize::from(register)]);
            let result = match instruction.operation {
                Operation::Binary(Binary::Add) => each!(LANES, |i| a[i] + b[i]),
                Operation::Binary(Binary::Subtract) => each!(LANES, |i| a[i] - b[i]),
                Operation::Binary(Binary::Multiply) => each!(LANES, |i| a[i] * b[i]),
                Operation::Binary(Binary::Divide) => each!(LANES, |i| a[i] / b[i]),
                Operation::Binary(Binary::Minimum) => each!(LANES, |i| a[i].minimum(b[i])),
                Operation::Binary(Binary::Maximum) => each!(LANES, |i| a[i].maximum(b[i])),
                Operation::Binary(Binary::Power) => {
                    each!(LANES, |i| functions::power(a[i], b[i]))
                }
                Operation::Unary(Unary::Negate) => each!(LANES, |i| -a[i]),
                Operation::Unary(Unary::Absolute) => each!(LANES, |i| a[i].abs()),
                Operation::Unary(Unary::SquareRoot) => each!(LANES, |i| a[i].sqrt()),
                Operation::Unary(Unary::Sine) => each!(LANES, |i| functions::sine(a[i])),
                Operation::Unary(Unary::Cosine) => each!(LANES, |i| functions::cosine(a[i])),
                Operation::Unary(Unary::Exponential) => {
                    each!(LANES, |i| functions::exponential(a[i]))
                }
                Operation::Unary(Unary::Logarithm) => each!(LANES, |i| functions::logarithm(a[i])),
                Operation::Logic(Logic::Less) => each!(LANES, |i| condition(a[i] < b[i])),
                Operation::Logic(Logic::LessEqual) => each!(LANES, |i| condition(a[i] <= b[i])),
                Operation::Logic(Logic::Equal) => each!(LANES, |i| condition(a[i] == b[i])),
                Operation::Logic(Logic::NotEqual) => each!(LANES, |i| condition(a[i] != b[i])),
                Operation::Logic(Logic::And) => each!(LANES, |i| a[i] * b[i]),
                Operation::Logic(Logic::Or) => each!(LANES, |i| a[i].maximum(b[i])),
                Operation::Not => each!(LANES, |i| T::ONE - a[i]),
                Operation::Select => {
                    each!(LANES, |i| if a[i] == T::ONE { b[i] } else { c[i] })
                }
                Operation::Noise => each!(LANES, |i| noise::noise([a[i], b[i], c[i]])),
            };
            values[usize::from(instruction.to)] = result;
        }
        self.output_registers.map(|register| values[usize::from(register)])
    }

    /// The force on one particle \[N\], in double precision: for tools and tests.
    #[must_use]
    pub fn evaluate(
        &self,
        position: [f64; 3],
        velocity: [f64; 3],
        time: f64,
        mass: f64,
        particle: usize,
        time_step: f64,
    ) -> [f64; 3] {
        self.evaluate_in(position, velocity, time, mass, particle, time_step)
    }

    /// [`Self::evaluate`] in the precision of a solver, bit for bit as the backends have it.
    #[must_use]
    pub fn evaluate_in<T: Real>(
        &self,
        position: [T; 3],
        velocity: [T; 3],
        time: T,
        mass: T,
        particle: usize,
        time_step: T,
    ) -> [T; 3] {
        let mut registers = FieldRegisters::<T, 1>::new();
        self.prepare(&mut registers, time, time_step);
        let [position, velocity] = [position, velocity].map(|vector| vector.map(|value| [value]));
        let inputs = FieldInputs {
            position: position.each_ref(),
            velocity: velocity.each_ref(),
            mass: &[mass],
            first: particle,
        };
        self.run(&mut registers, &inputs).map(|[value]| value)
    }
}
