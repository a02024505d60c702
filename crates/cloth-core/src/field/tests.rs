use proptest::prelude::*;

use super::*;
use crate::Precision;

fn force(source: &str) -> [f64; 3] {
    let program = FieldProgram::compile(source).unwrap_or_else(|error| panic!("{source}: {error}"));
    program.evaluate([1.0, -2.0, 3.0], [0.5, 0.25, -4.0], 2.0, 0.125, 7, 0.001)
}

fn scalar(source: &str) -> f64 {
    force(&format!("vec3({source}, 0, 0)"))[0]
}

#[test]
fn operators_bind_as_in_mathematics() {
    for (source, value) in [
        ("1 + 2 * 3", 7.0),
        ("-2 ^ 2", -4.0),
        ("2 ^ 3 ^ 2", 512.0),
        ("2 ^ -2", 0.25),
        ("8 / 4 / 2", 1.0),
        ("1 - 2 - 3", -4.0),
        ("(1 - 2) * -x.y", -2.0),
        ("x.x * x.y ^ 3", -8.0),
        ("select(1 < 2 and not 3 < 2 or x.x > 5, 1, 2)", 1.0),
        ("select(x.x >= 1 and x.x != 1, 1, 2)", 2.0),
        (".5 + 1e-1 + 2.", 2.6),
        ("let a = 3; let b = a * a; b - a", 6.0),
    ] {
        let source = match source.rsplit_once(';') {
            Some((definitions, value)) => format!("{definitions}; vec3({value}, 0, 0)"),
            None => format!("vec3({source}, 0, 0)"),
        };
        assert_eq!(force(&source)[0], value, "{source}");
    }
}

#[test]
fn every_function_has_its_value() {
    for (source, value) in [
        ("sin(2 * t)", 4.0_f64.sin()),
        ("cos(x.z)", 3.0_f64.cos()),
        ("exp(x.x)", 1.0_f64.exp()),
        ("log(x.z)", 3.0_f64.ln()),
        ("sqrt(x.z + 1)", 2.0),
        ("abs(x.y)", 2.0),
        ("min(x.x, x.y)", -2.0),
        ("max(x.x, x.y)", 1.0),
        ("clamp(x.z, 0, 2)", 2.0),
        ("mix(x.x, x.z, 0.25)", 1.5),
        ("dot(x, v)", -12.0),
        ("length(vec3(3, 0, x.x + 3))", 5.0),
        ("x.z ^ 0.5", 3.0_f64.sqrt()),
        ("x.z ^ x.x", 3.0),
        ("m + id + dt", 7.126),
        ("noise(vec3(0.5, 0.25, x.x)) - noise(vec3(0.5, 0.25, 1))", 0.0),
    ] {
        assert!((scalar(source) - value).abs() < 1e-14, "{source}: {}", scalar(source));
    }
    assert_eq!(force("cross(x, v)"), [7.25, 5.5, 1.25]);
    assert_eq!(force("abs(x) + max(v, 0.25)"), [1.5, 2.25, 3.25]);
    assert_eq!(force("normalize(vec3(0, 0, -x.z))"), [0.0, 0.0, -1.0]);
    assert_eq!(force("normalize(0 * x)"), [0.0; 3], "no direction, no NaN");
    assert_eq!(force("select(t < 1, x, v)"), [0.5, 0.25, -4.0]);
}

#[test]
fn left_handed_expressions_exchange_y_and_z() {
    let program = FieldProgram::compile_in(
        "vec3(x.x, x.y, x.z) + 2 * v + vec3(0, 10, 0)",
        FieldAxes::LeftHanded,
    )
    .unwrap();
    let force = program.evaluate([1.0, 2.0, 3.0], [0.5, 0.0, 1.0], 0.0, 1.0, 0, 0.1);
    assert_eq!(force, [2.0, 2.0, 15.0], "up is y in the text and z in the engine");
}

#[test]
fn what_has_no_value_is_infinite_or_not_a_number() {
    assert_eq!(scalar("1 / (x.x - 1)"), f64::INFINITY);
    assert_eq!(scalar("log(x.x - 1)"), f64::NEG_INFINITY);
    for source in ["log(x.y)", "sqrt(x.y)", "x.y ^ 0.5", "(x.x - 1) / (x.x - 1)"] {
        assert!(scalar(source).is_nan(), "{source}");
    }
    assert_eq!(scalar("select(x.x > 1, 1 / (x.x - 1), 5)"), 5.0, "what is not chosen does no harm");
}

#[test]
fn errors_name_the_place_and_the_mend() {
    for (source, line, column, words) in [
        ("", 1, 1, "expected a value, found the end"),
        ("x +", 1, 4, "expected a value"),
        ("x.x", 1, 1, "the expression is a scalar, but a force is a vec3"),
        ("x < v", 1, 3, "`<` compares two scalars, found a vec3 and a vec3"),
        ("x * v", 1, 3, "use dot or cross"),
        ("vec3(1, 2)", 1, 1, "`vec3` takes 3 arguments, found 2"),
        ("vec3(1, x, 2)", 1, 9, "`vec3` takes a scalar here, not a vec3"),
        ("speed * x", 1, 1, "`speed` is not known: there are x, v, t, m, id, dt, pi"),
        ("tan(1) * x", 1, 1, "there is no function `tan`"),
        ("sin * x", 1, 1, "write sin(...)"),
        ("x\n  / (2 - 2)", 2, 3, "division by zero"),
        ("sqrt(-1) * x", 1, 6, "no finite value"),
        ("1e39 * x", 1, 1, "too large"),
        ("t.x * x", 1, 3, "a scalar has no components"),
        ("x.w", 1, 3, "expected x, y or z"),
        ("let x = 3; v", 1, 5, "`x` has a meaning already"),
        ("let a = 3; let a = 4; v", 1, 16, "`a` has a meaning already"),
        ("let a = 3 v", 1, 11, "expected `;`"),
        ("x v", 1, 3, "expected the end of the expression, found `v`"),
        ("x @ v", 1, 3, "has no meaning"),
        ("ä", 1, 1, "has no meaning"),
        ("select(t, x, v)", 1, 8, "takes a condition first, not a scalar"),
        ("select(t < 1, x, t)", 1, 18, "chooses between"),
        ("not x", 1, 1, "`not` takes a condition"),
        ("(t < 1) * x", 1, 9, "takes no condition"),
        ("min(t < 1, 2) * x", 1, 5, "`min` takes no condition"),
    ] {
        let error = FieldProgram::compile(source).unwrap_err();
        assert_eq!((error.line, error.column), (line, column), "{source}: {error}");
        assert!(error.problem.contains(words), "{source}: {error}");
    }
}

#[test]
fn size_and_depth_are_bounded() {
    let long = format!("x{}", " + x".repeat(250_000));
    let deep = format!("{}x{}", "(".repeat(65), ")".repeat(65));
    let signs = format!("{}x", "-".repeat(70));
    let many: Vec<_> = (0..800).map(|i| format!("sin(t*{i})*x")).collect();
    for source in [long, deep, signs, many.join("+"), many.join(",")] {
        let error = FieldProgram::compile(&source).unwrap_err();
        let words = ["bytes", "deeper than 64", "too many", "expected the end"];
        assert!(words.iter().any(|words| error.problem.contains(words)), "{error}");
    }
    let chain = format!("x{}", " + x".repeat(1000));
    assert_eq!(force(&chain)[0], 1001.0, "a long sum is not deep");
    let names: String = (0..90).map(|i| format!("let a{i} = sin(x * {i});")).collect();
    let sum: Vec<_> = (0..90).map(|i| format!("a{i}")).collect();
    let wide = FieldProgram::compile(&format!("{names}{}", sum.join("+"))).unwrap_err();
    assert!(wide.problem.contains("at once"), "{wide}");
}

#[test]
fn equal_parts_are_computed_once() {
    let once = FieldProgram::compile("sin(t) * x").unwrap();
    let often = FieldProgram::compile("let unused = exp(t); sin(t) * x + 0 * x").unwrap();
    assert_eq!(once.operation_count(), 4);
    assert_eq!(often.operation_count(), 10, "{often:?}");
}

/// Expressions with every function and operator.
const EXAMPLES: &[&str] = &[
    "vec3(0, 0, 0)",
    "-m * x",
    "let r = length(vec3(x.x, x.y, 0)); m * select(r < 1e-3, vec3(0, 0, 1), cross(vec3(0, 0, 3), x) / r)",
    "vec3(sin(10 * x.x + t), cos(x.y * t), exp(-dot(x, x))) * abs(log(1 + abs(x.z))) ^ 1.5",
    "m * vec3(noise(4 * x), noise(4 * x + vec3(17.3, 0, t)), noise(x / dt))",
    "clamp(v, -1, 1) * mix(0.5, 2, id / 100) + min(x, v) - max(x, 0.1) * sqrt(x.x ^ 2 + 2 ^ t)",
    "select(not (x.x <= v.x) and x.y != 0 or t == 2, normalize(x), x * t ^ -3)",
];

#[test]
fn wgsl_is_valid() {
    let mut source = FieldProgram::wgsl_library().to_owned();
    for (number, example) in EXAMPLES.iter().enumerate() {
        source += &FieldProgram::compile(example).unwrap().wgsl(&format!("field_{number}"));
    }
    let module = naga::front::wgsl::parse_str(&source)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string(&source)));
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::empty(),
    );
    validator.validate(&module).unwrap();
    assert!(module.functions.len() >= EXAMPLES.len() + 10);
}

#[test]
fn cuda_names_every_operation() {
    for precision in [Precision::F32, Precision::F64] {
        for example in EXAMPLES {
            let program = FieldProgram::compile(example).unwrap();
            let text = program.cuda("force", precision);
            assert_eq!(text.matches("const ").count(), program.nodes.len());
        }
    }
}

/// The whole library in the words of the other languages: numbers that are not those of Rust would
/// give other bits.
#[test]
fn constants_of_the_libraries_are_those_of_the_functions() {
    let numbers = |text: &str, end: char| -> Vec<f64> {
        text.split(|c: char| !(c.is_ascii_alphanumeric() || ".-".contains(c)))
            .filter_map(|word| word.trim_start_matches('-').strip_suffix(end)?.parse().ok())
            .collect()
    };
    let found = numbers(FieldProgram::wgsl_library(), 'f');
    for wanted in [
        std::f64::consts::FRAC_2_PI,
        std::f64::consts::LOG2_E,
        std::f64::consts::SQRT_2,
        4.825_592_041_015_625e-4,
        1.267_590_795_056_731_4e-6,
        0.693_145_751_953_125,
        1.428_606_820_309_417_3e-6,
        f64::from(f32::MIN_POSITIVE),
        f64::from(f32::MAX),
        1.0 / 3_628_800.0,
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        1.0 / 9.0,
        1.0 / 7.0,
        0.2,
        1.0 / 3.0,
    ] {
        assert!(found.iter().any(|&number| number as f32 == wanted as f32), "{wanted:e}");
    }
}

proptest! {
    #[test]
    fn no_text_panics(source in "\\PC{0,60}") {
        let _ = FieldProgram::compile(&source);
    }

    #[test]
    fn no_mixture_of_words_panics(words in proptest::collection::vec(
        proptest::sample::select(vec![
            "x", "v", "t", "id", "(", ")", ",", "+", "-", "*", "/", "^", "<", "==", "and", "not",
            "let", "a", "=", ";", "1", "0", "2.5e3", ".x", "sin(", "vec3(", "select(", "noise(",
            "normalize(", "mix(",
        ]), 0..40)) {
        if let Ok(program) = FieldProgram::compile(&words.join(" ")) {
            let _ = program.evaluate([0.1, 0.2, 0.3], [1.0; 3], 0.0, 1.0, 0, 0.1);
        }
    }

    #[test]
    fn a_packet_has_the_bits_of_its_lanes(
        values in proptest::collection::vec(-20.0_f32..20.0, 7 * 4),
        number in 0..EXAMPLES.len(),
    ) {
        let program = FieldProgram::compile(EXAMPLES[number]).unwrap();
        let lanes = |k: usize| -> &[f32; 4] { values[4 * k..].first_chunk().unwrap() };
        let mut registers = FieldRegisters::<f32, 4>::new();
        program.prepare(&mut registers, 0.3, 0.01);
        let inputs = FieldInputs {
            position: [lanes(0), lanes(1), lanes(2)],
            velocity: [lanes(3), lanes(4), lanes(5)],
            mass: lanes(6),
            first: 8,
        };
        let packet = program.run(&mut registers, &inputs);
        for (lane, number) in (8..12).enumerate() {
            let at = |first: usize| [0, 1, 2].map(|axis| lanes(first + axis)[lane]);
            let single =
                program.evaluate_in(at(0), at(3), 0.3, lanes(6)[lane], number, 0.01);
            for axis in 0..3 {
                let [found, wanted] = [packet[axis][lane], single[axis]];
                prop_assert_eq!(found.to_bits(), wanted.to_bits());
            }
        }
    }
}
