//! A command that shows no window asks no display for anything, and neither does what it loads.
//!
//! Mesa's Vulkan layer that sorts adapters (`VK_LAYER_MESA_device_select`) asks Wayland and X11 on its own wherever an
//! instance could draw to a window, and every instance of wgpu could. It goes by the environment, which no program can
//! change safely while it runs: so this one is started anew in its own place, with another.

use crate::commands::common::process::Process;
use std::ffi::OsString;

/// Variables that name a display.
#[cfg(all(unix, not(target_vendor = "apple")))]
const DISPLAYS: [&str; 3] = ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"];

/// Switches Mesa's layer off; adapters are sorted here.
#[cfg(all(unix, not(target_vendor = "apple")))]
const NO_LAYER: &str = "NODEVICE_SELECT";

/// Tells if there may be a display to show a window on.
#[cfg(all(unix, not(target_vendor = "apple")))]
pub fn may_exist() -> bool {
    DISPLAYS.iter().any(|name| std::env::var_os(name).is_some_and(|value| !value.is_empty()))
}

/// Elsewhere displays have no names in the environment.
#[cfg(not(all(unix, not(target_vendor = "apple"))))]
pub fn may_exist() -> bool {
    true
}

/// Takes the process's place with one that knows of no display, unless it knows of none as it is. Where that fails,
/// goes on.
#[cfg(all(unix, not(target_vendor = "apple")))]
pub fn forget(process: &Process, arguments: &[OsString]) {
    use std::os::unix::process::CommandExt;
    let is_set = |name: &&str| std::env::var_os(name).is_some();
    // Where the layer is told to choose a device it is kept: it asks no display then.
    let keeps_layer = ["MESA_VK_DEVICE_SELECT", "DRI_PRIME"].iter().any(is_set);
    if !DISPLAYS.iter().any(is_set) && (keeps_layer || is_set(&NO_LAYER)) {
        return;
    }
    let Some(mut anew) = process.anew() else { return };
    anew.args(arguments);
    DISPLAYS.iter().for_each(|name| _ = anew.env_remove(name));
    if !keeps_layer {
        anew.env(NO_LAYER, "1");
    }
    let error = anew.exec();
    tracing::debug!("started with what names displays: {error}");
}

/// Nothing to forget.
#[cfg(not(all(unix, not(target_vendor = "apple"))))]
pub fn forget(_process: &Process, _arguments: &[OsString]) {}
