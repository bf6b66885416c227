//! `test`: everything CI checks, in the order in which failures are cheapest to find.

use std::io::{BufRead, BufReader};
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

/// What the test harnesses counted.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
struct Counts {
    passed: u64,
    failed: u64,
    skipped: u64,
}

/// Runs all checks, also after one has failed, and prints one line for all.
pub fn run() -> anyhow::Result<Verdict> {
    let mut outcomes = Vec::new();
    let mut counts = Counts::default();
    for check in &CHECKS {
        stderr_line(&format!("xtask test: {}: cargo {}", check.name, check.arguments.join(" ")));
        let start = Instant::now();
        outcomes.push((check.name, cargo(check, &mut counts), start.elapsed()));
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
    let Counts { passed, failed, skipped } = counts;
    print(&format!("{passed} passed, {failed} failed, {skipped} skipped\n"))?;
    let all_passed = outcomes.iter().all(|(_, passed, _)| *passed);
    print(&format!("xtask test: {}: {}\n", if all_passed { "ok" } else { "FAILED" }, words.join(", ")))?;
    Ok(if all_passed { Verdict::Well } else { Verdict::OutOfTolerance })
}

/// Whether cargo succeeded. What it prints goes through, and what the harnesses counted is added up.
fn cargo(check: &Check, counts: &mut Counts) -> bool {
    // The workspace that this program was built from, wherever it is called from.
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(check.arguments).current_dir(workspace).stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    if let Some(flags) = check.rustdoc_flags {
        command.env("RUSTDOCFLAGS", flags);
    }
    let Ok(mut child) = command.spawn() else { return false };
    let (out, err) = (child.stdout.take(), child.stderr.take());
    let skipped = std::thread::scope(|scope| {
        // Skips are written past the harness, to stderr.
        let errors = scope.spawn(move || {
            let lines = err.into_iter().flat_map(|err| BufReader::new(err).lines().map_while(Result::ok));
            lines.inspect(|line| stderr_line(line)).filter(|line| line.starts_with("SKIPPED ")).count()
        });
        for line in out.into_iter().flat_map(|out| BufReader::new(out).lines().map_while(Result::ok)) {
            counts.add(&line);
            // A reader that has gone away is no reason to stop checking.
            let _ = print(&format!("{line}\n"));
        }
        errors.join().unwrap_or(0)
    });
    counts.skipped += skipped as u64;
    child.wait().is_ok_and(|status| status.success())
}

impl Counts {
    /// Reads a harness's closing line, `test result: ok. 5 passed; 0 failed; …`.
    fn add(&mut self, line: &str) {
        let Some((_, result)) = line.split_once("test result: ") else { return };
        for part in result.split([';', '.']) {
            let mut words = part.split_whitespace();
            let (Some(count), Some(what)) = (words.next().and_then(|n| n.parse::<u64>().ok()), words.next())
            else {
                continue;
            };
            match what {
                "passed" => self.passed += count,
                "failed" => self.failed += count,
                "ignored" => self.skipped += count,
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closing_lines_add_up() {
        let mut counts = Counts::default();
        counts.add(
            "test result: ok. 55 passed; 0 failed; 2 ignored; 0 measured; 0 filtered out; finished in 0.2s",
        );
        counts.add(
            "test result: FAILED. 3 passed; 1 failed; 0 ignored; 0 measured; 9 filtered out; finished in 1s",
        );
        counts.add("test nothing ... ok");
        assert_eq!(counts, Counts { passed: 58, failed: 1, skipped: 2 });
    }
}
