//! What is not supported is said before any work: `supports` and `render` agree, and a refused frame leaves no pixel.

use scatter_core::{Frame, RenderError, ScatterImage, VolumetricShadow};

use super::{Broken, house_scenes};
use crate::contender::Contender;

/// Asks for every house scene.
pub fn check(contender: &Contender<'_>) -> Result<(), Broken> {
    for (name, scene) in house_scenes()? {
        scene.with_frame(|frame| {
            match contender.instance(&scatter_core::SceneFacts::of(frame)) {
                Ok(mut instance) => agreement(instance.as_mut(), frame),
                Err(error) => Err(format!("cannot be configured: {error}")),
            }
            .map_err(|fault| Broken::Rule(format!("{name}: {fault}")))
        })??;
    }
    Ok(())
}

/// Whether `supports` and `render` say the same of a frame, and a refusal leaves the image as it was.
pub fn agreement(instance: &mut dyn VolumetricShadow, frame: &Frame<'_>) -> Result<(), String> {
    /// A value that no technique computes by chance.
    const UNTOUCHED: f32 = 12_345.678;
    let mut image = ScatterImage::new();
    image.resize(frame.size());
    image.pixels_mut().0.fill([UNTOUCHED; 3]);
    let before = image.clone();
    let said = instance.supports(frame);
    match (said, instance.render(frame, &mut image)) {
        (Ok(()), Ok(_)) => Ok(()),
        (Ok(()), Err(error)) => Err(format!("supports() says yes and render() fails: {error}")),
        (Err(said), Ok(_)) => Err(format!("supports() says '{}' and render() renders", said.reason)),
        (Err(said), Err(RenderError::Unsupported(done))) if said != done => {
            Err(format!("supports() says '{}' and render() '{}'", said.reason, done.reason))
        }
        (Err(said), Err(RenderError::Unsupported(_))) if image != before => {
            Err(format!("supports() says '{}', and render() has touched the image", said.reason))
        }
        (Err(_), Err(RenderError::Unsupported(_))) => Ok(()),
        (Err(said), Err(error)) => Err(format!("supports() says '{}' and render() '{error}'", said.reason)),
    }
}
