//! What all rungs share: whether there is a GPU (without one tests say SKIPPED, unless `SCATTER_GPU=required`), and modules with
//! another text.

use scatter_gpu::harness::HarnessDevice;
use scatter_kernels::modules::Module;

/// True, and said, where there is no adapter.
#[track_caller]
pub fn skipped() -> bool {
    match HarnessDevice::shared() {
        Ok(_) => false,
        Err(none) => {
            assert!(
                std::env::var_os("SCATTER_GPU").is_none_or(|value| value != "required"),
                "SCATTER_GPU=required, and there is no adapter: {none}"
            );
            println!("SKIPPED: no adapter: {none}");
            true
        }
    }
}

/// A module with another text, for the life of the process.
pub fn changed(module: &Module, name: &'static str, old: &str, new: &str) -> &'static Module {
    let text = module.assemble();
    assert!(text.contains(old), "{old}");
    let text: &'static str = Box::leak(text.replace(old, new).into_boxed_str());
    let files: &'static [&'static str] = Box::leak(Box::new([text]));
    Box::leak(Box::new(Module { name, files, entries: module.entries }))
}
