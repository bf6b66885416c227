//! The Vulkan instance: the loader opened at run time, and the validation layer's messages where they are wanted.

use std::ffi::{CStr, c_void};
use std::sync::Mutex;

use ash::{ext, vk};

use super::error::{RasterError, Tried as _};

/// Khronos' layer that checks every call.
const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// A loader, an instance, and an ear for the validation layer.
pub(super) struct Instance {
    pub raw: ash::Instance,
    ear: Option<Ear>,
    /// The loader's library: dropped, and with it closed, last.
    _entry: ash::Entry,
}

/// Hears what the validation layer says.
struct Ear {
    debug: ext::debug_utils::Instance,
    messenger: vk::DebugUtilsMessengerEXT,
    /// The callback's user data; boxed, so that it stays where it is.
    messages: Box<Messages>,
}

/// One line a message.
type Messages = Mutex<Vec<String>>;

impl Instance {
    /// Opens the loader. `validate` turns the validation layer on where it is installed.
    pub fn new(validate: bool) -> Result<Self, RasterError> {
        // SAFETY: loading the system's Vulkan loader runs its initialisers, which every Vulkan program trusts.
        let entry = unsafe { ash::Entry::load() }
            .map_err(|error| RasterError::NoLoader { problem: one_line(&error.to_string()) })?;
        let validate = validate && has_validation_layer(&entry);
        let application = vk::ApplicationInfo::default()
            .application_name(c"scatter")
            .engine_name(c"scatter")
            .api_version(vk::API_VERSION_1_3);
        let (layers, extensions) = if validate {
            (vec![VALIDATION_LAYER.as_ptr()], vec![ext::debug_utils::NAME.as_ptr()])
        } else {
            (Vec::new(), Vec::new())
        };
        let info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        // SAFETY: the info and all that it points to outlive the call; its layers and extensions are available.
        let raw = unsafe { entry.create_instance(&info, None) }
            .map_err(|code| RasterError::NoDriver { problem: format!("{code:?}") })?;
        let mut instance = Self { raw, ear: None, _entry: entry };
        if validate {
            instance.ear = Some(Ear::new(&instance._entry, &instance.raw)?);
        }
        Ok(instance)
    }

    /// Whether the validation layer listens.
    pub fn validates(&self) -> bool {
        self.ear.is_some()
    }

    /// What the validation layer has said so far.
    pub fn messages(&self) -> Vec<String> {
        self.ear.as_ref().map_or_else(Vec::new, |ear| {
            ear.messages.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone()
        })
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some(ear) = self.ear.take() {
            // SAFETY: the messenger is the instance's own, and is destroyed once.
            unsafe { ear.debug.destroy_debug_utils_messenger(ear.messenger, None) };
        }
        // SAFETY: devices hold the instance in an Arc, so none is left; the handle is destroyed once.
        unsafe { self.raw.destroy_instance(None) };
    }
}

impl Ear {
    fn new(entry: &ash::Entry, instance: &ash::Instance) -> Result<Self, RasterError> {
        let debug = ext::debug_utils::Instance::new(entry, instance);
        let messages = Box::new(Messages::default());
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            )
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                    | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
            )
            .pfn_user_callback(Some(hear))
            .user_data(std::ptr::from_ref::<Messages>(&messages).cast_mut().cast());
        // SAFETY: the extension is enabled; the user data is boxed and lives until the messenger is destroyed.
        let messenger = unsafe { debug.create_debug_utils_messenger(&info, None) }
            .tried("listen to the validation layer")?;
        Ok(Self { debug, messenger, messages })
    }
}

/// Vulkan's debug callback: appends the message's first line.
///
/// # Safety
/// `data` and its texts are valid during the call, and `user_data` is the messenger's [`Messages`].
unsafe extern "system" fn hear(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: as this function demands.
    let (messages, text) = unsafe {
        let text = (*data).message_as_c_str().map(|text| text.to_string_lossy().into_owned());
        (&*user_data.cast::<Messages>().cast_const(), text)
    };
    let line = one_line(&text.unwrap_or_default());
    messages.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(line);
    vk::FALSE
}

fn has_validation_layer(entry: &ash::Entry) -> bool {
    // SAFETY: both calls only read what the loader knows; no instance is needed.
    let (layers, extensions) = unsafe {
        (
            entry.enumerate_instance_layer_properties().unwrap_or_default(),
            entry.enumerate_instance_extension_properties(Some(VALIDATION_LAYER)).unwrap_or_default(),
        )
    };
    layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION_LAYER))
        && extensions
            .iter()
            .any(|extension| extension.extension_name_as_c_str() == Ok(ext::debug_utils::NAME))
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
