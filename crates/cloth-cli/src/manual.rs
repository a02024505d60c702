//! `cloth completions` and `cloth man`: what shells and manuals know of the command line.

use std::io::{Write, stdout};

use clap::CommandFactory;
use clap_complete::Shell;
use clap_mangen::Man;

use crate::{arguments::Arguments, failure::Failure};

/// Prints the script for a shell.
pub(crate) fn completions(shell: Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "cloth", &mut script);
    Ok(stdout().write_all(&script)?)
}

/// Prints the manual page of the program, or of one of its commands.
pub(crate) fn man(command: Option<&str>) -> Result<(), Failure> {
    let mut program = Arguments::command();
    // For the arguments that all commands have.
    program.build();
    let page = match command {
        None => program,
        Some(name) => {
            let known: Vec<_> = program.get_subcommands().map(|known| known.get_name()).collect();
            let found = program.find_subcommand(name).ok_or_else(|| {
                let known = known.join(", ");
                Failure::Usage(format!("there is no command `{name}`; there are: {known}"))
            })?;
            // Building has named it after the program, too.
            found.clone()
        }
    };
    let mut text = Vec::new();
    Man::new(page).render(&mut text)?;
    Ok(stdout().write_all(&text)?)
}
