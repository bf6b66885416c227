//! How large the buffers of `epipolar` are: bounds that follow from the image's size, the spacing and the maps alone.

use scatter_core::MapProjection;

use super::factor_tables::TERMS;
use super::records::{COLUMNS, EpipolarUniform, MOST_BANDS, SliceData, SliceLine, SliceTask};
use crate::plan::{MOST_BINDING_BYTES, TooLarge};

/// Bytes of the buffers: of any frame of the size, wherever its epipole is, so that none grows while a camera moves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Room {
    /// Slices.
    pub slices: u64,
    /// Their lines.
    pub lines: u64,
    /// Rows of a batch.
    pub rows: u64,
    /// Tasks.
    pub tasks: u64,
    /// Pixels of fans' columns.
    pub ranges: u64,
    /// Tables of factors.
    pub nodes: u64,
    /// Answers.
    pub answers: u64,
    /// Uniforms of the batches.
    pub uniforms: u64,
    /// Most batches.
    pub batches: u64,
}

/// Bytes of a run: its start and who sees it.
pub(super) const RUN_BYTES: u64 = 8;

/// Runs beyond two a texel column that a row has room for: so many a column of the slice, for surfaces that pass from one view ray
/// to the next within a texel. What is more is not cut so finely, and counted.
pub(super) const CUTS_A_COLUMN: u32 = 2;

/// And as many in any row: a coarse map beside a small image cuts each of its few texels at most columns.
pub(super) const CUTS_A_ROW: u32 = 256;

/// Slices of a frame at the most: more than any preset asks for up to 8192² pixels, but for views of nearly half of all directions,
/// whose slices cost more than their pixels' own rays.
const MOST_SLICES: u64 = 1 << 17;

/// Most fans of a frame.
const MOST_FANS: usize = 12;

impl Room {
    /// Of frames of a size under a light's maps, with slices so many pixels apart; or what is too large of them.
    pub(super) fn of(
        size: [u32; 2],
        maps: &[MapProjection],
        (spacing, batch_bytes): (f64, u64),
        (channels, nodes): (u32, u64),
    ) -> Result<Self, TooLarge> {
        let [width, height] = size.map(u64::from);
        let longest = width.max(height);
        let bytes = |count: u64, size: usize| (count * size as u64).max(16);
        let mut room = Room {
            answers: bytes(width * height * u64::from(channels), 4),
            uniforms: bytes(1, size_of::<EpipolarUniform>()),
            ..Room::default()
        };
        if !maps.is_empty() {
            let sides = 2.0 * (width + height) as f64 / spacing;
            let slices = sides.ceil() as u64 + 4 * MOST_FANS as u64;
            if slices > MOST_SLICES {
                return Err(TooLarge {
                    what: "the image",
                    needed: slices,
                    unit: "epipolar slices",
                    limit: MOST_SLICES,
                    cure: "give a coarser spacing, fewer slices a radian, or a narrower view",
                });
            }
            // Cascades cut each other into two stretches each at the most.
            let lines = 2 * maps.len() as u64;
            let texels: u64 =
                maps.iter().map(|map| u64::from(*map.size().iter().max().unwrap_or(&0)) + 4).sum();
            let row = 4 + u64::from(CUTS_A_ROW) + u64::from(CUTS_A_COLUMN) * longest + 2 * texels + lines;
            let tasks = slices * (longest.div_ceil(COLUMNS.into()) + 2 * MOST_BANDS as u64);
            let batch = (batch_bytes / RUN_BYTES).max(2 * row);
            let batches = if slices * row <= batch {
                1
            } else {
                (slices * row).div_ceil(batch.saturating_sub(row).max(1))
            };
            room = Room {
                slices: bytes(slices, size_of::<SliceData>()),
                lines: bytes(slices * lines, size_of::<SliceLine>()),
                rows: bytes((slices * row).min(batch), RUN_BYTES as usize),
                tasks: bytes(tasks, size_of::<SliceTask>()),
                ranges: bytes(MOST_FANS as u64 * longest, 8),
                nodes: bytes(nodes, 4 * TERMS),
                uniforms: bytes(batches, size_of::<EpipolarUniform>()),
                batches,
                ..room
            };
        }
        for (what, needed) in [
            ("the slices of the image", room.slices.max(room.lines).max(room.tasks)),
            ("the answers of the slices", room.answers),
            ("the uniforms of the batches of slices", room.uniforms),
        ] {
            if needed > MOST_BINDING_BYTES {
                return Err(TooLarge {
                    what,
                    needed,
                    unit: "bytes",
                    limit: MOST_BINDING_BYTES,
                    cure: "give a smaller image, a coarser spacing, or a narrower view",
                });
            }
        }
        Ok(room)
    }

    /// How close slices of a picture may stand \[pixels\], for there are at most [`MOST_SLICES`].
    pub(super) fn closest_slices([width, height]: [u32; 2]) -> f64 {
        2.0 * (f64::from(width) + f64::from(height)) / (MOST_SLICES - 1 - 4 * MOST_FANS as u64) as f64
    }

    /// Bytes of all of them.
    pub fn bytes(&self) -> u64 {
        let Self { slices, lines, rows, tasks, ranges, nodes, answers, uniforms, batches: _ } = *self;
        slices + lines + rows + tasks + ranges + nodes + answers + uniforms
    }
}
