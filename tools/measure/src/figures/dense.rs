//! Sheets compared with the integral along the ray that they approximate.

use super::Stage;
use crate::report::{Cell, Table};
use glam::DVec3;
use splatkit::{
    compare::compare_pictures,
    math::{Bounds, Camera, Kernel},
    reference,
    scene::{Scene, Settings},
    volume::{TransferFunction, Volume, phantoms::Phantom},
};
use splatkit_tools::{failure::Failure, generate, progress::Progress};

/// The step of the dense integration, in samples.
const STEP: f64 = 0.05;

/// The error for a file of another kind.
pub const OTHER: &str = "is not a volume";

/// A volume and how it is shown.
pub struct Case {
    name: String,
    volume: Volume,
    kernel: Kernel,
    transfer: TransferFunction,
}

impl Case {
    /// Shows a volume as the command does by default.
    pub fn automatic(name: impl Into<String>, volume: Volume) -> Self {
        let transfer = TransferFunction::automatic(&volume);
        Self { name: name.into(), volume, kernel: Kernel::default(), transfer }
    }

    fn scene(&self) -> Scene {
        Scene::new().with_volume(self.volume.clone(), self.kernel.clone(), self.transfer.clone())
    }
}

/// Returns volumes with and without steep edges, in all ways to reconstruct them.
pub fn generated() -> Result<Vec<Case>, Failure> {
    let specimen = Phantom::Specimen.sample_bytes([48; 3])?;
    let narrow = Kernel::gaussian(0.7, 3.0)?;
    // A shell of a tenth of the ball's radius.
    let shell = TransferFunction {
        color: vec![(0.0, [0.9, 0.6, 0.3])],
        opacity: vec![(0.25, 0.0), (0.3, 0.5), (0.35, 0.0)],
        unit: 0.02,
        ..TransferFunction::default()
    };
    let ball = Phantom::Ball.sample([32; 3])?;
    let head = Phantom::Head.sample([48; 3])?;
    let bone = TransferFunction { unit: 0.01, ..TransferFunction::named("ct-bone", head.range)? };
    let sharp = specimen.clone().sharpened(&narrow)?;
    let body_centred = Phantom::Specimen.sample_on(generate::body_centred(48))?;
    Ok(vec![
        Case::automatic("specimen, 48³", specimen),
        Case { kernel: narrow, ..Case::automatic("specimen, 48³, sharp", sharp) },
        Case::automatic("specimen, body-centred", body_centred),
        Case { transfer: shell, ..Case::automatic("thin shell, 32³", ball) },
        Case { transfer: bone, ..Case::automatic("head, 48³, ct-bone", head) },
    ])
}

pub fn table(
    stage: &mut Stage,
    cases: &[Case],
    size: [u32; 2],
    progress: &Progress,
) -> Result<Table, Failure> {
    let mut table = Table::new(
        "Sheets against dense integration.",
        format!(
            "PSNR in dB of unlit pictures of {}×{} pixels, drawn by the engine, compared with the \
             reference's integral in steps of {STEP} samples through the same field.",
            size[0], size[1]
        ),
        &["volume", "default thickness", "a quarter of it"],
    );
    for case in cases {
        let scene = case.scene();
        let camera = camera(&case.volume.bounds(), size)?;
        let mut settings = Settings::new(size);
        settings.volume_shade = Some(None);
        progress.stage(format!("Integrating {}", case.name));
        let truth = reference::integrate(
            &scene,
            &camera,
            &settings,
            STEP * case.volume.lattice.kernel_spacing(),
        )?;
        let mut prepared = stage.prepare(&scene)?;
        let default = scene.sheets(&camera.view(size)?, &settings).step;
        let mut cells = Vec::new();
        for thickness in [default, 0.25 * default] {
            settings.sheet_thickness = Some(thickness);
            let picture = stage.draw(&mut prepared, &camera, &settings)?;
            let psnr = compare_pictures(&picture, &truth)?.psnr;
            cells.push(psnr.map_or(Cell::None, |psnr| Cell::Number(psnr, 1)));
        }
        table.row(&case.name, cells);
    }
    Ok(table)
}

fn camera(bounds: &Bounds, size: [u32; 2]) -> splatkit::Result<Camera> {
    let mut camera =
        Camera::framing(bounds, DVec3::Y, DVec3::Z, f64::from(size[0]) / f64::from(size[1]));
    camera.azimuth(30.0);
    camera.elevation(20.0);
    camera.tighten(bounds, size, 0.04)?;
    Ok(camera)
}
