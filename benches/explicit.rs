//! Time of one frame of the common workload, explicit integration, for criterion.

use std::{hint::black_box, time::Duration, time::Instant};

use cloth::scene::BenchKind;
use cloth_benches::{Workload, chosen_backends};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

fn explicit(criterion: &mut Criterion) {
    for chosen in chosen_backends() {
        for kind in [BenchKind::Hang, BenchKind::Sphere] {
            for contact in [false, true] {
                let scene = Workload::new(kind, 2, contact).scene();
                let suffix = if contact { "contact" } else { "plain" };
                let name = format!("explicit/{}/{scene}-{suffix}", chosen.name);
                let mut group = criterion.benchmark_group(name);
                for side in chosen.sides(&[160, 256]) {
                    let workload = Workload::new(kind, side, contact);
                    let mut running = workload.start(&*chosen.backend).expect("the workload runs");
                    let substeps = u64::from(running.step().expect("the workload runs").substeps);
                    group.throughput(Throughput::Elements(workload.particles() * substeps));
                    group.bench_function(BenchmarkId::from_parameter(side), |bencher| {
                        bencher.iter_custom(|frames| {
                            let mut total = Duration::ZERO;
                            for _ in 0..frames {
                                running.rewind_if_done().expect("the state fits");
                                let start = Instant::now();
                                black_box(running.step().expect("the workload runs"));
                                total += start.elapsed();
                            }
                            total
                        });
                    });
                }
                group.finish();
            }
        }
    }
}

criterion_group! {
    name = benches;
    // As many frames as the measured window has, so that every sample sees all of it.
    config = Criterion::default().sample_size(10).measurement_time(Duration::from_secs(5));
    targets = explicit
}
criterion_main!(benches);
