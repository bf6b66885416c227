//! Which device: the best one that can run the pass, or the one that was asked for by name or number.

use std::fmt;
use std::str::FromStr;

use ash::vk;

use super::error::{RasterError, Tried as _};
use super::instance::Instance;

/// Which Vulkan device to take.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The first suitable one, discrete before integrated before virtual before software.
    #[default]
    Best,
    /// The one at this place of [`raster_devices`](super::raster_devices).
    Index(usize),
    /// The first one whose name contains this, in any case of letters.
    Name(String),
}

/// What kind of device it is, from the most to the least preferred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A graphics card.
    Discrete,
    /// Graphics in the processor.
    Integrated,
    /// A device lent by a host.
    Virtual,
    /// Software, such as lavapipe.
    Software,
    /// None of these.
    Other,
}

/// A device as reports name it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: DeviceKind,
    /// Its driver's name and version.
    pub driver: String,
    /// The Vulkan version that it offers.
    pub api_version: [u32; 3],
    /// What it lacks for the raster pass; `None` if it can run it.
    pub lacks: Option<String>,
}

/// A physical device that was looked at.
pub(super) struct Candidate {
    pub raw: vk::PhysicalDevice,
    pub info: DeviceInfo,
    pub limits: vk::PhysicalDeviceLimits,
    pub queue_family: u32,
    /// Whether indices may use all 32 bits.
    pub wide_indices: bool,
}

impl FromStr for DeviceChoice {
    type Err = std::convert::Infallible;

    /// A number is an index, anything else a part of a name; nothing at all is [`DeviceChoice::Best`].
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let text = text.trim();
        Ok(match text.parse() {
            Ok(index) => Self::Index(index),
            Err(_) if text.is_empty() => Self::Best,
            Err(_) => Self::Name(text.to_string()),
        })
    }
}

impl fmt::Display for DeviceInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [major, minor, patch] = self.api_version;
        write!(f, "{} ({}, Vulkan {major}.{minor}.{patch})", self.name, self.driver)
    }
}

/// Every device that the instance knows.
pub(super) fn candidates(instance: &Instance) -> Result<Vec<Candidate>, RasterError> {
    // SAFETY: the instance lives.
    let devices = unsafe { instance.raw.enumerate_physical_devices() }.tried("list the machine's devices")?;
    Ok(devices.into_iter().map(|raw| Candidate::new(instance, raw)).collect())
}

/// The device that the choice means.
pub(super) fn chosen(candidates: Vec<Candidate>, choice: &DeviceChoice) -> Result<Candidate, RasterError> {
    if candidates.is_empty() {
        return Err(RasterError::NoDriver { problem: "the loader lists no device".into() });
    }
    let list = |with: fn(&DeviceInfo) -> String| {
        let names = candidates.iter().enumerate();
        names.map(|(index, c)| format!("{index} {}", with(&c.info))).collect::<Vec<_>>().join(", ")
    };
    let missing =
        |wanted: String| Err(RasterError::NoSuchDevice { wanted, found: list(|info| info.name.clone()) });
    let index = match choice {
        DeviceChoice::Best => {
            let suitable = candidates.iter().enumerate().filter(|(_, c)| c.info.lacks.is_none());
            match suitable.min_by_key(|(_, c)| c.info.kind) {
                Some((index, _)) => index,
                None => {
                    let problem =
                        list(|info| format!("{} {}", info.name, info.lacks.as_deref().unwrap_or("")));
                    return Err(RasterError::NoSuitableDevice { problem });
                }
            }
        }
        DeviceChoice::Index(index) if *index < candidates.len() => *index,
        DeviceChoice::Index(index) => return missing(index.to_string()),
        DeviceChoice::Name(name) => {
            let wanted = name.to_lowercase();
            match candidates.iter().position(|c| c.info.name.to_lowercase().contains(&wanted)) {
                Some(index) => index,
                None => return missing(format!("\"{name}\"")),
            }
        }
    };
    let mut candidates = candidates;
    let candidate = candidates.swap_remove(index);
    match candidate.info.lacks.clone() {
        Some(lacks) => Err(RasterError::Unsuitable { name: candidate.info.name, lacks }),
        None => Ok(candidate),
    }
}

impl Candidate {
    fn new(instance: &Instance, raw: vk::PhysicalDevice) -> Self {
        // SAFETY: the device is one of the instance's.
        let (properties, features, families, depth_format) = unsafe {
            (
                instance.raw.get_physical_device_properties(raw),
                instance.raw.get_physical_device_features(raw),
                instance.raw.get_physical_device_queue_family_properties(raw),
                instance.raw.get_physical_device_format_properties(raw, vk::Format::D32_SFLOAT),
            )
        };
        let version = properties.api_version;
        let has_1_3 = version >= vk::API_VERSION_1_3;
        let depth_use =
            vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT | vk::FormatFeatureFlags::TRANSFER_SRC;
        let family = families.iter().position(|family| {
            family.queue_count > 0 && family.queue_flags.contains(vk::QueueFlags::GRAPHICS)
        });
        let lacks = if !has_1_3 {
            Some("has no Vulkan 1.3")
        } else if features.depth_clamp == vk::FALSE {
            Some("cannot clamp depth")
        } else if !depth_format.optimal_tiling_features.contains(depth_use) {
            Some("has no readable 32-bit depth")
        } else if family.is_none() {
            Some("has no graphics queue")
        } else {
            None
        };
        let name = properties.device_name_as_c_str().unwrap_or_default().to_string_lossy().into_owned();
        let info = DeviceInfo {
            name,
            kind: match properties.device_type {
                vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
                vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
                vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
                vk::PhysicalDeviceType::CPU => DeviceKind::Software,
                _ => DeviceKind::Other,
            },
            driver: if has_1_3 { driver_of(instance, raw) } else { "an older driver".into() },
            api_version: [
                vk::api_version_major(version),
                vk::api_version_minor(version),
                vk::api_version_patch(version),
            ],
            lacks: lacks.map(str::to_string),
        };
        Self {
            raw,
            info,
            limits: properties.limits,
            queue_family: family.unwrap_or(0) as u32,
            wide_indices: features.full_draw_index_uint32 == vk::TRUE,
        }
    }
}

/// Name and version of the driver of a device of Vulkan 1.2 or later.
fn driver_of(instance: &Instance, raw: vk::PhysicalDevice) -> String {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
    // SAFETY: the device is one of the instance's; the chain lives on this stack.
    unsafe { instance.raw.get_physical_device_properties2(raw, &mut properties) };
    let text = |c: Result<&std::ffi::CStr, _>| -> String {
        c.map(|c: &std::ffi::CStr| c.to_string_lossy().into_owned())
            .unwrap_or_else(|_: std::ffi::FromBytesUntilNulError| String::new())
    };
    let (name, version) = (text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str()));
    format!("{name} {version}").trim().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(name: &str, kind: DeviceKind, lacks: Option<&str>) -> Candidate {
        Candidate {
            raw: vk::PhysicalDevice::null(),
            info: DeviceInfo {
                name: name.into(),
                kind,
                driver: "driver 1.0".into(),
                api_version: [1, 3, 0],
                lacks: lacks.map(str::to_string),
            },
            limits: vk::PhysicalDeviceLimits::default(),
            queue_family: 0,
            wide_indices: true,
        }
    }

    fn machine() -> Vec<Candidate> {
        vec![
            candidate("llvmpipe (LLVM)", DeviceKind::Software, None),
            candidate("Old Card", DeviceKind::Discrete, Some("has no Vulkan 1.3")),
            candidate("Chip Graphics", DeviceKind::Integrated, None),
        ]
    }

    fn pick(choice: &str) -> Result<String, String> {
        let choice = choice.parse().unwrap();
        chosen(machine(), &choice).map(|c| c.info.name).map_err(|error| error.to_string())
    }

    #[test]
    fn the_best_device_is_the_first_suitable_one_of_the_best_kind() {
        assert_eq!(pick(""), Ok("Chip Graphics".into()));
        assert_eq!(pick("0"), Ok("llvmpipe (LLVM)".into()));
        assert_eq!(pick("LLVMPIPE"), Ok("llvmpipe (LLVM)".into()));
    }

    #[test]
    fn a_device_that_is_not_there_or_not_able_is_named_with_those_that_are() {
        let missing = pick("7").unwrap_err();
        assert!(missing.contains('7') && missing.contains("2 Chip Graphics"), "{missing}");
        assert!(pick("voodoo").unwrap_err().contains("\"voodoo\""));
        assert!(pick("1").unwrap_err().contains("Old Card has no Vulkan 1.3"));
        let old = vec![candidate("Old Card", DeviceKind::Discrete, Some("has no Vulkan 1.3"))];
        let error = chosen(old, &DeviceChoice::Best).err().unwrap();
        assert!(error.is_missing_driver() && error.to_string().contains("apt-get install"), "{error}");
        let error = chosen(Vec::new(), &DeviceChoice::Best).err().unwrap();
        assert!(error.is_missing_driver() && !error.to_string().contains('\n'), "{error}");
    }
}
