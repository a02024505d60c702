//! The computer and the sources that the numbers are of.

use std::process::Command;

use sysinfo::System;

use crate::record::Machine;

pub(crate) fn machine() -> Machine {
    let system = System::new().ok().map(|mut system| {
        system.refresh_cpu_all();
        system.refresh_memory();
        system
    });
    let brand = |system: &System| system.cpus().first().map(|cpu| cpu.brand().trim().to_owned());
    Machine {
        processor: system.as_ref().and_then(brand).unwrap_or_else(|| "unknown processor".into()),
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        memory_gigabytes: system.map_or(0.0, |system| system.total_memory() as f64 / 1e9),
        system: System::long_os_version().unwrap_or_else(|_| std::env::consts::OS.into()),
    }
}

/// The revision that this program was built from, as the build saw it, or that of the folder it runs in.
pub(crate) fn revision() -> String {
    if let Some(revision) = option_env!("CLOTH_REVISION") {
        return revision.into();
    }
    let output = Command::new("git").args(["describe", "--always", "--dirty"]).output();
    let text = output.ok().filter(|output| output.status.success());
    let text = text.and_then(|output| String::from_utf8(output.stdout).ok());
    text.map_or_else(|| "unknown".into(), |text| text.trim().to_owned())
}

/// Today, as year-month-day, in UTC.
pub(crate) fn date() -> String {
    let today = time::OffsetDateTime::now_utc().date();
    format!("{}-{:02}-{:02}", today.year(), u8::from(today.month()), today.day())
}
