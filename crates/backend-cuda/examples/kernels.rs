//! Compiles every kernel for the architectures that are tested or sold today; needs NVRTC, but no GPU. With `--all` that is done with
//! every set of options on each of them, which takes minutes.

use cloth_backend_cuda::{KernelSets, kernels_compile};
use cloth_core::Error;

/// Hopper, which kernels are measured on; Ampere and Blackwell.
const ARCHITECTURES: [(&str, KernelSets); 3] =
    [("sm_90", KernelSets::Pairs), ("sm_80", KernelSets::Plain), ("sm_120", KernelSets::Plain)];

fn main() -> Result<(), Error> {
    let is_all = std::env::args().any(|argument| argument == "--all");
    for (architecture, sets) in ARCHITECTURES {
        let sets = if is_all { KernelSets::All } else { sets };
        let count = kernels_compile(architecture, sets)?;
        println!("cuda: {count} variants of modules compile for {architecture}");
    }
    Ok(())
}
