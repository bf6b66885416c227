//! No NaN, no infinity, no negative light; transmittance from 0 to 1.

use scatter_core::ScatterImage;

use super::{Broken, house_scenes, instance_for, rendered};
use crate::contender::Contender;

/// Renders all house scenes, also with rays of length 0 and endless ones.
pub fn check(contender: &Contender<'_>) -> Result<(), Broken> {
    for (name, scene) in house_scenes()? {
        let endless = scene.clone().ending_at(f32::INFINITY);
        let short = scene.clone().ending_at(0.0);
        for (what, scene) in [("", scene), (", rays of length 0", short), (", endless rays", endless)] {
            let Some(mut instance) = instance_for(contender, &scene)? else { continue };
            let mut image = ScatterImage::new();
            rendered(instance.as_mut(), &scene, &mut image)?;
            if let Some(fault) = first_insane(&image) {
                return Err(Broken::Rule(format!("{name}{what}: {fault}")));
            }
        }
    }
    Ok(())
}

/// The first value of an image that nothing can mean.
pub fn first_insane(image: &ScatterImage) -> Option<String> {
    let width = image.size()[0].max(1) as usize;
    let place = |index: usize| {
        let pixel = index / 3;
        format!("channel {} of pixel ({}, {})", index % 3, pixel % width, pixel / width)
    };
    let radiance = image.inscattered().iter().flatten().enumerate();
    if let Some((index, value)) = radiance.into_iter().find(|(_, v)| !(v.is_finite() && **v >= 0.0)) {
        return Some(format!("radiance {value} in {}", place(index)));
    }
    let through = image.transmittance().iter().flatten().enumerate();
    let outside = through.into_iter().find(|(_, t)| !(0.0..=1.0).contains(*t))?;
    Some(format!("transmittance {} in {}", outside.1, place(outside.0)))
}
