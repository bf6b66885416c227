// The trees of the light's maps, a layer each: the mirror of `TreeLayer` (scatter-kernels, minmax/tree_layer.rs; a test
// compares the layouts).

struct TreeLayer {
    // (u, v, depth) of a pixel's ray at s = 0 and a unit of s: at the reference pixel, a column's, a row's. u and v count
    // from `origin`, so that crossings near the eye keep their digits; under a perspective map they are to be divided by
    // the depth.
    start: array<vec4<f32>, 3>,
    step: array<vec4<f32>, 3>,
    size: vec2<u32>,
    // The texel that u and v count from.
    origin: vec2<i32>,
    perspective: u32,
    coarsest: u32,
    // The first node of each level.
    offsets: array<u32, 14>,
}

@group(0) @binding(1) var<storage, read> tree_layers: array<TreeLayer>;

// Finest level: blocks of 4x4 texels. Below are the texels themselves.
const FINEST: u32 = 2u;
// Coarsest level of any map.
const COARSEST: u32 = 13u;

// Columns and rows of a level's blocks.
fn blocks_of(layer: u32, level: u32) -> vec2<u32> {
    return (tree_layers[layer].size + vec2<u32>((1u << level) - 1u)) >> vec2<u32>(level);
}
