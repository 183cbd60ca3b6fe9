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
    fmt::format,
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
/// drivers complain on stderr if it is missing, although they do not need it. It is a folder of the
/// user's alone; where there is none, the variable stays unset.
#[cfg_attr(
    target_os = "linux",
    expect(unsafe_code, reason = "changing the environment is sound while there is one thread")
)]
pub fn quiet_drivers() {
    #[cfg(target_os = "linux")]
    if std::env::var_os("XDG_RUNTIME_DIR").is_none()
        && let Some(folder) = runtime_folder(&std::env::temp_dir())
    {
        // SAFETY: the process does this first, so no other thread reads the environment.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", folder) };
    }
}

/// Returns a folder below `temporary` that belongs to the user and that nobody else may enter. If
/// somebody else has made one of its name, there is none.
#[cfg(target_os = "linux")]
fn runtime_folder(temporary: &Path) -> Option<std::path::PathBuf> {
    use std::os::unix::fs::{DirBuilderExt, MetadataExt};
    // The owner of a process is the user that it runs as.
    let user = std::fs::metadata("/proc/self").ok()?.uid();
    let folder = temporary.join(format!("splatkit-{user}"));
    std::fs::DirBuilder::new().mode(0o700).create(&folder).ok();
    // Not of what a link leads to.
    let metadata = folder.symlink_metadata().ok()?;
    (metadata.is_dir() && metadata.uid() == user && metadata.mode() & 0o077 == 0).then_some(folder)
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

impl StartFlags {
    /// Returns which events are logged: those of the library. Those of other crates name neither
    /// the file nor what to do, and an error says what they mean.
    fn events(&self) -> Targets {
        let level = match (self.quiet, self.verbose) {
            (true, _) => LevelFilter::OFF,
            (_, 0) => LevelFilter::WARN,
            (_, 1) => LevelFilter::INFO,
            (_, _) => LevelFilter::TRACE,
        };
        Targets::new().with_target("splatkit", level)
    }
}

/// Logs the library's events to stderr. `RUST_LOG` sets the filter if it is present, also for other
/// crates.
fn start_log(flags: &StartFlags) {
    let filter: Targets = std::env::var("RUST_LOG")
        .ok()
        .filter(|text| !text.is_empty())
        .and_then(|text| text.parse().ok())
        .unwrap_or_else(|| flags.events());
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
        // A span logs its duration when it closes.
        .with_span_events(format::FmtSpan::CLOSE)
        .event_format(terminal::Events(format().with_ansi(colored).with_target(false)))
        .finish()
        .with(filter)
        .init();
}

#[cfg(test)]
mod tests {
    use super::*;
    use tracing::Level;

    #[test]
    fn other_crates_log_nothing() {
        for (quiet, verbose) in [(true, 0), (false, 0), (false, 1), (false, 2), (false, 9)] {
            let events = StartFlags { verbose, quiet, threads: None }.events();
            for target in ["jpeg2k::codec", "wgpu_core::device", "naga", "log", ""] {
                assert!(!events.would_enable(target, &Level::ERROR), "{target}, -v {verbose}");
            }
            assert_eq!(events.would_enable("splatkit::formats", &Level::WARN), !quiet);
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn sockets_have_a_folder_of_the_users_alone() {
        use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
        let temporary = tempfile::tempdir().expect("a folder");
        let folder = runtime_folder(temporary.path()).expect("a folder");
        assert_eq!(folder.metadata().expect("a folder").mode() & 0o777, 0o700);
        assert_eq!(runtime_folder(temporary.path()), Some(folder.clone()));
        // One that others may enter, a link, and a file.
        let open = std::fs::Permissions::from_mode(0o755);
        std::fs::set_permissions(&folder, open).expect("permissions");
        assert_eq!(runtime_folder(temporary.path()), None);
        std::fs::remove_dir(&folder).expect("removed");
        let other = temporary.path().join("other");
        std::fs::create_dir(&other).expect("a folder");
        let permissions = std::fs::Permissions::from_mode(0o700);
        std::fs::set_permissions(&other, permissions).expect("permissions");
        symlink(&other, &folder).expect("a link");
        assert_eq!(runtime_folder(temporary.path()), None);
        std::fs::remove_file(&folder).expect("removed");
        std::fs::write(&folder, "").expect("a file");
        assert_eq!(runtime_folder(temporary.path()), None);
    }
}
