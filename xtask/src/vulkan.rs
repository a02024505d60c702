//! Makes sure that there is a Vulkan driver, without which the wgpu backend cannot be tested.

use crate::packages;

/// The Debian packages of the driver that computes on the processor.
const PACKAGES: [&str; 2] = ["mesa-vulkan-drivers", "libvulkan1"];

/// Folders in which Linux systems list Vulkan drivers.
const DRIVER_FOLDERS: [&str; 3] =
    ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d"];

/// Installs a driver if there is none and that can be done here.
///
/// # Errors
/// The one line that installs it.
pub(crate) fn ensure() -> Result<(), String> {
    // Other systems come with Metal or DirectX.
    packages::ensure("the wgpu backend needs a Vulkan driver", &PACKAGES, is_there)
}

/// Whether the loader and a driver are there.
fn is_there() -> bool {
    // Both variables name drivers in other places.
    let named = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];
    if named.iter().any(|name| std::env::var_os(name).is_some()) {
        return true;
    }
    let has_files =
        |folder: &str| std::fs::read_dir(folder).is_ok_and(|mut files| files.next().is_some());
    DRIVER_FOLDERS.into_iter().any(has_files)
}
