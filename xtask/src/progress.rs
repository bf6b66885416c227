//! Progress on stderr: a line that moves on a terminal, a plain line a stage elsewhere; nothing for what takes a second.

use std::fmt::Write;
use std::io::{IsTerminal, stderr};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use crate::output::stderr_line;

/// What takes less is over before anybody reads it.
const SILENT: Duration = Duration::from_secs(1);

/// Tells people what is going on.
pub struct Progress {
    shown: Shown,
}

enum Shown {
    /// On a terminal.
    Bar(ProgressBar),
    /// Elsewhere: stages go to a thread that prints them, from the first second on. None once it has been ended.
    Lines(Option<(Sender<String>, JoinHandle<()>)>),
}

impl Progress {
    /// `total` steps, none for an unknown number.
    pub fn new(total: Option<u64>) -> Self {
        if !stderr().is_terminal() {
            let (stages, received) = channel();
            let printer = std::thread::spawn(move || print_lines(&received));
            return Self { shown: Shown::Lines(Some((stages, printer))) };
        }
        let bar = total.map_or_else(ProgressBar::new_spinner, ProgressBar::new);
        bar.set_style(style(total.is_some()));
        bar.enable_steady_tick(Duration::from_millis(120));
        Self { shown: Shown::Bar(bar) }
    }

    /// Says what comes next.
    pub fn stage(&self, text: &str) {
        match &self.shown {
            Shown::Bar(bar) => bar.set_message(text.to_string()),
            // A printer that is gone has nobody to print to.
            Shown::Lines(Some((stages, _))) => drop(stages.send(text.to_string())),
            Shown::Lines(None) => {}
        }
    }

    /// One step of the total is done.
    pub fn step(&self) {
        if let Shown::Bar(bar) = &self.shown {
            bar.inc(1);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        match &mut self.shown {
            Shown::Bar(bar) => bar.finish_and_clear(),
            Shown::Lines(printer) => {
                if let Some((stages, thread)) = printer.take() {
                    // The closed channel ends it.
                    drop(stages);
                    let _ = thread.join();
                }
            }
        }
    }
}

/// Prints stages as they come, but for those that are over within the first second.
fn print_lines(stages: &std::sync::mpsc::Receiver<String>) {
    let start = Instant::now();
    let mut current = None;
    loop {
        match stages.recv_timeout(SILENT.saturating_sub(start.elapsed())) {
            Ok(stage) => current = Some(stage),
            Err(RecvTimeoutError::Timeout) => break,
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
    if let Some(stage) = current {
        stderr_line(&stage);
    }
    for stage in stages {
        stderr_line(&stage);
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
