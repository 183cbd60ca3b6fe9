//! What the command writes about itself: scripts for shells, and manual pages.

use crate::common::*;

/// The tasks that `splatkit --help` lists, except `help`.
fn tasks(folder: &Folder) -> Vec<String> {
    let help = folder.run("--help").stdout();
    let list = help.split_once("Commands:\n").unwrap().1.split_once("\n\n").unwrap().0;
    let first_word = |line: &str| line.trim_start().split(' ').next().unwrap().to_owned();
    let is_name = |line: &&str| line.starts_with("  ") && !line.starts_with("   ");
    list.lines().filter(is_name).map(first_word).filter(|name| name != "help").collect()
}

#[test]
fn every_shell_gets_a_script_with_tasks_and_flags() {
    let folder = Folder::new();
    let tasks = tasks(&folder);
    assert!(tasks.iter().any(|task| task == "render"), "{tasks:?}");
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = String::from_utf8(folder.run(&format!("completions {shell}")).ok().stdout);
        let script = script.unwrap();
        for task in &tasks {
            assert!(script.contains(task), "{shell}: {task}");
        }
        assert!(script.contains("gpu-memory") && script.contains("quiet"), "{shell}");
    }
    folder.run("completions tcsh").fails(2, &["zsh"]);
    folder.run("completions").fails(2, &[]);
}

/// A shell that is installed reads its script without an error.
#[cfg(unix)]
#[test]
fn bash_completes_a_flag() {
    let folder = Folder::new();
    folder.put("script", folder.run("completions bash").ok().stdout);
    let commands = "source ./script; COMP_WORDS=(splatkit render --gpu-m); COMP_CWORD=2; \
        _splatkit splatkit --gpu-m render; echo \"${COMPREPLY[@]}\"";
    let bash = std::process::Command::new("bash")
        .args(["--norc", "-c", commands])
        .current_dir(&folder)
        .output();
    let Ok(output) = bash else { return };
    let (out, errors) = [&output.stdout, &output.stderr].map(|b| String::from_utf8_lossy(b)).into();
    assert_eq!((out.trim(), &*errors), ("--gpu-memory", ""));
}

#[test]
fn manual_pages_are_written_like_other_files() {
    let folder = Folder::new();
    folder.run("man pages/man1").ok();
    let read = |name: &str| std::fs::read_to_string(folder.path("pages/man1").join(name)).unwrap();
    let main = read("splatkit.1");
    let tasks = tasks(&folder);
    for task in &tasks {
        assert!(main.contains(&format!("splatkit\\-{task}")), "{task}");
        let page = read(&format!("splatkit-{task}.1"));
        assert!(page.contains(".SH SYNOPSIS"), "{task}");
        // The flags of all tasks are in each page.
        assert!(page.contains("threads"), "{task}");
    }
    assert!(read("splatkit-render.1").contains("gpu\\-memory"));
    let count = std::fs::read_dir(folder.path("pages/man1")).unwrap().count();
    assert_eq!(count, tasks.len() + 1);

    // All of them are refused before one is written.
    std::fs::remove_file(folder.path("pages/man1/splatkit.1")).unwrap();
    folder.put("pages/man1/splatkit-info.1", "mine");
    folder.run("man pages/man1").fails(1, &["exists already", "--overwrite"]);
    assert!(!folder.path("pages/man1/splatkit.1").exists());
    assert_eq!(read("splatkit-info.1"), "mine");
    folder.run("man pages/man1 --overwrite").ok();
    assert!(read("splatkit-info.1").contains(".SH SYNOPSIS"));
    assert_eq!(read("splatkit.1"), main);

    folder.put("file", "");
    folder.run("man file").fails(1, &["file"]);
}
