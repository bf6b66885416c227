//! The model of volumetric shadows: what every technique of Scatter reads, computes and returns.
//!
//! A frame flows through these modules in the order in which they stand here. An engine describes what it has
//! ([`Camera`], [`DepthMap`], [`Light`] with its [`ShadowMap`], [`Medium`]) and puts it into a [`Frame`]; a technique
//! behind [`VolumetricShadow`] fills a [`ScatterImage`]. In between lie the closed forms of one lit interval, which
//! all techniques share, and the [`SceneFacts`] that tell them what a scene does not need.

mod clip_rows;
mod clip_space;

mod camera;
mod camera_matrices;
mod clip_depth;
mod depth_map;
mod depth_quotient;
mod fog_ray;
mod height_falloff;
mod light;
mod map_projection;
mod medium;
mod phase;
mod shadow_depth;
mod shadow_map;
mod texel_walk;
mod translucent_segment;

mod cube_faces;
mod kinds;
mod map_layout;
mod map_source;
mod setup;
mod translucent;

mod fog_facts;
mod frame;
mod scene_facts;

mod capabilities;

mod dimmed_interval;
mod fog_lamp;
mod fog_lanes;
mod lamp_interval;
mod lamp_interval_f32;
mod lamp_panels;
mod light_integral_f32;
mod ray_light;
mod sun_integral_f32;
mod sun_interval;

pub mod parallel;
mod ray_fan;
mod ray_lanes;
mod ray_layers;
mod simd;
mod translucent_capture;
mod walked_radiance;

mod option_table;
mod quality;

mod estimate;
mod machine;
mod scene_sample;

mod technique;

mod modelled;
mod render_stats;
mod scatter_image;

mod error;
mod render_error;

#[cfg(test)]
mod engine_matrices;

pub use camera::{Camera, Projection, ViewRay, Window};
pub use capabilities::{Capabilities, Limits};
pub use clip_space::ClipSpace;
pub use depth_map::{DepthEncoding, DepthMap};
pub use depth_quotient::{DepthQuotient, ShadowDepthQuotient};
pub use error::ModelError;
pub use estimate::{Estimate, NoEstimate, Outlook, PredictedError};
#[doc(no_inline)]
pub use fearless_simd;
pub use fog_lanes::FogLanes;
pub use fog_ray::FogRay;
pub use frame::Frame;
pub use height_falloff::HeightFalloff;
pub use kinds::{CameraKind, ExtinctionKind, Kind, LightKind, MapKind, PhaseKind};
pub use lamp_interval::{LampIntegral, LampRay, airlight};
pub use lamp_interval_f32::LampIntegralF32;
pub use light::{DirectionalLight, Light, LightTexture, PointLight, SpotLight};
pub use light_integral_f32::LightIntegralF32;
pub use machine::{CostModel, Machine, TechniqueSpeed, UnitCost};
pub use map_layout::{MAX_CASCADES, MapLayout};
pub use map_projection::{MapProjection, MapRay, cube_face_of};
pub use map_source::{MapError, MapSource};
pub use medium::{Medium, Scattering};
pub use option_table::{
    Choice, NO_OPTIONS, OptionError, OptionInfo, OptionList, OptionRange, OptionRow, OptionTable, OptionValue,
};
pub use phase::{INV_4PI, Phase};
pub use quality::{Quality, Target};
pub use ray_fan::{AffineInPixel, MapFan, RayFan};
pub use ray_lanes::{RayLanes, write_pixels};
pub use ray_layers::{LayerPiece, layer_pieces, lit_part, lit_stretches};
pub use ray_light::RayLight;
pub use render_error::{RenderError, Unsupported};
pub use render_stats::{NamedList, RenderStats, STATS_CAPACITY, StageClock};
pub use scatter_image::ScatterImage;
pub use scene_facts::SceneFacts;
pub use scene_sample::{SampledRay, SceneSample, Triple};
pub use setup::Setup;
pub use shadow_depth::ShadowDepthEncoding;
pub use shadow_map::{CubeShadow, ShadowLayer, ShadowMap};
pub use simd::{Level, simd_level};
pub use sun_integral_f32::{SunIntegralF32, transmittances_f32, transmittances_of_pixels_f32};
pub use sun_interval::{exp_f32, sun_interval, sun_interval_f32};
pub use technique::{Configurable, MemoryBound, Rounding, Technique, TechniqueInfo, VolumetricShadow};
pub use texel_walk::{TexelSpan, TexelWalk};
pub use translucent::{Translucent, TranslucentLayer, TranslucentSource};
pub use translucent_capture::TranslucentCapture;
pub use translucent_segment::TranslucentSegment;
pub use walked_radiance::{walked_beyond, walked_radiance};
