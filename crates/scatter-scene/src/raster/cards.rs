//! A scene's cut-outs on the device: their corners with texture coordinates, and the masks' bits that fragments read.

use std::sync::Arc;

use ash::vk;

use super::device::Device;
use super::error::{RasterError, Tried as _};
use super::memory::Buffer;
use super::mesh::upload;
use super::pass::split;
use super::pipeline::CardVertex;
use crate::caster::SceneCaster;
use crate::cutout::Wrap;

/// The cut-outs of a scene, ready to be drawn.
pub(super) struct Cards {
    vertices: Buffer,
    words: Buffer,
    count: u32,
    pool: vk::DescriptorPool,
    /// The masks' bits, for the fragment stage. Lives in the pool.
    set: vk::DescriptorSet,
    device: Arc<Device>,
}

impl Cards {
    /// Uploads the caster's cut-outs; `None` for a scene without any. `layout` is the pipelines'.
    pub fn new(
        device: &Arc<Device>,
        layout: vk::DescriptorSetLayout,
        caster: &SceneCaster,
    ) -> Result<Option<Self>, RasterError> {
        let cards = caster.cards();
        if cards.is_empty() {
            return Ok(None);
        }
        let (mut words, mut masks) = (Vec::new(), Vec::new());
        for mask in cards.masks() {
            let [columns, rows] = mask.size();
            let wraps = mask.wrap().map(|wrap| match wrap {
                Wrap::Repeat => 0,
                Wrap::MirroredRepeat => 1,
                Wrap::ClampToEdge => 2,
            });
            masks.push([words.len() as u32, columns, rows, wraps[0] | wraps[1] << 2]);
            words.extend(mask.blocks().iter().flat_map(|block| [*block as u32, (*block >> 32) as u32]));
        }
        let (bytes, limit) = (words.len() as u64 * 4, u64::from(device.largest_storage));
        if bytes > limit {
            return Err(RasterError::MasksTooLarge { bytes, limit });
        }
        let list: Vec<(u32, _)> = cards.iter().collect();
        // At most 3·2³⁰ corners: the caster takes 2³⁰ triangles.
        let count = 3 * list.len();
        let centre = caster.bvh().centre;
        let usage = vk::BufferUsageFlags::VERTEX_BUFFER;
        let vertices =
            upload(device, "the scene's cut-outs", usage, count, |start, out: &mut [CardVertex]| {
                for (index, out) in (start..).zip(out) {
                    let (triangle, card) = list[index / 3];
                    let [high, low] = split(caster.corners(triangle)[index % 3] - centre);
                    let texel = card.texels[index % 3].as_vec2().to_array();
                    *out = CardVertex { high, low, texel, mask: masks[card.mask as usize] };
                }
            })?;
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let words = upload(device, "the scene's masks", usage, words.len(), |start, out: &mut [u32]| {
            out.copy_from_slice(&words[start..][..out.len()]);
        })?;
        let sizes =
            [vk::DescriptorPoolSize::default().ty(vk::DescriptorType::STORAGE_BUFFER).descriptor_count(1)];
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: the device lives, and the info is complete.
        let pool =
            unsafe { device.raw.create_descriptor_pool(&info, None) }.tried("create a descriptor pool")?;
        // From here on dropping it frees the pool.
        let set = vk::DescriptorSet::null();
        let mut cards = Self { vertices, words, count: count as u32, pool, set, device: device.clone() };
        cards.bind(layout)?;
        Ok(Some(cards))
    }

    fn bind(&mut self, layout: vk::DescriptorSetLayout) -> Result<(), RasterError> {
        let layouts = [layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.pool).set_layouts(&layouts);
        // SAFETY: pool and layout are this device's, and the pool has room for one set.
        let sets = unsafe { self.device.raw.allocate_descriptor_sets(&info) }.tried("bind the masks")?;
        self.set = sets.first().copied().unwrap_or_default();
        let buffers = [vk::DescriptorBufferInfo::default().buffer(self.words.raw).range(vk::WHOLE_SIZE)];
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .buffer_info(&buffers);
        // SAFETY: the set is this device's and in no submission; the buffer lives as long as it does.
        unsafe { self.device.raw.update_descriptor_sets(&[write], &[]) };
        Ok(())
    }

    /// Corners to draw.
    pub fn vertices(&self) -> (vk::Buffer, u32) {
        (self.vertices.raw, self.count)
    }

    /// The masks' bits.
    pub fn set(&self) -> vk::DescriptorSet {
        self.set
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        self.vertices.bytes + self.words.bytes
    }
}

impl Drop for Cards {
    fn drop(&mut self) {
        // SAFETY: the pool is its own, and every submission that used its set was waited for.
        unsafe { self.device.raw.destroy_descriptor_pool(self.pool, None) };
    }
}
