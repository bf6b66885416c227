//! The limits that all readers of scene files share.

use glam::DVec3;

use crate::error::{Checked, Fault};

/// Most triangles of one scene, instances included. A scene at the limit takes 1.2 GB for its indices; a file of a
/// few kilobytes can ask for any number through instancing, so there must be one.
pub const MAX_TRIANGLES: u64 = 100_000_000;

/// Most vertices of one scene: 2.4 GB of positions, and every index fits a `u32`.
pub const MAX_POSITIONS: u64 = 100_000_000;

/// Most particles of one scene, and most vertices of its strands: 1.2 GB each.
pub const MAX_OCCLUDERS: u64 = 30_000_000;

/// Largest coordinate of a vertex \[world units\], either sign. Beyond it products of two edges leave the range of
/// the f32 acceleration structures, and f64 resolves no more than a tenth of a unit anyway.
pub const MAX_COORDINATE: f64 = 1e15;

/// The place's position if it is finite and not absurdly far away.
pub(crate) fn checked_position(p_world: DVec3, place: impl Fn() -> String) -> Checked<DVec3> {
    if p_world.abs().max_element() <= MAX_COORDINATE && p_world.is_finite() {
        return Ok(p_world);
    }
    let [x, y, z] = p_world.to_array();
    let problem = if p_world.is_finite() {
        format!("the vertex ({x:e}, {y:e}, {z:e}) is farther than {MAX_COORDINATE:e} units from the origin")
    } else {
        format!("the vertex ({x}, {y}, {z}) is not finite")
    };
    Err(Fault::invalid(place(), problem, "export the mesh with finite coordinates of a sane size"))
}

/// Refuses a scene that would grow beyond the limits.
pub(crate) fn checked_counts(place: impl Fn() -> String, triangles: u64, positions: u64) -> Checked<()> {
    let (count, what, limit) = if triangles > MAX_TRIANGLES {
        (triangles, "triangles", MAX_TRIANGLES)
    } else if positions > MAX_POSITIONS {
        (positions, "vertices", MAX_POSITIONS)
    } else {
        return Ok(());
    };
    let problem = format!("the scene has {count} {what} or more, the limit is {limit}");
    Err(Fault::too_large(place(), problem, "simplify it, or use fewer instances"))
}

/// Refuses a scene whose particles, or the vertices of its strands, would grow beyond the limit.
pub(crate) fn checked_occluders(place: impl Fn() -> String, count: u64) -> Checked<()> {
    if count <= MAX_OCCLUDERS {
        return Ok(());
    }
    let problem =
        format!("the scene has {count} particles or strand vertices or more, the limit is {MAX_OCCLUDERS}");
    Err(Fault::too_large(place(), problem, "thin it out, or use fewer instances"))
}
