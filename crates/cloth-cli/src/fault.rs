//! The program's own faults: a plain sentence instead of the insides of the machine that built it.

use std::{
    backtrace::Backtrace,
    panic::{self, PanicHookInfo},
};

use crate::{failure::EXIT_INPUT, say};

/// Says every panic in a sentence, and ends with the exit code for input where memory is refused, which the
/// standard library says by itself.
pub(crate) fn install() {
    panic::set_hook(Box::new(|info| {
        say::error(sentence(info));
        if std::env::var_os("RUST_BACKTRACE").is_some_and(|value| value != "0") {
            say::line(&without_build_folders(&Backtrace::force_capture().to_string()));
        }
    }));
    memory_end_install();
}

fn sentence(info: &PanicHookInfo<'_>) -> String {
    let payload = info.payload();
    let message = (payload.downcast_ref::<&str>().copied())
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no reason given");
    let place = info.location().map_or_else(String::new, |at| {
        format!(" ({}:{})", without_build_folders(at.file()), at.line())
    });
    format!(
        "the program found a fault of its own: {message}{place}; please report it with the command \
         and the scene"
    )
}

/// `text` with the folders left out in which cargo keeps the sources of packages: `.../registry/src/INDEX/PACKAGE/src/lib.rs` becomes
/// `PACKAGE/src/lib.rs`, and the sources of Rust itself `library/...`.
fn without_build_folders(text: &str) -> String {
    let mut lines = Vec::new();
    for line in text.lines() {
        let mut line = line.replace('\\', "/");
        for (folder, levels) in [("/registry/src/", 1), ("/git/checkouts/", 2), ("/rustc/", 1)] {
            while let Some(at) = line.find(folder) {
                let start = line[..at].rfind([' ', '(', '"', '`']).map_or(0, |space| space + 1);
                let mut rest = &line[at + folder.len()..];
                for _ in 0..levels {
                    rest = rest.split_once('/').map_or("", |(_, rest)| rest);
                }
                line = format!("{}{rest}", &line[..start]);
            }
        }
        lines.push(line);
    }
    lines.join("\n")
}

/// An allocation that fails ends a Rust program with SIGABRT, after a line on stderr.
#[cfg(unix)]
fn memory_end_install() {
    use std::sync::{Arc, atomic::AtomicBool};

    let always = Arc::new(AtomicBool::new(true));
    let code = i32::from(EXIT_INPUT);
    // Without it the program ends with the signal, as others do.
    let _ = signal_hook::flag::register_conditional_shutdown(
        signal_hook::consts::SIGABRT,
        code,
        always,
    );
}

#[cfg(not(unix))]
fn memory_end_install() {
    let _ = EXIT_INPUT;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_the_build_are_left_out() {
        for (text, expected) in [
            (
                "/home/me/.cargo/registry/src/index-123/thing-1.2.0/src/lib.rs",
                "thing-1.2.0/src/lib.rs",
            ),
            ("  at C:\\u\\registry\\src\\index\\a-1\\b.rs:3", "  at a-1/b.rs:3"),
            ("/rustc/0123abc/library/core/src/x.rs", "library/core/src/x.rs"),
            ("crates/cloth/src/lib.rs", "crates/cloth/src/lib.rs"),
            ("/registry/src/", ""),
        ] {
            assert_eq!(without_build_folders(text), expected);
        }
    }
}
