//! Buffers and the depth image: each owns its memory, and frees it when dropped.

use std::sync::Arc;

use ash::vk;

use super::device::Device;
use super::error::{RasterError, Tried as _};

/// A buffer with memory of its own.
pub(super) struct Buffer {
    pub raw: vk::Buffer,
    pub bytes: u64,
    memory: vk::DeviceMemory,
    /// Where the host sees it; null if it does not.
    mapped: *mut u8,
    device: Arc<Device>,
}

// SAFETY: the mapped pointer is owned by the buffer and only used through `&self` reads and `&mut self` writes.
unsafe impl Send for Buffer {}
// SAFETY: as above; through `&self` the mapping is only read.
unsafe impl Sync for Buffer {}

/// A D32 image of one layer, with its view.
pub(super) struct DepthImage {
    pub raw: vk::Image,
    pub view: vk::ImageView,
    pub size: [u32; 2],
    memory: vk::DeviceMemory,
    device: Arc<Device>,
}

/// The whole of the depth image.
pub(super) const DEPTH_RANGE: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::DEPTH,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};

impl Buffer {
    /// Memory of the device, filled by copies.
    pub fn on_device(
        device: &Arc<Device>,
        what: &'static str,
        bytes: u64,
        usage: vk::BufferUsageFlags,
    ) -> Result<Self, RasterError> {
        let usage = usage | vk::BufferUsageFlags::TRANSFER_DST;
        let needed = vk::MemoryPropertyFlags::empty();
        Self::new(device, what, bytes, usage, needed, vk::MemoryPropertyFlags::DEVICE_LOCAL)
    }

    /// Memory that the host sees, for copies in both directions.
    pub fn on_host(device: &Arc<Device>, what: &'static str, bytes: u64) -> Result<Self, RasterError> {
        let usage = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
        let needed = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let mut buffer = Self::new(device, what, bytes, usage, needed, vk::MemoryPropertyFlags::HOST_CACHED)?;
        // SAFETY: the memory is host-visible, is the buffer's own and is mapped once; freeing it unmaps it.
        let mapped =
            unsafe { device.raw.map_memory(buffer.memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()) };
        buffer.mapped = mapped.tried("map a buffer")?.cast();
        Ok(buffer)
    }

    fn new(
        device: &Arc<Device>,
        what: &'static str,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        needed: vk::MemoryPropertyFlags,
        preferred: vk::MemoryPropertyFlags,
    ) -> Result<Self, RasterError> {
        let info = vk::BufferCreateInfo::default().size(bytes).usage(usage);
        // SAFETY: the device lives, and the size is not 0.
        let raw = unsafe { device.raw.create_buffer(&info, None) }.tried_for(what, bytes)?;
        let mut buffer = Self {
            raw,
            bytes,
            memory: vk::DeviceMemory::null(),
            mapped: std::ptr::null_mut(),
            device: device.clone(),
        };
        // SAFETY: the buffer is the device's.
        let requirements = unsafe { device.raw.get_buffer_memory_requirements(raw) };
        buffer.memory = allocate(device, what, requirements, needed, preferred)?;
        // SAFETY: the memory has a type and a size that the buffer allows, and is used for nothing else.
        unsafe { device.raw.bind_buffer_memory(raw, buffer.memory, 0) }.tried_for(what, bytes)?;
        Ok(buffer)
    }

    /// What the host sees; empty for a buffer on the device.
    pub fn bytes(&self) -> &[u8] {
        if self.mapped.is_null() {
            return &[];
        }
        // SAFETY: the mapping holds at least `bytes` initialised bytes (drivers hand out memory, u8 has no invalid
        // values), and the device writes only inside of `Device::run`, when nothing borrows them.
        unsafe { std::slice::from_raw_parts(self.mapped, self.bytes as usize) }
    }

    /// As [`Self::bytes`], to be written.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        if self.mapped.is_null() {
            return &mut [];
        }
        // SAFETY: as in `bytes`, and `&mut self` excludes other borrows.
        unsafe { std::slice::from_raw_parts_mut(self.mapped, self.bytes as usize) }
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: both are the buffer's own, and every submission that used them was waited for; null memory is
        // ignored.
        unsafe {
            self.device.raw.destroy_buffer(self.raw, None);
            self.device.raw.free_memory(self.memory, None);
        }
    }
}

impl DepthImage {
    /// An image of `size`, each side ≥ 1 and within the device's limits.
    pub fn new(device: &Arc<Device>, size: [u32; 2]) -> Result<Self, RasterError> {
        let what = "a depth map";
        let bytes = u64::from(size[0]) * u64::from(size[1]) * size_of::<f32>() as u64;
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(vk::Format::D32_SFLOAT)
            .extent(vk::Extent3D { width: size[0], height: size[1], depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC)
            .initial_layout(vk::ImageLayout::UNDEFINED);
        // SAFETY: the device lives; format, usage and size are within its limits.
        let raw = unsafe { device.raw.create_image(&info, None) }.tried_for(what, bytes)?;
        let mut image = Self {
            raw,
            view: vk::ImageView::null(),
            size,
            memory: vk::DeviceMemory::null(),
            device: device.clone(),
        };
        // SAFETY: the image is the device's.
        let requirements = unsafe { device.raw.get_image_memory_requirements(raw) };
        let (needed, preferred) = (vk::MemoryPropertyFlags::empty(), vk::MemoryPropertyFlags::DEVICE_LOCAL);
        image.memory = allocate(device, what, requirements, needed, preferred)?;
        // SAFETY: the memory has a type and a size that the image allows, and is used for nothing else.
        unsafe { device.raw.bind_image_memory(raw, image.memory, 0) }.tried_for(what, bytes)?;
        let view = vk::ImageViewCreateInfo::default()
            .image(raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(vk::Format::D32_SFLOAT)
            .subresource_range(DEPTH_RANGE);
        // SAFETY: the image is bound to memory, and the view is of its own format.
        image.view = unsafe { device.raw.create_image_view(&view, None) }.tried("create an image view")?;
        Ok(image)
    }
}

impl Drop for DepthImage {
    fn drop(&mut self) {
        // SAFETY: all three are the image's own, and every submission that used them was waited for; null handles
        // are ignored.
        unsafe {
            self.device.raw.destroy_image_view(self.view, None);
            self.device.raw.destroy_image(self.raw, None);
            self.device.raw.free_memory(self.memory, None);
        }
    }
}

fn allocate(
    device: &Device,
    what: &'static str,
    requirements: vk::MemoryRequirements,
    needed: vk::MemoryPropertyFlags,
    preferred: vk::MemoryPropertyFlags,
) -> Result<vk::DeviceMemory, RasterError> {
    let bytes = requirements.size;
    let out_of_memory = RasterError::OutOfMemory { what, bytes };
    let Some(index) = device.memory_type(requirements.memory_type_bits, needed, preferred) else {
        return Err(out_of_memory);
    };
    let heap = device.memory.memory_types[index as usize].heap_index as usize;
    // Software drivers promise what they have not; the layer, rightly, complains.
    if bytes > device.memory.memory_heaps[heap].size {
        return Err(out_of_memory);
    }
    let info = vk::MemoryAllocateInfo::default().allocation_size(bytes).memory_type_index(index);
    // SAFETY: the device lives, the type exists and the size is not 0.
    unsafe { device.raw.allocate_memory(&info, None) }.tried_for(what, bytes)
}
