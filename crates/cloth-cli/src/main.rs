//! The command line of the cloth engine.

mod arguments;
mod audit;
mod backends;
mod check;
mod convert;
mod fabrics;
mod failure;
mod fault;
mod foreign;
mod manual;
mod memory;
mod passages;
mod run;
mod run_folder;
mod say;
mod scene_source;
mod scenes;
mod signals;
mod solid_progress;
mod units;
#[cfg(feature = "cpu")]
mod validate;
#[cfg(feature = "viewer")]
mod viewer;

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    process::ExitCode,
};

use clap::Parser;

use arguments::{Arguments, Command};
use failure::Failure;
use say::Level;

fn main() -> ExitCode {
    fault::install();
    let arguments = Arguments::parse();
    say::level_set(match (arguments.quiet, arguments.verbose) {
        (true, _) => Level::Quiet,
        (_, true) => Level::Verbose,
        _ => Level::Normal,
    });
    // What went wrong in a panic is said where it happens.
    let Ok(result) = catch_unwind(AssertUnwindSafe(|| command(&arguments.command))) else {
        return ExitCode::FAILURE;
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        // `cloth scenes | head` is no error.
        Err(failure) if failure.is_broken_pipe() => ExitCode::SUCCESS,
        Err(failure @ Failure::Interrupted(_)) => failure.exit_code(),
        Err(failure) => {
            say::error(failure.sentence());
            failure.exit_code()
        }
    }
}

fn command(command: &Command) -> Result<(), Failure> {
    match command {
        Command::Run(arguments) => run::run(arguments),
        Command::Scenes(arguments) => scenes::scenes(arguments),
        Command::Fabrics(arguments) => fabrics::fabrics(arguments),
        #[cfg(feature = "cpu")]
        Command::Validate(arguments) => validate::validate(arguments),
        #[cfg(not(feature = "cpu"))]
        Command::Validate(_) => Err(Failure::absent("`cloth validate`", "cpu")),
        Command::Backends => backends::backends(),
        Command::Check(arguments) => check::check(arguments),
        Command::Audit(arguments) => audit::audit(arguments),
        Command::Convert(arguments) => {
            // Nothing is left half written where it is interrupted.
            signals::Signals::install()?;
            convert::convert(arguments)
        }
        #[cfg(feature = "viewer")]
        Command::Render(arguments) => {
            signals::Signals::install()?;
            viewer::render(arguments)
        }
        #[cfg(feature = "viewer")]
        Command::View(arguments) => viewer::view(arguments),
        #[cfg(not(feature = "viewer"))]
        Command::Render(_) => Err(Failure::absent("`cloth render`", "viewer")),
        #[cfg(not(feature = "viewer"))]
        Command::View(_) => Err(Failure::absent("`cloth view`", "viewer")),
        Command::Completions { shell } => manual::completions(*shell),
        Command::Man { command } => manual::man(command.as_deref()),
    }
}
