// Levels 2 to 6 of each layer's tree: nearest and farthest depth of blocks of 4x4 to 64x64 texels. A workgroup makes one
// block of 64x64 texels, a thread one of 4x4. Nodes beyond the map are not written, texels beyond it do not count.

@group(0) @binding(2) var<storage, read_write> nodes: array<vec2<f32>>;

var<workgroup> block_extrema: array<vec2<f32>, 256>;

fn store_node(layer: u32, level: u32, block: vec2<u32>, node: vec2<f32>) {
    let blocks = blocks_of(layer, level);
    if level <= tree_layers[layer].coarsest && block.x < blocks.x && block.y < blocks.y {
        nodes[tree_layers[layer].offsets[level] + block.y * blocks.x + block.x] = node;
    }
}

@compute @workgroup_size(16, 16)
fn extrema_low(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) thread: vec3<u32>) {
    let layer = group.z;
    let size = tree_layers[layer].size;
    let block = group.xy * 16u + thread.xy;
    var node = vec2<f32>(FARTHEST, 0.0);
    for (var n = 0u; n < 16u; n++) {
        let texel = block * 4u + vec2<u32>(n & 3u, n >> 2u);
        if texel.x < size.x && texel.y < size.y {
            let depth = stored_depth(layer, vec2<i32>(texel));
            node = vec2<f32>(min(node.x, depth), max(node.y, depth));
        }
    }
    store_node(layer, FINEST, block, node);
    let at = thread.y * 16u + thread.x;
    block_extrema[at] = node;
    for (var level = 3u; level <= 6u; level++) {
        // The blocks of the level before stand `gap` threads apart; those of this one twice as far.
        let gap = 1u << (level - 3u);
        workgroupBarrier();
        if ((thread.x | thread.y) & (2u * gap - 1u)) == 0u {
            let b = block_extrema[at + gap];
            let c = block_extrema[at + 16u * gap];
            let d = block_extrema[at + 17u * gap];
            node = vec2<f32>(min(min(node.x, b.x), min(c.x, d.x)), max(max(node.y, b.y), max(c.y, d.y)));
            block_extrema[at] = node;
            store_node(layer, level, block >> vec2<u32>(level - 2u), node);
        }
    }
}
