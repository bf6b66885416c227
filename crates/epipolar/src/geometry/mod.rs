//! Which half-planes a frame is cut into, and which pixel lies between which two of them; no texel is read here.
//!
//! [`Epipole`] → [`SliceSet`] (lines through it, in fans) → [`FanPixels`] (the pixels of a fan, column by column) →
//! [`SlicePlane`] (one half-plane in rectified coordinates) with its [`ColumnOrder`] (from the light on).

mod column_order;
mod diamond_angle;
mod epipole;
mod fan_pixels;
mod locate;
mod slice_plane;
mod slices;

pub use column_order::ColumnOrder;
pub use diamond_angle::{diamond_angle, direction_of_diamond_angle};
pub use epipole::{Epipole, STEEPEST};
pub use fan_pixels::FanPixels;
pub use locate::{PixelPlace, SliceMap};
pub use slice_plane::{SlicePlane, SliceRecord};
pub use slices::{Fan, Major, Slice, SliceSet};
