//! Loading a grid of 100,352 triangles from GLB and OBJ, end to end from the file; the parameter is the format.

use std::fmt::Write as _;
use std::hint::black_box;
use std::path::{Path, PathBuf};

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use scatter_scene::load_scene;

/// Cells a side; two triangles each.
const CELLS: u32 = 224;
const TRIANGLES: usize = 2 * (CELLS * CELLS) as usize;

fn loaders(c: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a folder for the files");
    let mut group = c.benchmark_group("load");
    group.throughput(Throughput::Elements(TRIANGLES as u64));
    group.sample_size(20);
    for path in [write_glb(folder.path()), write_obj(folder.path())] {
        let scene = load_scene(&path).expect("the grid is sound");
        assert_eq!(
            (scene.triangles.len(), scene.positions.len()),
            (TRIANGLES, ((CELLS + 1) * (CELLS + 1)) as usize)
        );
        let format = path.extension().unwrap_or_default().to_string_lossy().into_owned();
        group.bench_with_input(BenchmarkId::from_parameter(format), &path, |b, path| {
            b.iter(|| load_scene(black_box(path)));
        });
    }
    group.finish();
}

fn positions() -> impl Iterator<Item = [f32; 3]> {
    (0..=CELLS).flat_map(|y| {
        (0..=CELLS).map(move |x| [x as f32 * 0.1, ((x * y) % 13) as f32 * 0.01, y as f32 * 0.1])
    })
}

fn triangles() -> impl Iterator<Item = [u32; 3]> {
    (0..CELLS).flat_map(|y| (0..CELLS).map(move |x| y * (CELLS + 1) + x)).flat_map(|a| {
        let below = a + CELLS + 1;
        [[a, a + 1, below], [below, a + 1, below + 1]]
    })
}

fn write_obj(folder: &Path) -> PathBuf {
    let mut text = String::new();
    for [x, y, z] in positions() {
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for [a, b, c] in triangles() {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    written(folder.join("grid.obj"), text.as_bytes())
}

fn write_glb(folder: &Path) -> PathBuf {
    let mut bin: Vec<u8> = positions().flatten().flat_map(f32::to_le_bytes).collect();
    let position_bytes = bin.len();
    bin.extend(triangles().flatten().flat_map(u32::to_le_bytes));
    let json = serde_json::json!({
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": position_bytes / 12},
            {"bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": 3 * TRIANGLES}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": position_bytes},
            {"buffer": 0, "byteOffset": position_bytes, "byteLength": bin.len() - position_bytes}
        ],
        "buffers": [{"byteLength": bin.len()}]
    });
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + bin.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &bin)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    written(folder.join("grid.glb"), &bytes)
}

fn written(path: PathBuf, bytes: &[u8]) -> PathBuf {
    std::fs::write(&path, bytes).expect("the folder is writable");
    path
}

criterion_group!(benches, loaders);
criterion_main!(benches);
