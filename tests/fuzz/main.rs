//! `cloth-fuzz`: inputs that nobody would write, and runs that end when nobody expects it.
//!
//! Inputs are made of good ones by mutators that know their structure, and read in processes of their own with limits on memory and
//! time. A panic, a crash, too much time or too much memory is a finding; it is made smaller, and kept as a file that tests read again.
//! What is tried follows from a seed. The program needs nothing but itself, so that it can be copied to a large machine.

#[cfg(unix)]
mod arguments;
#[cfg(unix)]
mod campaign;
#[cfg(unix)]
mod finding;
#[cfg(unix)]
mod kills;
#[cfg(unix)]
mod mutate;
#[cfg(unix)]
mod processor;
#[cfg(unix)]
mod targets;
#[cfg(unix)]
mod worker;

#[cfg(unix)]
fn main() -> std::process::ExitCode {
    use clap::Parser;

    let arguments = arguments::Arguments::parse();
    let outcome = match &arguments.task {
        None => campaign::run(&arguments.campaign),
        Some(arguments::Task::Replay(replay)) => campaign::replay(replay),
        Some(arguments::Task::Kills(kills)) => kills::run(kills),
        Some(arguments::Task::Worker { memory }) => return worker::run(*memory),
    };
    match outcome {
        Ok(true) => std::process::ExitCode::SUCCESS,
        Ok(false) => std::process::ExitCode::FAILURE,
        Err(problem) => {
            eprintln!("error: {problem}");
            std::process::ExitCode::from(2)
        }
    }
}

/// Limits on processes are asked for in the way of Unix.
#[cfg(not(unix))]
fn main() {
    eprintln!("error: `cloth-fuzz` runs on Unix");
    std::process::exit(2);
}
