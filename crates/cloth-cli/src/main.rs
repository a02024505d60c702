//! The command line of the cloth engine.

mod arguments;
mod backends;
mod check;
mod convert;
mod failure;
mod memory;
mod passages;
mod run;
mod run_folder;
mod scene_source;
mod scenes;
mod solid_progress;
mod units;
#[cfg(feature = "viewer")]
mod viewer;

use std::process::ExitCode;

use clap::Parser;

use arguments::{Arguments, Command};

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Scenes(arguments) => scenes::scenes(&arguments),
        Command::Backends => backends::backends(),
        Command::Check(arguments) => check::check(&arguments),
        Command::Convert(arguments) => convert::convert(&arguments),
        #[cfg(feature = "viewer")]
        Command::Render(arguments) => viewer::render(&arguments),
        #[cfg(feature = "viewer")]
        Command::View(arguments) => viewer::view(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        // `cloth scenes | head` is no error.
        Err(failure) if failure.is_broken_pipe() => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {}", failure.sentence());
            failure.exit_code()
        }
    }
}
