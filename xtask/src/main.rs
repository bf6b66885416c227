//! `cargo xtask`: the door for people who try, compare and regression-test techniques.
//!
//! `main` reads the command line, dispatches, and turns what comes back into an exit code: 0 all is well, 1 a
//! technique is out of tolerance (or a check failed), 2 the input or the command line is wrong (one line on stderr).

mod auto;
mod commands;
mod flags;
mod gpu;
mod machine_file;
mod mesh_file;
mod output;
mod progress;
mod run;
mod select;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use clap::Parser;

use flags::{Cli, Command};
use scatter_validate::checks::counting_allocator::CountingAllocator;

/// Counts a thread's allocations for `stress`: one addition each, and timed frames allocate nothing.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return command_line_error(&error),
    };
    // A fault of ours is still one line, not a backtrace.
    std::panic::set_hook(Box::new(|_| {}));
    let outcome = catch_unwind(AssertUnwindSafe(|| dispatch(cli.command)));
    match outcome {
        Ok(Ok(Verdict::Well)) => ExitCode::SUCCESS,
        Ok(Ok(Verdict::OutOfTolerance)) => ExitCode::from(1),
        Ok(Err(error)) => {
            output::error_line(&one_line(&error));
            ExitCode::from(2)
        }
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
            output::error_line(&format!("internal fault: {text}; please report it with the command line"));
            ExitCode::from(2)
        }
    }
}

/// The error and its causes, each said once: our errors often quote their cause already.
fn one_line(error: &anyhow::Error) -> String {
    error.chain().fold(String::new(), |mut line, cause| {
        let cause = cause.to_string();
        if !line.contains(&cause) {
            line = if line.is_empty() { cause } else { format!("{line}: {cause}") };
        }
        line
    })
}

/// What a command found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    /// Everything is as it should be.
    Well,
    /// A technique is out of tolerance, or a check failed.
    OutOfTolerance,
}

fn dispatch(command: Command) -> anyhow::Result<Verdict> {
    match command {
        Command::Validate(flags) => commands::validate::run(&flags),
        Command::Tradeoff(flags) => commands::tradeoff::run(&flags),
        Command::Render(flags) => commands::render::run(&flags),
        Command::Plan(flags) => commands::plan::run(&flags),
        Command::Calibrate(flags) => commands::calibrate::run(&flags),
        Command::Compare(flags) => commands::compare::run(&flags),
        Command::Methods(flags) => commands::methods::run(&flags),
        #[cfg(feature = "gpu")]
        Command::GpuReport(flags) => commands::gpu_report::run(&flags),
        #[cfg(feature = "gpu")]
        Command::Shaders(flags) => commands::shaders::run(&flags),
        Command::Shots(flags) => commands::shots::run(&flags),
        Command::Stress(flags) => commands::stress::run(&flags),
        Command::Test => commands::test::run(),
    }
}

/// Help and version as clap prints them; everything else as one line.
fn command_line_error(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        // A reader who closes the pipe has seen enough.
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    let text = error.to_string();
    let lines = text.lines().map(str::trim).take_while(|line| !line.starts_with("Usage:"));
    let parts: Vec<&str> =
        lines.filter(|line| !line.is_empty() && !line.starts_with("For more information")).collect();
    let line = parts.join(" ");
    let problem = line.strip_prefix("error: ").unwrap_or(&line);
    output::error_line(&format!("{problem}; see cargo xtask --help"));
    ExitCode::from(2)
}
