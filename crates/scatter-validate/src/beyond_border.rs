//! Depth to the right of the picture, for frames whose camera has moved there.
//!
//! A timed frame is a real one: its depth map is what its own camera sees. With the shot's depth map instead, rays end before
//! walls that they see or beyond them, and techniques work on leaks of light that no engine's frame has.

use scatter_core::{Camera, MapError, MapSource};

/// Columns to the right of a picture, row by row.
#[derive(Debug, Clone, Default)]
pub struct BeyondBorder {
    depth: Vec<f32>,
}

impl BeyondBorder {
    /// How many columns there are: so many timed frames differ.
    pub const COLUMNS: u32 = 16;

    /// What a camera sees there.
    pub fn of(source: &dyn MapSource, camera: &Camera) -> Result<Self, MapError> {
        let mut depth = Vec::new();
        source.depth_map(&camera.of_columns(camera.size()[0] as i32, Self::COLUMNS), &mut depth)?;
        Ok(Self { depth })
    }

    /// By how many columns the camera of timed frame number `frame` is moved: 1 to [`Self::COLUMNS`], 0 for frame 0.
    pub fn columns_of(frame: u32) -> u32 {
        if frame == 0 { 0 } else { (frame - 1) % Self::COLUMNS + 1 }
    }

    /// The depth map of the camera moved by so many columns, made of the picture's own, of `width` columns.
    pub fn moved(&self, own: &[f32], width: usize, columns: u32) -> Vec<f32> {
        let columns = columns.min(Self::COLUMNS) as usize;
        // Of a picture that is narrower than that, some of what is beyond leaves it again.
        let row = width + Self::COLUMNS as usize;
        let mut moved = Vec::with_capacity(own.len());
        for (own, beyond) in own.chunks(width).zip(self.depth.chunks(row - width)) {
            moved.extend(own.iter().chain(beyond).skip(columns).take(width));
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_move_to_the_left_and_new_ones_follow() {
        let beyond = BeyondBorder { depth: (0..32).map(|at| 100.0 + at as f32).collect() };
        let own: Vec<f32> = (0..10).map(|at| at as f32).collect();
        assert_eq!(beyond.moved(&own, 5, 0), own);
        assert_eq!(beyond.moved(&own, 5, 2), [2.0, 3.0, 4.0, 100.0, 101.0, 7.0, 8.0, 9.0, 116.0, 117.0]);
        assert_eq!(beyond.moved(&own, 5, 7)[..5], [102.0, 103.0, 104.0, 105.0, 106.0]);
        assert_eq!([0, 1, 16, 17].map(BeyondBorder::columns_of), [0, 1, 16, 1]);
    }
}
