// Rectified rows (Baran et al. 2010, section 3): a slice's light rays, from the eye on, as runs that end at the same view ray.
// One workgroup a slice, a texel column a thread. The CPU twin is epipolar's rows/exact_cells.rs:
//
//     for each texel that the line crosses in a texel column (one, or two with a border between them):
//         n, n' = columns that see its surface's light rays lit where the line enters and where it leaves the texel
//         a run of floor(n) columns, and where the surface passes from one view ray to the next, the next number
//
// Runs that continue the one before are dropped; a scan of the others' numbers says where each goes.

@group(0) @binding(8) var<storage, read_write> status: array<atomic<u32>, 4>;
@group(0) @binding(10) var<storage, read> slices: array<SliceData>;
@group(0) @binding(11) var<storage, read> lines: array<SliceLine>;
// Bits of gamma, columns that see the run lit.
@group(0) @binding(12) var<storage, read_write> rows_out: array<vec2<u32>>;

// Bits of the largest f32: behind every light ray.
const END: u32 = 0x7f7fffffu;

var<workgroup> scan: array<u32, 256>;
var<workgroup> last_lit: array<u32, 256>;

// Of the light ray at t; not before that of `least`, so that lines follow each other whatever is rounded between them.
fn gamma_bits(line: SliceLine, t: f32, least: u32) -> u32 {
    let gamma = min(line.gamma.x + line.gamma.y * t, FARTHEST);
    // Not the bits of -0.
    return max(select(0u, bitcast<u32>(gamma), gamma > 0.0), least);
}

// Columns, counted from the light and fractional, that see the light ray at t lit if it ends at the depth z.
fn lit_columns(line: SliceLine, t: f32, depth: f32, columns: f32) -> f32 {
    let z = depth - line.depth_base;
    let n = (line.numerator.x + z * line.numerator.z) + (line.numerator.y + z * line.numerator.w) * t;
    let d = (line.denominator.x + z * line.denominator.z) + (line.denominator.y + z * line.denominator.w) * t;
    // Behind the camera all columns see it lit, or none. Compared with the denominator, for one that should be 0 may have any
    // sign.
    if !(d > 0.0) {
        return select(columns, 0.0, n < d);
    }
    // Beyond the last column, where the quotient may leave f32.
    if n >= columns * d {
        return columns;
    }
    return clamp(n / d, 0.0, columns);
}

// Where along the line exactly so many columns see a surface lit; an end of the texel where it runs along a view ray.
fn crossing(line: SliceLine, count: f32, depth: f32, low: f32, high: f32) -> f32 {
    let z = depth - line.depth_base;
    let start = (line.numerator.x + z * line.numerator.z) - count * (line.denominator.x + z * line.denominator.z);
    let slope = (line.numerator.y + z * line.numerator.w) - count * (line.denominator.y + z * line.denominator.w);
    if abs(slope) * FARTHEST <= abs(start) {
        return low;
    }
    return clamp(-start / slope, low, high);
}

fn depth_at(line: SliceLine, major: i32, minor: f32) -> f32 {
    let width = u32(frame.maps[line.layer].size.x);
    let index = u32(major) * line.strides.x + u32(minor) * line.strides.y;
    return stored_depth(line.layer, vec2<i32>(vec2<u32>(index % width, index / width)));
}

// The one or two cells of a texel column; of one the second is empty.
struct Cells {
    borders: vec3<f32>,
    depths: vec2<f32>,
    // At both ends of both.
    lit: vec4<u32>,
}

fn cells_of(line: SliceLine, column: u32, column_count: u32) -> Cells {
    let at = f32(column) - line.consumed;
    let start = clamp(at, 0.0, line.length);
    let end = min(at + 1.0, line.length);
    let one = clamp(floor(line.minor.x + line.minor.y * start), 0.0, line.last_minor);
    let other = clamp(floor(line.minor.x + line.minor.y * end), 0.0, line.last_minor);
    let major = line.first + line.advance * i32(column);
    let columns = f32(column_count);
    var cells: Cells;
    cells.depths = vec2<f32>(depth_at(line, major, one));
    cells.borders = vec3<f32>(start, end, end);
    if one != other {
        cells.depths.y = depth_at(line, major, other);
        cells.borders.y = clamp((max(one, other) - line.minor.x) / line.minor.y, start, max(start, end));
    }
    let a = lit_columns(line, cells.borders.x, cells.depths.x, columns);
    let b = lit_columns(line, cells.borders.y, cells.depths.x, columns);
    cells.lit = vec4<u32>(u32(a), u32(b), u32(b), u32(b));
    if one != other {
        cells.lit.z = u32(lit_columns(line, cells.borders.y, cells.depths.y, columns));
        cells.lit.w = u32(lit_columns(line, cells.borders.z, cells.depths.y, columns));
    }
    return cells;
}

fn apart(a: u32, b: u32) -> u32 {
    return max(a, b) - min(a, b);
}

@compute @workgroup_size(256)
fn rows(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let number = group.x + group.y * GROUPS_A_ROW;
    if number >= epipolar.batch.y {
        return;
    }
    let slice = slices[epipolar.batch.x + number];
    let first = slice.first_run + 1u;
    // Runs so far, and the columns that see the last of them. What no map holds is lit.
    var count = 1u;
    var previous = slice.column_count;
    // The light ray where the line before ends.
    var least = 0u;
    // Runs for which there must be room: two a texel column that is to come, and one behind each line.
    var later = slice.line_count;
    for (var n = 0u; n < slice.line_count; n++) {
        later += 2u * lines[slice.first_line + n].columns;
    }
    if thread == 0u {
        rows_out[first] = vec2<u32>(0u, previous);
    }
    for (var n = 0u; n < slice.line_count; n++) {
        let line = lines[slice.first_line + n];
        for (var begin = 0u; begin < line.columns; begin += 256u) {
            let width = min(line.columns - begin, 256u);
            later -= 2u * width;
            let cells = cells_of(line, begin + min(thread, width - 1u), slice.column_count);
            var lit = cells.lit;
            // Where texels are cut more finely than there is room, a texel's middle stands for all of it: as the CPU's
            // `uncut_columns`, and counted.
            for (var attempt = 0u; attempt < 2u; attempt++) {
                if attempt == 1u {
                    let middle = vec2<u32>(lit.x + lit.y, lit.z + lit.w) / vec2<u32>(2u);
                    lit = middle.xxyy;
                }
                last_lit[thread] = lit.w;
                workgroupBarrier();
                var before = previous;
                if thread > 0u {
                    before = last_lit[thread - 1u];
                }
                var own = apart(lit.x, lit.y) + apart(lit.z, lit.w)
                    + select(0u, 1u, lit.x != before) + select(0u, 1u, lit.z != lit.y);
                own = select(0u, own, thread < width);
                scan[thread] = own;
                workgroupBarrier();
                for (var reach = 1u; reach < 256u; reach *= 2u) {
                    var sum = scan[thread];
                    if thread >= reach {
                        sum += scan[thread - reach];
                    }
                    workgroupBarrier();
                    scan[thread] = sum;
                    workgroupBarrier();
                }
                let total = workgroupUniformLoad(&scan[255]);
                let fits = count + total + later <= slice.room;
                if fits || attempt == 1u {
                    if thread < width {
                        var at = first + count + scan[thread] - own;
                        for (var cell = 0u; cell < 2u; cell++) {
                            let is_second = cell == 1u;
                            let lit_first = select(lit.x, lit.z, is_second);
                            let lit_last = select(lit.y, lit.w, is_second);
                            var t = select(cells.borders.x, cells.borders.y, is_second);
                            let end = select(cells.borders.y, cells.borders.z, is_second);
                            let depth = select(cells.depths.x, cells.depths.y, is_second);
                            if lit_first != before {
                                rows_out[at] = vec2<u32>(gamma_bits(line, t, least), lit_first);
                                at += 1u;
                            }
                            for (var step = 0u; step < apart(lit_first, lit_last); step++) {
                                let next = select(lit_first - step - 1u, lit_first + step + 1u, lit_last > lit_first);
                                let border = select(lit_first - step, next, lit_last > lit_first);
                                t = crossing(line, f32(border), depth, t, max(t, end));
                                rows_out[at] = vec2<u32>(gamma_bits(line, t, least), next);
                                at += 1u;
                            }
                            before = lit_last;
                        }
                    }
                    count += total;
                    previous = workgroupUniformLoad(&last_lit[width - 1u]);
                    if thread == 0u && attempt == 1u {
                        atomicAdd(&status[1], 1u);
                    }
                    break;
                }
            }
        }
        // Outside of the map nothing is shadowed.
        later -= 1u;
        least = gamma_bits(line, line.length, least);
        if previous != slice.column_count {
            previous = slice.column_count;
            if thread == 0u {
                rows_out[first + count] = vec2<u32>(least, previous);
            }
            count += 1u;
        }
    }
    if thread == 0u {
        rows_out[first + count] = vec2<u32>(END, 0u);
        rows_out[slice.first_run] = vec2<u32>(count, 0u);
    }
}
