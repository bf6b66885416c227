//! What the tests and benches of several crates need: frames to render, and images to compare.
//!
//! A frame for a test is an [`OwnedFrame`]: everything that a `Frame` borrows, open to change. It is random
//! ([`OwnedFrame::random`], of a [`Recipe`]), the same every time ([`OwnedFrame::stock`], one for each [`MapKind`]), hard
//! on epipolar slices ([`SliceCase`]) or as an engine has it ([`meadow`](fn@meadow)). [`dense`](fn@dense) samples a
//! pixel of it by the formula of MODEL.md alone; [`differing`], [`exceeding`] and [`rel_rmse`] hold an image against what
//! it should be, and say where it is not.
//!
//! For tests alone: it panics where a value is no good, is not published, and knows the model and no technique. The
//! judge of a technique (`raymarch-ref`) is named by the test that asks for it. Crates take it as a dev-dependency by
//! path, without a version, so that they can be published. `scatter-core`'s own unit tests cannot use it: there the
//! types of its frames are another build of the crate.

mod comparison;
mod dense;
mod filling;
mod meadow;
mod owned_frame;
mod random;
mod random_frame;
mod slice_case;
mod stock;

pub use comparison::{Comparison, differing, exceeding, largest_difference, rel_rmse, values};
pub use dense::{Sampled, dense};
pub use filling::Filling;
pub use meadow::{Lighting, meadow};
pub use owned_frame::{MapKind, OwnedFrame};
pub use random::Random;
pub use random_frame::{Recipe, turned_faces};
pub use slice_case::{Facing, SliceCase, Texels, slice_cases};
pub use stock::{boards, coloured_medium, grey_medium};
