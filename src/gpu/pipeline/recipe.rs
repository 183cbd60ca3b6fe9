//! What a compute pipeline is made of, before there is a device.

use std::collections::HashSet;

/// What a binding holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Binding {
    Uniform,
    Read,
    Write,
    /// A three-dimensional texture of 32-bit words.
    Texture,
    /// A two-dimensional texture of 32-bit words.
    Words,
    /// A number that this pipeline does not bind.
    Unused,
}

/// The description of a compute pipeline. Shaders are joined from whole files: shared declarations
/// first, then the pass's own file. Only constants are generated.
#[derive(Debug, Clone)]
pub struct Recipe {
    /// The name of the pipeline in messages of wgpu and of the tests.
    pub label: String,
    source: String,
    pub entry: &'static str,
    /// The bindings of each bind group, in the order of the shader's binding numbers.
    pub groups: Vec<Vec<Binding>>,
}

impl Recipe {
    /// Joins `sources`. `entry` is the entry point of the pipeline.
    pub fn new(label: &str, sources: &[&str], entry: &'static str, groups: &[&[Binding]]) -> Self {
        let groups = groups.iter().map(|bindings| bindings.to_vec()).collect();
        Self { label: label.to_owned(), source: sources.concat(), entry, groups }
    }

    /// Returns the shader for a device whose dispatches have at most `most_workgroups` workgroups
    /// along one dimension.
    pub fn source(&self, most_workgroups: u32) -> String {
        format!("{}\nconst MOST_WORKGROUPS: u32 = {most_workgroups}u;\n", self.source)
    }

    /// Returns the hash of what is compiled. A constant of the variant that the shader does not
    /// mention does not count, so variants share the pipelines that are alike.
    pub fn hash(&self, most_workgroups: u32) -> blake3::Hash {
        let (constants, shader) = split(&self.source);
        let mentioned: HashSet<&str> = words(shader).collect();
        let is_used = |line: &&str| words(line).nth(1).is_some_and(|name| mentioned.contains(name));
        let used: String = constants.lines().filter(is_used).collect();
        let Self { label, entry, groups, .. } = self;
        let all = format!("{label}\n{entry}\n{groups:?}\n{most_workgroups}\n{used}\n{shader}");
        blake3::hash(all.as_bytes())
    }
}

/// Splits a shader after the constants at its beginning, one a line.
pub fn split(source: &str) -> (&str, &str) {
    let constants = source.lines().take_while(|line| line.starts_with("const "));
    source.split_at(constants.map(|line| line.len() + 1).sum())
}

/// Returns the words of a shader: its names, among others.
pub fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_that_are_not_mentioned_do_not_count() {
        let hash = |constants: &str, shader: &str, rows: u32| {
            Recipe::new("a", &[constants, shader], "main", &[&[Binding::Read]]).hash(rows)
        };
        let shader = "@compute fn main() { out = ROWS; }";
        let first = hash("const ROWS: u32 = 8u;\nconst FIELDS: u32 = 1u;\n", shader, 9);
        assert_eq!(first, hash("const ROWS: u32 = 8u;\nconst FIELDS: u32 = 2u;\n", shader, 9));
        assert_ne!(first, hash("const ROWS: u32 = 1u;\nconst FIELDS: u32 = 1u;\n", shader, 9));
        assert_ne!(first, hash("const ROWS: u32 = 8u;\n", "@compute fn main() { ROWS; }", 9));
        assert_ne!(first, hash("const ROWS: u32 = 8u;\n", shader, 10));
    }
}
