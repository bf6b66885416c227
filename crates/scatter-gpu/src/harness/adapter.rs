//! Which adapter renders: the best one, or one by its number or a part of its name.

/// No driver, or none that gives a device.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NoAdapter(pub String);

/// All adapters, in the order of their numbers.
pub fn adapters(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()))
}

/// Their names.
pub fn adapter_names() -> Vec<String> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    adapters(&instance).iter().map(|adapter| named(&adapter.get_info())).collect()
}

/// The one that is asked for: a number, or a part of a name in any case. The error lists what there is.
pub fn chosen(instance: &wgpu::Instance, asked: Option<&str>) -> Result<wgpu::Adapter, NoAdapter> {
    let Some(asked) = asked else {
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        return pollster::block_on(instance.request_adapter(&options))
            .map_err(|error| NoAdapter(error.to_string()));
    };
    let mut all = adapters(instance);
    let names: Vec<String> = all.iter().map(|adapter| named(&adapter.get_info())).collect();
    match index_of(asked, &names) {
        Some(index) => Ok(all.swap_remove(index)),
        None => Err(NoAdapter(unknown(asked, &names))),
    }
}

/// An adapter's name with its driver and its API: two APIs have the same card.
pub fn named(info: &wgpu::AdapterInfo) -> String {
    let driver = format!("{} {}", info.driver, info.driver_info);
    format!("{} ({}, {:?})", info.name, driver.trim(), info.backend)
}

fn index_of(asked: &str, names: &[String]) -> Option<usize> {
    if let Ok(index) = asked.parse::<usize>() {
        return (index < names.len()).then_some(index);
    }
    let asked = asked.to_lowercase();
    names.iter().position(|name| !asked.is_empty() && name.to_lowercase().contains(&asked))
}

fn unknown(asked: &str, names: &[String]) -> String {
    if names.is_empty() {
        return format!("\"{asked}\": there is none at all; install a Vulkan driver");
    }
    // One line, whatever there is.
    let listed: Vec<String> =
        names.iter().enumerate().map(|(index, name)| format!("{index}: {name}")).collect();
    format!("\"{asked}\" is none of them; give a part of a name or a number of {}", listed.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adapters_are_found_by_number_and_by_a_part_of_the_name() {
        let names: Vec<String> = ["llvmpipe (LLVM 15) (Vulkan)", "GeForce 9 (Vulkan)", "GeForce 9 (Dx12)"]
            .map(String::from)
            .into();
        for (asked, index) in
            [("0", Some(0)), ("2", Some(2)), ("3", None), ("geforce", Some(1)), ("Dx12", Some(2))]
        {
            assert_eq!(index_of(asked, &names), index, "{asked}");
        }
        for asked in ["", "Radeon", "-1"] {
            assert_eq!(index_of(asked, &names), None, "{asked}");
        }
        let error = unknown("Radeon", &names);
        assert!(error.contains("0: llvmpipe") && error.contains("2: GeForce 9 (Dx12)"), "{error}");
        assert!(unknown("7", &[]).contains("install"));
    }
}
