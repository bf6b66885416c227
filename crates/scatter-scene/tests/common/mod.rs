//! What the integration tests share: shots of the shared cases, images, error figures, and seeded random numbers.

#![expect(dead_code, reason = "each test binary uses its own part")]

use std::path::{Path, PathBuf};

use glam::DVec3;
use scatter_core::{
    Camera, DepthMap, Frame, Light, Medium, Phase, RenderStats, ScatterImage, ShadowMap, VolumetricShadow,
};
use scatter_scene::{RaycastTruth, Scene, SceneCaster, load_scene};

/// Camera, light, medium and range of a test.
pub struct TestShot {
    pub scene: Scene,
    pub camera: Camera,
    pub light: Light,
    pub medium: Medium,
    pub max_distance: f64,
}

impl TestShot {
    /// The truth's image and its stats.
    pub fn truth(&self) -> (ScatterImage, RenderStats) {
        let caster = SceneCaster::new(&self.scene).unwrap();
        self.truth_with(&caster)
    }

    /// The truth's image by a caster that is there already.
    pub fn truth_with(&self, caster: &SceneCaster) -> (ScatterImage, RenderStats) {
        let [width, height] = self.camera.size();
        // The truth ignores the frame's maps.
        let texels = vec![f32::INFINITY; width as usize * height as usize];
        let depth = DepthMap::new(&texels, [width, height]).unwrap();
        let frame = Frame::new(
            &self.camera,
            depth,
            &self.light,
            &ShadowMap::Unshadowed,
            &self.medium,
            self.max_distance,
        )
        .unwrap();
        let mut image = ScatterImage::new();
        let stats = RaycastTruth::new(caster).render(&frame, &mut image).unwrap();
        (image, stats)
    }

    /// From a shot file.
    pub fn load(path: &Path, size: Option<[u32; 2]>) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let shot: toml::Table = text.parse().unwrap();
        let table = |key: &str| shot[key].as_table().unwrap();
        let (camera, light, medium) = (table("camera"), table("light"), table("medium"));
        let number = |table: &toml::Table, key: &str| {
            table[key].as_float().or_else(|| table[key].as_integer().map(|i| i as f64)).unwrap()
        };
        let vector = |table: &toml::Table, key: &str| -> [f64; 3] {
            let values = table[key].as_array().unwrap();
            [0, 1, 2]
                .map(|i| values[i].as_float().or_else(|| values[i].as_integer().map(|v| v as f64)).unwrap())
        };
        let resolution = camera["resolution"].as_array().unwrap();
        let size = size.unwrap_or([0, 1].map(|i| resolution[i].as_integer().unwrap() as u32));
        let phase = match medium["phase"].as_str().unwrap() {
            "isotropic" => Phase::Isotropic,
            "rayleigh" => Phase::Rayleigh,
            _ => Phase::henyey_greenstein(number(medium, "g")).unwrap(),
        };
        let light = match light["kind"].as_str().unwrap() {
            "directional" => Light::directional(vector(light, "direction"), vector(light, "irradiance")),
            "point" => Light::point(vector(light, "position"), vector(light, "intensity"), 0.0),
            _ => Light::spot(
                vector(light, "position"),
                vector(light, "direction"),
                vector(light, "intensity"),
                number(light, "inner_cone_degrees"),
                number(light, "outer_cone_degrees"),
                0.0,
            ),
        };
        Self {
            scene: load_scene(&path.with_file_name(shot["mesh"].as_str().unwrap())).unwrap(),
            camera: Camera::perspective(
                vector(camera, "eye"),
                vector(camera, "target"),
                vector(camera, "up"),
                number(camera, "vertical_fov_degrees"),
                size,
            )
            .unwrap(),
            light: light.unwrap(),
            medium: Medium::homogeneous(vector(medium, "scattering"), vector(medium, "absorption"), phase)
                .unwrap(),
            max_distance: number(camera, "max_distance"),
        }
    }
}

/// The folder of shared references, or a visible note that the test is skipped.
pub fn shared(test: &str) -> Option<PathBuf> {
    let shared = std::env::var_os("SCATTER_SHARED").map(PathBuf::from);
    if shared.is_none() {
        eprintln!("SKIPPED {test}: SCATTER_SHARED does not name the folder of shared cases");
    }
    shared
}

/// RGB of an EXR file, `[y][x]`.
pub fn read_exr(path: &Path) -> Vec<[f32; 3]> {
    use exr::prelude::*;
    let image = read_first_rgba_layer_from_file(
        path,
        |size, _| (size.width(), vec![[0f32; 3]; size.area()]),
        |(width, pixels), position, (r, g, b, _): (f32, f32, f32, f32)| {
            pixels[position.y() * *width + position.x()] = [r, g, b];
        },
    )
    .unwrap();
    image.layer_data.channel_data.pixels.1
}

/// Relative RMSE, relative bias and non-finite count over the pixels that `mask` keeps.
pub fn figures(image: &[[f32; 3]], reference: &[[f32; 3]], mask: &[bool]) -> (f64, f64, usize) {
    assert_eq!(image.len(), reference.len());
    let (mut square, mut difference, mut sum, mut count, mut non_finite) = (0.0, 0.0, 0.0, 0.0, 0);
    for ((t, r), _) in image.iter().zip(reference).zip(mask).filter(|(_, keep)| **keep) {
        for c in 0..3 {
            let (t, r) = (f64::from(t[c]), f64::from(r[c]));
            if !t.is_finite() {
                non_finite += 1;
                continue;
            }
            square += (t - r) * (t - r);
            difference += t - r;
            sum += r;
            count += 1.0;
        }
    }
    let mean: f64 = sum / count;
    ((square / count).sqrt() / mean, difference / count / mean, non_finite)
}

/// SplitMix64 (Steele, Lea and Flood 2014): the same numbers everywhere.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [low, high).
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// Uniform in a cube around the origin.
    pub fn in_cube(&mut self, half: f64) -> DVec3 {
        DVec3::new(self.range(-half, half), self.range(-half, half), self.range(-half, half))
    }

    /// A unit vector, uniform on the sphere.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.in_cube(1.0);
            let length = v.length();
            if length > 0.1 && length <= 1.0 {
                return v / length;
            }
        }
    }
}
