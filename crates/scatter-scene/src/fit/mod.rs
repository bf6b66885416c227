//! Where a shot's shadow map looks: the projection that holds all that matters for the image, and little else.
//!
//! Sun: the bounding rectangle, in light space, of all view rays up to their ends, each cut to the rectangle of the
//! scene (a point beside it is shadowed by nothing). The near plane lies before the whole scene, so occluders behind
//! the camera count. Its sides lie on a coarse grid, so that one pixel's rounding moves no texel. Cascades: the same for
//! stretches of the rays (`cascades.rs`). Spot: square, twice the outer angle; wider than 80° and point lights: six cube faces.

mod cascades;
mod light_rectangle;
mod sun_space;

use scatter_core::{Camera, DepthMap, Light, MapProjection, ModelError};

use self::cascades::fit_cascades;
use self::sun_space::{SunSpace, View, across};
use crate::caster::SceneCaster;
use crate::map_resolution::MapResolution;

/// Projections of a light's shadow maps, fitted for a shot.
#[derive(Debug, Clone, PartialEq)]
pub enum FittedMap {
    /// A sun's parallel map.
    Orthographic(MapProjection),
    /// A spot's perspective map.
    Perspective(MapProjection),
    /// Six faces around a lamp.
    Cube {
        /// Where the lamp is.
        position: [f64; 3],
        /// Texels along an edge.
        size: u32,
    },
    /// A sun's parallel maps, from the nearest stretch of the view to the farthest.
    Cascades(Vec<MapProjection>),
}

/// Half angle \[radians\] from which on a spot has cube faces: 80° (MODEL.md, Conventions).
const WIDEST_PERSPECTIVE: f64 = 80.0 * std::f64::consts::PI / 180.0;
/// Share by which a spot's map is wider than its cone: its edge, where the light is 0 anyway, lies inside of the
/// outermost texels in spite of all rounding, and no texel becomes larger by more than that.
const SPOT_SLACK: f64 = 1e-6;

/// The projection for a light, or those of a sun's cascades. `depth` holds the first surfaces that the
/// camera sees; `max_distance` is where the other rays end.
pub fn fit_map(
    caster: &SceneCaster,
    camera: &Camera,
    depth: DepthMap<'_>,
    light: &Light,
    max_distance: f64,
    resolution: MapResolution,
) -> Result<FittedMap, ModelError> {
    let MapResolution { side: size, cascades } = resolution.checked()?;
    match light {
        Light::Directional(sun) if cascades > 1 => {
            let view = View { camera, depth, max_distance };
            fit_cascades(caster, &view, sun.direction(), size, cascades).map(FittedMap::Cascades)
        }
        Light::Directional(sun) => {
            let space = SunSpace::new(caster, sun.direction(), across(sun.direction()));
            let seen = space.seen(&View { camera, depth, max_distance });
            space.projection(seen, size).map(FittedMap::Orthographic)
        }
        Light::Point(lamp) => Ok(FittedMap::Cube { position: lamp.position().to_array(), size }),
        Light::Spot(spot) if spot.outer() > WIDEST_PERSPECTIVE => {
            Ok(FittedMap::Cube { position: spot.lamp().position().to_array(), size })
        }
        Light::Spot(spot) => {
            let axis = spot.direction();
            MapProjection::perspective(
                spot.lamp().position().to_array(),
                axis.to_array(),
                across(axis).to_array(),
                spot.outer().tan() * (1.0 + SPOT_SLACK),
                size,
            )
            .map(FittedMap::Perspective)
        }
    }
}
