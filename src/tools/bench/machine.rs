//! Build and memory of the process, without which a figure is worth nothing.

use serde::{Deserialize, Serialize};

/// Build of the program.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Build {
    /// Version of the package.
    pub version: String,
    /// `RELIEF_COMMIT` as it was when this was compiled: the commit, where the build says so.
    pub commit: Option<String>,
    /// `release` or `debug`.
    pub profile: String,
    /// Architecture and operating system.
    pub target: String,
    /// Features of the processor that the compiler could use beyond the architecture's base.
    pub target_features: Vec<String>,
}

impl Build {
    /// This one.
    pub fn this() -> Self {
        let mut target_features = Vec::new();
        let mut feature = |name: &str, enabled| {
            if enabled {
                target_features.push(name.to_owned());
            }
        };
        feature("sse4.2", cfg!(target_feature = "sse4.2"));
        feature("avx2", cfg!(target_feature = "avx2"));
        feature("fma", cfg!(target_feature = "fma"));
        feature("avx512f", cfg!(target_feature = "avx512f"));
        feature("neon", cfg!(target_feature = "neon"));
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            commit: option_env!("RELIEF_COMMIT").map(Into::into),
            profile: if cfg!(debug_assertions) { "debug" } else { "release" }.into(),
            target: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
            target_features,
        }
    }
}

/// The most memory of this process that was ever resident, megabytes of 2²⁰ bytes; `None` where the operating system
/// has no /proc.
pub fn peak_memory_mb() -> Option<f64> {
    memory_mb("VmHWM")
}

/// A figure of this process's memory by its name in proc(5), such as `VmRSS` for what is resident: megabytes of 2²⁰
/// bytes; `None` where the operating system has no /proc.
pub fn memory_mb(name: &str) -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
    line.trim().trim_end_matches("kB").trim().parse().ok().map(|kilobytes: f64| kilobytes / 1024.0)
}
