//! Expressions of force fields.

use cloth::{FieldAxes, FieldProgram, Precision};
use fastrand::Rng;

use crate::mutate::{any, text};

const SEEDS: [&str; 8] = [
    "let around = cross(vec3(0, 0, 1), x); m * exp(-t / 2) * around / (1 + dot(x, x))",
    "m * v",
    "select(x.z > 0 and not (t < 1 or t >= 2), vec3(0, 0, -9.81 * m), vec3(0, 0, 0))",
    "let p = 2 * x + vec3(t, 0, 0); m * vec3(noise(p), noise(p.y * vec3(1, 2, 3)), 0)",
    "clamp(mix(x, v, 0.5), -1, 1) ^ 2 + min(abs(x), 3) - max(v, vec3(0, 1, 2)) * length(x)",
    "normalize(x) * sqrt(1 + dot(v, v)) * log(2 + id) * sin(pi * t) / cos(dt)",
    "let a = 1e3; let b = a ^ 16; let c = b - a; vec3(c, -c, +c) * 1e-300",
    "vec3(1 / 0.5, x.y ^ -2, 2 ^ 3 ^ 2)",
];

const WORDS: [&str; 44] = [
    "x",
    "v",
    "t",
    "dt",
    "m",
    "id",
    "pi",
    "let",
    "and",
    "or",
    "not",
    "select(",
    "vec3(",
    "sin(",
    "cos(",
    "exp(",
    "log(",
    "sqrt(",
    "abs(",
    "min(",
    "max(",
    "clamp(",
    "mix(",
    "dot(",
    "cross(",
    "length(",
    "normalize(",
    "noise(",
    "+",
    "-",
    "*",
    "/",
    "^",
    "<",
    "<=",
    ">",
    ">=",
    "==",
    "!=",
    ".x",
    ".y",
    ".z",
    ";",
    ",",
];

/// A changed seed, or an expression that is right but for its numbers.
pub(crate) fn make(rng: &mut Rng) -> Vec<u8> {
    let seeds = SEEDS.map(str::to_owned);
    let made = match rng.u8(..3) {
        0 => text::mutated(rng, &seeds, &WORDS),
        1 => {
            let grown = vector(rng, 5);
            text::changed(rng, &grown, &seeds, &WORDS)
        }
        _ => vector(rng, 7),
    };
    text::bytes(rng, made)
}

fn vector(rng: &mut Rng, depth: u32) -> String {
    if depth == 0 {
        return any(rng, &["x", "v", "vec3(1, 2, 3)"]).to_string();
    }
    let mut of_vector = |depth| vector(rng, depth);
    let (a, b) = (of_vector(depth - 1), of_vector(depth / 2));
    match rng.u8(..9) {
        0 => format!("({a} + {b})"),
        1 => format!("({a} - {b})"),
        2 => format!("{} * {a}", scalar(rng, depth - 1)),
        3 => format!("({a}) / {}", scalar(rng, depth / 2)),
        4 => format!("cross({a}, {b})"),
        5 => format!("normalize({a})"),
        6 => format!("select({} < {}, {a}, {b})", scalar(rng, 1), scalar(rng, depth / 2)),
        7 => format!("mix({a}, {b}, {})", scalar(rng, depth / 2)),
        _ => {
            let [x, y, z] = std::array::from_fn(|_| scalar(rng, depth / 2));
            format!("vec3({x}, {y}, {z})")
        }
    }
}

fn scalar(rng: &mut Rng, depth: u32) -> String {
    if depth == 0 {
        return match rng.u8(..3) {
            0 => text::number(rng),
            _ => any(rng, &["t", "m", "dt", "id", "pi", "x.x", "v.y"]).to_string(),
        };
    }
    let (a, b) = (scalar(rng, depth - 1), scalar(rng, depth / 2));
    match rng.u8(..8) {
        0 => format!("({a} + {b})"),
        1 => format!("({a} * {b})"),
        2 => format!("({a} / {b})"),
        3 => format!("(({a}) ^ {b})"),
        4 => format!("{}({a})", any(rng, &["sin", "cos", "exp", "log", "sqrt", "abs"])),
        5 => format!("dot({}, v)", vector(rng, depth / 2)),
        6 => format!("noise({})", vector(rng, depth / 2)),
        _ => format!("clamp({a}, {b}, 1)"),
    }
}

/// What compiles is computed, for numbers of all sizes, and written for GPUs.
pub(crate) fn run(input: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(input) else { return false };
    let mut is_accepted = false;
    for axes in [FieldAxes::Engine, FieldAxes::LeftHanded] {
        let program = match FieldProgram::compile_in(text, axes) {
            Ok(program) => program,
            Err(error) => {
                // What is wrong is somewhere in the text.
                assert!(error.line as usize <= text.lines().count() + 1, "{error}");
                continue;
            }
        };
        is_accepted = true;
        assert!(program.operation_count() <= 8192);
        for number in [0.0, 1.5, -1e30, f64::MAX, f64::NAN, f64::INFINITY] {
            let at = [number, 0.5, -number];
            let _ = program.evaluate(at, at, number, 1e-3, 7, 1e-4);
            let single = at.map(|x| x as f32);
            let _ = program.evaluate_in::<f32>(single, single, 1.0, 1e-3, 7, 1e-4);
        }
        assert!(!program.wgsl("field").is_empty());
        for precision in [Precision::F32, Precision::F64] {
            assert!(!program.cuda("field", precision).is_empty());
        }
    }
    is_accepted
}
