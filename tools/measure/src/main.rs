//! The `splatkit-measure` command: what developers measure for the tables of the documentation. It
//! draws its own scenes. `splatkit bench` measures a user's.

#![deny(unsafe_code)]

mod figures;
mod report;
mod suite;
mod sweep;

use clap::{Parser, Subcommand};
use splatkit_tools::start::{StartFlags, end, quiet_drivers, tell};
use std::process::ExitCode;

/// Measure the frame times and the quality of pictures that the documentation states.
///
/// Exit codes are those of splatkit: 0 done, 1 runtime or output error, 2 wrong usage, 3 bad input
/// or nothing to draw, 4 no adapter, device failure or out of memory, 130 interrupted.
#[derive(Parser)]
#[command(name = "splatkit-measure", version, max_term_width = 110)]
struct Command {
    #[command(subcommand)]
    task: Task,

    #[command(flatten)]
    start: StartFlags,
}

#[derive(Subcommand)]
enum Task {
    /// Measure the frame times of a suite of cases. docs/performance.md describes each case.
    Suite(Box<suite::Suite>),
    /// Measure how the frame time follows the view, the data and the settings, step by step.
    /// docs/performance.md explains how to read the tables.
    Sweep(Box<sweep::Sweep>),
    /// Measure the quality of pictures: the tables of docs/volumes.md.
    Figures(Box<figures::Figures>),
}

fn main() -> ExitCode {
    quiet_drivers();
    let command = match Command::try_parse() {
        Ok(command) => command,
        Err(answer) => return tell(&answer),
    };
    let progress = match command.start.start() {
        Ok(progress) => progress,
        Err(failure) => return failure.report(),
    };
    let result = match command.task {
        Task::Suite(task) => task.run(&progress),
        Task::Sweep(task) => task.run(&progress),
        Task::Figures(task) => task.run(&progress),
    };
    end(result, &progress)
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    /// Only clap finds errors such as two groups that share a flag's name, and only in this test.
    #[test]
    fn the_flags_go_together() {
        super::Command::command().debug_assert();
    }
}
