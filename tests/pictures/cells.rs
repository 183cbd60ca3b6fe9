//! Cells: what they are divided into, and the pictures of them. The CPU engine is compared to the
//! reference, and both to integrals in closed form.

use crate::testing::psnr::measured;
use glam::{DVec3, Vec3};
use splatkit::{
    cells::{CellKind, CellOptions, Cells, Place, Tetrahedra},
    cpu::CpuRenderer,
    math::{Bounds, Camera, Projection},
    picture::Picture,
    reference,
    scene::{Clip, ClipShape, Gradient, Optics, Scene, Settings},
    surface::{Mesh, SurfelOptions},
    volume::{Isosurface, Shade, TransferFunction},
};

const SIZE: [u32; 2] = [64, 48];

const TUBES: [CellKind; 6] = [
    CellKind::Tetrahedron,
    CellKind::Hexahedron,
    CellKind::Wedge,
    CellKind::Pyramid,
    CellKind::QuadraticTetrahedron,
    CellKind::QuadraticHexahedron,
];

fn transfer() -> TransferFunction {
    TransferFunction {
        color: vec![(0.0, [0.1, 0.2, 0.9]), (50.0, [0.9, 0.9, 0.8]), (100.0, [0.9, 0.3, 0.1])],
        opacity: vec![(15.0, 0.0), (80.0, 0.7)],
        unit: 0.4,
        ..TransferFunction::default()
    }
}

fn lit() -> TransferFunction {
    TransferFunction { shade: Some(Shade::default()), ..transfer() }
}

fn surfaces() -> TransferFunction {
    let isosurfaces = vec![
        Isosurface { value: 40.0, color: [0.9, 0.8, 0.3], opacity: 0.5 },
        Isosurface { value: 70.0, color: [0.3, 0.8, 0.5], opacity: 0.9 },
    ];
    TransferFunction { isosurfaces, ..lit() }
}

fn divided(cells: &Cells) -> Tetrahedra {
    cells.tetrahedra(&CellOptions::default()).expect("tetrahedra")
}

/// The same cells, each with the mean of the values at its nodes.
fn of_cells(cells: &Cells) -> Cells {
    let mean = |cell: usize| {
        let nodes = cells.nodes_of(cell);
        nodes.iter().map(|node| cells.values[*node as usize]).sum::<f32>() / nodes.len() as f32
    };
    let values = (0..cells.len()).map(mean).collect();
    Cells { values, place: Place::Cells, ..cells.clone() }
}

fn camera(bounds: &Bounds, projection: Option<Projection>) -> Camera {
    let mut camera = Camera::framing(bounds, DVec3::Y, DVec3::Z, 4.0 / 3.0);
    camera.azimuth(35.0);
    camera.elevation(25.0);
    if let Some(projection) = projection {
        camera.projection = projection;
    }
    camera
}

/// A tube, coarser if its cells are divided.
fn tube(kind: CellKind) -> Cells {
    let is_curved = kind.nodes().is_some_and(|nodes| nodes >= 10);
    Cells::tube(kind, if is_curved { 1 } else { 2 }).expect("a tube")
}

/// A scene, and how it is drawn.
struct Case {
    name: String,
    scene: Scene,
    camera: Camera,
    settings: Settings,
}

impl Case {
    fn new(name: &str, cells: &Cells, transfer: TransferFunction) -> Self {
        let scene = Scene::new().with_cells(divided(cells), transfer);
        let camera = camera(&scene.bounds(), None);
        Self { name: name.into(), scene, camera, settings: Settings::new(SIZE) }
    }

    fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }

    fn drawn(&self) -> Picture {
        let mut renderer = CpuRenderer::new(&self.scene).expect(&self.name);
        renderer.render(&self.camera, &self.settings).expect(&self.name).0
    }

    /// Asserts that the CPU engine draws what the reference draws.
    fn check(&self) {
        let drawn = self.drawn();
        let truth = reference::render(&self.scene, &self.camera, &self.settings).expect(&self.name);
        if let Ok(folder) = std::env::var("SPLATKIT_PICTURES") {
            for (picture, of) in [(&drawn, "cpu"), (&truth, "reference")] {
                let path = std::path::Path::new(&folder).join(format!("{}-{of}.png", self.name));
                picture.save(path, None).expect("a folder to write to");
            }
        }
        let psnr = measured(&drawn, &truth);
        println!("{}: {psnr:.1} dB", self.name);
        assert!(truth.color.iter().any(|pixel| pixel[3] > 0.3), "{}: an empty picture", self.name);
        assert!(psnr >= 50.0, "{}: {psnr:.1} dB", self.name);
        let size = self.scene.bounds().diagonal() as f32;
        let depths = drawn.depth.iter().zip(&truth.depth).zip(&truth.color);
        let far = depths.filter(|((drawn, truth), color)| {
            color[3] > 0.9 && truth.is_finite() && (**drawn - **truth).abs() > 0.02 * size
        });
        let far = far.count();
        assert!(far * 100 <= drawn.depth.len(), "{}: {far} depths", self.name);
    }
}

#[test]
fn tubes_of_every_kind() {
    for kind in TUBES {
        Case::new(kind.name(), &tube(kind), lit()).check();
    }
}

#[test]
fn ways_to_draw() {
    let tube = Cells::tube(CellKind::Tetrahedron, 3).expect("a tube");
    let case = |name: &str, transfer: TransferFunction| Case::new(name, &tube, transfer);
    let orthographic = Projection::Orthographic { height: 2.6 };
    case("unlit", transfer()).check();
    case("orthographic", lit()).with(|case| case.camera.projection = orthographic).check();
    case("surfaces", surfaces()).check();
    case("maximum", transfer()).with(|case| case.settings.optics = Optics::Maximum).check();
    case("x-ray", transfer()).with(|case| case.settings.optics = Optics::XRay).check();
    case("from inside", lit())
        .with(|case| case.camera.position = case.camera.focal_point + DVec3::new(0.1, -0.7, 0.2))
        .check();
    let gradient = TransferFunction { gradient: vec![(20.0, 0.1), (150.0, 1.0)], ..lit() };
    case("gradient opacity", gradient).check();
    let plane = ClipShape::HalfSpace { normal: DVec3::new(0.3, 0.2, 1.0), offset: 0.1 };
    let cube = Bounds { min: DVec3::new(-0.2, -1.1, -0.3), max: DVec3::new(1.1, 0.1, 0.5) };
    let clips = [(plane, true), (ClipShape::Box(cube), false)];
    let clips: Vec<Clip> = clips.map(|(shape, inside)| Clip { shape, inside }).to_vec();
    case("clipped", lit()).with(|case| case.settings.clips.clone_from(&clips)).check();
    // One long tetrahedron beside many short ones.
    let mut long = tube.clone();
    let first = long.points.len() as u32;
    let corners = [[-3.0, -0.2, -0.1], [3.0, 0.0, 0.2], [0.3, 0.4, -0.3], [0.1, 0.1, 0.7]];
    long.points.extend(corners.map(Vec3::from_array));
    long.values.extend([0.0, 100.0, 60.0, 50.0]);
    long.push(CellKind::Tetrahedron, first..first + 4);
    Case::new("one long", &long, lit()).check();
}

#[test]
fn values_of_cells() {
    let tube = of_cells(&Cells::tube(CellKind::Hexahedron, 2).expect("a tube"));
    Case::new("of cells", &tube, lit()).check();
    Case::new("of cells, maximum", &tube, transfer())
        .with(|case| case.settings.optics = Optics::Maximum)
        .check();
    Case::new("of cells, x-ray", &tube, transfer())
        .with(|case| case.settings.optics = Optics::XRay)
        .check();
    let cube = Bounds { min: DVec3::new(-0.2, -1.1, -0.3), max: DVec3::new(1.1, 0.1, 0.5) };
    let other = Bounds { min: DVec3::new(0.3, -0.9, -0.9), max: DVec3::new(1.3, 0.3, 0.9) };
    let clips = [cube, other].map(|bounds| Clip { shape: ClipShape::Box(bounds), inside: false });
    Case::new("of cells, clipped", &tube, transfer())
        .with(|case| case.settings.clips = clips.to_vec())
        .check();
}

#[test]
fn among_surfels() {
    let tube = Cells::tube(CellKind::Wedge, 2).expect("a tube");
    let ball = || Mesh::sphere(2).surfels(&SurfelOptions::default()).expect("surfels");
    for (name, cells) in [("with a ball", tube.clone()), ("of cells, with a ball", of_cells(&tube))]
    {
        let mut case = Case::new(name, &cells, lit());
        let mut surfels = ball();
        surfels.splats.iter_mut().for_each(|splat| {
            splat.center = splat.center.map(|at| 0.6 * at);
            splat.factor = splat.factor.map(|entry| 0.6 * entry);
        });
        case.scene = case.scene.with_splats(surfels);
        case.check();
    }
}

/// Through the wall of a tube, where it is seen head on, rays are as long as the wall is thick.
#[test]
fn volumes_are_filled() {
    // In an X-ray of one extinction, opacity tells the length.
    let even = TransferFunction {
        color: vec![(0.0, [1.0; 3])],
        opacity: vec![(0.0, 0.5)],
        ..TransferFunction::default()
    };
    for kind in TUBES {
        let mut case = Case::new("even", &tube(kind), even.clone());
        case.settings.optics = Optics::XRay;
        case.settings.size = [17, 17];
        // The tube is open on the other side.
        case.camera = Camera {
            position: DVec3::new(-6.0, 6.0, 0.1),
            focal_point: DVec3::new(0.0, 0.0, 0.1),
            view_up: DVec3::Z,
            projection: Projection::Orthographic { height: 0.05 },
        };
        let picture = case.drawn();
        let worst = picture.color.iter().map(|pixel| {
            let length = -(1.0 - f64::from(pixel[3])).ln() / 2f64.ln();
            (length - 0.55).abs()
        });
        let worst = worst.fold(0.0, f64::max);
        println!("{kind:?}: {worst:e}");
        // Linear cells are not as round as the tube.
        assert!(worst < 0.03, "{kind:?}: {worst:e}");
    }
}

/// A linear field of cells of any kind gives the picture of the integral in closed form.
#[test]
fn a_linear_field_is_exact() {
    // A box of cells with the extinction of a value v as v, and value z along the view: the optical
    // depth of a ray from z0 to z1 is (z1² − z0²)/2.
    for kind in [CellKind::Tetrahedron, CellKind::Hexahedron, CellKind::Pyramid] {
        let mut cells = Cells::tube(kind, 2).expect("a tube");
        // Unroll the tube to a box: radius, angle and z.
        for at in &mut cells.points {
            let angle = at.y.atan2(at.x).rem_euclid(std::f32::consts::TAU);
            *at = Vec3::new(at.truncate().length(), angle / 5.0, at.z / 1.6 + 0.5);
        }
        cells.values = cells.points.iter().map(|at| at.z).collect();
        // opacity = 1 − exp(−v) over a unit of 1, in many steps.
        let opacity = (0..=256).map(|i| f64::from(i) / 256.0).map(|v| (v, 1.0 - (-v).exp()));
        let transfer = TransferFunction {
            color: vec![(0.0, [1.0; 3])],
            opacity: opacity.collect(),
            ..TransferFunction::default()
        };
        let mut case = Case::new("linear", &cells, transfer);
        case.camera = Camera {
            position: DVec3::new(0.75, 0.5, -5.0),
            focal_point: DVec3::new(0.75, 0.5, 0.0),
            view_up: DVec3::Y,
            projection: Projection::Orthographic { height: 0.3 },
        };
        let expected = 1.0 - (-0.5f64).exp();
        let picture = case.drawn();
        let worst = picture.color.iter().map(|pixel| (f64::from(pixel[3]) - expected).abs());
        let worst = worst.fold(0.0, f64::max);
        println!("{kind:?}: {worst:e}");
        assert!(worst < 2e-4, "{kind:?}: {worst:e}");
    }
}

/// Seen against an opaque background of cells, no ray falls between two of them.
#[test]
fn there_are_no_cracks() {
    for kind in TUBES {
        let opaque = TransferFunction {
            color: vec![(0.0, [1.0; 3])],
            opacity: vec![(0.0, 0.9999)],
            unit: 0.02,
            ..TransferFunction::default()
        };
        let tube = tube(kind);
        for projection in [None, Some(Projection::Orthographic { height: 0.5 })] {
            let mut case = Case::new("opaque", &tube, opaque.clone());
            case.settings.size = [96, 72];
            case.camera = Camera {
                position: DVec3::new(-6.0, 4.0, 1.0),
                focal_point: DVec3::new(-0.8, 0.3, 0.0),
                view_up: DVec3::Z,
                projection: projection.unwrap_or(Projection::Perspective { view_angle: 5.0 }),
            };
            let least = case.drawn().color.iter().map(|pixel| pixel[3]).fold(1.0, f32::min);
            assert!(least > 0.999, "{kind:?}: {least}");
        }
    }
}

#[test]
fn holes_and_what_is_left() {
    let mut tube = Cells::tube(CellKind::Hexahedron, 2).expect("a tube");
    let whole = divided(&tube).len();
    let node = tube.nodes_of(0)[6];
    tube.values[node as usize] = f32::NAN;
    let rest = divided(&tube).len();
    assert!(rest < whole && rest + 8 * 6 * 512 >= whole, "{rest} of {whole}");
    tube.values.fill(f32::NAN);
    let error = tube.tetrahedra(&CellOptions::default()).unwrap_err().to_string();
    assert!(error.contains("no cell has a volume"), "{error}");
    // Less is divided if there may be fewer.
    let curved = Cells::tube(CellKind::QuadraticHexahedron, 2).expect("a tube");
    let few = CellOptions { most: 1000, ..CellOptions::default() };
    let few = curved.tetrahedra(&few).expect("tetrahedra").len();
    assert!(few < divided(&curved).len() / 4 && few == 6 * curved.len(), "{few}");
}

#[test]
fn values_of_cells_become_values_of_points() {
    let tube = Cells::tube(CellKind::Hexahedron, 2).expect("a tube");
    let mut cells = of_cells(&tube);
    let first = cells.nodes_of(0)[0] as usize;
    assert_eq!(cells.clone().with_values_of_points().values[first], cells.values[0]);
    cells.values[0] = f32::NAN;
    let points = cells.with_values_of_points();
    assert!(points.values[first].is_nan() && points.place == Place::Points);
    // The cells around the nodes of one cell are left out: those that share a corner with it.
    let (rest, whole) = (divided(&points).len(), divided(&tube).len());
    assert!(rest < whole && 4 * rest > 3 * whole, "{rest} of {whole}");
}

#[test]
fn what_cells_do_not_draw_is_told() {
    let tube = Cells::tube(CellKind::Wedge, 1).expect("a tube");
    let mut case = Case::new("central", &tube, lit());
    let refused = |case: &Case, expected: &str| {
        let mut renderer = CpuRenderer::new(&case.scene).expect("a scene");
        let error = renderer.render(&case.camera, &case.settings).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    case.settings.gradient = Gradient::Central;
    refused(&case, "the gradient of cells");
    let cells = Case::new("of cells", &of_cells(&tube), surfaces());
    refused(&cells, "isosurfaces need values at the points");
    assert_eq!(cells.scene.beyond_gpu().as_deref(), Some("cells"));
}
