//! The edges of meshes, drawn as thin dark lines over a picture.

use super::Picture;
use crate::{math::View, parallel::prelude::*, surface::Mesh};
use glam::{DVec2, DVec3, Vec3};

/// The edges of a mesh's triangles, each once, to be drawn over a picture of the mesh
/// ([`Picture::draw_edges`]).
///
/// ```
/// use splatkit::{picture::Edges, surface::Mesh};
///
/// // An icosahedron: twenty triangles, thirty edges.
/// assert_eq!(Edges::of(&Mesh::sphere(0)).len(), 30);
/// ```
#[derive(Debug, Clone)]
pub struct Edges {
    origin: DVec3,
    positions: Vec<Vec3>,
    pairs: Vec<[u32; 2]>,
    /// For each edge of a solid, the normals of its two triangles, of any length: an edge between
    /// two that face away is hidden. Empty for other meshes.
    sides: Vec<[Vec3; 2]>,
}

/// How much of the light a line takes.
const DARKNESS: f32 = 0.8;

/// Lines may lie this far from the surface that a pixel shows, in pixels. The depth of a pixel is
/// known to about a sheet, and sheets are 8 pixels thick.
const BESIDE: f64 = 8.0;

/// Lines shorter than this, in pixels, fade, because many of them would darken everything.
const SHORT: f64 = 6.0;

impl Edges {
    /// Returns the edges of a mesh. Triangles that refer to missing vertices, or to vertices that
    /// are not finite, are left out. Of a polygon that was split into triangles, the diagonals are
    /// edges too.
    pub fn of(mesh: &Mesh) -> Self {
        let is_whole = |triangle: &&[u32; 3]| {
            let corner = |index: &u32| mesh.positions.get(*index as usize);
            triangle.iter().all(|index| corner(index).is_some_and(|place| place.is_finite()))
        };
        let mut all: Vec<([u32; 2], u32)> = mesh
            .triangles
            .par_iter()
            .zip(0..mesh.triangles.len() as u32)
            .filter(|(triangle, _)| is_whole(triangle))
            .flat_map_iter(|(&[a, b, c], at)| [([a, b], at), ([b, c], at), ([c, a], at)])
            .map(|([a, b], at)| ([a.min(b), a.max(b)], at))
            .collect();
        all.par_sort_unstable();
        let groups = all.chunk_by(|a, b| a.0 == b.0);
        let pairs = groups.clone().map(|triangles| triangles[0].0).collect();
        let normal = |at: u32| {
            let [a, b, c] = mesh.triangles[at as usize].map(|at| mesh.positions[at as usize]);
            (b - a).cross(c - a)
        };
        let sides = |triangles: &[([u32; 2], u32)]| match *triangles {
            [(_, a), (_, b)] => [normal(a), normal(b)],
            // Nothing is known of other edges.
            _ => [Vec3::NAN; 2],
        };
        let sides = if mesh.is_solid() { groups.map(sides).collect() } else { Vec::new() };
        Self { origin: mesh.origin, positions: mesh.positions.clone(), pairs, sides }
    }

    /// Returns edges by their ends, relative to an origin in the world.
    pub fn of_lines(origin: DVec3, lines: Vec<[Vec3; 2]>) -> Self {
        let pairs = (0..lines.len() as u32).map(|line| [2 * line, 2 * line + 1]).collect();
        Self { origin, positions: lines.as_flattened().to_vec(), pairs, sides: Vec::new() }
    }

    /// Returns the number of edges.
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Returns whether there is no edge.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }
}

/// An edge in the picture: places in pixels, and the inverse of the depth or, in orthographic
/// views, the depth, both of which are linear along the line.
struct Line {
    ends: [DVec2; 2],
    depths: [f64; 2],
}

impl Picture {
    /// Draws the edges of a mesh as dark lines of a constant `width`, in pixels, on the parts of
    /// its surface that the picture shows. `view` must be the view of the picture. Lines are
    /// smooth; those shorter than a few pixels fade. Transparent pixels, which have no depth, get
    /// no lines.
    pub fn draw_edges(&mut self, edges: &Edges, view: &View, width: f64) {
        let surface = Surface { picture: self, view };
        let visible =
            (0..edges.len()).into_par_iter().filter(|edge| edges.may_be_seen(*edge, view));
        let lines: Vec<Line> =
            visible.filter_map(|edge| edges.line(edges.pairs[edge], view)).collect();
        let mut shares = vec![0.0f32; self.color.len()];
        for line in &lines {
            surface.trace(line, width, &mut shares);
        }
        for (pixel, share) in self.color.iter_mut().zip(shares) {
            let left = 1.0 - DARKNESS * share;
            pixel[..3].iter_mut().for_each(|channel| *channel *= left);
        }
    }
}

impl Edges {
    /// Returns whether a triangle beside an edge may face the viewer.
    fn may_be_seen(&self, edge: usize, view: &View) -> bool {
        let Some(normals) = self.sides.get(edge) else { return true };
        let place = self.origin + self.positions[self.pairs[edge][0] as usize].as_dvec3();
        let toward = if view.perspective { view.position - place } else { -view.rotation.row(2) };
        normals.iter().any(|normal| normal.is_nan() || normal.as_dvec3().dot(toward) >= 0.0)
    }

    /// Returns an edge in the picture; `None` if it lies outside, or behind the eye.
    fn line(&self, pair: [u32; 2], view: &View) -> Option<Line> {
        let world = pair.map(|at| self.origin + self.positions[at as usize].as_dvec3());
        let [mut a, mut b] = world.map(|point| view.to_view(point));
        if view.perspective {
            // The part behind the eye is cut off.
            let near = 1e-6 * a.length().max(b.length());
            if a.z.max(b.z) <= near {
                return None;
            }
            if a.z < near {
                a = a.lerp(b, (near - a.z) / (b.z - a.z));
            } else if b.z < near {
                b = b.lerp(a, (near - b.z) / (a.z - b.z));
            }
        }
        let place = |p: DVec3| {
            view.center + view.scale * p.truncate() / if view.perspective { p.z } else { 1.0 }
        };
        let depth = |p: DVec3| if view.perspective { 1.0 / p.z } else { p.z };
        let line = Line { ends: [place(a), place(b)], depths: [depth(a), depth(b)] };
        line.within(DVec2::new(f64::from(view.size[0]), f64::from(view.size[1])))
    }
}

impl Line {
    /// Cuts a line to the picture, with a few pixels around it (Liang & Barsky 1984).
    fn within(self, size: DVec2) -> Option<Self> {
        const AROUND: f64 = 4.0;
        let [a, b] = self.ends;
        let (mut first, mut last) = (0.0f64, 1.0f64);
        for axis in 0..2 {
            let (from, along) = (a[axis], b[axis] - a[axis]);
            let (low, high) = (-AROUND - from, size[axis] + AROUND - from);
            if along == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (enter, leave) = if along > 0.0 { (low, high) } else { (high, low) };
            first = first.max(enter / along);
            last = last.min(leave / along);
        }
        let depth = |t: f64| self.depths[0] + t * (self.depths[1] - self.depths[0]);
        let is_visible = first < last && a.is_finite() && b.is_finite();
        is_visible.then(|| Self {
            ends: [a.lerp(b, first), a.lerp(b, last)],
            depths: [depth(first), depth(last)],
        })
    }
}

/// The depths of a picture, and how far from them a line may lie.
struct Surface<'a> {
    picture: &'a Picture,
    view: &'a View,
}

impl Surface<'_> {
    fn depth(&self, x: i64, y: i64) -> f64 {
        let Picture { width, height, depth, .. } = self.picture;
        let is_inside = (0..i64::from(*width)).contains(&x) && (0..i64::from(*height)).contains(&y);
        if is_inside {
            f64::from(depth[y as usize * *width as usize + x as usize])
        } else {
            f64::INFINITY
        }
    }

    /// Returns whether a line at a depth lies on the surface that a pixel shows. Where the surface
    /// is steep, the depth changes much within a pixel.
    fn shows(&self, x: i64, y: i64, depth: f64) -> bool {
        let near = [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)]
            .map(|(across, down)| self.depth(x + across, y + down));
        let surface = near[0];
        let surface = if surface.is_finite() {
            surface
        } else {
            // The picture's samples at a silhouette may miss the surface.
            near.into_iter().filter(|depth| depth.is_finite()).fold(f64::NEG_INFINITY, f64::max)
        };
        let step = |a: f64, b: f64| {
            let least = (a - surface).abs().min((b - surface).abs());
            if least.is_finite() { least } else { 0.0 }
        };
        let slope = step(near[1], near[2]) + step(near[3], near[4]);
        // A steep step is the border between two surfaces.
        let pixel = if self.view.perspective { depth } else { 1.0 } / self.view.scale;
        let beside = BESIDE * pixel;
        (depth - surface).abs() <= beside + slope.min(beside)
    }

    /// Adds the shares of the pixels that a line covers.
    fn trace(&self, line: &Line, width: f64, shares: &mut [f32]) {
        let [a, b] = line.ends;
        let along = b - a;
        let length = along.length();
        let fade = (length / SHORT).min(1.0);
        let axis = usize::from(along.y.abs() > along.x.abs());
        let other = 1 - axis;
        let [wide, high] = [self.picture.width, self.picture.height].map(i64::from);
        let reach = 0.5 * width + 0.5;
        // Pixels along the line's steeper axis, and around it across that axis.
        let (from, to) = (a[axis].min(b[axis]), a[axis].max(b[axis]));
        let flat = along[axis].abs() / length.max(1e-9);
        let span = reach / flat.max(0.5);
        for main in (from.floor() as i64)..=(to.floor() as i64) {
            let middle = main as f64 + 0.5;
            let t = ((middle - a[axis]) / along[axis]).clamp(0.0, 1.0);
            let t = if t.is_finite() { t } else { 0.0 };
            let center = a[other] + t * along[other];
            let depth = line.depths[0] + t * (line.depths[1] - line.depths[0]);
            let depth = if self.view.perspective { 1.0 / depth } else { depth };
            for cross in ((center - span).floor() as i64)..=((center + span).floor() as i64) {
                let (x, y) = if axis == 0 { (main, cross) } else { (cross, main) };
                if !(0..wide).contains(&x) || !(0..high).contains(&y) {
                    continue;
                }
                let away = (cross as f64 + 0.5 - center).abs() * flat;
                let share = ((reach - away).clamp(0.0, 1.0) * fade.min(width)) as f32;
                let share_here = &mut shares[(y * wide + x) as usize];
                if share > *share_here && self.shows(x, y, depth) {
                    *share_here = share;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Camera, Projection};

    /// A square of two triangles that fills the middle of a picture of 64 × 64 pixels.
    fn square() -> (Mesh, View, Picture) {
        let mesh = Mesh {
            positions: [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|[x, y]| Vec3::new(x, y, 0.0))
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let camera = Camera {
            position: DVec3::Z * 5.0,
            focal_point: DVec3::ZERO,
            view_up: DVec3::Y,
            projection: Projection::Orthographic { height: 4.0 },
        };
        let is_inside = |at: usize| [at % 64, at / 64].iter().all(|at| (16..48).contains(at));
        let color = (0..4096).map(|at| if is_inside(at) { [1.0; 4] } else { [0.0; 4] });
        let depth = (0..4096).map(|at| if is_inside(at) { 5.0 } else { f32::INFINITY });
        let picture =
            Picture { width: 64, height: 64, color: color.collect(), depth: depth.collect() };
        (mesh, camera.view([64, 64]).unwrap(), picture)
    }

    #[test]
    fn lines_lie_on_the_edges_and_nowhere_else() {
        let (mesh, view, mut picture) = square();
        let edges = Edges::of(&mesh);
        assert_eq!(edges.len(), 5);
        picture.draw_edges(&edges, &view, 1.0);
        let grey = |x: usize, y: usize| picture.color[y * 64 + x][0];
        // The diagonal, the left side, the middle of a triangle, and the background.
        assert!(grey(40, 23) < 0.35, "{}", grey(40, 23));
        assert!(grey(16, 40) < 0.7, "{}", grey(16, 40));
        assert_eq!((grey(20, 32), grey(44, 32), grey(4, 4)), (1.0, 1.0, 0.0));
        assert!(picture.color.iter().all(|pixel| pixel[3] == 0.0 || pixel[3] == 1.0));
    }

    #[test]
    fn hidden_edges_are_not_drawn() {
        let (mesh, view, whole) = square();
        for depth in [2.0, 8.0] {
            let mut picture = whole.clone();
            picture.depth.iter_mut().for_each(|stored| *stored = depth);
            picture.draw_edges(&Edges::of(&mesh), &view, 1.0);
            assert_eq!(picture.color, whole.color);
        }
    }

    #[test]
    fn edges_behind_the_eye_are_cut_off() {
        let (mesh, mut view, whole) = square();
        view.perspective = true;
        view.scale = 64.0;
        for position in [DVec3::ZERO, DVec3::new(0.2, 0.1, -1.0), DVec3::new(0.9, 0.0, 1e-9)] {
            view.position = position;
            whole.clone().draw_edges(&Edges::of(&mesh), &view, 1.0);
        }
    }
}
