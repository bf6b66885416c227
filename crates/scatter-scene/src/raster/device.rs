//! The logical device with its one queue: records commands, submits them and waits.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;

use super::choice::{Candidate, DeviceChoice, DeviceInfo, candidates, chosen};
use super::error::{RasterError, Tried as _};
use super::instance::Instance;

/// How to open a device.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RasterOptions {
    /// Which device.
    pub device: DeviceChoice,
    /// Whether the validation layer checks every call, where it is installed: for tests, at a price.
    pub validate: bool,
}

/// A Vulkan device, opened. Clones share it.
#[derive(Clone)]
pub struct RasterDevice(pub(super) Arc<Device>);

/// The devices of this machine, suitable or not, as [`DeviceChoice::Index`] counts them.
pub fn raster_devices() -> Result<Vec<DeviceInfo>, RasterError> {
    let instance = Instance::new(false)?;
    Ok(candidates(&instance)?.into_iter().map(|candidate| candidate.info).collect())
}

impl RasterDevice {
    /// Opens the loader, the instance and the device.
    pub fn open(options: &RasterOptions) -> Result<Self, RasterError> {
        let instance = Instance::new(options.validate)?;
        let candidate = chosen(candidates(&instance)?, &options.device)?;
        Ok(Self(Arc::new(Device::new(instance, candidate)?)))
    }

    /// What it is.
    pub fn info(&self) -> &DeviceInfo {
        &self.0.info
    }

    /// Texels along a side of the largest map.
    pub fn largest_map(&self) -> u32 {
        self.0.largest_map
    }

    /// Whether the validation layer is installed and checks this device's calls.
    pub fn validates(&self) -> bool {
        self.0.instance.validates()
    }

    /// What the validation layer has said so far, a line a message.
    pub fn validation_messages(&self) -> Vec<String> {
        self.0.instance.messages()
    }
}

impl fmt::Debug for RasterDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("RasterDevice").field(&self.0.info).finish()
    }
}

pub(super) struct Device {
    pub raw: ash::Device,
    pub memory: vk::PhysicalDeviceMemoryProperties,
    /// Largest number of vertices that an index may name.
    pub largest_index: u32,
    /// Texels along a side of the largest map.
    pub largest_map: u32,
    /// Most bytes that a shader can see of one buffer.
    pub largest_storage: u32,
    /// Step of the grid that vertices are moved to \[texels\].
    pub grid: f64,
    info: DeviceInfo,
    queue: Mutex<Queue>,
    /// Dropped after the device that was made from it.
    instance: Instance,
}

/// The queue with what one submission at a time needs.
struct Queue {
    raw: vk::Queue,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
}

/// Nanoseconds after which the device counts as hung: a 16384² map in software takes seconds.
const PATIENCE_NS: u64 = 120_000_000_000;

impl Device {
    fn new(instance: Instance, candidate: Candidate) -> Result<Self, RasterError> {
        let Candidate { raw: physical, info, limits, queue_family, wide_indices } = candidate;
        let priorities = [1.0];
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(queue_family)
            .queue_priorities(&priorities)];
        let features =
            vk::PhysicalDeviceFeatures::default().depth_clamp(true).full_draw_index_uint32(wide_indices);
        let mut features_1_3 =
            vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true).synchronization2(true);
        let create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_features(&features)
            .push_next(&mut features_1_3);
        // SAFETY: the physical device is the instance's; Vulkan 1.3 has both features, and the others were asked for.
        let (raw, memory) = unsafe {
            (
                instance.raw.create_device(physical, &create, None).tried("open the device")?,
                instance.raw.get_physical_device_memory_properties(physical),
            )
        };
        let largest_map = limits
            .max_image_dimension2_d
            .min(limits.max_framebuffer_width)
            .min(limits.max_framebuffer_height)
            .min(limits.max_viewport_dimensions[0])
            .min(limits.max_viewport_dimensions[1]);
        // SAFETY: the device has one queue of this family.
        let queue = unsafe { raw.get_device_queue(queue_family, 0) };
        let empty = Queue {
            raw: queue,
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
        };
        let device = Self {
            raw,
            memory,
            largest_index: if wide_indices { u32::MAX } else { limits.max_draw_indexed_index_value },
            largest_map,
            largest_storage: limits.max_storage_buffer_range,
            grid: 0.5f64.powi(limits.sub_pixel_precision_bits.min(i32::MAX as u32) as i32),
            info,
            queue: Mutex::new(empty),
            instance,
        };
        // From here on dropping the device destroys what is there; null handles may be destroyed.
        device.lock().fill(&device.raw, queue_family)?;
        Ok(device)
    }

    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Records commands, submits them and waits until they are done. `record` gets a buffer in the recording state.
    pub fn run(&self, record: impl FnOnce(&ash::Device, vk::CommandBuffer)) -> Result<(), RasterError> {
        let queue = self.lock();
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the lock is held, so nobody else uses the command buffer, and every earlier submission was waited
        // for; beginning resets it, which its pool allows.
        unsafe { self.raw.begin_command_buffer(queue.commands, &begin) }.tried("record commands")?;
        record(&self.raw, queue.commands);
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(queue.commands)];
        let submits = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
        let fences = [queue.fence];
        // SAFETY: the command buffer is in the recording state; the fence is unsignalled or reset here; the lock
        // serialises the queue. All that the commands use is borrowed by `record`'s caller until this returns.
        unsafe {
            self.raw.end_command_buffer(queue.commands).tried("record commands")?;
            self.raw.reset_fences(&fences).tried("reset a fence")?;
            self.raw.queue_submit2(queue.raw, &submits, queue.fence).tried("submit commands")?;
            let waited = self.raw.wait_for_fences(&fences, true, PATIENCE_NS).tried("wait for the device");
            if waited.is_err() {
                // What the commands use is freed next: nothing may run any more. A lost device returns at once.
                let _ = self.raw.device_wait_idle();
            }
            waited
        }
    }

    /// The best memory type among `allowed` bits that has `needed`, with `preferred` if there is one.
    pub fn memory_type(
        &self,
        allowed: u32,
        needed: vk::MemoryPropertyFlags,
        preferred: vk::MemoryPropertyFlags,
    ) -> Option<u32> {
        let types = self.memory.memory_types_as_slice();
        let find = |flags: vk::MemoryPropertyFlags| {
            (0..types.len() as u32).find(|&index| {
                allowed & (1 << index) != 0 && types[index as usize].property_flags.contains(flags)
            })
        };
        find(needed | preferred).or_else(|| find(needed))
    }
}

impl Queue {
    fn fill(&mut self, device: &ash::Device, family: u32) -> Result<(), RasterError> {
        let pool = vk::CommandPoolCreateInfo::default()
            .queue_family_index(family)
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
        // SAFETY: the device lives, and has this queue family.
        self.pool = unsafe { device.create_command_pool(&pool, None) }.tried("create a command pool")?;
        let commands =
            vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        // SAFETY: the pool is the device's.
        let commands =
            unsafe { device.allocate_command_buffers(&commands) }.tried("create a command buffer")?;
        self.commands = commands.first().copied().unwrap_or_default();
        // SAFETY: the device lives.
        self.fence =
            unsafe { device.create_fence(&vk::FenceCreateInfo::default(), None) }.tried("create a fence")?;
        Ok(())
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        let queue = self.queue.get_mut().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: buffers, images and pipelines hold the device in an Arc, so none is left; every submission was
        // waited for; the pool frees its command buffer; null handles are ignored.
        unsafe {
            self.raw.destroy_fence(queue.fence, None);
            self.raw.destroy_command_pool(queue.pool, None);
            self.raw.destroy_device(None);
        }
    }
}
