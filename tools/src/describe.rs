//! The settings and statistics that explain a picture, as JSON.

use serde_json::{Value, json};
use splatkit::{
    FrameStats,
    math::{Kernel, Profile},
    scene::{Classification, Item, Mode, Optics, Order, Scene, Settings},
    volume::TransferFunction,
};

/// Returns statistics of the bricks that a frame drew; null if it drew none.
pub fn bricks(stats: &FrameStats) -> Value {
    match stats.bricks {
        0 => Value::Null,
        drawn => {
            json!({
                "drawn": drawn,
                "read": stats.read_bricks,
                "level": stats.lambda,
                "bytes": stats.brick_bytes,
            })
        }
    }
}

/// Returns the settings of a picture, and how the fields of the scene are shown. `field` is the
/// first of them.
pub fn settings(scene: &Scene, settings: &Settings) -> Value {
    let (mode, order) = match settings.mode {
        Mode::Sheets => ("sheets", None),
        Mode::AxisSheets => ("axis-sheets", None),
        Mode::Splats(Order::FrontToBack) => ("splats", Some("front-to-back")),
        Mode::Splats(Order::BackToFront) => ("splats", Some("back-to-front")),
    };
    let classify = match (settings.mode, settings.classification) {
        (Mode::Sheets, Classification::PreIntegrated) => "pre-integrated",
        (Mode::Sheets, Classification::Post) => "post",
        _ => "pre",
    };
    let optics = match settings.optics {
        Optics::EmissionAbsorption => "light",
        Optics::Maximum => "maximum",
        Optics::XRay => "x-ray",
    };
    let fields: Vec<Value> = scene.items.iter().filter_map(field).collect();
    json!({
        "mode": mode,
        "order": order,
        "classify": classify,
        "optics": optics,
        "clips": settings.clips.len(),
        "sheet_thickness": settings.sheet_thickness,
        "field": fields.first(),
        "fields": fields,
    })
}

/// Returns how an item's field is shown; `None` if it has none.
fn field(item: &Item) -> Option<Value> {
    match item {
        Item::Volume(volume, shape, transfer) => {
            let mut field = transfer_json(transfer);
            field["kernel"] = kernel(shape);
            field["sharp"] = json!(volume.coefficients.is_some());
            Some(field)
        }
        Item::Bricks(_, shape, transfer) => {
            let mut field = transfer_json(transfer);
            field["kernel"] = kernel(shape);
            Some(field)
        }
        Item::Scalar(_, transfer) | Item::Cells(_, transfer) => Some(transfer_json(transfer)),
        Item::Radiance(_)
        | Item::Facets(_)
        | Item::Solid(_)
        | Item::Gaussians(_)
        | Item::Hierarchy(_) => None,
    }
}

fn transfer_json(transfer: &TransferFunction) -> Value {
    json!({
        "shade": transfer.shade.is_some(),
        "gradient_opacity": !transfer.gradient.is_empty(),
        "isosurfaces": transfer.isosurfaces,
    })
}

fn kernel(kernel: &Kernel) -> Value {
    let (name, sigma) = match kernel.profile {
        Profile::Gaussian(sigma) => ("gaussian", Some(sigma)),
        Profile::BSpline => ("b-spline", None),
        Profile::Hann => ("hann", None),
        Profile::Table(_) => ("table", None),
        Profile::Tensor(tensor) => (tensor.name(), None),
    };
    json!({ "profile": name, "sigma": sigma, "extent": kernel.extent })
}
