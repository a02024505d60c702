//! What copies in the memory of a device reach: the measure of all that memory bounds.

mod cpu;
mod cuda;
mod wgpu;

pub use cpu::copy_rate_cpu;
pub use cuda::copy_rate_cuda;
pub use wgpu::copy_rate_wgpu;
