//! The sources and licences of everything that is built in, by the rules of deny.toml. `cargo deny
//! check` checks more if it is installed.

use serde_json::Value;
use std::{path::Path, process::Command};

/// Returns the licences that deny.toml allows.
fn allowed(rules: &str) -> Vec<&str> {
    let list = rules.split_once("\nallow = [").unwrap().1.split_once(']').unwrap().0;
    list.split('"').skip(1).step_by(2).collect()
}

/// Whether the allowed licences satisfy an SPDX expression. OR binds less tightly than AND, and a
/// slash is an old form of OR.
fn is_met(expression: &str, allowed: &[&str]) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut at = 0;
    either(&words, &mut at, allowed) && at == words.len()
}

fn either(words: &[&str], at: &mut usize, allowed: &[&str]) -> bool {
    let mut is_met = both(words, at, allowed);
    while words.get(*at) == Some(&"OR") {
        *at += 1;
        is_met |= both(words, at, allowed);
    }
    is_met
}

fn both(words: &[&str], at: &mut usize, allowed: &[&str]) -> bool {
    let mut is_met = one(words, at, allowed);
    while words.get(*at) == Some(&"AND") {
        *at += 1;
        is_met &= one(words, at, allowed);
    }
    is_met
}

fn one(words: &[&str], at: &mut usize, allowed: &[&str]) -> bool {
    let word = words.get(*at).copied().unwrap_or_default();
    *at += 1;
    if word == "(" {
        let is_met = either(words, at, allowed);
        *at += 1;
        return is_met;
    }
    // An exception allows more, not less.
    if words.get(*at) == Some(&"WITH") {
        *at += 2;
    }
    allowed.contains(&word)
}

#[test]
fn expressions_are_understood() {
    let allowed = ["MIT", "Zlib"];
    for expression in [
        "MIT",
        "GPL-3.0 OR MIT",
        "MIT/Apache-2.0",
        "(MIT OR X) AND Zlib",
        "X OR MIT AND Zlib",
        "MIT WITH Y",
    ] {
        assert!(is_met(expression, &allowed), "{expression}");
    }
    for expression in
        ["", "X", "MIT AND X", "(X OR Y) AND MIT", "X OR MIT AND Y", "MIT MIT", "X WITH Y"]
    {
        assert!(!is_met(expression, &allowed), "{expression}");
    }
}

#[test]
fn what_is_built_in_may_be_passed_on() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let stdout_of = |command: &mut Command| {
        String::from_utf8(command.current_dir(&root).output().unwrap().stdout).unwrap()
    };
    let machine =
        stdout_of(Command::new(std::env::var_os("RUSTC").unwrap_or("rustc".into())).arg("-vV"));
    let machine = machine.lines().find_map(|line| line.strip_prefix("host: ")).unwrap();
    let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
    let arguments = ["metadata", "--locked", "--format-version", "1", "--filter-platform", machine];
    let metadata: Value =
        serde_json::from_str(&stdout_of(Command::new(cargo).args(arguments))).unwrap();
    let rules = std::fs::read_to_string(root.join("deny.toml")).unwrap();
    let allowed = allowed(&rules);
    assert!(
        allowed.contains(&"MIT") && allowed.iter().all(|name| !name.contains(' ')),
        "{allowed:?}"
    );
    let packages = metadata["packages"].as_array().unwrap();
    assert!(packages.len() > 50);
    for package in packages {
        let (name, licence) = (&package["name"], package["license"].as_str().unwrap_or_default());
        assert!(
            is_met(licence, &allowed),
            "{name} has the licence “{licence}”, which deny.toml does not allow"
        );
        let source = package["source"].as_str();
        let is_known = source
            .is_none_or(|source| source == "registry+https://github.com/rust-lang/crates.io-index");
        assert!(is_known, "{name} is from {source:?}");
    }
}
