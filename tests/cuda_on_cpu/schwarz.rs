//! The preconditioner `schwarz`, by the CUDA kernel that applies it.

use std::{fs, process::Command};

use cloth_core::{
    Cloth, GridPatch, GroupHierarchy, MaterialPreset, Model, ModelBuilder,
    schwarz::{Arch, ContactRows, MatrixCopy, PairRows, Schwarz},
};
use cloth_kernels::CudaModule;
use harness::random::Random;

use crate::{compiler, replaced};

/// Particles along both sides: with them there are three levels of groups, and a last group that is not full.
const SIDE: u32 = 183;

/// Two patches, so that behind the last group of the first one, which is smaller than the others, there is another.
fn model(side: u32) -> Model {
    let patch = |name, side, height| {
        let patch = GridPatch::horizontal(side, 0.01, height);
        let mut cloth = Cloth::grid(name, patch, &MaterialPreset::ALL[0]);
        cloth.material = MaterialPreset::ALL[0].material(1.0).into();
        cloth
    };
    let cloths = ModelBuilder::new().cloth(patch("large", side, 0.0)).cloth(patch("small", 6, 0.1));
    cloths.build().expect("patches are a model")
}

/// Springs of any stiffness on the model; some particles are held, others move along a plane.
fn matrix(model: &Model, random: &mut Random) -> MatrixCopy<f32> {
    let count = model.particle_count();
    let mut rows = vec![Vec::new(); count];
    for spring in model.springs().iter() {
        let [i, j] = spring.particles;
        let u: [f32; 3] = [0; 3].map(|_| (30.0 * random.between(-1.0, 1.0)) as f32);
        let g = random.between(0.0, 9.0) as f32;
        rows[i as usize].push((j, u, g));
        rows[j as usize].push((i, u, g));
    }
    let mut springs = PairRows { starts: vec![0], pairs: Vec::new() };
    for row in rows {
        springs.pairs.extend(row);
        springs.starts.push(springs.pairs.len() as u32);
    }
    let filter = |i: usize| match i % 97 {
        0 => Some([0.0; 6]),
        1 => Some([1.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
        _ => None,
    };
    let positions = model.positions().iter().map(|x| x.map(|x| x as f32)).collect();
    MatrixCopy {
        positions,
        base: (0..count).map(|_| [1.0, 1.5, 1.25, 0.0, 0.0, 0.0]).collect(),
        filters: (0..count).map(filter).collect(),
        springs,
        pairs: PairRows::default(),
        elements: None,
        contacts: ContactRows::default(),
    }
}

/// The same with the springs as pairs in contact, which have u alone.
fn in_contact(mut matrix: MatrixCopy<f32>) -> MatrixCopy<f32> {
    matrix.pairs = std::mem::take(&mut matrix.springs);
    matrix.pairs.pairs.iter_mut().for_each(|(_, _, g)| *g = 0.0);
    matrix
}

/// What the program that builds reads.
fn build_words(schwarz: &Schwarz, matrix: &MatrixCopy<f32>) -> Vec<u32> {
    let count = schwarz.len();
    let most = matrix.pairs.starts.windows(2).map(|ends| ends[1] - ends[0]).max().unwrap_or(0);
    let (mut partners, mut factors) =
        (vec![0_u32; most as usize * count], vec![[0.0_f32; 4]; most as usize * count]);
    let mut counts = Vec::new();
    for (i, ends) in matrix.pairs.starts.windows(2).enumerate() {
        counts.push(ends[1] - ends[0]);
        for (k, at) in (ends[0] as usize..ends[1] as usize).enumerate() {
            let (j, [x, y, z], _) = matrix.pairs.pairs[at];
            partners[k * count + i] = j;
            factors[k * count + i] = [x, y, z, 0.0];
        }
    }
    let touches: Vec<u32> =
        matrix.filters.iter().map(|f| u32::from(f.is_some_and(|f| f != [0.0; 6]))).collect();
    let half = |first: usize| -> Vec<[f32; 4]> {
        let filters = matrix.filters.iter().map(|f| f.unwrap_or_default());
        filters.map(|f| [f[first], f[first + 1], f[first + 2], 0.0]).collect()
    };
    let on: Vec<[f32; 4]> = matrix.base.iter().map(|b| [b[0], b[1], b[2], 0.0]).collect();
    let coarse = schwarz.levels()[0].matrix();
    let (filter_on, filter_off, positions) = (half(0), half(3), positions(matrix));
    let mut words = vec![count as u32, most];
    for list in [
        bytemuck::cast_slice::<_, u8>(schwarz.order()),
        bytemuck::cast_slice(schwarz.group_starts()),
        bytemuck::cast_slice(schwarz.places()),
        bytemuck::cast_slice(schwarz.group_of()),
        bytemuck::cast_slice(coarse.starts()),
        bytemuck::cast_slice(coarse.columns()),
        bytemuck::cast_slice(&partners),
        bytemuck::cast_slice(&factors),
        bytemuck::cast_slice(&counts),
        bytemuck::cast_slice(&on),
        bytemuck::cast_slice(&positions),
        bytemuck::cast_slice(&touches),
        bytemuck::cast_slice(&filter_on),
        bytemuck::cast_slice(&filter_off),
    ] {
        let list: Vec<u32> = bytemuck::pod_collect_to_vec(list);
        words.push(list.len() as u32);
        words.extend(list);
    }
    words
}

/// Places, and inverse masses, 0 where particles are held.
fn positions(matrix: &MatrixCopy<f32>) -> Vec<[f32; 4]> {
    let position = |(x, filter): (&[f32; 3], &Option<[f32; 6]>)| {
        let inverse = if *filter == Some([0.0; 6]) { 0.0 } else { 1.0 };
        [x[0], x[1], x[2], inverse]
    };
    matrix.positions.iter().zip(&matrix.filters).map(position).collect()
}

/// What the program that applies reads.
fn words(
    schwarz: &Schwarz,
    matrix: &MatrixCopy<f32>,
    [vector, on, off]: [&[[f32; 4]]; 3],
) -> Vec<u32> {
    let mut words = vec![schwarz.len() as u32];
    let mut put = |list: &[u8]| {
        let list: Vec<u32> = bytemuck::pod_collect_to_vec(list);
        words.push(list.len() as u32);
        words.extend(list);
    };
    put(bytemuck::cast_slice(schwarz.order()));
    put(bytemuck::cast_slice(schwarz.group_starts()));
    put(bytemuck::cast_slice(schwarz.places()));
    put(bytemuck::cast_slice(schwarz.group_of()));
    put(bytemuck::cast_slice(schwarz.prolongation()));
    words.extend([schwarz.group_starts().len() as u32 - 1, schwarz.levels().len() as u32]);
    for level in schwarz.levels() {
        let mut put = |list: &[u8]| {
            let list: Vec<u32> = bytemuck::pod_collect_to_vec(list);
            words.push(list.len() as u32);
            words.extend(list);
        };
        put(bytemuck::cast_slice(level.matrix().starts()));
        put(bytemuck::cast_slice(level.matrix().columns()));
        // Column by column.
        put(bytemuck::cast_slice(level.matrix().turned()));
        put(bytemuck::cast_slice(level.factors().rows()));
        put(bytemuck::cast_slice(level.factors().scale()));
        put(bytemuck::cast_slice(level.prolongation()));
        put(bytemuck::cast_slice(level.starts()));
        put(bytemuck::cast_slice(level.group_of()));
        put(bytemuck::cast_slice(level.inverse()));
        put(bytemuck::bytes_of(&level.weight()));
        let groups = level.starts().len().saturating_sub(1);
        words.extend([level.matrix().len() as u32, groups as u32]);
    }
    let positions = positions(matrix);
    for list in [&positions[..], vector, on, off] {
        let list: Vec<u32> = bytemuck::pod_collect_to_vec(list);
        words.push(list.len() as u32);
        words.extend(list);
    }
    words
}

/// Output of the program of a module.
fn by_program(
    (module, options, main): (&str, &[&str], &str),
    words: &[u32],
    (blocks, seed): (u32, u32),
    edit: impl Fn(String) -> String,
) -> Vec<u8> {
    let module = CudaModule::find(module).expect("the module exists");
    let kernel = module
        .compose_with(options.to_vec(), &["ptx"].map(|part| (part, "")))
        .expect("the module has this option");
    let text = format!("#include \"runtime.h\"\n{}\n{}\n", edit(kernel), main);
    let program = compiler::program(&text);
    let folder = tempfile::tempdir().expect("there is room for temporary files");
    let [input, output] = ["input", "output"].map(|name| folder.path().join(name));
    fs::write(&input, bytemuck::cast_slice(words)).expect("the input can be written");
    let mut command = Command::new(program);
    command.args([&input, &output]).args([blocks, seed].map(|number| number.to_string()));
    let ran = command.status().expect("the program starts");
    assert!(ran.success(), "the program ended with {ran}");
    fs::read(&output).expect("the output is there")
}

fn by_kernel(words: &[u32], launch: (u32, u32), edit: impl Fn(String) -> String) -> Vec<[u32; 3]> {
    let program = ("conjugate_gradient", &["schwarz"][..], include_str!("schwarz.h"));
    let numbers: Vec<[f32; 4]> =
        bytemuck::pod_collect_to_vec(&by_program(program, words, launch, edit));
    numbers.into_iter().map(|[x, y, z, _]| [x, y, z].map(f32::to_bits)).collect()
}

#[test]
fn the_preconditioner_schwarz() {
    let model = model(SIDE);
    let random = &mut Random::new(5);
    let matrix = matrix(&model, random);
    let mut schwarz = Schwarz::new(GroupHierarchy::new(&model));
    schwarz.build(&matrix, Arch::new());
    assert_eq!(schwarz.levels().len(), 3);
    let vector: Vec<[f32; 4]> = matrix
        .filters
        .iter()
        .map(|filter| match filter {
            Some([0.0, ..]) => [0.0; 4],
            _ => [0; 4].map(|_| random.between(-1.0, 1.0) as f32),
        })
        .collect();
    // What stands for the inverse blocks of particles.
    let [on, off] = [0, 1].map(|_| -> Vec<[f32; 4]> {
        vector.iter().map(|_| [0; 4].map(|_| random.between(-1.0, 1.0) as f32)).collect()
    });
    let moved = schwarz.apply(|i| [0, 1, 2].map(|axis| vector[i][axis]), Arch::new());
    // Without colliders the kernel filters held particles alone.
    let expected: Vec<[u32; 3]> = (0..schwarz.len())
        .map(|i| {
            if matches!(matrix.filters[i], Some([0.0, ..])) {
                return [0; 3];
            }
            let ([x, y, z, _], [xx, yy, zz, _], [xy, xz, yz, _]) = (vector[i], on[i], off[i]);
            let own =
                [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z];
            let moved: [f32; 3] = schwarz.moved(i, &moved);
            std::array::from_fn(|axis| (own[axis] + moved[axis]).to_bits())
        })
        .collect();
    let words = words(&schwarz, &matrix, [&vector, &on, &off]);
    for launch in [(1, 0), (3, 7)] {
        let found = by_kernel(&words, launch, |text| text);
        let differs = expected.iter().zip(&found).position(|(a, b)| a != b);
        assert_eq!(differs, None, "{launch:?}");
    }
    // A chunk of a row that is left out, a smoother without its weight, a second smoothing of
    // the first residual, rigid modes of another group, particles of the next group, blocks that are left out.
    for (right, wrong) in [
        ("chunk <= row / 2", "chunk < row / 2"),
        ("level.weight * (scale * sum)", "(scale * sum)"),
        (
            "node_residual(level, level.solution[0], at / NODE",
            "node_residual(level, level.solution[1], at / NODE",
        ),
        ("(size_t)__ldg(&p.group_of[i])", "(size_t)(__ldg(&p.group_of[i]) / 2)"),
        ("if (place < end)", "if (place <= end)"),
        ("own.x + (real)sums[0]", "(real)sums[0]"),
    ] {
        let found = by_kernel(&words, (2, 0), |text| replaced(&text, right, wrong));
        assert!(expected != found, "`{wrong}` is not found");
    }
}

/// What groups of particles have, as the host builds it: prolongation and coarse matrix.
fn built(schwarz: &Schwarz) -> Vec<u8> {
    let mut bytes: Vec<u8> = bytemuck::cast_slice(schwarz.prolongation()).to_vec();
    let blocks = schwarz.levels()[0].matrix().blocks();
    bytes.extend_from_slice(bytemuck::cast_slice(blocks));
    let turned = schwarz.levels()[0].matrix().turned();
    bytes.extend_from_slice(bytemuck::cast_slice(turned));
    bytes
}

#[test]
fn the_preconditioner_schwarz_is_built() {
    let model = model(19);
    let matrix = in_contact(matrix(&model, &mut Random::new(8)));
    let mut schwarz = Schwarz::new(GroupHierarchy::new(&model));
    schwarz.build(&matrix, Arch::new());
    let (expected, words) = (built(&schwarz), build_words(&schwarz, &matrix));
    let program = ("preconditioner_build_schwarz", &[][..], include_str!("schwarz_build.h"));
    for seed in [0, 3] {
        let found = by_program(program, &words, (1, seed), |text| text);
        let differs = expected.iter().zip(&found).position(|(a, b)| a != b);
        assert_eq!(
            (differs, found.len()),
            (None, expected.len()),
            "of {} bytes",
            72 * schwarz.len()
        );
    }
    // A block that is taken for its transpose, a filter that is left out, modes that are not independent.
    for (right, wrong) in [
        ("turned = 6 * (entry % 6) + entry / 6", "turned = entry"),
        ("if (is_filtered)", "if (false)"),
        ("#define RANK_MIN 1e-6", "#define RANK_MIN 1.0"),
    ] {
        let found = by_program(program, &words, (1, 0), |text| replaced(&text, right, wrong));
        assert!(expected != found, "`{wrong}` is not found");
    }
}
