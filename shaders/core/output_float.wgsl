// The image: in-scattered RGB and mean transmittance; RGB transmittance.
@group(0) @binding(6) var inscattered_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(7) var transmittance_out: texture_storage_2d<rgba32float, write>;

// A number that every f32 sum of such holds.
const LARGEST: f32 = 1e30;
