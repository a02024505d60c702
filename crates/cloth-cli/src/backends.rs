//! `cloth backends`.

use std::io::{Write, stdout};

#[cfg(feature = "wgpu")]
use crate::units::{bytes_text, number_text};
use crate::{failure::Failure, foreign::hushed, say::Shown};

pub(crate) fn backends() -> Result<(), Failure> {
    // Names of devices and drivers come from elsewhere.
    let mut out = Shown(stdout().lock());
    for info in hushed(cloth::backends) {
        let precisions: Vec<String> = info.precisions.iter().map(ToString::to_string).collect();
        writeln!(out, "{}: {}, precision {}", info.name, info.device, precisions.join(" or "))?;
        for (name, value) in &info.details {
            writeln!(out, "  {name}: {value}")?;
        }
        #[cfg(feature = "wgpu")]
        if info.name == "wgpu" {
            adapters(&mut out)?;
        }
    }
    for (name, error) in hushed(cloth::backends_missing) {
        writeln!(out, "{name}: not on this machine: {error}")?;
    }
    for name in cloth::backends_absent() {
        writeln!(out, "{name}: not in this build; the Cargo feature `{name}` adds it")?;
    }
    Ok(())
}

/// The GPUs that `--adapter` can name.
#[cfg(feature = "wgpu")]
fn adapters(out: &mut impl Write) -> Result<(), Failure> {
    for adapter in hushed(cloth::wgpu::adapters) {
        let cloth::wgpu::AdapterDescription { number, name, interface, kind, .. } = &adapter;
        writeln!(
            out,
            "  adapter {number}: {name}, {kind}, {interface}, driver {}",
            adapter.driver
        )?;
        writeln!(
            out,
            "    limits: {} for each buffer, {} buffers for each kernel, {} particles",
            bytes_text(adapter.buffer_limit),
            adapter.buffer_count_limit,
            number_text(adapter.particle_limit as f64)
        )?;
    }
    Ok(())
}
