//! The exact image of a shot file (or of a small scene made here) as an EXR: `truth [SHOT.toml] [OUT.exr]`.

use std::path::Path;

use scatter_core::{
    Camera, DepthMap, Frame, Light, Medium, Phase, ScatterImage, ShadowMap, VolumetricShadow,
};
use scatter_scene::{RadianceImage, RaycastTruth, Scene, SceneCaster, load_shot, write_exr};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (scene, camera, light, medium, max_distance) = match arguments.next() {
        Some(path) => {
            let shot = load_shot(Path::new(&path))?;
            let light = shot.lights.first().ok_or("the shot has no light")?.light.clone();
            (shot.scene, shot.camera, light, shot.medium, shot.max_distance)
        }
        None => {
            // One triangle in the sun.
            let positions = [[-2.0, 2.0, -6.0], [2.0, 2.0, -6.0], [0.0, 4.0, -6.0]].map(Into::into).to_vec();
            (
                Scene { positions, triangles: vec![[0, 1, 2]], ..Scene::default() },
                Camera::perspective([0.0, 2.0, 0.0], [0.0, 2.0, -1.0], [0.0, 1.0, 0.0], 60.0, [65, 49])?,
                Light::directional([0.2, -1.0, 0.5], [10.0, 9.0, 7.5])?,
                Medium::homogeneous([0.05; 3], [0.0; 3], Phase::Isotropic)?,
                20.0,
            )
        }
    };
    let caster = SceneCaster::new(&scene)?;
    let mut distances = Vec::new();
    caster.depth_map(&camera, &mut distances);
    let depth = DepthMap::new(&distances, camera.size())?;
    let frame = Frame::new(&camera, depth, &light, &ShadowMap::Unshadowed, &medium, max_distance)?;
    let mut image = ScatterImage::new();
    RaycastTruth::new(&caster).render(&frame, &mut image)?;
    let mean = image.inscattered().iter().map(|rgb| rgb[1]).sum::<f32>() / image.inscattered().len() as f32;
    println!("mean radiance {mean:.5}");
    if let Some(out) = arguments.next() {
        write_exr(
            Path::new(&out),
            &RadianceImage { size: image.size(), pixels: image.inscattered().to_vec() },
        )?;
    }
    Ok(())
}
