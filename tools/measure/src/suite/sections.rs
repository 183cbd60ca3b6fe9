//! The marked block of a document, in sections: one for each machine.

use splatkit_tools::failure::Failure;
use std::fmt;

/// How the section of a machine begins in a document.
pub const HEADING: &str = "### ";

/// Returns the first line of a section.
fn heading(section: &str) -> &str {
    section.lines().next().unwrap_or_default()
}

/// Returns the sections of a text, one for each machine.
fn sections(text: &str) -> Vec<&str> {
    let mut sections = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        let end = rest.find(&format!("\n{HEADING}")).unwrap_or(rest.len());
        let (first, others) = rest.split_at(end);
        sections.push(first.trim());
        rest = others.trim();
    }
    sections
}

/// Returns the section of a machine; empty if there is none.
fn section_of(text: &str, machine: impl fmt::Display) -> String {
    let wanted = format!("{HEADING}{machine}");
    sections(text)
        .into_iter()
        .find(|section| heading(section) == wanted)
        .unwrap_or_default()
        .to_owned()
}

/// Returns a text with sections of several machines, in which this section is added or replaced.
pub fn with_section(text: &str, section: &str) -> String {
    let mut sections = sections(text);
    match sections.iter_mut().find(|old| heading(old) == heading(section)) {
        Some(old) => *old = section.trim(),
        None => sections.push(section.trim()),
    }
    sections.join("\n\n") + "\n"
}

/// A machine's section is replaced as a whole. Returns an error if that would remove tables of
/// parts that are not measured now. `left_out` contains the names and titles of these parts, and
/// `flag` is the flag that leaves them out.
pub fn check_kept(
    text: &str,
    machine: impl fmt::Display,
    left_out: impl IntoIterator<Item = (String, &'static str)>,
    flag: &str,
) -> Result<(), Failure> {
    let section = section_of(text, machine);
    match left_out.into_iter().find(|(_, title)| section.contains(&format!("**{title}**"))) {
        Some((name, _)) => Err(Failure::Usage(format!(
            "--write would remove this machine's tables of “{name}”, which {flag} leaves out; \
             measure that part too, or leave --write out"
        ))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_machine_has_its_section() {
        let one = with_section("", "### a\n\n1");
        let both = with_section(&one, "### b\n\n2\n");
        assert_eq!(both, "### a\n\n1\n\n### b\n\n2\n");
        assert_eq!(with_section(&both, "### a\n\n3"), "### a\n\n3\n\n### b\n\n2\n");
        assert_eq!(
            (section_of(&both, "b").as_str(), section_of(&both, "c").as_str()),
            ("### b\n\n2", "")
        );
        assert_eq!(with_section("– Words.\n", &one), "– Words.\n\n### a\n\n1\n");
    }
}
