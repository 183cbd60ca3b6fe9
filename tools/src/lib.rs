//! The `splatkit` command: one file per subcommand; flags that subcommands share are in modules of
//! their own. The library does all drawing.
//!
//! What is public is for `tools/measure`, which loads scenes and opens devices by the same flags.

#![deny(unsafe_code)]

mod arrays;
mod bench;
#[cfg(feature = "remote")]
mod cache;
#[doc(hidden)]
pub mod camera;
mod check;
mod clip;
mod color;
mod compare;
mod completions;
mod convert;
mod demo;
mod describe;
mod edit;
#[doc(hidden)]
pub mod engine;
#[doc(hidden)]
pub mod failure;
mod figure;
mod flag_names;
mod formats;
mod frames;
#[doc(hidden)]
pub mod generate;
mod given;
mod gpus;
mod help;
mod info;
mod input_values;
mod interrupt;
mod job;
mod kernel;
mod limits;
#[doc(hidden)]
pub mod load;
mod man;
mod method;
mod motion;
#[doc(hidden)]
pub mod output;
mod overlay;
#[doc(hidden)]
pub mod parse;
#[doc(hidden)]
pub mod progress;
mod publish;
mod render;
mod scan;
mod scene;
mod scene_file;
mod show;
#[doc(hidden)]
pub mod start;
mod terminal;
mod threads;
mod times;
#[doc(hidden)]
pub mod timing;
mod transfer;
mod transform;
#[cfg(feature = "window")]
mod view;
#[cfg(not(feature = "window"))]
#[path = "view_absent.rs"]
mod view;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use given::Given;
use splatkit::input::is_remote;
use start::{StartFlags, quiet_drivers, tell};
use std::{ffi::OsString, path::Path, process::ExitCode};

/// Draw volumes and surfaces as elliptic splats.
///
/// Exit codes: 0 done, 1 runtime or output error, 2 wrong usage, 3 bad input or nothing to draw, 4
/// no adapter, device failure or out of memory, 5 comparison failed, 130 interrupted.
#[derive(Parser)]
#[command(name = "splatkit", version, max_term_width = 110)]
struct Command {
    #[command(subcommand)]
    task: Task,

    #[command(flatten)]
    start: StartFlags,

    #[cfg(feature = "remote")]
    #[command(flatten)]
    cache: cache::CacheFlags,
}

#[derive(Subcommand)]
enum Task {
    /// Draw meshes, point clouds and volumes in one picture.
    Render(Box<render::Render>),
    /// Show a scene in a window: turn it, edit its transfer function, cut it open, save pictures.
    View(Box<view::View>),
    /// Make a page that shows a scene in a browser, as one file or as a folder for a static host.
    Publish(Box<publish::Publish>),
    /// Show a scene in a browser, by a server on this machine.
    #[cfg(feature = "serve")]
    Serve(Box<publish::Serve>),
    /// Print what a file contains.
    Info(info::Info),
    /// Build a hierarchy of splats from meshes and point clouds, or write 3D Gaussians; write a
    /// volume on another lattice or in bricks.
    Convert(Box<convert::Convert>),
    /// Check a hierarchy or a volume in bricks for damage, or another input for oddities.
    Check(check::Check),
    /// Compare two pictures, or two scenes.
    Compare(Box<compare::Compare>),
    /// Measure frame times; the camera turns by 5 degrees between frames.
    Bench(Box<bench::Bench>),
    /// Generate a mesh and a volume, draw them and print timings; needs no download.
    Demo(demo::Demo),
    /// Write a phantom (a volume or scattered samples) to try the other commands on, or a large
    /// scan.
    Generate(generate::Generate),
    /// Write the transfer function that a volume, cells or scattered samples would be drawn with,
    /// as JSON to start from.
    Transfer(Box<transfer::Transfer>),
    /// List the adapters that can draw, and their limits.
    Gpus(gpus::Gpus),
    /// List the formats of files: what they hold, and whether they are read in pieces and written.
    Formats(formats::Formats),
    /// Print a script that completes tasks and flags in a shell.
    Completions(completions::Completions),
    /// Write these help texts as manual pages.
    Man(man::Pages),
}

/// Returns the whole command line.
fn command() -> clap::Command {
    help::with_short_help(Command::command())
}

/// Runs the command with the arguments of this process.
pub fn main() -> ExitCode {
    quiet_drivers();
    let arguments = with_task(std::env::args_os().collect());
    let matches = match command().try_get_matches_from(&arguments) {
        Ok(matches) => matches,
        Err(answer) => return tell(&answer),
    };
    let (given, parsed) = match Command::from_arg_matches(&matches) {
        Ok(parsed) => (Given::of(&matches), parsed),
        Err(answer) => return tell(&answer),
    };
    let progress = match parsed.start.start() {
        Ok(progress) => progress,
        Err(failure) => return failure.report(),
    };
    #[cfg(feature = "remote")]
    parsed.cache.apply();
    let result = match parsed.task {
        Task::Render(task) => task.run(&given, &progress),
        Task::View(task) => task.run(&given, &progress),
        Task::Publish(task) => task.run(&given, &progress),
        #[cfg(feature = "serve")]
        Task::Serve(task) => task.run(&given, &progress),
        Task::Info(task) => task.run(&given, &progress),
        Task::Convert(task) => task.run(&given, &progress),
        Task::Check(task) => task.run(&progress),
        Task::Compare(task) => task.run(),
        Task::Bench(task) => task.run(&given, &progress),
        Task::Demo(task) => task.run(&progress),
        Task::Generate(task) => task.run(&progress),
        Task::Transfer(task) => task.run(&progress),
        Task::Gpus(task) => task.run(),
        Task::Formats(task) => task.run(),
        Task::Completions(task) => task.run(command()),
        Task::Man(task) => task.run(command()),
    };
    start::end(result, &progress)
}

/// Adds `render` if the first argument is a file instead of a task, so that `splatkit FILE` draws
/// it.
fn with_task(mut arguments: Vec<OsString>) -> Vec<OsString> {
    let is_file = |argument: &OsString| {
        let is_task = argument.to_str().is_some_and(|name| {
            name == "help"
                || name.starts_with('-')
                || Command::command().find_subcommand(name).is_some()
        });
        let path = Path::new(argument);
        !is_task && (path.exists() || path.extension().is_some() || is_remote(path))
    };
    if arguments.get(1).is_some_and(is_file) {
        arguments.insert(1, "render".into());
    }
    arguments
}

#[cfg(test)]
mod tests {
    use super::{Command, with_task};
    use clap::CommandFactory;

    /// Only clap finds errors such as two groups that share a flag's name, and only in this test.
    #[test]
    fn the_flags_go_together() {
        Command::command().debug_assert();
    }

    #[test]
    fn a_file_alone_is_drawn() {
        let words = |text: &str| text.split(' ').map(Into::into).collect::<Vec<_>>();
        assert_eq!(with_task(words("splatkit a.ply -q")), words("splatkit render a.ply -q"));
        for text in ["splatkit", "splatkit render a.ply", "splatkit --version", "splatkit rendr"] {
            assert_eq!(with_task(words(text)), words(text));
        }
    }
}
