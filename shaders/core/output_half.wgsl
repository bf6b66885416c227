// The image: in-scattered RGB and mean transmittance; RGB transmittance.
@group(0) @binding(6) var inscattered_out: texture_storage_2d<rgba16float, write>;
@group(0) @binding(7) var transmittance_out: texture_storage_2d<rgba16float, write>;

// The largest number of the format.
const LARGEST: f32 = 65504.0;
