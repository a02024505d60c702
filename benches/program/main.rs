//! `cloth-bench`: every backend of this machine on every workload and every published table, as one page.
//!
//! It needs nothing but itself: carried to another machine, without Rust, it runs there as well. Times are
//! reported only of runs whose result has been compared with the f64 reference on the CPU.
//!
//! - [`engine`] opens the backends and asks what their memory can do.
//! - [`case`] says what is run, [`measure`] runs it, [`check`] compares it, [`record`] keeps what came of it.
//! - [`linear`] compares solvers of linear systems by themselves.
//! - [`suite`] lists the cases, those of published tables among them.
//! - [`output`] writes JSON, CSV and the page, prints, and compares with an older run.

mod arguments;
mod case;
mod check;
mod engine;
mod linear;
mod machine;
mod measure;
mod memory;
mod output;
mod record;
mod run;
mod suite;

use std::process::ExitCode;

use clap::Parser;

use crate::arguments::{Arguments, Task};

#[global_allocator]
static MEMORY: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let outcome = match &arguments.task {
        Some(Task::Readme { results, into, plot }) => output::readme::write(results, into, plot),
        None => run::run(&arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
