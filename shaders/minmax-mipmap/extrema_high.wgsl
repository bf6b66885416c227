// Levels 7 and up of each layer's tree, from level 6: a workgroup a layer, which alone reads what it wrote.

@group(0) @binding(2) var<storage, read_write> nodes: array<vec2<f32>>;

@compute @workgroup_size(256)
fn extrema_high(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let layer = group.x;
    for (var level = 7u; level <= COARSEST; level++) {
        let below = blocks_of(layer, level - 1u);
        let blocks = blocks_of(layer, level);
        let count = select(0u, blocks.x * blocks.y, level <= tree_layers[layer].coarsest);
        let offset = tree_layers[layer].offsets[level - 1u];
        for (var at = thread; at < count; at += 256u) {
            let first = vec2<u32>(at % blocks.x, at / blocks.x) * 2u;
            let last = min(first + vec2<u32>(1u), below - vec2<u32>(1u));
            let a = nodes[offset + first.y * below.x + first.x];
            let b = nodes[offset + first.y * below.x + last.x];
            let c = nodes[offset + last.y * below.x + first.x];
            let d = nodes[offset + last.y * below.x + last.x];
            nodes[tree_layers[layer].offsets[level] + at] =
                vec2<f32>(min(min(a.x, b.x), min(c.x, d.x)), max(max(a.y, b.y), max(c.y, d.y)));
        }
        storageBarrier();
    }
}
