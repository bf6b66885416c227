//! Runs a job in a thread pool of its own, so that `--threads` means what it says.

use anyhow::Context;

/// Runs `job` in a pool of that many threads (one a core by default); `job` is told how many there are.
pub fn in_pool<R: Send>(threads: Option<u32>, job: impl FnOnce(usize) -> R + Send) -> anyhow::Result<R> {
    let pool = rayon::ThreadPoolBuilder::new()
        // 0 is rayon's word for one a core.
        .num_threads(threads.unwrap_or(0) as usize)
        .build()
        .context("--threads: the threads cannot be started; give a smaller number")?;
    Ok(pool.install(|| job(pool.current_num_threads())))
}
