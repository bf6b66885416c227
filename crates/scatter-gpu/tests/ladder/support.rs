//! Whether there is a GPU: without one tests say SKIPPED, unless `SCATTER_GPU=required`.

use scatter_gpu::harness::HarnessDevice;

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
