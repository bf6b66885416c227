//! Where slices leave what they found: the share of each pixel's unoccluded light.
//!
//! Slices are integrated side by side on several threads and meet pixels in no order of memory. Every pixel is written
//! once a frame, by the one task that owns its gap: relaxed stores of f32 bits cost what plain stores cost, need no
//! lock and no `unsafe`, and leave the same bits for any number of threads.

use std::sync::atomic::{AtomicU32, Ordering};

/// Shares of the unoccluded light, `[channel][pixel]`: one slot each, [`EMPTY`] until it is written, from any thread.
#[derive(Debug, Default)]
pub struct Shares {
    slots: Vec<AtomicU32>,
    pixels: usize,
}

/// An empty slot, and a pixel that is left to be walked; shares are ≥ 0.
pub const EMPTY: f32 = -1.0;

impl Shares {
    /// Room for `pixels` pixels with one or three channels; all slots empty.
    pub fn clear(&mut self, pixels: usize, channels: usize) {
        self.pixels = pixels;
        self.slots.resize_with(pixels * channels, AtomicU32::default);
        for slot in &mut self.slots {
            *slot.get_mut() = EMPTY.to_bits();
        }
    }

    /// Writes the share of a pixel.
    #[inline(always)]
    pub fn put(&self, pixel: usize, channel: usize, share: f32) {
        self.slots[channel * self.pixels + pixel].store(share.to_bits(), Ordering::Relaxed);
    }

    /// The shares of the pixels from `first` on; negative where no slice has written one.
    #[inline(always)]
    pub fn read(&self, first: usize, channel: usize, out: &mut [f32]) {
        let from = channel * self.pixels + first;
        for (share, slot) in out.iter_mut().zip(&self.slots[from..]) {
            *share = f32::from_bits(slot.load(Ordering::Relaxed));
        }
    }

    /// The share of a pixel; negative where no slice has written one.
    #[inline(always)]
    pub fn get(&self, pixel: usize, channel: usize) -> f32 {
        f32::from_bits(self.slots[channel * self.pixels + pixel].load(Ordering::Relaxed))
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * self.slots.capacity()
    }
}
