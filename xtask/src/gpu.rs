//! Techniques on the GPU, where this build has them and the machine a driver.

use scatter::Technique;

use anyhow::bail;
use scatter_validate::Twin;

use crate::flags::{Device, DeviceFlags};

/// An id as it is meant on a device: `raymarch` on the GPU is `raymarch@gpu`; references stay what they are.
pub fn id_on(device: Device, id: &str) -> String {
    if device == Device::Gpu && !id.contains('@') && !id.starts_with("truth-") {
        format!("{id}@gpu")
    } else {
        id.into()
    }
}

/// Takes the card that is asked for. One that is not there is an error that lists those that are; so is one for nothing.
pub fn choose(on: &DeviceFlags, is_on_gpu: bool) -> anyhow::Result<()> {
    let Some(asked) = &on.gpu_adapter else { return Ok(()) };
    if !is_on_gpu {
        bail!("--gpu-adapter: the CPU renders; add --device gpu, or name a --method that ends in @gpu");
    }
    #[cfg(feature = "gpu")]
    scatter_gpu::harness::HarnessDevice::share(asked);
    match adapter() {
        Ok(_) => Ok(()),
        Err(none) => bail!("--gpu-adapter {asked}: {none}"),
    }
}

/// The GPU's techniques, each with the CPU's whose twin it is.
pub fn twins() -> Vec<Twin<'static>> {
    let twin = |id: &'static str| {
        let of = scatter::technique(id.strip_suffix("@gpu")?)?;
        Some(Twin { id, of })
    };
    techniques().iter().filter_map(|technique| twin(technique.info().id)).collect()
}

/// All techniques of the GPU.
pub fn techniques() -> &'static [&'static dyn Technique] {
    #[cfg(feature = "gpu")]
    return scatter_gpu::harness::TECHNIQUES;
    #[cfg(not(feature = "gpu"))]
    return &[];
}

/// The technique with that id.
pub fn technique(id: &str) -> Option<&'static dyn Technique> {
    techniques().iter().copied().find(|technique| technique.info().id == id)
}

/// Ids of the GPU's techniques where a software driver runs them: their times are not a GPU's.
pub fn emulated(techniques: &[&dyn Technique]) -> Vec<&'static str> {
    let on_gpu = techniques.iter().map(|technique| technique.info().id).filter(|id| id.ends_with("@gpu"));
    #[cfg(feature = "gpu")]
    {
        let mut on_gpu = on_gpu.peekable();
        // Without a technique of the GPU no driver is looked for.
        let is_emulated = on_gpu.peek().is_some()
            && scatter_gpu::harness::HarnessDevice::shared().is_ok_and(|device| device.is_emulated());
        if is_emulated { on_gpu.collect() } else { Vec::new() }
    }
    #[cfg(not(feature = "gpu"))]
    on_gpu.collect()
}

/// Makes what is made once, which belongs to no technique's first frame.
pub fn warm_up() {
    #[cfg(feature = "gpu")]
    if let Ok(device) = scatter_gpu::harness::HarnessDevice::shared() {
        device.gpu.warm_up();
    }
}

/// What the GPU's techniques run on, or why they cannot.
pub fn adapter() -> Result<String, String> {
    #[cfg(feature = "gpu")]
    return match scatter_gpu::harness::HarnessDevice::shared() {
        Ok(device) if device.is_emulated() => Ok(device.describe()),
        Ok(device) => Ok(format!(
            "{}; its times: set-up, submission, waiting (maps are uploaded before, images read back after)",
            device.describe()
        )),
        Err(none) => Err(format!("no adapter: {none}")),
    };
    #[cfg(not(feature = "gpu"))]
    return Err("xtask was built without its feature gpu".into());
}
