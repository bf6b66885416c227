//! The same frame handed over in the model's own terms and as an engine has it (matrices, depth buffer, shadow maps of
//! every convention) is the same picture, by the exact walk and by every technique.

use glam::{DMat4, DVec3, DVec4, dcamera};
use raymarch_ref::ShadowMapWalk;
use scatter::{TECHNIQUES, Target};
use scatter_core::{
    Camera, ClipSpace, DepthEncoding, DepthMap, Frame, Light, LightTexture, MapProjection, Quality, Rounding,
    ScatterImage, SceneFacts, ShadowDepthEncoding, ShadowMap, VolumetricShadow,
};
use scatter_testing::{Filling, MapKind, OwnedFrame, differing, values};

const SIZE: [u32; 2] = [33, 21];
const NEAR: f64 = 1.0;
const FAR: f64 = 64.0;

/// What forward z adds to a technique's rounding. Near 1 an f32 is off by 2⁻²⁵, which moves a surface at d ≤ 12 units by
/// d²/near·2⁻²⁵ = 4e-6: 1e-6 of the shortest ray, and as much of a lit part's border. Ten times as much is allowed, as in
/// `Rounding::F64`, since a lamp's light is denser near it.
const FORWARD_Z: f64 = 1e-5;

/// An engine's way with clip space.
#[derive(Debug, Clone, Copy)]
struct Engine {
    name: &'static str,
    space: ClipSpace,
    left_handed: bool,
}

/// Every way, row 0 of pictures on top as the model's.
fn engines() -> Vec<Engine> {
    let spaces = [
        ("Direct3D", ClipSpace::DIRECT3D),
        ("Vulkan", ClipSpace::VULKAN),
        ("OpenGL, rows turned", ClipSpace::OPENGL.with_row_0_at(1.0)),
    ];
    let mut all = Vec::new();
    for (name, space) in spaces {
        for left_handed in [false, true] {
            all.push(Engine { name, space, left_handed });
            all.push(Engine { name, space: space.reversed(), left_handed });
        }
    }
    all
}

impl Engine {
    fn is_opengl(&self) -> bool {
        self.name.starts_with("OpenGL")
    }

    fn y_sign(&self) -> f64 {
        if self.name == "Vulkan" { -1.0 } else { 1.0 }
    }

    /// z row of a clip space whose depth is the row `depth` and whose w row is `w`.
    fn z_row(&self, depth: DVec4, w: DVec4, perspective: bool) -> DVec4 {
        // As 0 to 1, forward.
        let z =
            if perspective { (depth * FAR - DVec4::W * (FAR * NEAR)) / (FAR - NEAR) } else { depth / FAR };
        let z = if self.space.is_reversed() { w - z } else { z };
        if self.is_opengl() { z * 2.0 - w } else { z }
    }

    /// The texel that the engine's device stores.
    fn texel(&self, clip: DMat4, p: DVec3) -> f32 {
        let seen = clip * p.extend(1.0);
        let z = seen.z / seen.w;
        (if self.is_opengl() { 0.5 * z + 0.5 } else { z }).clamp(0.0, 1.0) as f32
    }

    fn cleared(&self) -> f32 {
        if self.space.is_reversed() { 0.0 } else { 1.0 }
    }

    /// View and projection of the stock camera, by glam.
    fn camera(&self, camera: &Camera) -> [DMat4; 2] {
        let [width, height] = SIZE.map(f64::from);
        let view = dcamera::rh::view::look_to_mat4(camera.eye(), camera.forward(), camera.up());
        let flip = DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0));
        let view = if self.left_handed { flip * view } else { view };
        let forward = match (self.left_handed, self.name) {
            (false, "Vulkan") => dcamera::rh::proj::vulkan::perspective,
            (true, "Vulkan") => dcamera::lh::proj::vulkan::perspective,
            (false, "Direct3D") => dcamera::rh::proj::directx::perspective,
            (true, "Direct3D") => dcamera::lh::proj::directx::perspective,
            (false, _) => dcamera::rh::proj::opengl::perspective,
            (true, _) => dcamera::lh::proj::opengl::perspective,
        };
        let mut clip = forward(70f64.to_radians(), width / height, NEAR, FAR);
        if self.space.is_reversed() {
            // 0 to 1 turned into 1 to 0, −1 to 1 into 1 to −1.
            let rows = [0, 1, 2, 3].map(|row| clip.row(row));
            let z = if self.is_opengl() { -rows[2] } else { rows[3] - rows[2] };
            clip = DMat4::from_cols(rows[0], rows[1], z, rows[3]).transpose();
        }
        [view, clip]
    }

    /// The matrix of a map, made of its rows.
    fn map(&self, map: &MapProjection) -> DMat4 {
        let [u, v, depth] = map.rows();
        let [half_u, half_v] = map.size().map(|n| 0.5 * f64::from(n));
        let w = if map.is_perspective() { depth } else { DVec4::W };
        let (x, y) = (u / half_u - w, (w - v / half_v) * self.y_sign());
        DMat4::from_cols(x, y, self.z_row(depth, w, map.is_perspective()), w).transpose()
    }

    /// What the device stored of a map's linear depths.
    fn texels(&self, map: &MapProjection, linear: &[f32]) -> Vec<f32> {
        let clip = self.map(map);
        let width = map.size()[0] as usize;
        let stored = linear.iter().enumerate().map(|(index, &depth)| {
            let (column, row) = ((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
            let (start, step) = map.light_ray(column, row).unwrap();
            if depth.is_finite() { self.texel(clip, start + step * f64::from(depth)) } else { self.cleared() }
        });
        stored.collect()
    }
}

/// The frame as the engine hands it over, lent.
fn with_engine<R>(engine: &Engine, plain: &OwnedFrame, use_frame: impl FnOnce(&Frame<'_>) -> R) -> R {
    let array = |m: DMat4| m.to_cols_array_2d();
    let [view, clip] = engine.camera(&plain.camera);
    let camera = Camera::from_matrices_in(array(view), array(clip), engine.space, SIZE).unwrap();
    let buffer: Vec<f32> = (0..SIZE[0] * SIZE[1])
        .map(|n| {
            let (ray, distance) = (plain.camera.pixel_ray(n % SIZE[0], n / SIZE[0]), plain.depth[n as usize]);
            if !distance.is_finite() {
                return engine.cleared();
            }
            engine.texel(clip * view, plain.camera.eye() + ray.direction * f64::from(distance))
        })
        .collect();
    let mut distances = Vec::new();
    let depth = DepthEncoding::Clip { clip_from_world: array(clip * view), space: engine.space };
    depth.decode(&camera, &buffer, &mut distances).unwrap();

    let encoding = ShadowDepthEncoding::Clip(engine.space);
    let texels: Vec<f32> = plain
        .projections
        .iter()
        .zip(&plain.texels)
        .flat_map(|(map, linear)| engine.texels(map, linear))
        .collect();
    let size = plain.projections[0].size();
    let mut linear = Vec::new();
    let matrices = |index: usize| array(engine.map(&plain.projections[index]));
    let (two, six);
    let shadow = match plain.kind {
        MapKind::Orthographic => {
            let [layer] = encoding.layers(&[matrices(0)], size, &texels, &mut linear).unwrap();
            ShadowMap::Orthographic(layer)
        }
        MapKind::Spot => {
            let [layer] = encoding.layers(&[matrices(0)], size, &texels, &mut linear).unwrap();
            ShadowMap::Perspective(layer)
        }
        MapKind::Cascades => {
            two = encoding.layers(&[matrices(0), matrices(1)], size, &texels, &mut linear).unwrap();
            ShadowMap::Cascades(&two)
        }
        _ => {
            six = encoding.layers::<6>(&std::array::from_fn(matrices), size, &texels, &mut linear).unwrap();
            ShadowMap::Faces(&six)
        }
    };
    let depth = DepthMap::new(&distances, SIZE).unwrap();
    let frame = Frame::new(&camera, depth, &plain.light, &shadow, &plain.medium, plain.max_distance).unwrap();
    // The glass through its matrix; of its z row the sign alone matters.
    let texture = plain.texture.as_ref().map(|(map, panes)| {
        let projection =
            MapProjection::from_clip_from_world_in(array(engine.map(map)), engine.space, map.size()).unwrap();
        LightTexture::new(projection, panes).unwrap()
    });
    match &texture {
        Some(texture) => use_frame(&frame.with_texture(texture).unwrap()),
        None => use_frame(&frame),
    }
}

fn image_of(instance: &mut dyn VolumetricShadow, frame: &Frame<'_>) -> ScatterImage {
    let mut image = ScatterImage::new();
    instance.render(frame, &mut image).unwrap();
    image
}

/// What renders a frame, with how far its image may move.
fn instances(facts: &SceneFacts) -> Vec<(String, Rounding, Box<dyn VolumetricShadow>)> {
    let mut all: Vec<(_, _, Box<dyn VolumetricShadow>)> =
        vec![("truth-shadow-map".to_owned(), Rounding::F64, Box::new(ShadowMapWalk::new()))];
    for technique in TECHNIQUES {
        let info = technique.info();
        let instance =
            technique.configure(Target::Quality(Quality::Film), info.rounding.overrides, facts).unwrap();
        all.push((info.id.to_owned(), info.rounding, instance));
    }
    all
}

#[test]
fn a_frame_as_an_engine_hands_it_over_is_the_same_picture() {
    let mut worst: Vec<(String, f64)> = Vec::new();
    for kind in [MapKind::Orthographic, MapKind::Cascades, MapKind::Spot, MapKind::Faces] {
        let filling = Filling::Random { seed: 5, far: 9.0 };
        let mut plain = OwnedFrame::stock(kind, SIZE, 16, filling);
        if matches!(kind, MapKind::Cascades | MapKind::Spot) {
            plain = plain.with_glass();
        }
        // An eighth of a unit is 2⁻⁹ of the far plane: parallel texels of f32 hold it without rounding.
        for depth in plain.texels.iter_mut().flatten() {
            *depth = ((8.0 * *depth).round() / 8.0).max(1.125);
        }
        plain.depth[40] = f32::INFINITY;
        // A spot's is measured without its cone.
        let mut clear = plain.unoccluded();
        if let Some(lamp) = clear.light.position() {
            clear.light = Light::point(lamp.to_array(), clear.light.strength(), 0.0).unwrap();
        }
        let scale = values(&clear.render(&mut ShadowMapWalk::new()));
        let facts = plain.with(SceneFacts::of);
        let mut bare = plain.clone();
        bare.texture = None;
        for (name, rounding, mut instance) in instances(&facts) {
            // Who refuses glass gets the frame without it, and nothing else may be refused.
            let plain = if plain.with(|frame| instance.supports(frame)).is_ok() { &plain } else { &bare };
            let expected = values(&plain.render(&mut *instance));
            for engine in engines() {
                let image = with_engine(&engine, plain, |frame| image_of(&mut *instance, frame));
                let allowed = rounding.moved + if engine.space.is_reversed() { 0.0 } else { FORWARD_Z };
                let found = differing(&image, &expected, &scale, allowed);
                assert!(found.is_close(), "{name}, {kind:?}, {engine:?}: {found}");
                match worst.iter_mut().find(|(of, _)| *of == name) {
                    Some((_, most)) => *most = most.max(found.largest() / allowed),
                    None => worst.push((name.clone(), found.largest() / allowed)),
                }
            }
        }
    }
    println!("largest move as a share of what is allowed: {worst:?}");
}
