//! A semi-implicit step beside an implicit one.

use std::{error::Error, time::Instant};

use cloth::{Backend, ImplicitSettings, Integrator, SemiImplicitSettings};
use cloth_benches::HangWorkload;

use crate::timing;

/// Steps before measurements start, and measured.
const STEPS: [usize; 2] = [5, 30];

pub(crate) fn print(backend: &dyn Backend) -> Result<(), Box<dyn Error>> {
    println!("\nhang, 24 neighbours, h = 1/60 s: median of {} steps", STEPS[1]);
    println!(
        "{:>5}{:>14}{:>18}{:>8}{:>28}",
        "N", "implicit ms", "semi-implicit ms", "ratio", "first steps, factorised ms"
    );
    for side in [33, 160, 256] {
        let workload = HangWorkload::new(side);
        let time = |integrator| -> cloth::Result<(f64, f64)> {
            let start = Instant::now();
            let mut running = workload.start(backend, integrator, STEPS[0])?;
            let first = start.elapsed().as_secs_f64() * 1e3;
            Ok((timing(&mut running, STEPS[1])?.milliseconds, first))
        };
        let (implicit, _) = time(Integrator::Implicit(ImplicitSettings::default()))?;
        let (semi, first) = match time(Integrator::SemiImplicit(SemiImplicitSettings::default())) {
            Err(cloth::Error::Unsupported { .. }) => {
                println!("{side:>5}{implicit:>14.3}{:>18}", "not supported");
                continue;
            }
            result => result?,
        };
        println!("{side:>5}{implicit:>14.3}{semi:>18.3}{:>8.1}{first:>28.1}", implicit / semi);
    }
    Ok(())
}
