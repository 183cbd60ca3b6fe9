//! What a compute pipeline is made of, before there is a device.

/// What a binding holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Binding {
    Uniform,
    Read,
    Write,
    /// A three-dimensional texture of 32-bit words.
    Texture,
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
}
