//! `test`: everything CI checks, in the order in which failures are cheapest to find.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use clap::Parser;

use crate::Verdict;
use crate::flags::{Cli, Command as XtaskCommand};
use crate::output::{print, stderr_line};

/// One check: its name, cargo's arguments, and rustdoc's flags.
struct Check {
    name: &'static str,
    arguments: &'static [&'static str],
    rustdoc_flags: Option<&'static str>,
}

const CHECKS: [Check; 4] = [
    Check { name: "format", arguments: &["fmt", "--all", "--check"], rustdoc_flags: None },
    Check {
        name: "lints",
        arguments: &["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"],
        rustdoc_flags: None,
    },
    Check {
        name: "docs",
        arguments: &["doc", "--workspace", "--no-deps"],
        rustdoc_flags: Some("-D warnings"),
    },
    Check { name: "tests", arguments: &["test", "--workspace"], rustdoc_flags: None },
];

/// Runs all checks, also after one has failed, and prints one line for all.
pub fn run() -> anyhow::Result<Verdict> {
    let mut outcomes = Vec::new();
    for check in &CHECKS {
        stderr_line(&format!("xtask test: {}: cargo {}", check.name, check.arguments.join(" ")));
        let start = Instant::now();
        outcomes.push((check.name, cargo(check), start.elapsed()));
    }
    stderr_line("xtask test: validate --quick");
    let start = Instant::now();
    let validate = match Cli::try_parse_from(["xtask", "validate", "--quick"]).map(|cli| cli.command) {
        Ok(XtaskCommand::Validate(flags)) => super::validate::run(&flags)? == Verdict::Well,
        _ => false,
    };
    outcomes.push(("validate", validate, start.elapsed()));
    let words: Vec<String> = outcomes
        .iter()
        .map(|(name, passed, time)| {
            format!("{name} {} ({:.0} s)", if *passed { "ok" } else { "FAILED" }, time.as_secs_f64())
        })
        .collect();
    let all_passed = outcomes.iter().all(|(_, passed, _)| *passed);
    print(&format!("xtask test: {}: {}\n", if all_passed { "ok" } else { "FAILED" }, words.join(", ")))?;
    Ok(if all_passed { Verdict::Well } else { Verdict::OutOfTolerance })
}

/// Whether cargo succeeded.
fn cargo(check: &Check) -> bool {
    // The workspace that this program was built from, wherever it is called from.
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(check.arguments).current_dir(workspace).stdin(Stdio::null());
    if let Some(flags) = check.rustdoc_flags {
        command.env("RUSTDOCFLAGS", flags);
    }
    command.status().is_ok_and(|status| status.success())
}
