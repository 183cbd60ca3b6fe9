//! The table of formats in docs/formats.md is the one that the library follows, and the table of
//! features in docs/library.md is that of `Cargo.toml`.
//!
//! To update the table of formats, run
//! `SPLATKIT_WRITE=1 cargo test --release --test files list_of_formats`.

use splatkit::formats::FORMATS;
use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write,
    fs,
    path::Path,
};

const START: &str = "<!-- formats: written by `SPLATKIT_WRITE=1 cargo test --release --test \
     files list_of_formats` -->\n\n";
const END: &str = "\n<!-- end of formats -->";

fn table() -> String {
    let mut text = String::from(
        "| format | files | holds | read in pieces | written |\n|---|---|---|---|---|\n",
    );
    for format in FORMATS {
        let files: Vec<String> =
            format.extensions.iter().map(|extension| format!("`.{extension}`")).collect();
        let files = if files.is_empty() { "any".into() } else { files.join(", ") };
        let holds: Vec<String> = format.holds.iter().map(ToString::to_string).collect();
        let pieces = match format.in_pieces() {
            None => "no",
            Some("") => "yes",
            Some(of) => of,
        };
        let written = format.written.map_or("no".into(), |extension| format!("`.{extension}`"));
        let (name, holds) = (format.name, holds.join("; "));
        writeln!(text, "| {name} | {files} | {holds} | {pieces} | {written} |")
            .expect("writing to a string");
    }
    text
}

#[test]
fn the_list_of_formats_is_current() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/formats.md");
    let text = fs::read_to_string(&page).expect("docs/formats.md").replace('\r', "");
    let (before, rest) = text.split_once(START).expect("the block's first line");
    let (inside, after) = rest.split_once(END).expect("the block's last line");
    let table = table();
    if std::env::var_os("SPLATKIT_WRITE").is_some() {
        fs::write(&page, format!("{before}{START}{table}{END}{after}")).expect("docs/formats.md");
        return;
    }
    for (old, new) in inside.lines().zip(table.lines()) {
        assert_eq!(old, new, "docs/formats.md is out of date; SPLATKIT_WRITE=1 updates it");
    }
    assert_eq!(inside, table, "docs/formats.md is out of date; SPLATKIT_WRITE=1 updates it");
}

/// The features that are not of formats.
const OTHERS: [&str; 11] = [
    "default",
    "dx12",
    "files",
    "gpu",
    "metal",
    "pictures",
    "reference",
    "remote",
    "reproject",
    "vulkan",
    "webgpu",
];

fn read(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
    fs::read_to_string(path).expect(name).replace('\r', "")
}

/// Returns the features in `Cargo.toml`, each with what it turns on.
fn features() -> BTreeMap<String, Vec<String>> {
    let manifest = read("Cargo.toml");
    let (_, rest) = manifest.split_once("\n[features]\n").expect("features");
    let (section, _) = rest.split_once("\n[").expect("a section after the features");
    let lines = section.lines().filter(|line| !line.starts_with('#'));
    let section: String = lines.collect();
    let entries = section.split_terminator(']').map(|entry| {
        let (name, list) = entry.split_once(" = [").expect("a list");
        (name.to_owned(), list.split('"').skip(1).step_by(2).map(String::from).collect())
    });
    entries.collect()
}

#[test]
fn formats_name_the_features_of_the_manifest() {
    let of_formats = FORMATS.iter().filter_map(|format| format.feature);
    let named: BTreeSet<_> = of_formats.chain(OTHERS).collect();
    let features = features();
    assert_eq!(named, features.keys().map(String::as_str).collect());
}

#[test]
fn the_list_of_features_is_current() {
    let features = features();
    let mut on: BTreeSet<&str> = BTreeSet::new();
    let mut open = vec!["default"];
    while let Some((name, list)) = open.pop().and_then(|name| features.get_key_value(name)) {
        on.insert(name);
        open.extend(list.iter().map(String::as_str).filter(|name| features.contains_key(*name)));
    }
    let page = read("docs/library.md");
    let (_, rest) = page.split_once("| feature | brings | default |\n").expect("the table");
    let rows = rest.lines().skip(1).take_while(|line| line.starts_with('|'));
    let listed: BTreeSet<(&str, &str)> = rows
        .map(|row| {
            let cells: Vec<&str> = row.split('|').map(str::trim).collect();
            (cells[1].trim_matches('`'), cells[3])
        })
        .collect();
    let wanted = features.keys().filter(|name| *name != "default");
    let wanted =
        wanted.map(|name| (name.as_str(), if on.contains(name.as_str()) { "yes" } else { "no" }));
    assert_eq!(listed, wanted.collect());
}
