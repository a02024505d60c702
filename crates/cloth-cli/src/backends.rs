//! `cloth backends`.

use std::io::{Write, stdout};

use cloth::wgpu::AdapterDescription;

use crate::{
    failure::Failure,
    units::{bytes_text, number_text},
};

pub(crate) fn backends() -> Result<(), Failure> {
    let mut out = stdout().lock();
    for info in cloth::backends() {
        let precisions: Vec<String> = info.precisions.iter().map(ToString::to_string).collect();
        writeln!(out, "{}: {}, precision {}", info.name, info.device, precisions.join(" or "))?;
        for (name, value) in &info.details {
            writeln!(out, "  {name}: {value}")?;
        }
        if info.name == "wgpu" {
            adapters(&mut out)?;
        }
    }
    for (name, error) in cloth::backends_missing() {
        writeln!(out, "{name}: not on this machine: {error}")?;
    }
    Ok(())
}

/// The GPUs that `--adapter` can name.
fn adapters(out: &mut impl Write) -> Result<(), Failure> {
    for adapter in cloth::wgpu::adapters() {
        let AdapterDescription { number, name, interface, kind, .. } = &adapter;
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
