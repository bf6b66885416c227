//! What can go wrong with a device: each variant names the thing and the cure, in one line.

use ash::vk;
use scatter_core::ModelError;

/// Why the raster pass could not be made or did not run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RasterError {
    /// This machine has no Vulkan loader. Cure: install one.
    #[error("no Vulkan loader ({problem}); {INSTALL}")]
    NoLoader {
        /// What the system says.
        problem: String,
    },
    /// There is a loader and no driver that it could use. Cure: install one.
    #[error("no Vulkan driver ({problem}); {INSTALL}")]
    NoDriver {
        /// What the loader says.
        problem: String,
    },
    /// There are devices, and none can run the pass. Cure: another driver.
    #[error("no suitable Vulkan device ({problem}); {INSTALL}")]
    NoSuitableDevice {
        /// Each device with what it lacks.
        problem: String,
    },
    /// The device that was asked for is not there. Cure: one of those that are.
    #[error("there is no Vulkan device {wanted}; choose one of: {found}")]
    NoSuchDevice {
        /// The name or index that was asked for.
        wanted: String,
        /// The devices that there are.
        found: String,
    },
    /// The device that was asked for cannot run the pass. Cure: another one.
    #[error("the Vulkan device {name} {lacks}; choose another device")]
    Unsuitable {
        /// Its name.
        name: String,
        /// What it lacks.
        lacks: String,
    },
    /// A map beyond the device's limits. Cure: a smaller map, or ray casts.
    #[error(
        "a depth map of {width}x{height} texels is beyond the device's limit of {limit}x{limit}; choose a smaller map or ray casts"
    )]
    TooLarge {
        /// Texels a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Texels a side that the device allows.
        limit: u32,
    },
    /// A scene beyond the device's limits. Cure: ray casts.
    #[error(
        "the scene has {vertices} vertices and the device draws at most {limit}; split the scene or choose ray casts"
    )]
    SceneTooLarge {
        /// Vertices of the scene.
        vertices: usize,
        /// Vertices that an index may name.
        limit: u32,
    },
    /// The masks of the scene's cut-outs are larger than what a shader of this device can see. Cure: ray casts.
    #[error(
        "the cut-outs' masks take {bytes} bytes and the device can read {limit}; choose ray casts or smaller textures"
    )]
    MasksTooLarge {
        /// Bytes of all masks, a bit a texel.
        bytes: u64,
        /// Bytes that one buffer may have.
        limit: u64,
    },
    /// The device has no memory left. Cure: a smaller map, or ray casts.
    #[error("the device has no {bytes} bytes for {what}; choose a smaller map or ray casts")]
    OutOfMemory {
        /// What the memory is for.
        what: &'static str,
        /// How much was asked for.
        bytes: u64,
    },
    /// The host has no memory left for a map. Cure: a smaller map.
    #[error("this machine has no {bytes} bytes for a depth map; choose a smaller map")]
    OutOfHostMemory {
        /// How much was asked for.
        bytes: u64,
    },
    /// A call that failed for another reason. Cure: the driver's, mostly.
    #[error("Vulkan: cannot {action} ({code}); update the driver or choose another device")]
    Vulkan {
        /// What was tried, as a verb.
        action: &'static str,
        /// The driver's result.
        code: String,
    },
    /// A projection or a size that no map can have.
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// The cure for a machine without Vulkan, as Debian and Ubuntu have it.
const INSTALL: &str = "install a Vulkan 1.3 driver (software: apt-get install mesa-vulkan-drivers libvulkan1), or choose ray casts";

impl RasterError {
    /// Whether a machine without a usable Vulkan is the reason, rather than the request.
    pub fn is_missing_driver(&self) -> bool {
        matches!(self, Self::NoLoader { .. } | Self::NoDriver { .. } | Self::NoSuitableDevice { .. })
    }
}

/// Turns the driver's results into errors that say what was tried.
pub(super) trait Tried<T> {
    /// The error of an action, as a verb: `create the pipeline`.
    fn tried(self, action: &'static str) -> Result<T, RasterError>;
    /// The error of asking for memory.
    fn tried_for(self, what: &'static str, bytes: u64) -> Result<T, RasterError>;
}

impl<T> Tried<T> for Result<T, vk::Result> {
    fn tried(self, action: &'static str) -> Result<T, RasterError> {
        self.map_err(|code| RasterError::Vulkan { action, code: format!("{code:?}") })
    }

    fn tried_for(self, what: &'static str, bytes: u64) -> Result<T, RasterError> {
        self.map_err(|code| match code {
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY
            | vk::Result::ERROR_OUT_OF_HOST_MEMORY
            | vk::Result::ERROR_TOO_MANY_OBJECTS => RasterError::OutOfMemory { what, bytes },
            _ => RasterError::Vulkan { action: "allocate memory", code: format!("{code:?}") },
        })
    }
}
