//! Compiles the kernels of the historical ladder for the architectures that are tested or sold today; needs NVRTC, but no GPU.

use cloth::Error;
use cloth_benches::ladder;

/// Ampere, Hopper, Blackwell.
const ARCHITECTURES: [&str; 3] = ["sm_80", "sm_90", "sm_120"];

fn main() -> Result<(), Error> {
    for architecture in ARCHITECTURES {
        let count = ladder::kernels_compile(architecture)?;
        println!("ladder: {count} files compile for {architecture}");
    }
    Ok(())
}
