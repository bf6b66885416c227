// Every pixel's own ray through the trees of the light's maps: lit runs, each integrated in closed form.
//
//     until the end of the ray:  the first layer that contains the point; none: lit up to the next layer
//         block <- that of the start, at the level where rays enter
//         until the ray leaves the layer:
//             the ray is before the nearest depth of the block: lit;  behind the farthest: dark;  else a level down
//             a texel: split where the ray crosses its depth
//             go to the next block, by its index; a level up where that is another parent's
//
// Cells advance by integers, and the other axis' index is clamped to the block that is left and never turns back: a ray
// cannot stall. Every loop is bounded; what a bound would cut off stays dark, and is counted in `status`.

@group(0) @binding(2) var<storage, read> nodes: array<vec2<f32>>;
// Rays cut short; with `count_looks` also nodes, texels and lit runs.
@group(0) @binding(8) var<storage, read_write> status: array<atomic<u32>, 4>;

override count_looks: bool = false;

// The level where rays enter a tree: coarser nodes of real maps are neither light nor dark.
const ENTRY: u32 = 6u;
const MOST_LAYERS: u32 = 16u;
const NO_LAYER: u32 = 16u;
// Blocks of one layer at most, for a map of 16384 texels a side.
const MOST_BLOCKS: u32 = 262144u;

// The ray of this pixel, and what it has added up.
struct Walk {
    light: vec3<f32>,
    // The run that may go on.
    lit: vec2<f32>,
    runs: u32,
    looked: vec2<u32>,
    is_cut: bool,
}

var<private> walk: Walk;
var<private> ray: Ray;
// The pixel relative to the reference pixel.
var<private> place: vec2<f32>;
var<private> fog: FogAlong;
var<private> lamp: LampAlong;

// Ends the run: where coloured glass stands before the light, pieces of one colour each.
fn end_run() {
    if !(walk.lit.y > walk.lit.x) {
        return;
    }
    walk.runs += 1u;
    let has_glass = has(frame.kinds.w, FRAME_GLASS);
    let start = affine(frame.glass.start, place);
    let step = affine(frame.glass.step, place);
    let w = select(vec2<f32>(1.0, 0.0), vec2<f32>(start.z, step.z), has(frame.glass.place.w, LAYER_PERSPECTIVE));
    let size = vec2<u32>(frame.glass.size.xy);
    let columns = axis_of(start.x, step.x, w, 0, size.x);
    let rows = axis_of(start.y, step.y, w, 0, size.y);
    var part = vec2<f32>(FARTHEST, FARTHEST);
    if has_glass {
        part = part_inside(columns, rows, walk.lit.y, 0.0);
    }
    var s = walk.lit.x;
    var piece_start = s;
    // None yet.
    var colour = vec3<f32>(-1.0);
    var cell = vec2<i32>(-1, -1);
    for (var n = 0u; n < MOST_BLOCKS; n++) {
        var next = walk.lit.y;
        var here = vec3<f32>(1.0);
        if s < part.x {
            next = min(next, part.x);
        } else if s < part.y {
            if cell.x < 0 {
                let clear = clear_of_lamp(columns, rows, s, part.y);
                cell = vec2<i32>(texel_at(columns, clear), texel_at(rows, clear));
            }
            let rgb = textureLoad(glass_texture, cell, 0).xyz;
            here = vec3<f32>(finite_texel(rgb.x), finite_texel(rgb.y), finite_texel(rgb.z));
            let column_end = border(columns, cell.x, 0u);
            let row_end = border(rows, cell.y, 0u);
            next = min(max(min(column_end, row_end), s), min(next, part.y));
            if row_end < column_end {
                cell.y = next_border(rows, cell.y, 0u) - select(0, 1, rows.heading < 0);
            } else {
                cell.x = next_border(columns, cell.x, 0u) - select(0, 1, columns.heading < 0);
            }
            // Off the glass all is white again.
            if any(cell < vec2<i32>(0)) || any(cell >= vec2<i32>(size)) {
                part.y = next;
            }
        }
        let is_over = s >= walk.lit.y;
        if is_over || any(here != colour) {
            if s > piece_start {
                let a = piece_start * ray.stretch;
                let b = s * ray.stretch;
                if frame.kinds.z == LIGHT_SUN {
                    walk.light += colour * sun_interval(fog, a, b);
                } else {
                    walk.light += colour * lamp_interval(lamp, a, b);
                }
            }
            piece_start = s;
            colour = here;
        }
        if is_over {
            return;
        }
        s = next;
    }
    walk.is_cut = true;
}

fn add_lit(a: f32, b: f32) {
    if b > a {
        if a != walk.lit.y {
            end_run();
            walk.lit.x = a;
        }
        walk.lit.y = b;
    }
}

// One image axis of a ray: the coordinate is (place + s step) / (w + s w_step), of which `heading` is the sign of the slope.
struct Axis {
    place: f32,
    step: f32,
    w: vec2<f32>,
    heading: i32,
    origin: i32,
    count: i32,
    // Below this w, close to a lamp, rounding is worth a texel: numerator and denominator cancel alike. Occluders as near to the
    // lamp, 5e-7 of the camera's distance a texel of the map's side, are seen through the texel where the ray is clear of it.
    least: f32,
}

// Roundings of a coordinate's numerator, relative to its terms: affine in the pixel, and once more in s.
const ROUNDINGS: f32 = 2.5e-7;

// Where the slope is but the rounding of its two products (a ray that stays on a border; drivers that fuse one of the products
// leave one), either sign will do: the borders that it names lie where w is below `least`.
fn axis_of(place: f32, step: f32, w: vec2<f32>, origin: i32, count: u32) -> Axis {
    let slope = step * w.x - place * w.y;
    let heading = select(0, 1, slope > 0.0) - select(0, 1, slope < 0.0);
    return Axis(place, step, w, heading, origin, i32(count), 2.0 * ROUNDINGS * f32(count) * abs(w.x));
}

// The first point from s on, if not after s_to, that is clear of the lamp: indices found there are off by a texel at most.
fn clear_of_lamp(columns: Axis, rows: Axis, s: f32, s_to: f32) -> f32 {
    let w = columns.w;
    let clear = (max(columns.least, rows.least) - w.x) / select(w.y, 1.0, w.y <= 0.0);
    return select(s, min(max(s, clear), s_to), w.y > 0.0);
}

fn coordinate(axis: Axis, s: f32) -> f32 {
    return (axis.place + axis.step * s) / max(axis.w.x + axis.w.y * s, 1e-30);
}

// The texel at s; on a border that the ray enters downwards, the one below.
fn texel_at(axis: Axis, s: f32) -> i32 {
    let at = clamp(coordinate(axis, s), -1e9, 1e9);
    let whole = floor(at);
    let below = select(0, 1, axis.heading < 0 && at == whole);
    return clamp(i32(whole) - below + axis.origin, 0, axis.count - 1);
}

// The border behind which the ray is in the next block, as the first texel beyond it.
fn next_border(axis: Axis, index: i32, level: u32) -> i32 {
    return ((index >> level) + select(0, 1, axis.heading > 0)) << level;
}

// Where the ray leaves its block; FARTHEST where it never does.
fn border(axis: Axis, index: i32, level: u32) -> f32 {
    let k = f32(next_border(axis, index, level) - axis.origin);
    let below = k * axis.w.y - axis.step;
    let s = (axis.place - k * axis.w.x) / select(below, 1.0, below == 0.0);
    // A perspective ray may never reach a border before infinity: the solution then lies behind the lamp.
    let is_there = axis.heading != 0 && below != 0.0 && axis.w.x + axis.w.y * s > axis.least && abs(s) < FARTHEST;
    return select(FARTHEST, s, is_there);
}

// The index at s, inside of the block and not behind where it was.
fn follow(axis: Axis, index: i32, s: f32, level: u32) -> i32 {
    let first = (index >> level) << level;
    let last = min(first + (1 << level) - 1, axis.count - 1);
    let now = clamp(i32(floor(clamp(coordinate(axis, s), -1e9, 1e9))) + axis.origin, first, last);
    return select(select(min(now, index), max(now, index), axis.heading > 0), index, axis.heading == 0);
}

// What the point of a ray is in a layer: affine in the pixel's place.
fn affine(rows: array<vec4<f32>, 3>, at: vec2<f32>) -> vec3<f32> {
    return rows[0].xyz + rows[1].xyz * at.x + rows[2].xyz * at.y;
}

// The part of [0, s_end] of a ray inside of a map's rectangle and before a lamp; empty: both ends at FARTHEST. With `slack`
// the rectangle is wider by what its sides are rounded by: faces of a cube then overlap and leave no ray between them.
fn part_inside(columns: Axis, rows: Axis, s_end: f32, slack: f32) -> vec2<f32> {
    var part = vec2<f32>(0.0, s_end);
    for (var side = 0u; side < 5u; side++) {
        // Linear in s: >= 0 inside.
        var value = columns.w;
        var terms = abs(columns.w);
        if side < 4u {
            let is_row = side >= 2u;
            let low = f32(-select(columns.origin, rows.origin, is_row));
            let count = f32(select(columns.count, rows.count, is_row));
            let at = select(vec2<f32>(columns.place, columns.step), vec2<f32>(rows.place, rows.step), is_row);
            value = select(at - low * columns.w, (low + count) * columns.w - at, (side & 1u) == 1u);
            terms = abs(at) + count * abs(columns.w);
        }
        value += slack * terms;
        if value.y == 0.0 {
            // Texels are half-open: on the left and the upper border a ray is inside.
            if value.x < 0.0 || (value.x == 0.0 && (side & 1u) == 1u) || (side == 4u && value.x == 0.0) {
                part = vec2<f32>(FARTHEST, FARTHEST);
            }
        } else {
            let s = clamp(-value.x / value.y, -FARTHEST, FARTHEST);
            part = select(vec2<f32>(part.x, min(part.y, s)), vec2<f32>(max(part.x, s), part.y), value.y > 0.0);
        }
    }
    return select(vec2<f32>(FARTHEST, FARTHEST), part, part.x < part.y);
}

fn part_of_layer(layer: u32, s_end: f32) -> vec2<f32> {
    let start = affine(tree_layers[layer].start, place);
    let step = affine(tree_layers[layer].step, place);
    let w = select(vec2<f32>(1.0, 0.0), vec2<f32>(start.z, step.z), tree_layers[layer].perspective != 0u);
    let origin = tree_layers[layer].origin;
    let size = tree_layers[layer].size;
    let slack = select(0.0, ROUNDINGS, frame.kinds.y == MAPS_FACES);
    let columns = axis_of(start.x, step.x, w, origin.x, size.x);
    return part_inside(columns, axis_of(start.y, step.y, w, origin.y, size.y), s_end, slack);
}

fn node_of(layer: u32, level: u32, i: i32, j: i32) -> vec2<f32> {
    return nodes[tree_layers[layer].offsets[level] + (u32(j) >> level) * blocks_of(layer, level).x + (u32(i) >> level)];
}

// Adds what is lit of the part [s_from, s_to] of a ray, which lies inside of the layer; all of it where that is NO_LAYER.
// It calls `add_lit`, into which drivers inline the integrals of lamps, in one place only.
fn walk_layer(layer: u32, s_from: f32, s_to: f32) {
    // What is read of no layer is not used.
    let read = min(layer, MOST_LAYERS - 1u);
    let start = affine(tree_layers[read].start, place);
    let step = affine(tree_layers[read].step, place);
    let is_perspective = tree_layers[read].perspective != 0u;
    let w = select(vec2<f32>(1.0, 0.0), vec2<f32>(start.z, step.z), is_perspective);
    let size = tree_layers[read].size;
    var columns = axis_of(start.x, step.x, w, tree_layers[read].origin.x, size.x);
    var rows = axis_of(start.y, step.y, w, tree_layers[read].origin.y, size.y);
    let coarsest = tree_layers[read].coarsest;
    let clear = clear_of_lamp(columns, rows, s_from, s_to);
    var i = texel_at(columns, clear);
    var j = texel_at(rows, clear);
    var s = s_from;
    var depth = start.z + step.z * s;
    var level = min(ENTRY, coarsest);
    for (var n = 0u; n < MOST_BLOCKS; n++) {
        let column_end = border(columns, i, level);
        let row_end = border(rows, j, level);
        let by_rows = row_end < column_end;
        // A border may be rounded to just before the point where the ray is: the stretch is then empty.
        let end = min(max(min(column_end, row_end), s), s_to);
        let end_depth = start.z + step.z * end;
        // The lit stretch of the block, empty where it is dark.
        var lit = vec2<f32>(s, s);
        if layer == NO_LAYER {
            lit.y = s_to;
        } else if level == 0u {
            walk.looked.y += 1u;
            let surface = stored_depth(layer, vec2<i32>(i, j));
            let crossing = (surface - start.z) / select(step.z, 1.0, step.z == 0.0);
            if surface >= FARTHEST {
                lit.y = end;
            } else if step.z > 0.0 {
                lit.y = min(end, crossing);
            } else if step.z < 0.0 {
                lit = vec2<f32>(max(s, crossing), end);
            } else if start.z <= surface {
                lit.y = end;
            }
        } else {
            walk.looked.x += 1u;
            let node = node_of(layer, level, i, j);
            if max(depth, end_depth) <= node.x || node.x >= FARTHEST {
                lit.y = end;
            } else if min(depth, end_depth) <= node.y {
                level = select(level - 1u, 0u, level == FINEST);
                continue;
            }
        }
        add_lit(lit.x, lit.y);
        if layer == NO_LAYER || !(end < s_to) {
            return;
        }
        let before = vec2<i32>(i, j);
        if by_rows {
            j = next_border(rows, j, level) - select(0, 1, rows.heading < 0);
            i = follow(columns, i, end, level);
        } else {
            i = next_border(columns, i, level) - select(0, 1, columns.heading < 0);
            j = follow(rows, j, end, level);
        }
        // The part ends where the map does, but for rounding: what is left of it is in the texels at the border.
        if i < 0 || i >= i32(size.x) {
            columns.heading = 0;
            i = before.x;
        }
        if j < 0 || j >= i32(size.y) {
            rows.heading = 0;
            j = before.y;
        }
        s = end;
        depth = end_depth;
        let above = select(level + 1u, FINEST, level == 0u);
        if above <= coarsest && (((i ^ before.x) | (j ^ before.y)) >> above) != 0 {
            level = above;
        }
    }
    walk.is_cut = true;
}

// All of the ray, layer by layer: of the layers that contain a point the first decides.
fn walk_layers(s_end: f32) {
    var parts: array<vec2<f32>, MOST_LAYERS>;
    let count = min(frame.kinds.x, MOST_LAYERS);
    for (var n = 0u; n < count; n++) {
        parts[n] = part_of_layer(n, s_end);
    }
    var s = 0.0;
    // Each layer begins once and ends once. A last piece behind everything ends the last run.
    for (var piece = 0u; piece <= 2u * MOST_LAYERS + 1u; piece++) {
        var chosen = NO_LAYER;
        var next = s_end;
        let is_last = !(s < s_end) || piece == 2u * MOST_LAYERS + 1u;
        if is_last {
            s = 2.0 * FARTHEST;
            next = 3.0 * FARTHEST;
        } else {
            for (var n = 0u; n < count; n++) {
                let part = parts[n];
                if part.x <= s && s < part.y {
                    chosen = n;
                    next = min(next, part.y);
                    break;
                }
                if part.x > s {
                    next = min(next, part.x);
                }
            }
        }
        // Faces of a cube overlap; beside six faces that leave a gap it is dark.
        if is_last || chosen != NO_LAYER || frame.kinds.y != MAPS_FACES {
            walk_layer(chosen, s, next);
        }
        if is_last {
            break;
        }
        s = next;
    }
}

@compute @workgroup_size(8, 8)
fn traverse(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= image_size()) {
        return;
    }
    let pixel = camera_pixel(id.xy);
    ray = pixel_ray(pixel);
    fog = fog_along(ray);
    lamp = lamp_along(ray);
    let distance = ray_end(pixel);
    walk.lit = vec2<f32>(-1.0, -1.0);
    place = from_reference(pixel);
    walk_layers(distance / ray.stretch);
    var light = walk.light;
    if frame.kinds.z == LIGHT_SUN {
        light *= sun_scattering(image_direction(id.xy));
    }
    write_pixel(id.xy, light * frame.strength.xyz, transmittance_to(fog, distance), distance);

    if walk.is_cut {
        atomicAdd(&status[0], 1u);
    }
    if count_looks {
        atomicAdd(&status[1], walk.looked.x);
        atomicAdd(&status[2], walk.looked.y);
        atomicAdd(&status[3], walk.runs);
    }
}
