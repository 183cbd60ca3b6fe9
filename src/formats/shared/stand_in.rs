//! Files that stand in for the data: what a download or a checkout leaves where the data should be.

use crate::{Result, input::Source};

/// The first bytes of such a file, what it is, and what to do.
const STAND_INS: &[(&[&str], &str, &str)] = &[
    (
        &["version https://git-lfs.github.com/spec/"],
        "a pointer of Git LFS, not the data",
        "git lfs pull fetches the data",
    ),
    (
        &["/annex/objects/", "../.git/annex/objects/"],
        "a pointer of git-annex, not the data",
        "git annex get fetches the data",
    ),
    (
        &["<!doctype html", "<html"],
        "a web page, not the data",
        "the page may say why it was not downloaded; open it in a browser",
    ),
];

/// Bytes that are looked at.
const LOOKED_AT: usize = 256;

/// Refuses a file that stands in for the data, whatever its name is.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) with what the file is, and what to do.
pub(crate) fn check(source: &Source) -> Result<()> {
    if source.folder().is_some() {
        return Ok(());
    }
    let first = &source.bytes()[..source.bytes().len().min(LOOKED_AT)];
    let begins = |word: &&str| {
        let text = first.trim_ascii_start();
        text.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word.as_bytes()))
    };
    match STAND_INS.iter().find(|(words, ..)| words.iter().any(begins)) {
        Some((_, what, hint)) => Err(source.error("file", format!("is {what}")).hint(*hint)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Limits;
    use std::path::Path;

    #[test]
    fn what_stands_in_is_told() {
        let message = |text: &str| {
            let limits = Limits::default();
            let source = Source::from_bytes(Path::new("a.ply"), text.as_bytes(), &limits).unwrap();
            check(&source).err().map(|error| error.to_string())
        };
        let lfs = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
        assert!(message(lfs).unwrap().contains("Git LFS"));
        assert!(message("/annex/objects/SHA256E-s1--4d7a.ply\n").unwrap().contains("git-annex"));
        assert!(message("\n<!DOCTYPE HTML>\n<html>404").unwrap().contains("web page"));
        assert_eq!(
            [message("ply\nformat ascii 1.0\n"), message(""), message("<?xml?>")],
            [None, None, None]
        );
    }
}
