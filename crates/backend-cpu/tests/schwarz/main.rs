//! The preconditioner `schwarz` (NUMERICS §5) on systems of cloth.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod rig;

use std::sync::Arc;

use cloth_backend_cpu::CpuBackend;
use cloth_backend_reference::ReferenceBackend;
use cloth_core::{
    Backend, Cloth, Geometry, LinearSettings, LinearStop, LinearVector, Mass, MaterialPreset,
    Model, ModelBuilder, NetworkSpring, Precision, Preconditioner, SpringClass, SpringNetwork,
};

use rig::{assembled, assembled_by, fabric, folded, numbers, settings, sheet, solve, springs};

/// To a hundredth of the first error in the norm of the energy.
const fn energy(preconditioner: Preconditioner) -> LinearSettings {
    LinearSettings { stop: LinearStop::Energy, tolerance: 1e-2, ..settings(preconditioner) }
}

fn iterations(model: &Arc<Model>, settings: &LinearSettings) -> u32 {
    solve(&mut *folded(model, Precision::F32, 2), settings).iterations
}

#[test]
fn iterations_are_few_and_hardly_grow_with_the_mesh() {
    for material in [|_| fabric(), springs] {
        let [small, large] = [64, 128].map(|side| sheet(side, material));
        let [few, more] =
            [&small, &large].map(|model| iterations(model, &energy(Preconditioner::Schwarz)));
        let block = iterations(&large, &energy(Preconditioner::Block));
        println!("schwarz {few} {more}, block {block}");
        assert!(5 * more <= block, "{more} of {block}");
        assert!(f64::from(more) < 1.4 * f64::from(few), "{few} {more}");
    }
}

/// Bodies hold cloth in contact as stiffly as they do in the matrix: left out, it took 79 iterations instead of 14.
#[test]
fn contact_with_a_body_takes_few_more_iterations() {
    let [free, lying] = [0.1, 1.5e-3].map(|height| {
        let model = rig::lying(height);
        let mut kernels = assembled(&model, model.positions(), Precision::F32, 2);
        let mut random = numbers();
        let right_side: Vec<[f64; 3]> =
            model.masses().iter().map(|mass| [0.0; 3].map(|_| mass * random())).collect();
        kernels.vector_write(LinearVector::RightSide, &right_side).unwrap();
        let mut contacts = Default::default();
        kernels.contacts_read(&mut contacts).unwrap();
        assert_eq!(contacts.contacts.is_empty(), height > 0.01);
        solve(&mut *kernels, &energy(Preconditioner::Schwarz)).iterations
    });
    println!("free {free}, lying {lying}");
    assert!(lying <= 2 * free, "{lying} {free}");
}

#[test]
fn the_answer_is_that_of_blocks() {
    for model in [sheet(40, |_| fabric()), sheet(40, springs)] {
        let [a, b] = [Preconditioner::Block, Preconditioner::Schwarz].map(|preconditioner| {
            let mut kernels = folded(&model, Precision::F64, 2);
            let settings = LinearSettings { tolerance: 1e-11, ..settings(preconditioner) };
            solve(&mut *kernels, &settings);
            let mut solution = Vec::new();
            kernels.vector_read(LinearVector::Solution, &mut solution).unwrap();
            solution
        });
        let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
        let size = norm(&mut a.as_flattened().iter().copied());
        let apart = norm(&mut a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a - b));
        assert!(apart < 1e-6 * size, "{apart} {size}");
    }
}

/// Sparse Cholesky factorisation is exact: of fabric, and of fabric that lies on a body.
#[test]
fn the_answer_is_that_of_a_factorisation() {
    for model in [sheet(24, |_| fabric()), rig::lying(1.5e-3)] {
        let [iterated, direct] = [false, true].map(|is_direct| {
            let mut kernels = assembled(&model, model.positions(), Precision::F64, 2);
            let mut random = numbers();
            let right_side: Vec<[f64; 3]> =
                model.masses().iter().map(|mass| [0.0; 3].map(|_| mass * random())).collect();
            kernels.vector_write(LinearVector::RightSide, &right_side).unwrap();
            if is_direct {
                let outcome = kernels.direct_solve().unwrap();
                assert!(outcome.converged && outcome.residual < 1e-10, "{outcome:?}");
            } else {
                let settings =
                    LinearSettings { tolerance: 1e-12, ..settings(Preconditioner::Schwarz) };
                solve(&mut *kernels, &settings);
            }
            let mut solution = Vec::new();
            kernels.vector_read(LinearVector::Solution, &mut solution).unwrap();
            solution
        });
        let largest = direct.as_flattened().iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (a, b) in iterated.as_flattened().iter().zip(direct.as_flattened()) {
            assert!((a - b).abs() < 1e-8 * largest, "{a} {b}");
        }
    }
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    for precision in [Precision::F32, Precision::F64] {
        let model = sheet(70, |_| fabric());
        let all = [1, 2, 3].map(|threads| {
            let mut kernels = folded(&model, precision, threads);
            solve(&mut *kernels, &settings(Preconditioner::Schwarz));
            let mut solution = Vec::new();
            kernels.vector_read(LinearVector::Solution, &mut solution).unwrap();
            solution
        });
        assert!(all[0] == all[1] && all[0] == all[2], "{precision}");
    }
}

/// Points and springs between them.
fn network(positions: Vec<[f64; 3]>, pairs: &[[u32; 2]]) -> Arc<Model> {
    let springs = pairs
        .iter()
        .map(|&particles| NetworkSpring {
            particles,
            class: SpringClass::Stretch,
            rest_length: None,
            coefficients: None,
        })
        .collect();
    let mut material = MaterialPreset::ALL[0].material(0.01);
    material.mass = Mass::PerParticle(1e-4);
    material.stretch.stiffness = 1000.0;
    let cloth = Cloth {
        name: "net".into(),
        geometry: Geometry::Network(SpringNetwork { positions, springs }),
        material: material.into(),
        pins: vec![],
        velocity: [0.0; 3],
    };
    Arc::new(ModelBuilder::new().cloth(cloth).build().unwrap())
}

fn is_solved(model: &Arc<Model>, iterations_max: u32) {
    let mut random = numbers();
    let mut kernels = assembled(model, model.positions(), Precision::F32, 2);
    let right_side: Vec<[f64; 3]> =
        (0..model.particle_count()).map(|_| std::array::from_fn(|_| 1e-5 * random())).collect();
    kernels.vector_write(LinearVector::RightSide, &right_side).unwrap();
    let outcome = solve(&mut *kernels, &settings(Preconditioner::Schwarz));
    println!("{outcome:?}");
    assert!(outcome.iterations <= iterations_max, "{outcome:?}");
}

#[test]
fn ropes_and_pieces_are_solved() {
    // A long rope along no axis, many short ones of which several share a group, and single particles.
    let rope = |first: u32, length: u32| (1..length).map(move |k| [first + k - 1, first + k]);
    let place = |k: u32| [0.003, -0.004, 0.0086].map(|step| step * f64::from(k));
    let mut pairs: Vec<[u32; 2]> = rope(0, 3000).collect();
    let mut count = 3000;
    for length in [1, 2, 5, 31, 32, 33, 40].into_iter().cycle().take(200) {
        pairs.extend(rope(count, length));
        count += length;
    }
    is_solved(&network((0..count).map(place).collect(), &pairs), 200);
}

#[test]
fn particles_that_nothing_connects_are_solved_at_once() {
    is_solved(&network((0..100_000).map(|k| [f64::from(k), 0.0, 0.0]).collect(), &[]), 3);
}

/// P^-1 v of the plain loops and of this backend, which keeps inverse factors in single precision.
#[test]
fn it_is_that_of_the_plain_loops() {
    // Two levels above the particles.
    let place = |k: u32| [0.003, -0.004, 0.0086].map(|step| step * f64::from(k));
    let pairs: Vec<[u32; 2]> = (1..70 * 17).filter(|k| k % 17 > 0).map(|k| [k - 1, k]).collect();
    let ropes = network((0..70 * 17).map(place).collect(), &pairs);
    for model in [sheet(16, |_| fabric()), sheet(30, springs), ropes] {
        let mut random = numbers();
        let at: Vec<[f64; 3]> = (model.positions().iter())
            .map(|place| place.map(|x| 1.002 * x + 1e-4 * random()))
            .collect();
        let vector: Vec<[f64; 3]> =
            model.positions().iter().map(|_| std::array::from_fn(|_| random())).collect();
        let backends: [&dyn Backend; 2] =
            [&CpuBackend::new(None).unwrap(), &ReferenceBackend::new()];
        let [found, expected] = backends.map(|backend| {
            let mut kernels = assembled_by(backend, &model, &at, (Precision::F64, 2));
            kernels.vector_write(LinearVector::Residual, &vector).unwrap();
            kernels.preconditioner_build(Preconditioner::Schwarz).unwrap();
            kernels
                .preconditioner_apply(LinearVector::Residual, LinearVector::Preconditioned)
                .unwrap();
            let mut out = Vec::new();
            kernels.vector_read(LinearVector::Preconditioned, &mut out).unwrap();
            out
        });
        let size = expected.as_flattened().iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let apart = (found.as_flattened().iter().zip(expected.as_flattened()))
            .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        println!("{apart:e} of {size:e}");
        assert!(apart < 1e-4 * size, "{apart} {size}");
    }
}
