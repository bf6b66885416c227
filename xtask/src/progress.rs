//! Progress on stderr: a line that moves on a terminal, plain lines elsewhere; nothing for what takes a second.

use std::fmt::Write;
use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use crate::output::stderr_line;

/// What takes less is over before anybody reads it.
const SILENT: Duration = Duration::from_secs(1);

/// Tells people what is going on.
pub struct Progress {
    bar: Option<ProgressBar>,
    start: Instant,
    /// Whether stages are lines of their own where stderr is no terminal.
    plain_lines: bool,
}

impl Progress {
    /// `total` steps, none for an unknown number. `plain_lines` for jobs of many stages.
    pub fn new(total: Option<u64>, plain_lines: bool) -> Self {
        let bar = stderr().is_terminal().then(|| {
            let bar = total.map_or_else(ProgressBar::new_spinner, ProgressBar::new);
            bar.set_style(style(total.is_some()));
            bar.enable_steady_tick(Duration::from_millis(120));
            bar
        });
        Self { bar, start: Instant::now(), plain_lines }
    }

    /// Says what comes next.
    pub fn stage(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.set_message(text.to_string()),
            None if self.plain_lines && self.start.elapsed() > SILENT => stderr_line(text),
            None => {}
        }
    }

    /// One step of the total is done.
    pub fn step(&self) {
        if let Some(bar) = &self.bar {
            bar.inc(1);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// An empty line for the first second, then spinner, time, steps and message.
fn style(has_total: bool) -> ProgressStyle {
    let line = move |state: &ProgressState, writer: &mut dyn Write| {
        if state.elapsed() > SILENT {
            let seconds = state.elapsed().as_secs();
            let _ = write!(writer, "{seconds:>3} s ");
            if has_total {
                let _ = write!(writer, "[{}/{}] ", state.pos() + 1, state.len().unwrap_or_default());
            }
        }
    };
    // A template that does not parse would show in the first run on a terminal; the default one serves then.
    ProgressStyle::with_template("{line}{wide_msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .with_key("line", line)
}
