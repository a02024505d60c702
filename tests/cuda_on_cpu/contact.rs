//! Pairs of triangles that may touch or meet, by the CUDA kernels that find them, against all pairs there are and the functions of the
//! CPU, in both precisions.

use std::{collections::BTreeSet, fs, process::Command, sync::Arc};

use cloth_core::{
    Cloth, ContactResponse, Geometry, GridPatch, MaterialPreset, Model, ModelBuilder, Pinch, Real,
    SelfContact,
    contact::{
        Candidate, ContactSurface, UnprovenPair,
        device::{
            DeviceContact, MOVED_NUMBERS, Moved, PAIR_WORDS, TASK_MARKED, TASK_NEW, pairs_of,
            surface_words,
        },
    },
};
use cloth_kernels::CudaModule;
use harness::random::Random;

use crate::{compiler, replaced};

/// Shared parts that these kernels do without: all but five.
const NOT_HERE: [&str; 31] = [
    "ptx",
    "schwarz",
    "spring",
    "field",
    "procedural",
    "fabric",
    "bending",
    "air",
    "collider",
    "contact",
    "list",
    "limit",
    "sync",
    "meeting",
    "build",
    "substep",
    "frame",
    "stencil",
    "tile",
    "flat",
    "pairs",
    "strip",
    "tile_list",
    "around",
    "team",
    "contact_rows",
    "linear",
    "fabric_matrix",
    "sum",
    "solve",
    "constraint",
];
const SPACING: f64 = 0.01;
const DISTANCE: f64 = 2e-3;
/// Length of the substep \[s\].
const LENGTH: f64 = 1.0 / 256.0;

/// Sheets above each other.
fn model() -> Arc<Model> {
    let response = ContactResponse::Triangles { friction: 0.3 };
    let mut builder =
        ModelBuilder::new().self_contact(SelfContact { distance: DISTANCE, response });
    for layer in 0..5_u32 {
        let height = 0.9 * DISTANCE * f64::from(layer);
        builder = builder.cloth(Cloth {
            name: format!("{layer}"),
            geometry: Geometry::Grid(GridPatch::horizontal(14, SPACING, height)),
            material: MaterialPreset::JERSEY.material(SPACING).into(),
            pins: vec![],
            velocity: [0.0; 3],
        });
    }
    Arc::new(builder.build().expect("the sheets are a model"))
}

/// Where particles are, how fast they go, and where they were, in numbers of a precision.
struct Motion<T> {
    position: Vec<[T; 3]>,
    velocity: Vec<[T; 3]>,
    start: Vec<[T; 3]>,
}

impl<T: Real> Motion<T> {
    fn new(model: &Model, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let mut motion = Self { position: vec![], velocity: vec![], start: vec![] };
        for x in model.positions() {
            let [by, v, back] = [0.2 * DISTANCE, 0.3, 0.5 * DISTANCE].map(|a| random.vector(a));
            let position: [T; 3] = std::array::from_fn(|k| T::from_f64(x[k] + by[k]));
            motion.start.push(std::array::from_fn(|k| position[k] - T::from_f64(back[k])));
            motion.position.push(position);
            // All go down together as well.
            motion.velocity.push(std::array::from_fn(|k| T::from_f64(v[k] - f64::from(k == 2))));
        }
        motion
    }
}

/// What the kernels have found.
#[derive(Debug, PartialEq)]
struct Found<T> {
    list: BTreeSet<UnprovenPair>,
    near: BTreeSet<UnprovenPair>,
    unproven: BTreeSet<UnprovenPair>,
    marked: BTreeSet<UnprovenPair>,
    /// Pairs that came more than once.
    surplus: usize,
    moved: [Vec<T>; 2],
}

/// What is asked.
#[derive(Clone, Copy)]
struct Question<T> {
    reach: T,
    delta: T,
    flags: u32,
}

fn words_of<T: Real>(number: T) -> Vec<u32> {
    if T::IS_DOUBLE {
        let bits = number.to_f64().to_bits();
        vec![bits as u32, (bits >> 32) as u32]
    } else {
        vec![(number.to_f64() as f32).to_bits()]
    }
}

/// The answer of the kernels, their text changed by `edit`.
fn by_kernels<T: Real>(
    model: &Model,
    motion: &Motion<T>,
    question: Question<T>,
    edit: impl Fn(String) -> String,
) -> Found<T> {
    let find = |name| CudaModule::find(name).expect("the module exists");
    let options = if T::IS_DOUBLE { vec!["f64"] } else { vec![] };
    let first = find("contact_pairs");
    let mut text = first
        .compose_with(options, &NOT_HERE.map(|part| (part, "")))
        .expect("the module has these options");
    text += find("contact_geometry").file();
    text += find("contact_certify").file();
    let text = edit(text);
    let program = compiler::program(&format!(
        "#include \"runtime.h\"\n{text}\n{}\n",
        include_str!("contact.h")
    ));
    let contact = model.self_contact().expect("it has contact");
    let surface = ContactSurface::new(model, contact);
    let task = DeviceContact::<T>::new(model, Pinch::Refuse)
        .expect("it has contact of triangles")
        .list
        .task;
    let mut words = vec![
        1,
        model.particle_count() as u32,
        task.group_count,
        task.edge_count,
        task.moved_blocks,
        question.flags,
        1 << 20,
    ];
    let numbers = [question.reach, T::from_f64(LENGTH), question.delta, task.distance];
    words.extend(numbers.into_iter().flat_map(words_of));
    let surface = surface_words(&surface, task.group_count);
    words.push(surface.len() as u32);
    words.extend(surface);
    for field in [&motion.position, &motion.velocity, &motion.start] {
        let vectors = field.iter().flat_map(|&[x, y, z]| [x, y, z, T::ONE]);
        words.extend(vectors.flat_map(words_of));
    }
    let folder = tempfile::tempdir().expect("there is room for temporary files");
    let [input, output] = ["input", "output"].map(|name| folder.path().join(name));
    fs::write(&input, bytemuck::cast_slice(&words)).expect("the input can be written");
    let ran = Command::new(program).args([&input, &output]).status().expect("the program starts");
    assert!(ran.success(), "the program ended with {ran}");
    let bytes = fs::read(&output).expect("the output is there");
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
    let mut rest = &words[..];
    let mut surplus = 0;
    let mut pairs = || {
        let count = rest[0] as usize;
        let (pairs, left) = rest[1..].split_at(PAIR_WORDS * count);
        rest = left;
        let set: BTreeSet<_> = pairs_of(pairs).collect();
        surplus += count - set.len();
        set
    };
    let (list, near, unproven) = (pairs(), pairs(), pairs());
    let (marked_list, marked) = (pairs(), pairs());
    let numbers: Vec<T> = (rest.chunks_exact(2))
        .map(|word| f64::from_bits(u64::from(word[0]) | u64::from(word[1]) << 32))
        .map(T::from_f64)
        .collect();
    let (starts, ends) = numbers.split_at(numbers.len() / 2);
    surplus += if marked.is_subset(&marked_list) { 0 } else { marked.len() };
    Found { list, near, unproven, marked, surplus, moved: [starts.to_vec(), ends.to_vec()] }
}

/// Whether two features are apart along an axis of space, on the same side of it in all sets of their points.
fn are_apart<T: Real>(candidate: Candidate, sets: &[[[T; 3]; 4]], reach: T) -> bool {
    let middle = match candidate {
        Candidate::VertexTriangle(_) => 1,
        Candidate::EdgeEdge(_) => 2,
    };
    let range = |points: &[[T; 3]], axis: usize| {
        let numbers = points.iter().map(|x| x[axis]);
        numbers
            .fold([T::INFINITY, -T::INFINITY], |[low, high], x| [low.minimum(x), high.maximum(x)])
    };
    let is_above = |set: &[[T; 3]; 4], axis: usize, is_first: bool| {
        let (first, second) = set.split_at(middle);
        let [a, b] = [range(first, axis), range(second, axis)];
        if is_first { a[0] - b[1] >= reach } else { b[0] - a[1] >= reach }
    };
    let sides = (0..3).flat_map(|axis| [(axis, true), (axis, false)]);
    sides.into_iter().any(|(axis, side)| sets.iter().all(|set| is_above(set, axis, side)))
}

fn question<T: Real>(model: &Model, flags: u32) -> Question<T> {
    let task = DeviceContact::<T>::new(model, Pinch::Refuse)
        .expect("it has contact of triangles")
        .list
        .task;
    Question { reach: task.reach, delta: T::from_f64(2e-5), flags }
}

/// The same by the functions of the CPU, for all pairs there are.
fn by_cpu<T: Real>(model: &Model, motion: &Motion<T>, question: Question<T>) -> Found<T> {
    let contact = model.self_contact().expect("it has contact");
    let surface = ContactSurface::new(model, contact);
    let (length, distance) = (T::from_f64(LENGTH), T::from_f64(contact.distance));
    let Motion { position, velocity, start } = motion;
    let second: Vec<[T; 3]> = (position.iter().zip(velocity))
        .map(|(x, v)| std::array::from_fn(|k| x[k] + length * v[k]))
        .collect();
    let mut found = Found {
        list: BTreeSet::new(),
        near: BTreeSet::new(),
        unproven: BTreeSet::new(),
        marked: BTreeSet::new(),
        surplus: 0,
        moved: [vec![], vec![]],
    };
    for candidate in surface.candidates() {
        let particles = surface.particles(candidate);
        let at = |set: &[[T; 3]]| particles.map(|i| set[i as usize]);
        let is_marked = particles.iter().any(|i| i % 3 == 0);
        let is_new = question.flags & TASK_NEW != 0;
        let pair = UnprovenPair { candidate, particles };
        let is_unproven = pair.is_unproven(start, position, (question.delta, is_new));
        if is_marked && is_unproven {
            found.marked.insert(pair);
        }
        if are_apart(candidate, &[at(position), at(&second)], question.reach) {
            continue;
        }
        found.list.insert(pair);
        // Whatever touches is one of those that may.
        if surface.contact(candidate, |i| position[i as usize]).is_some() {
            assert!(!are_apart(candidate, &[at(position)], distance));
            found.near.insert(pair);
        }
        if (question.flags & TASK_MARKED == 0 || is_marked) && is_unproven {
            found.unproven.insert(pair);
        }
    }
    for (half, set) in [start, position].into_iter().enumerate() {
        let mut numbers = vec![T::ZERO; MOVED_NUMBERS];
        numbers[..12].fill(-T::MAX);
        for ((x, a), b) in set.iter().zip(position).zip(&second) {
            for k in 0..3 {
                let ways = [x[k] - a[k], a[k] - x[k], x[k] - b[k], b[k] - x[k]];
                for (which, way) in ways.into_iter().enumerate() {
                    let place = &mut numbers[3 * which + k];
                    *place = place.maximum(way);
                }
                numbers[12] = numbers[12].maximum(x[k].abs());
            }
        }
        found.moved[half] = numbers;
    }
    found
}

fn largest<T: Real>(numbers: &[T]) -> String {
    format!("{:?}", Moved::of(numbers))
}

fn check<T: Real>() {
    let model = model();
    for (seed, flags) in [(1, 0), (2, TASK_NEW), (3, TASK_MARKED)] {
        let motion = Motion::<T>::new(&model, seed);
        let question = question(&model, flags);
        let expected = by_cpu(&model, &motion, question);
        let found = by_kernels(&model, &motion, question, |text| text);
        assert_eq!(found.surplus, 0, "a pair comes twice");
        assert_eq!(found.list.len(), expected.list.len(), "pairs of the list");
        assert!(found.list == expected.list, "the list is another");
        assert!(expected.near.is_subset(&found.near), "a contact is missing");
        assert!(!expected.near.is_empty() && 2 * found.near.len() < found.list.len());
        assert!(!expected.unproven.is_empty(), "all is proven");
        assert!(found.unproven == expected.unproven, "others are unproven");
        assert!(found.marked == expected.marked && !found.marked.is_empty(), "of marked ones");
        assert!(found.unproven.len() < found.list.len());
        for half in 0..2 {
            assert_eq!(largest(&found.moved[half]), largest(&expected.moved[half]), "{half}");
        }
    }
}

#[test]
fn pairs_of_triangles() {
    check::<f32>();
    check::<f64>();
}

/// A pair that is missing, boxes that are apart at one end alone, a level of the tree, a normal that points the wrong way, a margin that is none, a barrier.
#[test]
fn faults_of_pairs_are_found() {
    let model = model();
    let motion = Motion::<f32>::new(&model, 1);
    let question = question(&model, 0);
    let expected = by_cpu(&model, &motion, question);
    for (right, wrong) in [
        ("t.list[place] = pair_between(t,", "if (place != 77) t.list[place] = pair_between(t,"),
        ("above &= component", "above |= component"),
        (
            "width = t.task.group_count / 2 / gridDim.x; width > 0",
            "width = t.task.group_count / 4 / gridDim.x; width > 0",
        ),
        ("(other > slot ||", "(other > slot + 1 ||"),
        (
            "triangles_compare(t, lane < queued, queue[lane])",
            "triangles_compare(t, false, queue[lane])",
        ),
        ("pair_first + first + before;", "pair_first + first;"),
        ("first > 0; first /= 2", "first > 1; first /= 2"),
        ("(by_marks && !triangle_is_marked(t, other))", "false"),
        ("by_marks || last_group(2 * node, count)", "last_group(2 * node, count)"),
        ("t.task.flags & TASK_MARKED ? t.ways : t.references", "t.references"),
        ("place = t.task.pair_first + first", "place = first"),
        ("if (dot(normal, across) > 0)", "if (dot(normal, across) < 0)"),
        ("a1.low - b1.high > delta", "a1.low - b1.high > 0"),
        ("d6 >= 0 && d5 <= d6", "d6 >= 0"),
        ("maximum(own[3 + axis], q - p)", "maximum(own[3 + axis], p - q)"),
    ] {
        let found = by_kernels(&model, &motion, question, |text| replaced(&text, right, wrong));
        let same = found.list == expected.list
            && expected.near.is_subset(&found.near)
            && found.unproven == expected.unproven
            && found.marked == expected.marked
            && found.surplus == 0
            && (0..2).all(|half| largest(&found.moved[half]) == largest(&expected.moved[half]));
        assert!(!same, "`{wrong}` is not found");
    }
}
