//! What only the inside of the module can show: that the validation layer is heard.

use std::io::Write as _;

use ash::vk;

use super::{RasterDevice, RasterOptions};

#[test]
fn a_mistake_made_on_purpose_is_heard() {
    let options = RasterOptions { validate: true, ..RasterOptions::default() };
    let skip = |reason: &str| {
        let _ = writeln!(std::io::stderr(), "SKIPPED a_mistake_made_on_purpose_is_heard: {reason}");
    };
    let device = match RasterDevice::open(&options) {
        Ok(device) => device,
        Err(error) => {
            let required = std::env::var_os("SCATTER_VULKAN").is_some_and(|value| value == "required");
            assert!(error.is_missing_driver() && !required, "SCATTER_VULKAN=required, and: {error}");
            return skip(&error.to_string());
        }
    };
    if !device.validates() {
        return skip("the validation layer is not installed; apt-get install vulkan-validationlayers");
    }
    assert_eq!(device.validation_messages(), Vec::<String>::new());
    // A buffer of no bytes.
    let info = vk::BufferCreateInfo::default().size(0).usage(vk::BufferUsageFlags::TRANSFER_SRC);
    // SAFETY: the mistake is the point: the layer reports it, and the software driver makes an empty buffer. Whatever
    // is made is destroyed at once and used for nothing.
    unsafe {
        if let Ok(buffer) = device.0.raw.create_buffer(&info, None) {
            device.0.raw.destroy_buffer(buffer, None);
        }
    }
    let messages = device.validation_messages();
    assert!(messages.iter().any(|message| message.contains("VUID-VkBufferCreateInfo-size")), "{messages:?}");
}
