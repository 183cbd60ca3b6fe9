//! What each engine draws, and by which method: tests the table of docs/engine.md by asking the
//! engines.
//!
//! To update the table, run
//! `SPLATKIT_WRITE=1 cargo test --release --test pictures what_engines_draw`.

use crate::testing::{gpu::gpu, psnr::measured};
use glam::{DMat3, DVec3};
use splatkit::{
    Error, Result,
    bricks::Bricks,
    cells::{CellKind, CellOptions, Cells, Solid, SolidOptions, Tint},
    color::{ColorMap, ColorScale},
    cpu::CpuRenderer,
    gpu::Renderer,
    hierarchy::{BuildOptions, Hierarchy, Tree},
    math::{Bounds, Camera, Kernel, Projection, Tensor},
    picture::Picture,
    reference,
    scattered::{Points, SampleOptions},
    scene::{
        Classification, Clip, ClipShape, Evaluate, Gradient, Mode, Optics, Order, Scene, Settings,
    },
    splat::Surfels,
    surface::{Mesh, SurfelOptions},
    volume::{
        Arrangement, Isosurface, Lattice, Samples, Shade, TransferFunction, Volume,
        phantoms::Phantom,
    },
};
use std::{fmt::Write, fs, path::Path, sync::Arc};

const SIDE: usize = 12;
const SIZE: [u32; 2] = [16, 16];

/// Minimum agreement with the reference, in dB, of a picture that shows the scene at all.
const LIKENESS: f64 = 25.0;

/// A feature, and a scene that needs it.
struct Row {
    name: &'static str,
    scene: Result<Scene>,
    camera: Camera,
    settings: Settings,
}

fn row(name: &'static str, scene: Result<Scene>) -> Row {
    let bounds = Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE };
    let mut camera = Camera::framing(&bounds, DVec3::Y, DVec3::Z, 1.0);
    camera.azimuth(30.0);
    camera.elevation(20.0);
    Row { name, scene, camera, settings: Settings::new(SIZE) }
}

impl Row {
    fn with(mut self, change: impl FnOnce(&mut Settings)) -> Self {
        change(&mut self.settings);
        self
    }

    fn from(mut self, change: impl FnOnce(&mut Camera)) -> Self {
        change(&mut self.camera);
        self
    }
}

fn bytes_on(lattice: Lattice) -> Result<Volume> {
    let volume = Phantom::Ball.sample_on(lattice)?;
    let bytes = (0..volume.len()).map(|i| (255.0 * volume.value(i)).round() as u8).collect();
    Volume::new(volume.lattice, Samples::U8(bytes))
}

/// A lattice in the cube from −1 to 1, with `layers` samples along z.
fn cartesian(layers: usize) -> Lattice {
    let step = |count: usize| 2.0 / (count - 1) as f64;
    let steps = DVec3::new(step(SIDE), step(SIDE), step(layers));
    Lattice::cartesian([SIDE, SIDE, layers], DVec3::NEG_ONE, DMat3::from_diagonal(steps))
}

fn sheared() -> Lattice {
    let mut lattice = cartesian(SIDE);
    lattice.axes.z_axis.x = 0.05;
    lattice
}

fn body_centred() -> Lattice {
    let edge = 2.0 / (SIDE as f64 - 0.5);
    Lattice::body_centred(
        [SIDE, SIDE, 2 * SIDE],
        DVec3::NEG_ONE,
        DMat3::from_diagonal(DVec3::splat(edge)),
    )
}

fn rectilinear() -> Lattice {
    let last = (SIDE - 1) as f64;
    let place = |i: usize| {
        (2.0 * i as f64 / last - 1.0) * (0.7 + 0.3 * (2.0 * i as f64 / last - 1.0).abs())
    };
    let places: [Vec<f64>; 3] = std::array::from_fn(|_| (0..SIDE).map(place).collect());
    let arrangement = Arrangement::Rectilinear(Arc::new(places));
    Lattice { dims: [SIDE; 3], origin: DVec3::ZERO, axes: DMat3::IDENTITY, arrangement }
}

fn transfer() -> TransferFunction {
    TransferFunction {
        color: vec![(0.0, [0.1, 0.2, 0.9]), (255.0, [0.9, 0.3, 0.1])],
        opacity: vec![(10.0, 0.0), (200.0, 0.6)],
        unit: 0.2,
        ..TransferFunction::default()
    }
}

fn volume_scene(
    lattice: Lattice,
    kernel: Result<Kernel>,
    transfer: TransferFunction,
) -> Result<Scene> {
    Ok(Scene::new().with_volume(bytes_on(lattice)?, kernel?, transfer))
}

fn on(lattice: Lattice) -> Result<Scene> {
    volume_scene(lattice, Ok(Kernel::default()), transfer())
}

fn by(kernel: Result<Kernel>) -> Result<Scene> {
    volume_scene(cartesian(SIDE), kernel, transfer())
}

fn sharp(lattice: Lattice, kernel: Result<Kernel>) -> Result<Scene> {
    let kernel = kernel?;
    Ok(Scene::new().with_volume(bytes_on(lattice)?.sharpened(&kernel)?, kernel, transfer()))
}

fn of_type(samples: fn(&Volume) -> Samples) -> Result<Scene> {
    let volume = bytes_on(cartesian(SIDE))?;
    let samples = samples(&volume);
    let volume = Volume::new(volume.lattice, samples)?;
    Ok(Scene::new().with_volume(volume, Kernel::default(), transfer()))
}

fn usual() -> Result<Scene> {
    on(cartesian(SIDE))
}

/// Two volumes on different lattices, with different colours.
fn two_volumes() -> Result<Scene> {
    let other = TransferFunction { color: vec![(0.0, [0.1, 0.9, 0.2])], ..transfer() };
    Ok(usual()?.with_volume(bytes_on(sheared())?, Kernel::default(), other))
}

fn bricks(scene: Scene, kernel: Result<Kernel>) -> Result<Scene> {
    Ok(scene.with_bricks(
        Bricks::from_volume(Arc::new(bytes_on(cartesian(SIDE))?))?,
        kernel?,
        transfer(),
    ))
}

fn samples(scene: Scene) -> Result<Scene> {
    let volume = bytes_on(cartesian(SIDE))?;
    let points = Points {
        positions: (0..volume.len()).map(|i| volume.lattice.sample_position(i).as_vec3()).collect(),
        values: (0..volume.len()).map(|i| volume.value(i) as f32).collect(),
        ..Points::default()
    };
    Ok(scene.with_samples(points.to_splats(&SampleOptions::default())?, transfer()))
}

/// The samples of a lattice as the corners of hexahedra.
fn cells() -> Result<Scene> {
    let ball = bytes_on(cartesian(SIDE))?;
    let points = (0..ball.len()).map(|i| ball.lattice.sample_position(i).as_vec3()).collect();
    let values = (0..ball.len()).map(|i| ball.value(i) as f32).collect();
    let mut cells = Cells { points, values, ..Cells::default() };
    let side = SIDE as u32;
    let inner = || 0..side - 1;
    for (z, y, x) in
        inner().flat_map(|z| inner().flat_map(move |y| inner().map(move |x| (z, y, x))))
    {
        let first = (z * side + y) * side + x;
        let square = [0, 1, side + 1, side].map(|step| first + step);
        cells.push(
            CellKind::Hexahedron,
            square.into_iter().chain(square.map(|at| at + side * side)),
        );
    }
    Ok(Scene::new().with_cells(cells.tetrahedra(&CellOptions::default())?, transfer()))
}

fn solid() -> Result<Scene> {
    let cells = Cells::tube(CellKind::Hexahedron, 1)?;
    let scale = ColorScale { range: cells.range(), ..ColorScale::new(ColorMap::VIRIDIS) };
    Ok(Scene::new().with_solid(Solid::new(cells, &SolidOptions::new(Tint::Values(scale)))?))
}

fn surfels() -> Result<Surfels> {
    Mesh::sphere(2).surfels(&SurfelOptions::default())
}

fn surface() -> Result<Scene> {
    Ok(Scene::new().with_splats(surfels()?))
}

fn hierarchy() -> Result<Hierarchy> {
    let tree =
        Tree::build(&surfels()?, &BuildOptions { closed: true, ..BuildOptions::default() }, None)?;
    Hierarchy::from_tree(tree)
}

/// The features that a picture may need, one per row of the table.
fn rows() -> Vec<Row> {
    [rows_of_items(), rows_of_kernels(), rows_of_transfers(), rows_of_settings()]
        .into_iter()
        .flatten()
        .collect()
}

fn rows_of_items() -> Vec<Row> {
    vec![
        row("a Cartesian lattice", usual()),
        row("slices 5 times as far apart", on(cartesian(3))),
        row("a sheared lattice", on(sheared())),
        row("a body-centred lattice", on(body_centred())),
        row("a rectilinear lattice", on(rectilinear())),
        row("a volume in bricks", bricks(Scene::new(), Ok(Kernel::default()))),
        row(
            "samples of 16 bits",
            of_type(|v| Samples::U16((0..v.len()).map(|i| v.value(i) as u16).collect())),
        ),
        row(
            "samples of 32 bits",
            of_type(|v| Samples::F32((0..v.len()).map(|i| v.value(i) as f32).collect())),
        ),
        row("scattered samples", samples(Scene::new())),
        row("cells", cells()),
        row("cells as a solid", solid()),
        row("surfels", surface()),
        row("a hierarchy", hierarchy().map(|hierarchy| Scene::new().with_hierarchy(hierarchy))),
        row(
            "surfels and a volume",
            surfels().and_then(|surfels| Ok(usual()?.with_splats(surfels))),
        ),
        row(
            "a hierarchy and a volume",
            hierarchy().and_then(|hierarchy| Ok(usual()?.with_hierarchy(hierarchy))),
        ),
        row(
            "surfels and a volume in bricks",
            surface().and_then(|scene| bricks(scene, Ok(Kernel::default()))),
        ),
        row("surfels and scattered samples", surface().and_then(samples)),
        row("several fields", two_volumes()),
    ]
}

fn rows_of_kernels() -> Vec<Row> {
    let gaussian = || Ok(Kernel::default());
    let tensor = |tensor| Ok(Kernel::tensor(tensor));
    let table = || Kernel::table((0..=32).map(|i| 1.0 - f64::from(i) / 32.0).collect(), 2.0);
    vec![
        row("kernel: a Gaussian that reaches 3 samples", by(Kernel::gaussian(0.6, 3.0))),
        row("kernel: a Gaussian that reaches 1.5", by(Kernel::gaussian(0.6, 1.5))),
        row("kernel: a Gaussian of σ 0.9", by(Kernel::gaussian(0.9, 3.0))),
        row("kernel: a Gaussian of σ 0.25", by(Kernel::gaussian(0.25, 2.0))),
        row("kernel: b-spline", by(Kernel::b_spline(2.0))),
        row("kernel: hann", by(Kernel::hann(3.0))),
        row("kernel: a table", by(table())),
        row("kernel: linear", by(tensor(Tensor::Linear))),
        row("kernel: catmull-rom", by(tensor(Tensor::CatmullRom))),
        row("kernel: cubic-b-spline", by(tensor(Tensor::CubicBSpline))),
        row(
            "b-spline on a rectilinear lattice",
            volume_scene(rectilinear(), Kernel::b_spline(2.0), transfer()),
        ),
        row(
            "linear on a rectilinear lattice",
            volume_scene(rectilinear(), tensor(Tensor::Linear), transfer()),
        ),
        row("linear in bricks", bricks(Scene::new(), tensor(Tensor::Linear))),
        row("sharp: gaussian", sharp(cartesian(SIDE), gaussian())),
        row("sharp: b-spline", sharp(cartesian(SIDE), Kernel::b_spline(2.0))),
        row("sharp: cubic-b-spline", sharp(cartesian(SIDE), tensor(Tensor::CubicBSpline))),
        row("sharp, on a body-centred lattice", sharp(body_centred(), gaussian())),
        row("sharp, on a rectilinear lattice", sharp(rectilinear(), gaussian())),
    ]
}

fn rows_of_transfers() -> Vec<Row> {
    let light = || TransferFunction { shade: Some(Shade::default()), ..transfer() };
    let isosurface = || TransferFunction {
        isosurfaces: vec![Isosurface { value: 100.0, color: [0.9, 0.8, 0.7], opacity: 0.7 }],
        ..transfer()
    };
    let gradient = || TransferFunction { gradient: vec![(0.0, 0.0), (300.0, 1.0)], ..transfer() };
    let lit = |transfer| volume_scene(cartesian(SIDE), Ok(Kernel::default()), transfer);
    vec![
        row("light", lit(light())),
        row("light by --gradient central", lit(light()))
            .with(|settings| settings.gradient = Gradient::Central),
        row("an isosurface", lit(isosurface())),
        row("opacity by the gradient", lit(gradient())),
    ]
}

fn rows_of_settings() -> Vec<Row> {
    let thick = |samples: f64| {
        move |settings: &mut Settings| settings.sheet_thickness = Some(samples * 2.0 / 11.0)
    };
    let clip =
        |shape| move |settings: &mut Settings| settings.clips = vec![Clip { shape, inside: true }];
    let cube = Bounds { min: DVec3::splat(-0.5), max: DVec3::splat(0.6) };
    vec![
        row("a clip plane", usual())
            .with(clip(ClipShape::HalfSpace { normal: DVec3::X, offset: 0.2 })),
        row("a clip box", usual()).with(clip(ClipShape::Box(cube))),
        row("a clipped surface", surface()).with(clip(ClipShape::Box(cube))),
        row("no perspective", usual())
            .from(|camera| camera.projection = Projection::Orthographic { height: 3.0 }),
        row("a camera inside", usual()).from(|camera| camera.position *= 0.05),
        row("sheets of 2 samples", usual()).with(thick(2.0)),
        row("sheets of 4 samples", usual()).with(thick(4.0)),
        row("--classify post", usual())
            .with(|settings| settings.classification = Classification::Post),
        row("--classify pre", usual())
            .with(|settings| settings.classification = Classification::Pre),
        row("--mode axis-sheets", usual()).with(|settings| settings.mode = Mode::AxisSheets),
        row("--mode splats", usual())
            .with(|settings| settings.mode = Mode::Splats(Order::FrontToBack)),
        row("--mode splats of surfels", surface())
            .with(|settings| settings.mode = Mode::Splats(Order::BackToFront)),
        row("--classify pre by linear", by(Ok(Kernel::tensor(Tensor::Linear))))
            .with(|settings| settings.classification = Classification::Pre),
        row("--optics maximum", usual()).with(|settings| settings.optics = Optics::Maximum),
        row("--optics maximum of scattered samples", samples(Scene::new()))
            .with(|settings| settings.optics = Optics::Maximum),
        row("--optics maximum of surfels", surface())
            .with(|settings| settings.optics = Optics::Maximum),
        row("--optics x-ray", usual()).with(|settings| settings.optics = Optics::XRay),
    ]
}

/// Titles of the columns, and the method that each asks for.
const COLUMNS: [(&str, Evaluate); 4] = [
    ("CPU: scatter", Evaluate::Scatter),
    ("CPU: gather", Evaluate::Gather),
    ("GPU: scatter", Evaluate::Scatter),
    ("GPU: gather", Evaluate::Gather),
];

/// The reasons of refusals, each listed once.
#[derive(Default)]
struct Reasons(Vec<String>);

impl Reasons {
    fn cell(&mut self, answer: &Result<Picture>) -> String {
        match answer {
            Ok(_) => "yes".into(),
            Err(Error::Argument(reason)) => {
                let at = self.0.iter().position(|known| known == reason).unwrap_or_else(|| {
                    self.0.push(reason.clone());
                    self.0.len() - 1
                });
                format!("no ({})", at + 1)
            }
            Err(error) => panic!("an engine refuses by an argument error alone, not: {error}"),
        }
    }
}

/// The engines. The GPU engine keeps its pipelines from scene to scene.
struct Engines {
    gpu: Renderer,
}

impl Engines {
    fn draw(&mut self, row: &Row, column: &str, evaluate: Evaluate) -> Result<Picture> {
        let scene = match &row.scene {
            Ok(scene) => scene,
            // Such a scene can't be made.
            Err(Error::Argument(reason)) => return Err(Error::Argument(reason.clone())),
            Err(error) => panic!("{}: {error}", row.name),
        };
        let settings = Settings { evaluate, ..row.settings.clone() };
        if column.starts_with("CPU") {
            return Ok(CpuRenderer::new(scene)?.render(&row.camera, &settings)?.0);
        }
        let mut prepared = self.gpu.prepare(scene)?;
        Ok(self.gpu.render(&mut prepared, &row.camera, &settings)?.0)
    }
}

/// Asserts that the pictures show the scene; other pictures do not count as drawn.
fn check_likeness(row: &Row, pictures: &[(&str, &Picture)]) {
    let (Ok(scene), false) = (&row.scene, pictures.is_empty()) else { return };
    let truth = |evaluate| {
        let settings = Settings { evaluate, ..row.settings.clone() };
        reference::render(scene, &row.camera, &settings).expect(row.name)
    };
    let [gathered, scattered] = [Evaluate::Gather, Evaluate::Scatter].map(truth);
    assert!(gathered.color.iter().any(|pixel| pixel[3] > 0.3), "{}: an empty picture", row.name);
    for (column, picture) in pictures {
        let truth = if column.ends_with("gather") { &gathered } else { &scattered };
        let psnr = measured(picture, truth);
        assert!(psnr > LIKENESS, "{}, {column}: {psnr:.1} dB", row.name);
    }
}

fn table() -> String {
    let mut engines = Engines { gpu: Renderer::new(gpu()) };
    let mut reasons = Reasons::default();
    let heads = COLUMNS.map(|(name, _)| name).join(" | ");
    let mut text = format!("| | {heads} |\n|---|{}\n", "---|".repeat(COLUMNS.len()));
    for row in rows() {
        let answers =
            COLUMNS.map(|(column, evaluate)| (column, engines.draw(&row, column, evaluate)));
        let pictures: Vec<_> = answers
            .iter()
            .filter_map(|(column, answer)| Some((*column, answer.as_ref().ok()?)))
            .collect();
        check_likeness(&row, &pictures);
        let cells = answers.each_ref().map(|(_, answer)| reasons.cell(answer));
        writeln!(text, "| {} | {} |", row.name, cells.join(" | ")).expect("writing to a string");
    }
    text.push('\n');
    for (at, reason) in reasons.0.iter().enumerate() {
        writeln!(text, "{}. {reason}", at + 1).expect("writing to a string");
    }
    text
}

const START: &str = "<!-- drawn: written by `SPLATKIT_WRITE=1 cargo test --release --test \
     pictures what_engines_draw` -->\n\n";
const END: &str = "\n<!-- end of drawn -->";

#[test]
fn the_table_of_what_each_engine_draws_is_true() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/engine.md");
    let text = fs::read_to_string(&page).expect("docs/engine.md").replace('\r', "");
    let (before, rest) = text.split_once(START).expect("the block's first line");
    let (inside, after) = rest.split_once(END).expect("the block's last line");
    let table = table();
    if std::env::var_os("SPLATKIT_WRITE").is_some() {
        fs::write(&page, format!("{before}{START}{table}{END}{after}")).expect("docs/engine.md");
        return;
    }
    for (old, new) in inside.lines().zip(table.lines()) {
        assert_eq!(old, new, "docs/engine.md is out of date; SPLATKIT_WRITE=1 updates it");
    }
    assert_eq!(inside, table, "docs/engine.md is out of date; SPLATKIT_WRITE=1 updates it");
}
