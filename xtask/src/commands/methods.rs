//! `methods`: what each technique is, takes and cannot do.

use std::fmt::Write;

use scatter::{MemoryBound, TECHNIQUES, TechniqueInfo};
use scatter_scene::raster_devices;
use scatter_validate::{RAYCAST_TRUTH, SHADOW_MAP_TRUTH};
use serde_json::{Value, json};

use crate::Verdict;
use crate::flags::Methods;
use crate::output::{print, print_json};

/// The references: no options, no level, everything that the model has.
const REFERENCES: [(&str, &str); 2] = [
    (RAYCAST_TRUTH, "the exact image for the triangles, without sampling, f64"),
    (SHADOW_MAP_TRUTH, "the exact image for the shadow map, texel by texel, f64"),
];

/// Prints all techniques and references.
pub fn run(flags: &Methods) -> anyhow::Result<Verdict> {
    let infos = || TECHNIQUES.iter().map(|technique| technique.info());
    if flags.json {
        let references =
            REFERENCES.map(|(id, summary)| json!({ "id": id, "summary": summary, "reference": true }));
        let all: Vec<Value> = references.into_iter().chain(infos().map(document)).collect();
        print_json(&all)?;
        return Ok(Verdict::Well);
    }
    let mut text = String::new();
    for (id, summary) in REFERENCES {
        let _ = writeln!(text, "{id} (reference)\n  {summary}\n");
    }
    for info in infos() {
        describe(&mut text, info);
    }
    text.push_str(&devices());
    print(&text)?;
    Ok(Verdict::Well)
}

/// What `--shadow-source raster` can run on.
fn devices() -> String {
    let mut text = String::from("--shadow-source raster\n");
    match raster_devices() {
        Ok(devices) => {
            for (index, device) in devices.iter().enumerate() {
                let lacks = device.lacks.as_ref().map_or(String::new(), |lacks| format!("; {lacks}"));
                let _ = writeln!(text, "  --vulkan-device {index}  {device}{lacks}");
            }
        }
        Err(error) => {
            let _ = writeln!(text, "  {error}");
        }
    }
    text
}

fn document(info: &TechniqueInfo) -> Value {
    let options: Vec<Value> = info
        .options()
        .into_iter()
        .map(|option| {
            json!({
                "key": option.key,
                "summary": option.summary,
                "unit": option.unit,
                "range": option.range.to_string(),
                "numbers": option.range.numbers(),
                "words": option.range.words(),
                "default": option.default.to_string(),
            })
        })
        .collect();
    let capabilities: serde_json::Map<String, Value> =
        info.capabilities.describe().into_iter().map(|(name, values)| (name.into(), values.into())).collect();
    json!({
        "id": info.id,
        "summary": info.summary,
        "reference": false,
        "paper": info.paper,
        "capabilities": capabilities,
        "cannot": info.capabilities.cannot(),
        "misses": info.misses,
        "memory": {
            "fixed_bytes_a_thread": info.memory.fixed,
            "bytes_a_pixel_and_thread": info.memory.a_pixel,
            "bytes_a_texel": info.memory.a_texel,
        },
        "options": options,
    })
}

fn describe(text: &mut String, info: &TechniqueInfo) {
    let _ = writeln!(text, "{}\n  {}", info.id, info.summary);
    let _ = writeln!(text, "  paper    {}", info.paper);
    for (name, values) in info.capabilities.describe() {
        let _ = writeln!(text, "  {name:<8} {values}");
    }
    for phrase in info.capabilities.cannot() {
        let _ = writeln!(text, "  cannot   {phrase}");
    }
    if !info.misses.is_empty() {
        let _ = writeln!(text, "  misses   {}", info.misses);
    }
    let MemoryBound { fixed, a_pixel, a_texel } = info.memory;
    let fixed = fixed.div_ceil(1 << 20);
    let _ = writeln!(
        text,
        "  memory   at most {fixed} MiB and {a_pixel} bytes a pixel, each a thread, and {a_texel} bytes a texel"
    );
    for option in info.options() {
        let unit = if option.unit.is_empty() { String::new() } else { format!(" [{}]", option.unit) };
        let _ = writeln!(text, "  --set {}={}{unit}", option.key, option.default);
        let _ = writeln!(text, "           {}; {}", option.summary, option.range);
    }
    text.push('\n');
}
