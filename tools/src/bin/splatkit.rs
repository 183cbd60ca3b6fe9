//! The `splatkit` command.

fn main() -> std::process::ExitCode {
    splatkit_tools::main()
}
