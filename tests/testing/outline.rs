//! Pictures of a mesh compared with its triangles, traced with 16 rays a pixel: where it is drawn
//! beside its outline, how large it is, and how alike its inside is.

use glam::DVec3;
use splatkit::{
    formats::{ReadOptions, load_mesh},
    input::Limits,
    math::Camera,
    picture::Picture,
    reference::trace,
    scene::Settings,
    surface::{Mesh, SurfelOptions},
};

/// Reads the meshes that `SPLATKIT_MESHES` names, separated by colons.
pub fn given_meshes() -> Vec<(String, Mesh)> {
    let paths = std::env::var("SPLATKIT_MESHES").unwrap_or_default();
    let read = |path: &str| load_mesh(path, &Limits::default(), &ReadOptions::default());
    let paths = paths.split(':').filter(|path| !path.is_empty());
    paths.map(|path| (path.to_owned(), read(path).expect(path))).collect()
}

/// Rays along each side of a pixel of the true picture.
const RAYS: u32 = 4;
/// A pixel with more opacity than this counts as drawn.
const DRAWN: f32 = 0.1;

/// A view of a mesh, and its true picture.
pub struct Truth {
    pub camera: Camera,
    pub settings: Settings,
    pub picture: Picture,
}

/// How a picture differs from the truth.
#[derive(Debug, Clone, Copy)]
pub struct Difference {
    /// Signal to noise where the mesh fills whole pixels, and in the whole picture, in dB.
    pub inside: f64,
    pub whole: f64,
    /// The area that is too large, as a part of the true one.
    pub area: f64,
    /// Drawn pixels more than one pixel beside those that the mesh meets.
    pub outside: usize,
    /// Pixels that the mesh fills, but that let more than a tenth of the light through.
    pub holes: usize,
}

impl Truth {
    /// The view from the right and from above that shows the whole mesh, with +Z up, or from
    /// `nearer` times as near.
    pub fn new(mesh: &Mesh, size: [u32; 2], nearer: f64) -> Self {
        let bounds = mesh.bounds().expect("bounds");
        let mut camera = Camera::framing_with(
            &bounds,
            DVec3::Y,
            DVec3::Z,
            f64::from(size[0]) / f64::from(size[1]),
            Camera::DEFAULT_VIEW_ANGLE,
        );
        camera.azimuth(30.0);
        camera.elevation(20.0);
        camera.tighten(&bounds, size, 0.04).expect("a camera");
        camera.position = camera.focal_point + (camera.position - camera.focal_point) / nearer;
        let settings = Settings::new(size);
        let crease = SurfelOptions::default().crease_angle_degrees;
        let picture = trace(mesh, crease, &camera, &settings, RAYS).expect("a traced picture");
        Self { camera, settings, picture }
    }

    /// Returns the pixels that the mesh fills, and all around them, those of them with less opacity
    /// than `least`, and the smallest opacity there.
    pub fn opacity_inside(&self, picture: &Picture, least: f32) -> (usize, usize, f32) {
        let [width, height] = self.settings.size.map(|side| side as usize);
        let is_inside = |at: usize| {
            let (x, y) = (at % width, at / width);
            (y.saturating_sub(1)..(y + 2).min(height)).all(|row| {
                let mut columns = x.saturating_sub(1)..(x + 2).min(width);
                columns.all(|column| self.picture.color[row * width + column][3] >= 1.0)
            })
        };
        let inside = (0..picture.color.len()).filter(|&at| is_inside(at));
        let opacities: Vec<f32> = inside.map(|at| picture.color[at][3]).collect();
        let below = opacities.iter().filter(|&&opacity| opacity < least).count();
        (opacities.len(), below, opacities.iter().copied().fold(1.0, f32::min))
    }

    pub fn compare(&self, picture: &Picture) -> Difference {
        let (drawn, truth) = (&picture.color, &self.picture.color);
        let [width, height] = self.settings.size.map(|side| side as usize);
        let error = |at: usize| -> f64 {
            drawn[at].iter().zip(truth[at]).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>()
        };
        let psnr = |at: &dyn Fn(usize) -> bool| {
            let pixels: Vec<usize> = (0..truth.len()).filter(|&i| at(i)).collect();
            let sum: f64 = pixels.iter().map(|&i| error(i)).sum();
            -10.0 * (sum / (4 * pixels.len().max(1)) as f64).log10()
        };
        let area =
            |colors: &[[f32; 4]]| -> f64 { colors.iter().map(|color| f64::from(color[3])).sum() };
        let is_beside = |at: usize| {
            let (x, y) = (at % width, at / width);
            let rows = y.saturating_sub(1)..(y + 2).min(height);
            rows.flat_map(|row| {
                (x.saturating_sub(1)..(x + 2).min(width)).map(move |column| row * width + column)
            })
            .all(|near| truth[near][3] == 0.0)
        };
        Difference {
            inside: psnr(&|at| truth[at][3] >= 1.0),
            whole: psnr(&|_| true),
            area: area(drawn) / area(truth) - 1.0,
            outside: (0..truth.len()).filter(|&at| drawn[at][3] > DRAWN && is_beside(at)).count(),
            holes: (0..truth.len()).filter(|&at| truth[at][3] >= 1.0 && drawn[at][3] < 0.9).count(),
        }
    }
}
