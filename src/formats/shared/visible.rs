//! Surfaces that a file makes invisible everywhere.

use crate::{input::Source, parallel::prelude::*, surface::Mesh, warning};

/// Makes a mesh or point cloud opaque, with a warning, if the opacities of its vertices are 0
/// everywhere: some programs write a channel that they do not fill.
pub(crate) fn keep_visible(source: &Source, mesh: &mut Mesh) {
    // Materials say on purpose what they hide.
    let hides = mesh.materials.iter().any(|material| material.color[3] <= 0.0);
    let is_clear = !mesh.colors.is_empty() && mesh.colors.par_iter().all(|color| color[3] == 0);
    if is_clear && !hides {
        mesh.colors.par_iter_mut().for_each(|color| color[3] = 255);
        let file = source.path.display();
        warning::give!("{file}: the opacity of all colours is 0; drawn opaque");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Limits;

    #[test]
    fn nothing_is_invisible_everywhere() {
        let limits = Limits::default();
        let source = Source::from_bytes("a.ply".as_ref(), b"", &limits).unwrap();
        let with = |alphas: [u8; 8]| {
            let mut mesh = Mesh::cube(1.0);
            mesh.colors = alphas.map(|alpha| [9, 8, 7, alpha]).to_vec();
            keep_visible(&source, &mut mesh);
            mesh.colors.iter().map(|color| color[3]).collect::<Vec<u8>>()
        };
        assert_eq!(with([0; 8]), [255; 8]);
        assert_eq!(with([0, 0, 0, 0, 0, 0, 0, 1]), [0, 0, 0, 0, 0, 0, 0, 1]);
    }
}
