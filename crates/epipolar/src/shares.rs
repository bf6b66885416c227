//! Where slices leave what they found: the share of each pixel's unoccluded light.
//!
//! Slices are integrated side by side on several threads and meet pixels in no order of memory. Every pixel is written
//! once a frame, by the one task that owns its gap: relaxed stores of f32 bits cost what plain stores cost, need no
//! lock and no `unsafe`, and leave the same bits for any number of threads.

use std::sync::atomic::{AtomicU32, Ordering};

/// One slot a pixel and channel. A slot is empty before it is written and after it was taken.
#[derive(Debug, Default)]
pub struct Shares {
    slots: Vec<AtomicU32>,
    pixels: usize,
}

/// An empty slot, and a pixel that is left to be walked; shares are ≥ 0.
pub const EMPTY: f32 = -1.0;

impl Shares {
    /// Room for `pixels` pixels with one or three channels; all slots empty.
    pub fn resize(&mut self, pixels: usize, channels: usize) {
        let count = pixels * channels;
        if self.pixels != pixels || self.slots.len() != count {
            self.slots.clear();
            self.slots.resize_with(count, || AtomicU32::new(EMPTY.to_bits()));
            self.pixels = pixels;
        }
    }

    /// Writes the share of a pixel.
    #[inline(always)]
    pub fn put(&self, pixel: usize, channel: usize, share: f32) {
        self.slots[channel * self.pixels + pixel].store(share.to_bits(), Ordering::Relaxed);
    }

    /// The share of a pixel, and empties its slot; `None` if no slice has written it.
    #[inline(always)]
    pub fn take(&self, pixel: usize, channel: usize) -> Option<f32> {
        let slot = &self.slots[channel * self.pixels + pixel];
        let share = f32::from_bits(slot.load(Ordering::Relaxed));
        slot.store(EMPTY.to_bits(), Ordering::Relaxed);
        (share >= 0.0).then_some(share)
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * self.slots.capacity()
    }
}
