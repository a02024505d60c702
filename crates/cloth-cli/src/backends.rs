//! `cloth backends`.

use std::io::{Write, stdout};

use crate::failure::Failure;

pub(crate) fn backends() -> Result<(), Failure> {
    let mut out = stdout().lock();
    for info in cloth::backends() {
        let precisions: Vec<String> = info.precisions.iter().map(ToString::to_string).collect();
        writeln!(out, "{}: {}, precision {}", info.name, info.device, precisions.join(" or "))?;
        for (name, value) in &info.details {
            writeln!(out, "  {name}: {value}")?;
        }
    }
    Ok(())
}
