//! The order of the house: modules import one way, without circles, and lines keep to 100 columns.
//! CONTRIBUTING.md explains the rooms.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};
use syn::{Attribute, Item, ItemMod, ItemUse, Meta, UseTree, visit::Visit};

/// The rooms of src. Each imports only from rooms before it.
pub const ROOMS: [&str; 34] = [
    "error",
    "warning",
    "parallel",
    "deadline",
    "stop",
    "progress",
    "memory",
    "disk",
    "math",
    "input",
    "container",
    "about",
    "color",
    "splat",
    "gaussians",
    "facet",
    "volume",
    "surface",
    "scattered",
    "cells",
    "picture",
    "formats",
    "bricks",
    "hierarchy",
    "edit",
    "compare",
    "scene",
    "interaction",
    "session",
    "plan",
    "cpu",
    "gpu",
    "reference",
    "renderer",
];

/// The rooms of src/gpu, in the same way.
const GPU: [&str; 15] = [
    "device", "output", "pipeline", "budget", "variant", "uniforms", "lamps", "scene", "targets",
    "passes", "upload", "frame", "outline", "pending", "renderer",
];

/// Maximum length of a line, in characters.
const COLUMNS: usize = 100;

/// A module, by the names from the crate's root on.
pub type Module = Vec<String>;

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Lists the files below a folder, without what is built or fetched.
pub fn files(folder: &Path, paths: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry")) {
        let (path, name) = (entry.path(), entry.file_name());
        let left_out = ["target", "out", "corpus", "artifacts", "coverage", "regressions"];
        let is_hidden = name.to_string_lossy().starts_with('.');
        if is_hidden || left_out.contains(&&*name.to_string_lossy()) {
            continue;
        }
        if path.is_dir() {
            files(&path, paths);
        } else {
            paths.push(path);
        }
    }
}

#[test]
fn lines_keep_to_their_columns() {
    let mut all = Vec::new();
    files(root(), &mut all);
    let kinds = ["rs", "wgsl", "sh", "toml"];
    let is_script = |path: &Path| path.parent() == Some(&root().join("tools"));
    let mut long = Vec::new();
    for path in all {
        let kind = path.extension().map(|kind| kind.to_string_lossy().into_owned());
        if !kind.map_or(is_script(&path), |kind| kinds.contains(&&*kind)) {
            continue;
        }
        let text = fs::read_to_string(&path).expect("a text");
        for (number, line) in (1..).zip(text.lines()) {
            // An address cannot be broken.
            if line.chars().count() > COLUMNS && !line.contains("://") {
                long.push(format!("{}:{number}", path.display()));
            }
        }
    }
    assert!(long.is_empty(), "lines over {COLUMNS} columns:\n{}", long.join("\n"));
}

/// The paths that a module names, but for those in tests.
struct Named {
    module: Module,
    paths: BTreeSet<Module>,
}

/// Returns whether an attribute keeps its item out of everything but tests.
fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        Meta::List(list) if list.path.is_ident("cfg") => {
            let words = list.tokens.to_string();
            words.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == "test")
        }
        _ => false,
    })
}

impl Named {
    /// Adds a path that begins with `crate`, `super` or `self`.
    fn add(&mut self, names: &[String]) {
        let mut absolute = match names.first().map(String::as_str) {
            Some("crate") => Vec::new(),
            Some("super" | "self") => self.module.clone(),
            _ => return,
        };
        for name in names {
            match name.as_str() {
                "crate" | "self" => {}
                "super" => drop(absolute.pop()),
                _ => absolute.push(name.clone()),
            }
        }
        self.paths.insert(absolute);
    }

    fn add_tree(&mut self, before: &[String], tree: &UseTree) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(path) => self.add_tree(&with(&path.ident), &path.tree),
            UseTree::Name(name) => self.add(&with(&name.ident)),
            UseTree::Rename(rename) => self.add(&with(&rename.ident)),
            UseTree::Glob(_) => self.add(before),
            UseTree::Group(group) => {
                group.items.iter().for_each(|tree| self.add_tree(before, tree));
            }
        }
    }
}

impl<'ast> Visit<'ast> for Named {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes = match item {
            Item::Mod(ItemMod { attrs, .. })
            | Item::Use(ItemUse { attrs, .. })
            | Item::Fn(syn::ItemFn { attrs, .. })
            | Item::Impl(syn::ItemImpl { attrs, .. })
            | Item::Const(syn::ItemConst { attrs, .. }) => attrs.as_slice(),
            _ => &[],
        };
        if !is_for_tests(attributes) {
            syn::visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        self.add_tree(&[], &item.tree);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Vec<String> =
            path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        self.add(&names);
        syn::visit::visit_path(self, path);
    }
}

/// Returns the modules of a crate that other modules may import, each with the modules it imports.
/// Modules for tests alone are left out. `source`: the folder of the crate's root.
pub fn imports(source: &str) -> BTreeMap<Module, BTreeSet<Module>> {
    let source = root().join(source);
    let mut all = Vec::new();
    files(&source, &mut all);
    let mut read = BTreeMap::new();
    let mut tests = BTreeSet::new();
    for path in all.iter().filter(|path| path.extension().is_some_and(|kind| kind == "rs")) {
        let inside = path.strip_prefix(&source).expect("in src").with_extension("");
        let mut module: Module =
            inside.iter().map(|name| name.to_string_lossy().into_owned()).collect();
        if module.last().is_some_and(|name| name == "mod" || name == "lib") {
            module.pop();
        }
        let text = fs::read_to_string(path).expect("a text");
        let file = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        for item in &file.items {
            if let Item::Mod(inner) = item
                && is_for_tests(&inner.attrs)
            {
                tests.insert([module.as_slice(), &[inner.ident.to_string()]].concat());
            }
        }
        let mut named = Named { module: module.clone(), paths: BTreeSet::new() };
        named.visit_file(&file);
        read.insert(module, named.paths);
    }
    let is_test = |module: &Module| (1..=module.len()).any(|n| tests.contains(&module[..n]));
    let known: BTreeSet<Module> = read.keys().cloned().collect();
    let of_path = |path: &Module| {
        let longest = (1..=path.len()).rev().find(|&n| known.contains(&path[..n]));
        longest.map(|n| path[..n].to_vec())
    };
    let edges = |(module, paths): (Module, BTreeSet<Module>)| {
        let imported = paths.iter().filter_map(of_path);
        // What a module above offers comes from one of the other modules.
        let others = imported.filter(|other| !module.starts_with(other)).collect();
        (module, others)
    };
    read.into_iter().filter(|(module, _)| !is_test(module)).map(edges).collect()
}

/// Asserts that the rooms below `above` import only from rooms before them in `order`.
fn assert_order(above: &[&str], order: &[&str]) {
    let mut back = BTreeSet::new();
    let mut seen = BTreeSet::new();
    for (module, imported) in imports("src") {
        let room = |module: &Module| {
            let inside = module.iter().take(above.len()).eq(above.iter());
            module.get(above.len()).filter(|_| inside).cloned()
        };
        let Some(from) = room(&module) else { continue };
        seen.insert(from.clone());
        let place = |room: &str| {
            let place = order.iter().position(|other| *other == room);
            place.unwrap_or_else(|| {
                panic!("{room} is not in the order of rooms: tests/files/house.rs")
            })
        };
        for to in imported.iter().filter_map(room) {
            if from != to && place(&to) > place(&from) {
                back.insert(format!("{} imports from {to}", module.join("::")));
            }
        }
    }
    assert!(back.is_empty(), "imports that run back: {back:#?}");
    let gone: Vec<_> = order.iter().filter(|room| !seen.contains(**room)).collect();
    assert!(gone.is_empty(), "rooms that are gone: {gone:?}");
}

#[test]
fn rooms_import_one_way() {
    assert_order(&[], &ROOMS);
    assert_order(&["gpu"], &GPU);
}

/// Follows the imports of `module`. Returns the modules of a circle, if it finds one.
fn circle(
    module: &Module,
    imports: &BTreeMap<Module, BTreeSet<Module>>,
    way: &mut Vec<Module>,
    done: &mut BTreeSet<Module>,
) -> Option<Vec<Module>> {
    if let Some(start) = way.iter().position(|other| other == module) {
        return Some(way[start..].to_vec());
    }
    if done.contains(module) {
        return None;
    }
    way.push(module.clone());
    let imported = imports.get(module).into_iter().flatten();
    // A module above only lists those below it.
    let cycle = imported
        .filter(|other| !other.starts_with(module))
        .find_map(|other| circle(other, imports, way, done));
    way.pop();
    done.insert(module.clone());
    cycle
}

/// Asserts that no modules import each other in a circle.
fn assert_no_circle(imports: &BTreeMap<Module, BTreeSet<Module>>) {
    let mut done = BTreeSet::new();
    for module in imports.keys() {
        let cycle = circle(module, imports, &mut Vec::new(), &mut done);
        let names = cycle.map(|cycle| cycle.iter().map(|m| m.join("::")).collect::<Vec<_>>());
        assert_eq!(names, None, "a circle of imports");
    }
}

#[test]
fn no_modules_import_each_other() {
    assert_no_circle(&imports("src"));
    assert_no_circle(&imports("tools/python/src"));
}

/// Panels return actions, so that none of them needs the window.
#[test]
fn no_modules_of_the_window_import_each_other() {
    let mut imports = imports("tools/src");
    imports.retain(|module, _| module.first().is_some_and(|name| name == "view"));
    assert!(imports.len() > 20, "the window is elsewhere");
    assert_no_circle(&imports);
    let panels = imports.iter().filter(|(module, _)| module.get(1).is_some_and(|m| m == "panels"));
    let window = ["view".to_owned(), "window".to_owned()];
    let of_window = panels.filter(|(_, all)| all.iter().any(|other| other.starts_with(&window)));
    assert_eq!(of_window.map(|(module, _)| module.join("::")).collect::<Vec<_>>(), [""; 0]);
}

/// On the Python index, the project's plain name belongs to a stranger's package. Nothing tells
/// anyone to install or import it.
#[test]
fn python_knows_the_package_by_its_own_name() {
    // In two parts, since this file is read too.
    let taken = concat!("splat", "kit");
    let installers = ["install", "pip", "pipx", "uv", "uvx", "conda", "mamba", "poetry", "pixi"];
    let statements = ["import", "from", "requires", "import_module", "importorskip"];
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let names_it = |before: &str, after: &str| {
        let is_part = |c: char| is_word(c) || "-/".contains(c);
        if before.ends_with(|c| is_part(c) || ".:$".contains(c))
            || after.starts_with(|c| is_part(c) || c == ':')
        {
            return false;
        }
        let words = |text: &str| text.split(|c| !is_word(c)).map(String::from).collect::<Vec<_>>();
        let last = words(before.trim_end_matches(|c| !is_word(c))).pop().unwrap_or_default();
        let is_installed = || {
            let command = words(before.rsplit('`').next().unwrap_or_default());
            let has = |word: &&str| command.iter().any(|other| other == word);
            installers.iter().any(|word| has(word) || last == **word) && !has(&"cargo")
        };
        // As in `import numpy as np, x`.
        let is_listed = before.rsplit_once("import ").is_some_and(|(_, list)| {
            list.ends_with(", ") && list.chars().all(|c| is_word(c) || ",. ".contains(c))
        });
        // Extras, as in `x[ray]`.
        after.starts_with('[') || statements.contains(&&*last) || is_listed || is_installed()
    };
    let mut all = Vec::new();
    files(root(), &mut all);
    files(&root().join(".github"), &mut all);
    let mut offers = Vec::new();
    for path in all {
        // Pictures and the like are no texts.
        let Ok(text) = fs::read_to_string(&path) else { continue };
        for (number, line) in (1..).zip(text.lines()) {
            let mut places = line.match_indices(taken);
            if places.any(|(at, _)| names_it(&line[..at], &line[at + taken.len()..])) {
                offers.push(format!("{}:{number}: {}", path.display(), line.trim()));
            }
        }
    }
    assert!(offers.is_empty(), "the package is called py{taken}:\n{}", offers.join("\n"));
    let project = fs::read_to_string(root().join("tools/python/pyproject.toml")).expect("a text");
    assert!(project.contains(&format!("\nname = \"py{taken}\"\n")), "another name in the project");
}

/// Returns whether a line of source holds unsafe code, rather than speaking of it.
fn is_unsafe(line: &str) -> bool {
    let code = line.split("//").next().unwrap_or_default();
    let follows = |word: &str| {
        ["{", "impl ", "fn ", "extern ", "trait "]
            .iter()
            .any(|next| word.trim_start().starts_with(next))
    };
    code.match_indices("unsafe").any(|(at, word)| {
        let is_word =
            !code[..at].ends_with(|letter: char| letter == '_' || letter.is_alphanumeric());
        is_word && follows(&code[at + word.len()..])
    })
}

/// SECURITY.md and docs/files.md name every file with unsafe code, and no other.
#[test]
fn the_documents_count_unsafe_code() {
    assert!(is_unsafe("    unsafe { f() };") && is_unsafe("unsafe impl A for B {}"));
    assert!(!is_unsafe("    // unsafe { f() }") && !is_unsafe("fn is_unsafe() {"));
    let mut all = Vec::new();
    ["src", "tools", "tests", "benches", "examples", "fuzz"]
        .iter()
        .for_each(|folder| files(&root().join(folder), &mut all));
    let name = |path: &PathBuf| {
        path.strip_prefix(root()).expect("below").to_string_lossy().replace('\\', "/")
    };
    let is_source = |path: &&PathBuf| {
        let is_this = path.ends_with(file!().rsplit(['/', '\\']).next().expect("a name"));
        path.extension().is_some_and(|extension| extension == "rs") && !is_this
    };
    let has_code =
        |path: &&PathBuf| fs::read_to_string(path).is_ok_and(|text| text.lines().any(is_unsafe));
    let unsafe_files: BTreeSet<String> =
        all.iter().filter(is_source).filter(has_code).map(name).collect();
    for document in ["SECURITY.md", "docs/files.md"] {
        let text = fs::read_to_string(root().join(document)).expect("a document");
        let start = text.find("Unsafe code").expect("a section");
        let end = text[start..].find("\n## ").map_or(text.len(), |end| start + end);
        let named: BTreeSet<String> = text[start..end]
            .split('`')
            .skip(1)
            .step_by(2)
            .filter(|word| word.ends_with(".rs"))
            .map(str::to_owned)
            .collect();
        assert_eq!(named, unsafe_files, "{document}");
    }
}
