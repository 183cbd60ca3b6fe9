//! Parts of a mesh.

use super::Mesh;
use crate::parallel::prelude::*;

impl Mesh {
    /// Keeps the vertices that are marked, and the triangles and lines of which all ends are kept.
    ///
    /// # Panics
    /// If there are not as many marks as vertices.
    pub fn keep(&mut self, kept: &[bool]) {
        let count = self.positions.len();
        assert_eq!(kept.len(), count, "a mark for each vertex");
        // How many vertices are kept before each.
        let mut before = Vec::with_capacity(count + 1);
        before.push(0);
        let mut sum = 0;
        for is_kept in kept {
            sum += u32::from(*is_kept);
            before.push(sum);
        }
        let is_kept = |vertex: usize| kept[vertex];
        fn keep<T>(list: &mut Vec<T>, is_kept: impl Fn(usize) -> bool) {
            let mut at = 0..;
            list.retain(|_| at.next().is_some_and(&is_kept));
        }
        keep(&mut self.positions, is_kept);
        keep(&mut self.normals, is_kept);
        keep(&mut self.colors, is_kept);
        keep(&mut self.uvs, is_kept);
        keep(&mut self.values, is_kept);
        keep(&mut self.radii, is_kept);
        let is_whole: Vec<bool> = (self.triangles.par_iter())
            .map(|triangle| triangle.iter().all(|&vertex| is_kept(vertex as usize)))
            .collect();
        keep(&mut self.triangles, |triangle| is_whole[triangle]);
        keep(&mut self.triangle_materials, |triangle| is_whole[triangle]);
        for vertex in self.triangles.iter_mut().flatten() {
            *vertex = before[*vertex as usize];
        }
        self.lines.retain(|line| line.iter().all(|&vertex| is_kept(vertex as usize)));
        for vertex in self.lines.iter_mut().flatten() {
            *vertex = before[*vertex as usize];
        }
        for sensor in &mut self.sensors {
            let [start, end] =
                [sensor.points.start, sensor.points.end].map(|at| before[at.min(count)] as usize);
            sensor.points = start..end;
        }
    }
}
