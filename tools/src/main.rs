//! The `splatkit` command: one file per subcommand; flags that subcommands share are in modules of
//! their own. The library does all drawing.

#![deny(unsafe_code)]

mod arrays;
mod bench;
#[cfg(feature = "remote")]
mod cache;
mod camera;
mod check;
mod clip;
mod color;
mod compare;
mod completions;
mod convert;
mod demo;
mod describe;
mod engine;
mod failure;
mod figures;
mod formats;
mod frames;
mod generate;
mod given;
mod gpus;
mod info;
mod interrupt;
mod kernel;
mod limits;
mod load;
mod man;
mod method;
mod motion;
mod output;
mod overlay;
mod own;
mod parse;
mod progress;
mod render;
mod report;
mod samples;
mod scan;
mod scene;
mod scene_file;
mod show;
mod suite;
mod sweep;
mod terminal;
mod threads;
mod timing;
mod transfer;
mod video;
#[cfg(feature = "window")]
mod view;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use failure::Failure;
use given::Given;
use progress::Progress;
use splatkit::input::is_remote;
use std::{
    ffi::OsString,
    io::{ErrorKind, IsTerminal, Write},
    path::Path,
    process::ExitCode,
};

/// Draw volumes and surfaces as elliptic splats.
///
/// Exit codes: 0 done, 1 runtime or output error, 2 wrong usage, 3 bad input or nothing to draw, 4
/// no adapter, device failure or out of memory, 5 comparison failed, 130 interrupted.
#[derive(Parser)]
#[command(name = "splatkit", version, max_term_width = 110)]
struct Command {
    #[command(subcommand)]
    task: Task,

    /// Log more to stderr; give it twice (-vv) to log every frame.
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    verbose: u8,

    /// Print errors only.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,

    /// Compute on this many threads [default: RAYON_NUM_THREADS, or one per processor]
    #[arg(
        long,
        global = true,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=1024)
    )]
    threads: Option<u32>,

    #[cfg(feature = "remote")]
    #[command(flatten)]
    cache: cache::CacheFlags,
}

#[derive(Subcommand)]
enum Task {
    /// Draw meshes, point clouds and volumes in one picture.
    Render(Box<render::Render>),
    /// Show a scene in a window: turn it, edit its transfer function, cut it open, save pictures.
    #[cfg(feature = "window")]
    View(Box<view::View>),
    /// Print what a file contains.
    Info(info::Info),
    /// Build a hierarchy of splats from meshes and point clouds, or write 3D Gaussians; write a
    /// volume on another lattice or in bricks.
    Convert(Box<convert::Convert>),
    /// Check a hierarchy or a volume in bricks for damage, or another input for oddities.
    Check(check::Check),
    /// Compare two pictures.
    Compare(compare::Compare),
    /// Measure frame times; the camera turns by 5 degrees between frames.
    Bench(Box<bench::Bench>),
    /// Generate a mesh and a volume, draw them and print timings; needs no download.
    Demo(demo::Demo),
    /// Write a phantom (a volume or scattered samples) to try the other commands on, or a large
    /// scan.
    Generate(generate::Generate),
    /// Measure the quality of pictures: the tables of docs/volumes.md.
    Figures(figures::Figures),
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

fn main() -> ExitCode {
    quiet_drivers();
    let arguments = with_task(std::env::args_os().collect());
    let mut matches = match Command::command().try_get_matches_from(&arguments) {
        Ok(matches) => matches,
        Err(answer) => return tell(&answer),
    };
    match scene_file::expanded(&arguments, &matches, &Command::command()) {
        Ok(None) => {}
        Ok(Some(expanded)) => match Command::command().try_get_matches_from(expanded) {
            Ok(own) => matches = own,
            Err(answer) => return tell(&answer),
        },
        Err(failure) => return failure.report(),
    }
    let (given, command) = match Command::from_arg_matches(&matches) {
        Ok(command) => (Given::of(&matches), command),
        Err(answer) => return tell(&answer),
    };
    start_log(&command);
    interrupt::answer();
    if let Err(failure) = threads::start(command.threads) {
        return failure.report();
    }
    #[cfg(feature = "remote")]
    command.cache.apply();
    let progress = Progress::new(!command.quiet);
    let result = match command.task {
        Task::Render(task) => task.run(&given, &progress),
        #[cfg(feature = "window")]
        Task::View(task) => task.run(&matches, &progress),
        Task::Info(task) => task.run(&given, &progress),
        Task::Convert(task) => task.run(&given, &progress),
        Task::Check(task) => task.run(&progress),
        Task::Compare(task) => task.run(),
        Task::Bench(task) => task.run(&given, &progress),
        Task::Demo(task) => task.run(&progress),
        Task::Generate(task) => task.run(&progress),
        Task::Figures(task) => task.run(&progress),
        Task::Transfer(task) => task.run(&progress),
        Task::Gpus(task) => task.run(),
        Task::Formats(task) => task.run(),
        Task::Completions(task) => task.run(Command::command()),
        Task::Man(task) => task.run(Command::command()),
    };
    progress.clear();
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
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

/// Sets `XDG_RUNTIME_DIR`, the folder for a user's sockets, if it is unset, as on servers. Mesa's
/// drivers complain on stderr if it is missing, although they do not need it.
#[cfg_attr(
    unix,
    expect(unsafe_code, reason = "changing the environment is sound while there is one thread")
)]
fn quiet_drivers() {
    #[cfg(unix)]
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        let folder = std::env::temp_dir();
        // SAFETY: the process does this first, so no other thread reads the environment.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", folder) };
    }
}

/// Prints what clap returns instead of a command: a help text, the version, or an error in the
/// arguments.
fn tell(answer: &clap::Error) -> ExitCode {
    if answer.use_stderr() {
        let is_plain =
            |argument: std::ffi::OsString| terminal::is_safe(&argument.to_string_lossy());
        if std::env::args_os().all(is_plain) {
            answer.print().ok();
        } else {
            // Without colours: their escape sequences look like those in the arguments.
            write!(std::io::stderr(), "{}", terminal::safe_lines(&answer.render().to_string()))
                .ok();
        }
        return u8::try_from(answer.exit_code()).map_or(ExitCode::FAILURE, ExitCode::from);
    }
    match answer.print().and_then(|()| std::io::stdout().flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Failure::output(Path::new("stdout"), error).report()
        }
        _ => ExitCode::SUCCESS,
    }
}

/// Logs the library's events to stderr. `RUST_LOG` sets the filter if it is present.
fn start_log(command: &Command) {
    let default = match (command.quiet, command.verbose) {
        (true, _) => "off",
        (_, 0) => "error,splatkit=warn",
        (_, 1) => "error,splatkit=info",
        (_, _) => "warn,splatkit=trace",
    };
    let filter =
        tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| default.into());
    let colored = std::io::stderr().is_terminal()
        && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty());
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .fmt_fields(terminal::SafeFields)
        .with_writer(std::io::stderr)
        // If stderr is closed, reporting that on stderr would panic.
        .log_internal_errors(false)
        .with_ansi(colored)
        .with_target(false)
        // A span logs its duration when it closes.
        .with_span_events(tracing_subscriber::fmt::format::FmtSpan::CLOSE)
        .init();
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
