//! The machine and the build that a table was measured with.

use scatter_scene::RasterDevice;
use serde::Serialize;

/// Where a measurement ran, and what it was built with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// The processor's name, as the system tells it.
    pub cpu: String,
    /// Logical cores that this process may use.
    pub cores: usize,
    /// Operating system and architecture.
    pub os: String,
    /// Compiler.
    pub rustc: String,
    /// Widest vector instructions that the processor has, or `baseline` where they are switched off.
    pub simd: String,
    /// Version of this project.
    pub version: String,
    /// Vulkan device and driver, where they drew the maps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vulkan: Option<String>,
}

impl Machine {
    /// This machine and this build.
    pub fn this() -> Self {
        Self {
            cpu: cpu_name().unwrap_or_else(|| "unknown processor".into()),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            os: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            rustc: env!("SCATTER_RUSTC_VERSION").into(),
            simd: simd_level().into(),
            version: env!("CARGO_PKG_VERSION").into(),
            vulkan: None,
        }
    }

    /// The same machine with the device that draws its maps, if one does.
    pub fn drawing_on(self, device: Option<&RasterDevice>) -> Self {
        Self { vulkan: device.map(|device| device.info().to_string()), ..self }
    }
}

impl std::fmt::Display for Machine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { cpu, cores, os, rustc, simd, version, vulkan } = self;
        write!(f, "{cpu}, {cores} cores, {simd}, {os}, {rustc}, scatter {version}")?;
        vulkan.as_ref().map_or(Ok(()), |device| write!(f, ", maps by raster on {device}"))
    }
}

/// Linux says it in a file; elsewhere the environment may (Windows), or nobody does.
fn cpu_name() -> Option<String> {
    let from_proc = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name") || line.starts_with("Model"))?;
        Some(line.split_once(':')?.1.trim().to_string())
    });
    from_proc.or_else(|| std::env::var("PROCESSOR_IDENTIFIER").ok()).filter(|name| !name.is_empty())
}

/// What [`scatter_core::simd_level`] chooses.
fn simd_level() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        let level = scatter_core::simd_level();
        if level.as_avx512().is_some() {
            "avx512"
        } else if level.as_avx2().is_some() {
            "avx2"
        } else {
            "baseline"
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        if std::env::var_os("SCATTER_SIMD").is_some_and(|value| value == "baseline") {
            "baseline"
        } else if cfg!(target_arch = "aarch64") {
            "neon"
        } else {
            "portable"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_field_says_something() {
        let machine = Machine::this();
        assert!(machine.cores >= 1 && machine.rustc.starts_with("rustc"), "{machine}");
        assert!(!machine.cpu.is_empty() && !machine.simd.is_empty());
    }
}
