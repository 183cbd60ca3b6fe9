//! What documents repeat of the sources: the drawing of the rooms in docs/architecture.md, the
//! layout in CONTRIBUTING.md, and the example in the README.
//!
//! To update the drawing, run `SPLATKIT_WRITE=1 cargo test --release --test files documents`.

use crate::house::{ROOMS, imports, root};
use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write,
    fs,
};

const START: &str = "<!-- rooms: written by `SPLATKIT_WRITE=1 cargo test --release --test files \
     documents` -->\n\n";
const END: &str = "\n<!-- end of rooms -->";

fn read(name: &str) -> String {
    fs::read_to_string(root().join(name)).expect("a document").replace('\r', "")
}

/// Returns the rooms that each room of src imports from.
fn rooms() -> BTreeMap<String, BTreeSet<String>> {
    let mut rooms: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (module, imported) in imports("src") {
        let Some(room) = module.first() else { continue };
        let others = imported.iter().filter_map(|other| other.first()).filter(|name| *name != room);
        rooms.entry(room.clone()).or_default().extend(others.cloned());
    }
    rooms
}

/// Returns the rooms that a room reaches through others.
fn reached(room: &str, rooms: &BTreeMap<String, BTreeSet<String>>) -> BTreeSet<String> {
    let mut all = BTreeSet::new();
    let mut left: Vec<&String> = rooms[room].iter().collect();
    while let Some(next) = left.pop() {
        if all.insert(next.clone()) {
            left.extend(&rooms[next]);
        }
    }
    all
}

/// Draws the rooms. An arrow that a longer way implies is left out.
fn drawing() -> String {
    let rooms = rooms();
    let mut text = String::from("```mermaid\nflowchart TD\n");
    let mut table = String::from("| room | imports from |\n|---|---|\n");
    for room in ROOMS.iter().rev() {
        let imported: Vec<&str> =
            ROOMS.into_iter().rev().filter(|other| rooms[*room].contains(*other)).collect();
        let ways: Vec<_> = imported.iter().map(|other| reached(other, &rooms)).collect();
        let is_needed = |other: &&&str| !ways.iter().any(|way| way.contains(**other));
        let arrows: Vec<&str> = imported.iter().filter(is_needed).copied().collect();
        if arrows.is_empty() {
            writeln!(text, "    {room}").expect("writing to a string");
            continue;
        }
        writeln!(text, "    {room} --> {}", arrows.join(" & ")).expect("writing to a string");
        writeln!(table, "| `{room}` | {} |", imported.join(", ")).expect("writing to a string");
    }
    format!("{text}```\n\n{table}")
}

#[test]
fn the_drawing_of_the_rooms_is_current() {
    let page = "docs/architecture.md";
    let text = read(page);
    let (before, rest) = text.split_once(START).expect("the block's first line");
    let (inside, after) = rest.split_once(END).expect("the block's last line");
    let drawing = drawing();
    if std::env::var_os("SPLATKIT_WRITE").is_some() {
        fs::write(root().join(page), format!("{before}{START}{drawing}{END}{after}"))
            .expect("docs/architecture.md");
        return;
    }
    assert_eq!(inside, drawing, "{page} is out of date; SPLATKIT_WRITE=1 updates it");
}

/// CONTRIBUTING.md names every room, and the layout every folder of src and every document.
#[test]
fn the_layout_names_every_folder_and_document() {
    let text = read("CONTRIBUTING.md");
    let (rooms, layout) = text.split_once("\n## Layout\n").expect("the layout");
    let (_, rooms) = rooms.split_once("\n## The rooms of `src`\n").expect("the rooms");
    let unnamed: Vec<_> =
        ROOMS.iter().filter(|room| !rooms.contains(&format!("`{room}`"))).collect();
    assert!(unnamed.is_empty(), "rooms without a line: {unnamed:?}");
    let names = |folder: &str| -> Vec<String> {
        let entries = fs::read_dir(root().join(folder)).expect("a folder");
        let entries = entries.map(|entry| entry.expect("an entry").path());
        let kept = entries.filter(|path| match folder {
            "src" => path.is_dir(),
            _ => path.is_file(),
        });
        kept.map(|path| path.file_name().expect("a name").to_string_lossy().into()).collect()
    };
    let folders = names("src").into_iter().map(|name| format!("`src/{name}`"));
    let documents = names("docs").into_iter().map(|name| format!("](docs/{name})"));
    let missing: Vec<_> = folders.chain(documents).filter(|name| !layout.contains(name)).collect();
    assert!(missing.is_empty(), "not in the layout of CONTRIBUTING.md: {missing:?}");
    let named = layout.split("`src/").skip(1).filter_map(|rest| rest.split('`').next());
    let gone: Vec<_> = named.filter(|name| !root().join("src").join(name).exists()).collect();
    assert!(gone.is_empty(), "in the layout, but gone: {gone:?}");
}

#[test]
fn the_example_of_the_readme_is_that_of_a_file() {
    let text = read("README.md");
    let (_, rest) = text.split_once("```rust\n").expect("an example");
    let (example, _) = rest.split_once("```").expect("the example's end");
    let file = read("examples/volume.rs");
    let code = file.trim_start_matches(|c| c != '\n').trim_start();
    assert_eq!(example, code, "README.md and examples/volume.rs differ");
}
