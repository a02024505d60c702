//! Finding a GPU.

use cloth_core::{Error, Result};

use crate::fault::BACKEND;

/// An adapter of this machine: a GPU through one interface, or a driver that computes on the
/// processor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterDescription {
    /// Number by which it can be chosen.
    pub number: usize,
    /// Name that the driver gives it.
    pub name: String,
    /// Interface: Vulkan, Metal or DirectX 12.
    pub interface: &'static str,
    /// Kind of device: discrete, integrated or virtual GPU, or processor.
    pub kind: &'static str,
    /// The driver and its version.
    pub driver: String,
    /// Largest buffer that a kernel can be given \[byte\].
    pub buffer_limit: u64,
    /// Storage buffers that a kernel can be given.
    pub buffer_count_limit: u32,
    /// Most particles that one dispatch can reach.
    pub particle_limit: u64,
}

/// The interfaces that are taken without being asked for. OpenGL is not among them: wgpu would fall
/// back to it in silence, and much is missing there.
const INTERFACES: wgpu::Backends = wgpu::Backends::PRIMARY;

/// How to get an adapter.
const MEND: &str = "install a Vulkan driver for your GPU, or the one that computes on the processor \
                    (Debian: apt-get install mesa-vulkan-drivers), or use --backend cpu";

fn instance(interfaces: wgpu::Backends) -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: interfaces,
        // No validation layers: they cost time and are for debugging this crate.
        flags: wgpu::InstanceFlags::empty(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    })
}

/// All adapters of this machine, in the order of their numbers; OpenGL left out.
pub async fn adapters_async() -> Vec<AdapterDescription> {
    let found = adapters_of(INTERFACES).await;
    found.iter().enumerate().map(|(number, adapter)| describe(number, adapter)).collect()
}

/// As [`adapters_async`], waiting for the answer.
#[must_use]
pub fn adapters() -> Vec<AdapterDescription> {
    pollster::block_on(adapters_async())
}

async fn adapters_of(interfaces: wgpu::Backends) -> Vec<wgpu::Adapter> {
    instance(interfaces).enumerate_adapters(interfaces).await
}

pub(crate) fn describe(number: usize, adapter: &wgpu::Adapter) -> AdapterDescription {
    let info = adapter.get_info();
    let limits = adapter.limits();
    let groups = u64::from(limits.max_compute_workgroups_per_dimension);
    AdapterDescription {
        number,
        name: info.name.clone(),
        interface: interface_name(info.backend),
        kind: kind_name(info.device_type),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        buffer_limit: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
        buffer_count_limit: limits.max_storage_buffers_per_shader_stage,
        particle_limit: (groups * groups)
            .saturating_mul(u64::from(crate::dispatch::WORKGROUP))
            .min(u64::from(u32::MAX)),
    }
}

pub(crate) const fn interface_name(backend: wgpu::Backend) -> &'static str {
    match backend {
        wgpu::Backend::Vulkan => "Vulkan",
        wgpu::Backend::Metal => "Metal",
        wgpu::Backend::Dx12 => "DirectX 12",
        wgpu::Backend::Gl => "OpenGL",
        wgpu::Backend::BrowserWebGpu => "WebGPU",
        wgpu::Backend::Noop => "none",
    }
}

pub(crate) const fn kind_name(kind: wgpu::DeviceType) -> &'static str {
    match kind {
        wgpu::DeviceType::DiscreteGpu => "discrete GPU",
        wgpu::DeviceType::IntegratedGpu => "integrated GPU",
        wgpu::DeviceType::VirtualGpu => "virtual GPU",
        wgpu::DeviceType::Cpu => "processor",
        wgpu::DeviceType::Other => "device of unknown kind",
    }
}

/// How much an adapter is to be preferred when none is asked for.
const fn rank(kind: wgpu::DeviceType) -> u32 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

/// The adapter that `choice` means: a number, part of a name, or the best there is. `gl` and
/// `gl:CHOICE` look among OpenGL adapters instead.
pub(crate) async fn adapter_choose(choice: Option<&str>) -> Result<wgpu::Adapter> {
    let (interfaces, choice) = match choice {
        Some("gl") => (wgpu::Backends::GL, None),
        Some(choice) => match choice.strip_prefix("gl:") {
            Some(rest) => (wgpu::Backends::GL, Some(rest)),
            None => (INTERFACES, Some(choice)),
        },
        None => (INTERFACES, None),
    };
    let found = adapters_of(interfaces).await;
    let names: Vec<String> = found.iter().map(|adapter| adapter.get_info().name).collect();
    match choose(&names, choice) {
        Ok(Some(number)) => Ok(found.into_iter().nth(number)),
        // The first one of the best kind.
        Ok(None) => {
            Ok(found.into_iter().min_by_key(|adapter| rank(adapter.get_info().device_type)))
        }
        Err(reason) => Err(reason),
    }
    .and_then(|adapter| adapter.ok_or_else(|| format!("no adapter found; {MEND}")))
    .map_err(|reason| Error::NoDevice { backend: BACKEND, reason })
}

/// The number of the adapter that is meant, `None` for any.
fn choose(names: &[String], choice: Option<&str>) -> std::result::Result<Option<usize>, String> {
    let Some(choice) = choice.filter(|_| !names.is_empty()) else { return Ok(None) };
    let found = match choice.parse::<usize>() {
        Ok(number) => (number < names.len()).then_some(number),
        Err(_) => {
            let wanted = choice.to_lowercase();
            names.iter().position(|name| name.to_lowercase().contains(&wanted))
        }
    };
    found.map(Some).ok_or_else(|| {
        let there: Vec<String> =
            names.iter().enumerate().map(|(number, name)| format!("{number} ({name})")).collect();
        format!("there is no adapter `{choice}`; there are: {}", there.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adapters_are_chosen_by_number_or_part_of_the_name() {
        let names = ["NVIDIA H200".to_owned(), "llvmpipe (LLVM 15)".to_owned()];
        assert_eq!(choose(&names, None), Ok(None));
        assert_eq!(choose(&names, Some("1")), Ok(Some(1)));
        assert_eq!(choose(&names, Some("h200")), Ok(Some(0)));
        let message = choose(&names, Some("7")).unwrap_err();
        assert_eq!(
            message,
            "there is no adapter `7`; there are: 0 (NVIDIA H200), 1 (llvmpipe (LLVM 15))"
        );
        assert!(choose(&names, Some("radeon")).is_err());
        assert_eq!(choose(&[], Some("radeon")), Ok(None), "the lack of any adapter comes first");
    }
}
