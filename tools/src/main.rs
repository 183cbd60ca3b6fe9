//! The `splatkit` command: one file per subcommand, the flags that they share in modules of their own. All drawing is the
//! library's.

#![deny(unsafe_code)]

mod bench;
mod camera;
mod check;
mod clip;
mod compare;
mod convert;
mod demo;
mod describe;
mod engine;
mod failure;
mod figures;
mod generate;
mod gpus;
mod info;
mod interrupt;
mod kernel;
mod limits;
mod load;
mod method;
mod output;
mod parse;
mod progress;
mod render;
mod report;
mod samples;
mod scan;
mod scene;
mod show;
mod suite;
mod sweep;
mod terminal;
mod threads;
mod timing;

use clap::{Parser, Subcommand};
use failure::Failure;
use progress::Progress;
use std::{
    io::{ErrorKind, IsTerminal, Write},
    path::Path,
    process::ExitCode,
};

/// Draws volumes and surfaces as elliptic splats.
///
/// Exit codes: 0 done, 1 runtime or output, 2 usage, 3 bad input or nothing to draw, 4 no adapter or out of memory,
/// 5 comparison failed, 130 interrupted.
#[derive(Parser)]
#[command(name = "splatkit", version, max_term_width = 110)]
struct Command {
    #[command(subcommand)]
    task: Task,

    /// Tells more on stderr; twice for every frame.
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    verbose: u8,

    /// Tells nothing but errors.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,

    /// Compute on this many threads [default: RAYON_NUM_THREADS, or as many as there are processors]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

#[derive(Subcommand)]
enum Task {
    /// Draws meshes, clouds and volumes in one picture.
    Render(Box<render::Render>),
    /// Tells what is in a file.
    Info(info::Info),
    /// Makes a hierarchy of splats from meshes and clouds; writes 3D Gaussians; writes volumes on other lattices or in bricks.
    Convert(Box<convert::Convert>),
    /// Looks for damage in a hierarchy or a volume in bricks, or for what is odd in another input.
    Check(check::Check),
    /// Compares two pictures.
    Compare(compare::Compare),
    /// Measures frame times: the camera turns by 5 degrees between frames.
    Bench(Box<bench::Bench>),
    /// Makes a mesh and a volume and draws them: pictures and timings with no download.
    Demo(demo::Demo),
    /// Writes a phantom: a volume or scattered samples to try the other commands on; or a large scan.
    Generate(generate::Generate),
    /// Measures the quality of what is drawn: the tables of docs/volumes.md.
    Figures(figures::Figures),
    /// Lists the adapters that can draw, and their limits.
    Gpus(gpus::Gpus),
}

fn main() -> ExitCode {
    quiet_drivers();
    let command = match Command::try_parse() {
        Ok(command) => command,
        Err(answer) => return tell(&answer),
    };
    start_log(&command);
    interrupt::answer();
    if let Err(failure) = threads::start(command.threads) {
        return failure.report();
    }
    let progress = Progress::new(!command.quiet);
    let result = match command.task {
        Task::Render(task) => task.run(&progress),
        Task::Info(task) => task.run(&progress),
        Task::Convert(task) => task.run(&progress),
        Task::Check(task) => task.run(&progress),
        Task::Compare(task) => task.run(),
        Task::Bench(task) => task.run(&progress),
        Task::Demo(task) => task.run(&progress),
        Task::Generate(task) => task.run(&progress),
        Task::Figures(task) => task.run(&progress),
        Task::Gpus(task) => task.run(),
    };
    progress.clear();
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

/// Mesa's drivers complain on stderr where the folder for a user's sockets is not set, as on servers. They need none.
#[cfg_attr(
    unix,
    expect(unsafe_code, reason = "the environment may be changed while there is one thread")
)]
fn quiet_drivers() {
    #[cfg(unix)]
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        let folder = std::env::temp_dir();
        // SAFETY: this is the first thing that the process does; no other thread reads the environment.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", folder) };
    }
}

/// Prints what clap answers instead of a command: a help text, the version, or what is wrong with the arguments.
fn tell(answer: &clap::Error) -> ExitCode {
    if answer.use_stderr() {
        let is_plain =
            |argument: std::ffi::OsString| terminal::is_safe(&argument.to_string_lossy());
        if std::env::args_os().all(is_plain) {
            answer.print().ok();
        } else {
            // Without colours, since those cannot be told from what arguments hold.
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

/// Sends the library's events to stderr; `RUST_LOG` decides where it is set.
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
        // Where stderr is closed, telling of that on stderr would panic.
        .log_internal_errors(false)
        .with_ansi(colored)
        .with_target(false)
        // A span that closes tells its time.
        .with_span_events(tracing_subscriber::fmt::format::FmtSpan::CLOSE)
        .init();
}

#[cfg(test)]
mod tests {
    use super::Command;
    use clap::CommandFactory;

    /// Flags of a name that two groups share, and the like, are found by clap alone, and only here.
    #[test]
    fn the_flags_go_together() {
        Command::command().debug_assert();
    }
}
