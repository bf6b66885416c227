//! Where slices leave what they found: for each pixel the weighted answers of the two slices beside it.
//!
//! Slices are integrated side by side on several threads and meet pixels in no order of memory. Each pixel has one
//! slot for the slice before it and one for the slice behind it, written once a frame by one slice each: relaxed
//! stores of f32 bits, which cost what plain stores cost, need no lock and no `unsafe`, and leave the same bits for any
//! number of threads.

use std::sync::atomic::{AtomicU32, Ordering};

/// Two slots a pixel and channel. A slot is empty before it is written and after it was taken.
#[derive(Debug, Default)]
pub struct Planes {
    slots: Vec<AtomicU32>,
    pixels: usize,
}

/// An empty slot; shares are ≥ 0.
const EMPTY: f32 = -1.0;

impl Planes {
    /// Room for `pixels` pixels with one or three channels; all slots empty.
    pub fn resize(&mut self, pixels: usize, channels: usize) {
        let count = 2 * pixels * channels;
        if self.pixels != pixels || self.slots.len() != count {
            self.slots.clear();
            self.slots.resize_with(count, || AtomicU32::new(EMPTY.to_bits()));
            self.pixels = pixels;
        }
    }

    /// Writes one of the two answers for a pixel.
    #[inline(always)]
    pub fn put(&self, pixel: usize, channel: usize, behind: bool, share: f32) {
        let slot = (2 * channel + usize::from(behind)) * self.pixels + pixel;
        self.slots[slot].store(share.to_bits(), Ordering::Relaxed);
    }

    /// The share of a pixel, and empties its slots; `None` if a slice left it out.
    #[inline(always)]
    pub fn take(&self, pixel: usize, channel: usize) -> Option<f32> {
        let slot = |behind: usize| &self.slots[(2 * channel + behind) * self.pixels + pixel];
        let [before, behind] = [slot(0), slot(1)].map(|slot| {
            let share = f32::from_bits(slot.load(Ordering::Relaxed));
            slot.store(EMPTY.to_bits(), Ordering::Relaxed);
            share
        });
        (before >= 0.0 && behind >= 0.0).then_some(before + behind)
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * self.slots.capacity()
    }
}
