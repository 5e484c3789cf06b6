//! A command that shows no window asks no display for anything, and neither does what it loads.
//!
//! Mesa's Vulkan layer that sorts adapters (`VK_LAYER_MESA_device_select`) asks Wayland and X11 on its own wherever an
//! instance could draw to a window, and every instance of wgpu could. It goes by the environment, which no program can
//! change safely while it runs: so this one is started anew in its own place, with another.

/// Variables that name a display.
#[cfg(all(unix, not(target_vendor = "apple")))]
const DISPLAYS: [&str; 3] = ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"];

/// Switches Mesa's layer off; adapters are sorted here.
#[cfg(all(unix, not(target_vendor = "apple")))]
const NO_LAYER: &str = "NODEVICE_SELECT";

/// Whether there may be a display to show a window on.
#[cfg(all(unix, not(target_vendor = "apple")))]
pub fn may_exist() -> bool {
    DISPLAYS.iter().any(|name| std::env::var_os(name).is_some_and(|value| !value.is_empty()))
}

/// Elsewhere displays have no names in the environment.
#[cfg(not(all(unix, not(target_vendor = "apple"))))]
pub fn may_exist() -> bool {
    true
}

/// Takes the program's place with one that knows of no display, unless it knows of none as it is. Where that fails,
/// goes on.
#[cfg(all(unix, not(target_vendor = "apple")))]
pub fn forget() {
    use std::os::unix::process::CommandExt;
    let is_set = |name: &&str| std::env::var_os(name).is_some();
    // Where the layer is told to choose a device it is kept: it asks no display then.
    let keeps_layer = ["MESA_VK_DEVICE_SELECT", "DRI_PRIME"].iter().any(is_set);
    if !DISPLAYS.iter().any(is_set) && (keeps_layer || is_set(&NO_LAYER)) {
        return;
    }
    let (Ok(program), mut arguments) = (std::env::current_exe(), std::env::args_os()) else { return };
    let mut anew = std::process::Command::new(&program);
    anew.arg0(arguments.next().unwrap_or(program.into_os_string())).args(arguments);
    DISPLAYS.iter().for_each(|name| _ = anew.env_remove(name));
    if !keeps_layer {
        anew.env(NO_LAYER, "1");
    }
    let error = anew.exec();
    tracing::debug!("started with what names displays: {error}");
}

/// Nothing to forget.
#[cfg(not(all(unix, not(target_vendor = "apple"))))]
pub fn forget() {}
