//! How a process begins and ends: its log, its threads, what Ctrl-C does, and its exit code.

use crate::{failure::Failure, interrupt, progress::Progress, terminal, threads};
use clap::Args;
use std::{
    io::{ErrorKind, IsTerminal, Write},
    path::Path,
    process::ExitCode,
};
use tracing_subscriber::{
    filter::{LevelFilter, Targets},
    layer::SubscriberExt,
    util::SubscriberInitExt,
};

/// The flags of every task.
#[derive(Args, Debug)]
pub struct StartFlags {
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
        value_parser = clap::value_parser!(u32).range(1..=1024),
        hide_short_help = true
    )]
    threads: Option<u32>,
}

impl StartFlags {
    /// Starts the log and the threads, and handles Ctrl-C. Returns the line of progress.
    pub fn start(&self) -> Result<Progress, Failure> {
        start_log(self);
        interrupt::answer();
        threads::start(self.threads)?;
        Ok(Progress::new(!self.quiet))
    }
}

/// Prints the failure, if there is one, and returns the exit code.
pub fn end(result: Result<(), Failure>, progress: &Progress) -> ExitCode {
    progress.clear();
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            let code = failure.code();
            failure.report();
            std::io::stdout().flush().ok();
            // At once: the ordinary exit unloads the driver, whose threads may still be drawing on
            // a device that was lost, and then crash.
            signal_hook::low_level::exit(code.into())
        }
    }
}

/// Sets `XDG_RUNTIME_DIR`, the folder for a user's sockets, if it is unset, as on servers. Mesa's
/// drivers complain on stderr if it is missing, although they do not need it.
#[cfg_attr(
    unix,
    expect(unsafe_code, reason = "changing the environment is sound while there is one thread")
)]
pub fn quiet_drivers() {
    #[cfg(unix)]
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        let folder = std::env::temp_dir();
        // SAFETY: the process does this first, so no other thread reads the environment.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", folder) };
    }
}

/// Prints what clap returns instead of a command: a help text, the version, or an error in the
/// arguments.
pub fn tell(answer: &clap::Error) -> ExitCode {
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
fn start_log(flags: &StartFlags) {
    let (others, own) = match (flags.quiet, flags.verbose) {
        (true, _) => (LevelFilter::OFF, LevelFilter::OFF),
        (_, 0) => (LevelFilter::ERROR, LevelFilter::WARN),
        (_, 1) => (LevelFilter::ERROR, LevelFilter::INFO),
        (_, _) => (LevelFilter::WARN, LevelFilter::TRACE),
    };
    let filter: Targets = std::env::var("RUST_LOG")
        .ok()
        .filter(|text| !text.is_empty())
        .and_then(|text| text.parse().ok())
        .unwrap_or_else(|| Targets::new().with_default(others).with_target("splatkit", own));
    let levels = filter.iter().map(|(_, level)| level).chain(filter.default_level());
    let colored = std::io::stderr().is_terminal()
        && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty());
    tracing_subscriber::fmt()
        .with_max_level(levels.max().unwrap_or(LevelFilter::OFF))
        .fmt_fields(terminal::SafeFields)
        .with_writer(std::io::stderr)
        // If stderr is closed, reporting that on stderr would panic.
        .log_internal_errors(false)
        .with_ansi(colored)
        .with_target(false)
        // A span logs its duration when it closes.
        .with_span_events(tracing_subscriber::fmt::format::FmtSpan::CLOSE)
        .finish()
        .with(filter)
        .init();
}
