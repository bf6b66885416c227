//! The same bits whatever the number of threads.

use scatter_core::ScatterImage;

use super::{Broken, first_difference, house_scenes, instance_for, rendered};
use crate::contender::Contender;

/// Renders all house scenes in pools of 1, 2 and 3 threads.
pub fn check(contender: &Contender<'_>) -> Result<(), Broken> {
    let scenes = house_scenes()?;
    let mut first: Vec<Option<ScatterImage>> = Vec::new();
    for threads in 1..=3 {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|error| Broken::NotRun(format!("{threads} threads cannot be started: {error}")))?;
        for (index, (name, scene)) in scenes.iter().enumerate() {
            let image = pool.install(|| -> Result<Option<ScatterImage>, Broken> {
                let Some(mut instance) = instance_for(contender, scene)? else { return Ok(None) };
                let mut image = ScatterImage::new();
                rendered(instance.as_mut(), scene, &mut image)?;
                Ok(Some(image))
            })?;
            if threads == 1 {
                first.push(image);
            } else if let (Some(one), Some(many)) = (&first[index], &image)
                && let Some(difference) = first_difference(one, many)
            {
                return Err(Broken::Rule(format!("{name}, 1 and {threads} threads: {difference}")));
            }
        }
    }
    Ok(())
}
