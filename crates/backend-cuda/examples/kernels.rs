//! Compiles every kernel for the architectures that are tested or sold today; needs NVRTC, but no GPU.

use cloth_core::Error;

/// Ampere, Hopper, Blackwell.
const ARCHITECTURES: [&str; 3] = ["sm_80", "sm_90", "sm_120"];

fn main() -> Result<(), Error> {
    for architecture in ARCHITECTURES {
        let count = cloth_backend_cuda::kernels_compile(architecture)?;
        println!("cuda: {count} variants of modules compile for {architecture}");
    }
    Ok(())
}
