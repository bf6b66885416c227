//! No frame leaves a trace in the next: an instance that has rendered one scene renders another like a new instance.

use scatter_core::ScatterImage;

use super::{Broken, first_difference, house_scenes, instance_for, rendered};
use crate::contender::Contender;
use crate::scenario::Scenario;
use crate::stress::scenes;

/// Every ordered pair of scenes that differ in light, map, medium, camera, size, or in a map's texels alone.
pub fn check(contender: &Contender<'_>) -> Result<(), Broken> {
    let scenes = scenes_to_follow_each_other()?;
    for (name, first) in &scenes {
        // Options follow from the facts of the first scene: the new instance gets the same ones.
        for (next_name, next) in &scenes {
            let (Some(mut used), Some(mut fresh)) =
                (instance_for(contender, first)?, instance_for(contender, first)?)
            else {
                continue;
            };
            if next_name == name || !next.with_frame(|frame| fresh.supports(frame).is_ok())? {
                continue;
            }
            let (mut after, mut alone) = (ScatterImage::new(), ScatterImage::new());
            rendered(used.as_mut(), first, &mut after)?;
            rendered(used.as_mut(), next, &mut after)?;
            rendered(fresh.as_mut(), next, &mut alone)?;
            if let Some(difference) = first_difference(&after, &alone) {
                return Err(Broken::Rule(format!("{next_name} after {name}, and alone: {difference}")));
            }
        }
    }
    Ok(())
}

fn scenes_to_follow_each_other() -> Result<Vec<(&'static str, Scenario)>, Broken> {
    let mut list = house_scenes()?;
    for (_, scene) in &mut list {
        *scene = scene.clone().seen_by(scene.camera.with_size(scenes::SIZE)?);
    }
    let sun = scenes::sun()?;
    let other_texels = sun.clone().with_depths(|old, i, _| if i % 3 == 0 { 17.0 } else { old });
    list.push(("another map of the sun", other_texels));
    list.push(("a larger map of the sun", sun.clone().with_map_side(31)));
    list.push(("a smaller image", sun.clone().seen_by(scenes::camera([7, 11])?)));
    list.push(("shorter rays", sun.ending_at(2.5)));
    Ok(list)
}
