//! Bytes per particle, by the allocator's count.

use std::error::Error;

use cloth::{
    Backend, Frame, LinearMethod, MatrixForm, Preconditioner, State,
    scene::{
        BenchKind, CompileOptions, Scene, SceneGeometry, SceneSolver, SceneStencil, bench_scene,
    },
};

use crate::MEMORY;

const SIDE: u32 = 256;

pub(crate) fn print(backend: &dyn Backend) -> Result<(), Box<dyn Error>> {
    println!(
        "\nbytes per particle of a {SIDE} x {SIDE} patch with 12 and 24 neighbours, f32, without contact"
    );
    println!("{:<48}{:>8}{:>8}{:>12}{:>8}", "", "12", "peak", "24", "peak");
    for (name, change) in CASES {
        print!("{name:<48}");
        for (stencil, width) in [(SceneStencil::Neighbours12, 8), (SceneStencil::Neighbours24, 12)]
        {
            let mut scene = bench_scene(BenchKind::Sphere, SIDE, false);
            change(&mut scene);
            if let SceneGeometry::Grid(grid) = &mut scene.cloths[0].geometry {
                grid.stencil = stencil;
            }
            match bytes(backend, &scene) {
                Ok([running, peak]) => print!("{running:>width$.0}{peak:>8.0}"),
                Err(cloth::Error::Unsupported { .. }) => print!("{:>16}", "not supported"),
                Err(error) => return Err(error.into()),
            }
        }
        println!();
    }
    Ok(())
}

type Case = (&'static str, fn(&mut Scene));

const CASES: [Case; 7] = [
    ("explicit", |_| {}),
    ("implicit, cg, diagonal, matrix-free", |scene| {
        implicit(scene, Preconditioner::Diagonal, MatrixForm::MatrixFree);
    }),
    ("implicit, cg, block, matrix-free (default)", |scene| {
        implicit(scene, Preconditioner::Block, MatrixForm::MatrixFree);
    }),
    ("implicit, cg, block, assembled", |scene| {
        implicit(scene, Preconditioner::Block, MatrixForm::Assembled);
    }),
    ("implicit, cg, incomplete-cholesky, matrix-free", |scene| {
        implicit(scene, Preconditioner::IncompleteCholesky, MatrixForm::MatrixFree);
    }),
    ("implicit, jacobi", |scene| {
        scene.simulation.solver = Some(SceneSolver::Implicit);
        scene.simulation.implicit.linear = LinearMethod::Jacobi;
    }),
    ("semi-implicit", |scene| scene.simulation.solver = Some(SceneSolver::SemiImplicit)),
];

fn implicit(scene: &mut Scene, preconditioner: Preconditioner, matrix: MatrixForm) {
    scene.simulation.solver = Some(SceneSolver::Implicit);
    scene.simulation.implicit.preconditioner = preconditioner;
    scene.simulation.implicit.matrix = matrix;
}

/// Bytes per particle of model, solver and a state on the host: while it runs, and at the peak.
fn bytes(backend: &dyn Backend, scene: &Scene) -> cloth::Result<[f64; 2]> {
    let particles = f64::from(SIDE) * f64::from(SIDE);
    let base = MEMORY.current_usage();
    let per_particle = |bytes: usize| bytes.saturating_sub(base) as f64 / particles;
    let compiled =
        scene.compile(&CompileOptions::default()).expect("the workload is a valid scene");
    let mut solver = backend.create_solver(compiled.model.clone(), &compiled.config)?;
    let mut state = State::default();
    MEMORY.reset_peak_usage();
    for _ in 0..3 {
        solver.advance(Frame::per_second(60.0))?;
        solver.synchronize()?;
        solver.download(&mut state)?;
    }
    Ok([per_particle(MEMORY.current_usage()), per_particle(MEMORY.peak_usage())])
}
