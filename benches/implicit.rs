//! Time of one large step of a hanging patch with 24 neighbours, for criterion.

use std::{hint::black_box, time::Duration, time::Instant};

use cloth::{
    Backend, Error, ImplicitSettings, Integrator, LinearSettings, Preconditioner,
    SemiImplicitSettings,
};
use cloth_benches::{HangWorkload, chosen_backends};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

/// Steps before the measured ones: the patch then hangs stretched.
const STEPS_BEFORE: usize = 20;

fn measure(criterion: &mut Criterion, name: &str, sides: &[u32], integrator: &Integrator) {
    for chosen in chosen_backends() {
        let mut group = criterion.benchmark_group(format!("{name}/{}", chosen.name));
        for side in chosen.sides(sides) {
            side_measure(&mut group, &*chosen.backend, HangWorkload::new(side), integrator);
        }
        group.finish();
    }
}

fn side_measure(
    group: &mut criterion::BenchmarkGroup<'_, criterion::measurement::WallTime>,
    backend: &dyn Backend,
    workload: HangWorkload,
    integrator: &Integrator,
) {
    let mut running = match workload.start(backend, integrator.clone(), STEPS_BEFORE) {
        Err(Error::Unsupported { .. }) => return eprintln!("{integrator:?} is not supported"),
        running => running.expect("the workload runs"),
    };
    group.throughput(Throughput::Elements(workload.particles()));
    group.bench_function(BenchmarkId::from_parameter(workload.side), |bencher| {
        bencher.iter_custom(|steps| {
            let mut total = Duration::ZERO;
            for _ in 0..steps {
                running.rewind_if_done().expect("the state fits");
                let start = Instant::now();
                black_box(running.step().expect("the workload runs"));
                total += start.elapsed();
            }
            total
        });
    });
}

/// To a relative residual of 0.001 with each preconditioner, and thirty iterations as the reference
/// program does them.
fn implicit(criterion: &mut Criterion) {
    for &preconditioner in Preconditioner::ALL {
        let linear = LinearSettings { preconditioner, ..LinearSettings::default() };
        let integrator =
            Integrator::Implicit(ImplicitSettings { linear, ..ImplicitSettings::default() });
        measure(criterion, &format!("implicit/{preconditioner}"), &[60, 160, 256], &integrator);
    }
    let linear = LinearSettings {
        preconditioner: Preconditioner::Diagonal,
        tolerance: 0.0,
        iterations_max: 30,
        ..LinearSettings::default()
    };
    let integrator =
        Integrator::Implicit(ImplicitSettings { linear, ..ImplicitSettings::default() });
    measure(criterion, "implicit/30-iterations", &[60, 160, 256], &integrator);
}

fn semi_implicit(criterion: &mut Criterion) {
    let integrator = Integrator::SemiImplicit(SemiImplicitSettings::default());
    measure(criterion, "semi_implicit", &[33, 256], &integrator);
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10).measurement_time(Duration::from_secs(5));
    targets = implicit, semi_implicit
}
criterion_main!(benches);
