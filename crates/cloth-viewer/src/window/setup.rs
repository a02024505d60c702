//! How the window and its device are made, and what is said if they cannot be.

use std::sync::Arc;

use cloth::wgpu::wgpu;
use eframe::egui_wgpu::{WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};

use super::WindowOptions;
use crate::ViewerError;

/// What brings a screen.
const MEND_DISPLAY: &str = "run it in a desktop session, or on a virtual screen (Debian: apt-get \
                            install xvfb, then xvfb-run cloth view); `cloth render` needs none";
/// What brings a driver.
const MEND_ADAPTER: &str = "install a Vulkan driver for your GPU, or the one that computes on the \
                            processor (Debian: apt-get install mesa-vulkan-drivers)";

pub(super) fn native_options(options: &WindowOptions) -> eframe::NativeOptions {
    let mut create = WgpuSetupCreateNew::without_display_handle();
    // OpenGL lacks much of what the backend needs.
    create.instance_descriptor.backends = wgpu::Backends::PRIMARY;
    create.instance_descriptor.flags = wgpu::InstanceFlags::empty();
    let wanted = options.adapter.clone();
    create.native_adapter_selector = Some(Arc::new(move |adapters, surface| {
        adapter_choose(adapters, surface, wanted.as_deref())
    }));
    create.device_descriptor = Arc::new(|adapter| wgpu::DeviceDescriptor {
        label: Some("cloth"),
        // For the times of stages.
        required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
        // All that it has, as the simulation shares it.
        required_limits: adapter.limits(),
        ..Default::default()
    });
    eframe::NativeOptions {
        viewport: eframe::egui::ViewportBuilder::default()
            .with_title(format!("cloth - {}", options.source.name()))
            .with_inner_size(options.size)
            .with_drag_and_drop(true),
        renderer: eframe::Renderer::Wgpu,
        wgpu_options: WgpuConfiguration {
            wgpu_setup: WgpuSetup::CreateNew(create),
            ..WgpuConfiguration::default()
        },
        ..eframe::NativeOptions::default()
    }
}

/// The adapter with this number or part of this name, or the best one, that can show the window.
fn adapter_choose(
    adapters: &[wgpu::Adapter],
    surface: Option<&wgpu::Surface<'_>>,
    wanted: Option<&str>,
) -> Result<wgpu::Adapter, String> {
    let is_wanted = |number: usize, adapter: &wgpu::Adapter| match wanted {
        Some(wanted) => match wanted.parse::<usize>() {
            Ok(wanted) => wanted == number,
            Err(_) => adapter.get_info().name.to_lowercase().contains(&wanted.to_lowercase()),
        },
        None => true,
    };
    let rank = |adapter: &wgpu::Adapter| match adapter.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    };
    let shows = |adapter: &wgpu::Adapter| {
        surface.is_none_or(|surface| adapter.is_surface_supported(surface))
    };
    let candidates = adapters.iter().enumerate();
    let fitting =
        candidates.filter(|(number, adapter)| is_wanted(*number, adapter) && shows(adapter));
    fitting.map(|(_, adapter)| adapter).min_by_key(|adapter| rank(adapter)).cloned().ok_or_else(
        || match wanted {
            Some(wanted) => format!("no adapter `{wanted}` can show a window"),
            None => "no adapter found".to_owned(),
        },
    )
}

/// The one line that is said.
pub(super) fn window_error(error: eframe::Error) -> ViewerError {
    let (reason, mend) = match &error {
        eframe::Error::Wgpu(error) => (error.to_string(), MEND_ADAPTER),
        error => (error.to_string(), MEND_DISPLAY),
    };
    // Systems tell it in several lines.
    let reason = reason.split_whitespace().collect::<Vec<_>>().join(" ");
    let reason = without_place(&reason).to_owned();
    ViewerError::Window { reason, mend }
}

/// `reason` without the place in the sources of a library, which names folders of whoever built it.
fn without_place(reason: &str) -> &str {
    let rest = reason.rsplit_once(".rs:").map_or(reason, |(_, rest)| rest);
    rest.trim_start_matches(|letter: char| letter.is_ascii_digit() || [':', ' '].contains(&letter))
        .trim_end_matches('.')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_name_no_sources() {
        let reason = "winit EventLoopError: os error at /home/a/.cargo/registry/src/winit-0.30/src/linux/mod.rs:765: \
                      neither WAYLAND_DISPLAY nor DISPLAY is set.";
        assert_eq!(without_place(reason), "neither WAYLAND_DISPLAY nor DISPLAY is set");
        assert_eq!(without_place("no adapter found"), "no adapter found");
    }
}
