//! Many simulations side by side without a window: how far each fabric sags in a frame. A table goes to the standard output.
//! `cargo run -p cloth --example headless_batch`.

use std::{error::Error, num::NonZeroUsize, sync::mpsc, thread};

use cloth::{
    Cloth, Control, GridPatch, ImplicitSettings, Integrator, MaterialPreset, ModelBuilder,
    ModelSimulation, SolverConfig, backend_create,
};

const SIDE: u32 = 17;
const FRAMES: u32 = 30;

/// Any error that can cross threads.
type AnyError = Box<dyn Error + Send + Sync>;

/// Depth of the middle of a cloth that is held all around \[m\].
fn sag(fabric: &MaterialPreset) -> Result<f64, AnyError> {
    let patch = GridPatch::new([SIDE, SIDE], 0.03);
    let is_border = |index: u32| index == 0 || index == SIDE - 1;
    let border = (0..SIDE * SIDE).filter(|i| is_border(i % SIDE) || is_border(i / SIDE));
    let model =
        ModelBuilder::new().cloth(Cloth::grid("sheet", patch, fabric).with_pins(border)).build()?;
    let config = SolverConfig {
        integrator: Integrator::Implicit(ImplicitSettings::default()),
        time_step: 1.0 / 60.0,
        ..SolverConfig::default()
    };
    // One thread each: several simulations fill a machine better than one on all of its threads.
    let backend = backend_create("cpu", NonZeroUsize::new(1))?;
    let mut simulation = ModelSimulation::new(model, &config, 60.0, backend.as_ref())?;
    for _ in 0..FRAMES {
        simulation.step(&Control::default())?;
    }
    let middle = patch.particle(SIDE / 2, SIDE / 2);
    Ok(-simulation.state()?.positions[middle as usize][2])
}

/// The depth of each fabric, in their order, whichever thread computed it.
fn sags() -> Result<Vec<(&'static str, f64)>, AnyError> {
    let threads = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let (sender, receiver) = mpsc::channel();
    thread::scope(|scope| {
        for first in 0..threads {
            let sender = sender.clone();
            scope.spawn(move || {
                let fabrics = MaterialPreset::ALL.iter().enumerate().skip(first).step_by(threads);
                for (index, fabric) in fabrics {
                    // Whoever receives is there until all senders are gone.
                    let _ = sender.send((index, fabric.name, sag(fabric)));
                }
            });
        }
    });
    drop(sender);
    let mut rows: Vec<_> = receiver.iter().collect();
    rows.sort_by_key(|&(index, ..)| index);
    rows.into_iter().map(|(_, name, sag)| Ok((name, sag?))).collect()
}

fn main() -> Result<(), AnyError> {
    println!("fabric,sag_m");
    for (fabric, sag) in sags()? {
        println!("{fabric},{sag:.6}");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_is_that_of_the_fabrics_and_stiff_ones_sag_less() {
        let rows = sags().expect("the example runs");
        let names: Vec<_> = rows.iter().map(|&(name, _)| name).collect();
        assert_eq!(names, MaterialPreset::ALL.map(|fabric| fabric.name));
        assert!(rows[0].1 > 1.3 * rows[4].1 && rows[4].1 > 0.0, "{rows:?}");
    }
}
