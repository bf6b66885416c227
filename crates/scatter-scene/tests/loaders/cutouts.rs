//! Alpha cut-outs of glTF and MTL materials: which texel of which mask covers which corner, and what is only noted.

use std::path::Path;

use glam::DVec2;
use scatter_scene::{Cutout, Scene, Wrap, load_scene};
use serde_json::{Value, json};

use crate::common::{Asset, F32, I16, U8, U16, f32_bytes, png};

/// A triangle in the plane z = 0 with texture coordinates, under a material.
fn masked(material: &Value, coordinates: [[f32; 2]; 3]) -> Asset {
    let mut asset = Asset::new();
    let positions = asset.positions(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let view = asset.view(&f32_bytes(coordinates.as_flattened()), None);
    let tex_coords = asset.accessor(view, F32, "VEC2", 3);
    let material = asset.push("materials", material.clone());
    asset.placed(json!({
        "attributes": {"POSITION": positions, "TEXCOORD_0": tex_coords}, "material": material
    }));
    asset
}

/// An RGBA texture of 2 × 3 texels whose alpha is listed row by row, in the file; returns the texture's index.
fn texture(asset: &mut Asset, alpha: [u8; 6]) -> usize {
    let image =
        image::RgbaImage::from_fn(2, 3, |x, y| image::Rgba([255, 255, 255, alpha[(y * 2 + x) as usize]]));
    let view = asset.view(&png(&image.into()), None);
    let image = asset.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    asset.push("textures", json!({"source": image}))
}

fn mask_material(texture: usize) -> Value {
    json!({"name": "leaf", "alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorTexture": {"index": texture}}})
}

const CORNERS: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

const STEPS: [u8; 6] = [0, 127, 128, 200, 50, 255];

/// Which of the six texels of the only mask are there.
fn bits(scene: &Scene) -> [bool; 6] {
    let mask = &scene.masks[0];
    assert_eq!(mask.size(), [2, 3]);
    std::array::from_fn(|i| {
        mask.is_there(DVec2::new((i % 2) as f64 * 0.5 + 0.25, ((i / 2) as f64 + 0.5) / 3.0))
    })
}

#[test]
fn alpha_times_factor_against_the_cutoff_decides_each_texel() {
    // The texture is the same; its index is known before it is made.
    for (change, there) in [
        (json!({}), [false, false, true, true, false, true]),
        (json!({"alphaCutoff": 0.1}), [false, true, true, true, true, true]),
        (json!({"alphaCutoff": 0.79}), [false, false, false, false, false, true]),
    ] {
        let mut material = mask_material(0);
        material.as_object_mut().unwrap().extend(change.as_object().unwrap().clone());
        let mut asset = masked(&material, CORNERS);
        texture(&mut asset, STEPS);
        let scene = asset.load().unwrap();
        assert_eq!(bits(&scene), there, "{change}");
        assert_eq!(scene.cutouts, [Cutout { triangle: 0, mask: 0, uv: [DVec2::ZERO, DVec2::X, DVec2::Y] }]);
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    }
    // 200/255 · 0.6 = 0.47 and 255/255 · 0.6 = 0.6.
    let mut material = mask_material(0);
    material["pbrMetallicRoughness"]["baseColorFactor"] = json!([1, 1, 1, 0.6]);
    let mut asset = masked(&material, CORNERS);
    texture(&mut asset, STEPS);
    assert_eq!(bits(&asset.load().unwrap()), [false, false, false, false, false, true]);
}

#[test]
fn a_factor_alone_or_a_texture_of_one_mind_needs_no_mask() {
    for (factor, triangles) in [(0.5, 2), (0.49, 1)] {
        let material =
            json!({"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, factor]}});
        let mut asset = masked(&material, CORNERS);
        asset.placed(json!({"attributes": {"POSITION": 0}}));
        let scene = asset.load().unwrap();
        assert_eq!(
            (scene.triangles.len(), scene.cutouts.len(), scene.masks.len()),
            (triangles, 0, 0),
            "{factor}"
        );
    }
    for (alpha, triangles) in [(255, 2), (3, 1)] {
        let mut asset = masked(&mask_material(0), CORNERS);
        texture(&mut asset, [alpha; 6]);
        asset.placed(json!({"attributes": {"POSITION": 0}}));
        let scene = asset.load().unwrap();
        assert_eq!((scene.triangles.len(), scene.cutouts.len()), (triangles, 0), "{alpha}");
    }
}

#[test]
fn coordinates_may_be_of_any_type_and_any_set() {
    let mut bytes = vec![0u8, 51, 255, 102, 0, 255];
    let eight = bytes.clone();
    bytes.clear();
    for v in [0u16, 13107, 65535, 26214, 0, 65535] {
        bytes.extend(v.to_le_bytes());
    }
    for (component, bytes, normalized, expected) in [
        (U8, eight, true, [[0.0, 0.2], [1.0, 0.4], [0.0, 1.0]]),
        (U16, bytes.clone(), true, [[0.0, 0.2], [1.0, 0.4], [0.0, 1.0]]),
        (I16, 1i16.to_le_bytes().repeat(6), false, [[1.0, 1.0]; 3]),
    ] {
        let mut material = mask_material(0);
        material["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = json!(3);
        let mut asset = masked(&material, CORNERS);
        texture(&mut asset, STEPS);
        let view = asset.view(&bytes, None);
        let accessor = asset.accessor(view, component, "VEC2", 3);
        asset.json["accessors"][accessor]["normalized"] = json!(normalized);
        asset.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_3"] = json!(accessor);
        let uv = asset.load().unwrap().cutouts[0].uv;
        for (found, wanted) in uv.iter().zip(expected) {
            assert!((*found - DVec2::from_array(wanted)).length() < 1e-15, "{component}: {found}");
        }
    }
}

#[test]
fn a_texture_transform_scales_turns_and_moves_and_may_name_another_set() {
    let mut material = mask_material(0);
    // The specification's example: the lower left quarter of the image, turned by a right angle.
    material["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]["KHR_texture_transform"] =
        json!({"offset": [0, 1], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.5]});
    let mut asset = masked(&material, CORNERS);
    texture(&mut asset, STEPS);
    let uv = asset.load().unwrap().cutouts[0].uv;
    for (found, wanted) in uv.iter().zip([[0.0, 1.0], [0.0, 0.5], [0.5, 1.0]]) {
        assert!((*found - DVec2::from_array(wanted)).length() < 1e-15, "{found}");
    }
    asset.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({"KHR_texture_transform": {"texCoord": 1, "scale": [3, 2]}});
    let view = asset.view(&f32_bytes(&[0.5; 6]), None);
    let accessor = asset.accessor(view, F32, "VEC2", 3);
    asset.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(accessor);
    assert_eq!(asset.load().unwrap().cutouts[0].uv, [DVec2::new(1.5, 1.0); 3]);
}

#[test]
fn the_sampler_says_what_lies_beyond_and_instances_keep_their_masks() {
    let mut asset = masked(&mask_material(0), CORNERS);
    texture(&mut asset, STEPS);
    asset.json["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648, "magFilter": 9729}]);
    asset.json["textures"][0]["sampler"] = json!(0);
    asset.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    asset.push("nodes", json!({"mesh": 1}));
    asset.push("nodes", json!({"mesh": 0, "translation": [0, 0, 5]}));
    asset.mesh(json!({"attributes": {"POSITION": 0}}));
    let scene = asset.load().unwrap();
    assert_eq!(scene.masks[0].wrap(), [Wrap::ClampToEdge, Wrap::MirroredRepeat]);
    // Both uses share a mask; the triangle between them is whole.
    assert_eq!(scene.cutouts.iter().map(|c| (c.triangle, c.mask)).collect::<Vec<_>>(), [(0, 0), (2, 0)]);
}

#[test]
fn a_texture_may_lie_beside_the_file_or_in_a_data_uri() {
    let mut asset = masked(&mask_material(0), CORNERS);
    texture(&mut asset, STEPS);
    let expected = bits(&asset.load().unwrap());
    let view = asset.json["bufferViews"].as_array().unwrap().last().unwrap();
    let from = view["byteOffset"].as_u64().unwrap() as usize;
    let bytes = asset.bin[from..from + view["byteLength"].as_u64().unwrap() as usize].to_vec();
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("tex")).unwrap();
    std::fs::write(folder.path().join("tex/my leaf.png"), &bytes).unwrap();
    let data = format!("data:image/png;base64,{}", crate::common::base64(&bytes));
    for uri in ["tex/my%20leaf.png", "tex\\my leaf.png", &data] {
        asset.json["images"][0] = json!({"uri": uri});
        let path = folder.path().join("a.glb");
        std::fs::write(&path, asset.glb()).unwrap();
        assert_eq!(bits(&load_scene(&path).unwrap()), expected, "{uri}");
    }
}

#[test]
fn what_lets_light_through_otherwise_counts_as_opaque_with_a_line_that_names_it() {
    for (material, part) in [
        (json!({"name": "pane", "alphaMode": "BLEND"}), "material \"pane\" is blended"),
        (
            json!({"name": "pane", "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.9}}}),
            "material \"pane\" lets light through (KHR_materials_transmission)",
        ),
        (
            json!({"extensions": {"KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 1}}}),
            "materials[0] lets light through (KHR_materials_diffuse_transmission)",
        ),
        (json!({"name": "odd", "alphaMode": "GLASS"}), "material \"odd\" has an unknown alphaMode"),
        (mask_material(7), "textures[7]: the asset has 0 textures"),
    ] {
        let scene = masked(&material, CORNERS).load().unwrap();
        assert_eq!((scene.triangles.len(), scene.cutouts.len()), (1, 0));
        assert!(scene.notes.len() == 1 && scene.notes[0].contains(part), "{part}: {:?}", scene.notes);
    }
    let noted = |change: fn(&mut Asset)| {
        let mut asset = masked(&mask_material(0), CORNERS);
        texture(&mut asset, STEPS);
        change(&mut asset);
        let scene = asset.load().unwrap();
        assert_eq!(scene.notes.len(), 1, "{:?}", scene.notes);
        (scene.cutouts.len(), scene.notes[0].clone())
    };
    for (change, part) in [
        (
            (|a: &mut Asset| {
                a.json["textures"][0] = json!({"extensions": {"EXT_texture_webp": {"source": 0}}})
            }) as fn(&mut Asset),
            "only there as EXT_texture_webp",
        ),
        (|a| a.json["images"][0] = json!({"uri": "none.png"}), "images[0].uri: cannot read"),
        (
            |a| a.json["images"][0] = json!({"uri": "data:;base64,UklGRgAAAABXRUJQVlA4"}),
            "the image is a WebP",
        ),
        (
            |a| {
                a.json["meshes"][0]["primitives"][0]["attributes"]
                    .as_object_mut()
                    .unwrap()
                    .remove("TEXCOORD_0");
            },
            "has no TEXCOORD_0",
        ),
    ] {
        let (count, note) = noted(change);
        assert!(count == 0 && note.contains("material \"leaf\"") && note.contains(part), "{part}: {note}");
    }
    let (count, note) = noted(|a| {
        let view = a.view(&[255; 12], None);
        let colors = a.accessor(view, U8, "VEC4", 3);
        a.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
    });
    assert!(count == 1 && note.contains("COLOR_0"), "{note}");
}

const QUAD: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                    usemtl leaf\nf 1/1 2/2 3/3 4/4\n";

/// Loads an OBJ beside a library and images.
fn obj(text: &str, library: &str, images: &[(&str, image::DynamicImage)]) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), text).unwrap();
    std::fs::write(folder.path().join("a.mtl"), library).unwrap();
    for (name, image) in images {
        image.save(folder.path().join(name)).unwrap();
    }
    load_scene(Path::new(&folder.path().join("a.obj"))).unwrap()
}

/// Alpha and red tell different stories: alpha is [`STEPS`], red its opposite.
fn two_stories() -> image::DynamicImage {
    image::RgbaImage::from_fn(2, 3, |x, y| {
        let alpha = STEPS[(y * 2 + x) as usize];
        image::Rgba([255 - alpha, 0, 0, alpha])
    })
    .into()
}

#[test]
fn a_librarys_maps_cut_faces_out_with_v_upwards() {
    let by_alpha = [false, false, true, true, false, true];
    let grey = image::DynamicImage::ImageRgb8(two_stories().to_rgb8());
    for (library, image, there) in [
        ("newmtl leaf\nmap_d a.png\n", two_stories(), by_alpha),
        ("newmtl leaf\nmap_Kd a.png\n", two_stories(), by_alpha),
        ("newmtl leaf\r\nKd 1\r\nmap_d a.png\r\n", grey.clone(), by_alpha.map(|b| !b)),
        ("newmtl leaf\nmap_d -imfchan r -blendu off a.png", two_stories(), by_alpha.map(|b| !b)),
        // 1 − alpha.
        ("newmtl leaf\nmap_d -mm 1 -1 a.png", two_stories(), by_alpha.map(|b| !b)),
    ] {
        let scene = obj(QUAD, library, &[("a.png", image)]);
        assert_eq!(bits(&scene), there, "{library}");
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        // The first corner is at the texture's lower left: v = 1 of a mask.
        let uv = [DVec2::new(0.0, 1.0), DVec2::new(1.0, 1.0), DVec2::new(1.0, 0.0), DVec2::ZERO];
        let expected = [
            Cutout { triangle: 0, mask: 0, uv: [uv[0], uv[1], uv[2]] },
            Cutout { triangle: 1, mask: 0, uv: [uv[0], uv[2], uv[3]] },
        ];
        assert_eq!(scene.cutouts, expected, "{library}");
    }
    // A colour map without alpha cuts nothing; one whose alpha is whole neither.
    assert!(obj(QUAD, "newmtl leaf\nmap_Kd a.png", &[("a.png", grey)]).cutouts.is_empty());
}

#[test]
fn a_librarys_options_place_the_map_and_its_names_may_be_anything() {
    let library =
        "newmtl other\nnewmtl Material #25\nmap_d -clamp on -s 2 4 1 -o 0.5 -0.25 -bm 2 my leaf.png\n";
    let text = QUAD.replace("leaf", "Material #25").replace("f 1", "f -4/-4 -3/-3 -2/-2\nf 1");
    let scene = obj(&text, library, &[("my leaf.png", two_stories())]);
    assert_eq!(scene.masks[0].wrap(), [Wrap::ClampToEdge; 2]);
    // u·2 + 0.5 and 1 − (v·4 − 0.25).
    assert_eq!(scene.cutouts[1].uv, [DVec2::new(0.5, 1.25), DVec2::new(2.5, 1.25), DVec2::new(2.5, -2.75)]);
    assert_eq!(scene.cutouts[0].uv, scene.cutouts[1].uv);
    // Windows paths, a library in another folder, and a path that is not here.
    let scene = obj(
        &QUAD.replace("a.mtl", ".\\a.mtl"),
        "newmtl leaf\nmap_d C:\\tex\\a.png",
        &[("a.png", two_stories())],
    );
    assert_eq!(scene.cutouts.len(), 2);
}

#[test]
fn what_a_library_cannot_do_is_said() {
    for (library, part) in [
        ("newmtl leaf\nd 0.3\n", "material \"leaf\" lets light through (opacity 0.3)"),
        ("newmtl leaf\nTr 0.7\n", "material \"leaf\" lets light through"),
        ("newmtl leaf\nd 1\nillum 7\n", "material \"leaf\" is glass (illum 7)"),
        (
            "newmtl leaf\nmap_d none.png\n",
            "material \"leaf\" is a cut-out, but counts as opaque: there is no image none.png",
        ),
        (
            "newmtl leaf\nmap_Kd none.png\n",
            "textures that cannot be read, so that any alpha of theirs is not seen: none.png",
        ),
        ("newmtl other\n", "materials that no library has count as opaque: leaf"),
    ] {
        let scene = obj(QUAD, library, &[]);
        assert!(scene.notes.len() == 1 && scene.notes[0].contains(part), "{part}: {:?}", scene.notes);
        assert_eq!((scene.triangles.len(), scene.cutouts.len()), (2, 0));
    }
    let scene = obj(&QUAD.replace("a.mtl", "none.mtl"), "", &[]);
    assert!(scene.notes[0].contains("material library none.mtl is not read"), "{:?}", scene.notes);
    let scene = obj(&QUAD.replace("4/4", "4"), "newmtl leaf\nmap_d a.png", &[("a.png", two_stories())]);
    assert!(
        scene.cutouts.len() == 1 && scene.notes[0].contains("without texture coordinates"),
        "{:?}",
        scene.notes
    );
    // A colour of one number is no reason to lose the rest.
    let scene =
        obj(QUAD, "newmtl leaf\nKd spectral x.rfl\nNs none\nmap_d a.png", &[("a.png", two_stories())]);
    assert_eq!(scene.cutouts.len(), 2);
}
