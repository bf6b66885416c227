//! All buffers live in the technique: the second frame of the same size allocates nothing.
//!
//! In a pool of one thread: what rayon's queues do when several threads share a frame is not ours to count.

use scatter_core::ScatterImage;

use super::counting_allocator::allocations_of_this_thread;
use super::{Broken, house_scenes, instance_for};
use crate::contender::Contender;

/// Renders each house scene twice into one image and counts during the second time.
pub fn check(contender: &Contender<'_>) -> Result<(), Broken> {
    if allocations_of_this_thread().is_none() {
        return Err(Broken::NotRun("this program does not count its allocations".into()));
    }
    if contender.is_on_device() {
        return Err(Broken::NotRun("its driver allocates for every command buffer".into()));
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .map_err(|error| Broken::NotRun(format!("a thread cannot be started: {error}")))?;
    pool.install(|| {
        for (name, scene) in house_scenes()? {
            let Some(mut instance) = instance_for(contender, &scene)? else { continue };
            let mut image = ScatterImage::new();
            let allocated = scene.with_frame(|frame| {
                let first = instance.render(frame, &mut image).is_ok();
                let before = allocations_of_this_thread();
                let second = instance.render(frame, &mut image).is_ok();
                let after = allocations_of_this_thread();
                (first && second).then(|| after.unwrap_or(0) - before.unwrap_or(0))
            })?;
            match allocated {
                Some(0) => {}
                Some(count) => {
                    return Err(Broken::Rule(format!("{name}: {count} allocations in the second frame")));
                }
                None => return Err(Broken::Rule(format!("{name}: supports() says yes and render() fails"))),
            }
        }
        Ok(())
    })
}
