//! Recipes for what is known to have measured the values.

use super::{Hidden, colours, materials::Materials, recipe::Points, sides, survey::Survey};
use crate::about::{About, Modality};

/// Hounsfield units: from air to fat, and from blood to bone.
const SKIN: [f64; 3] = [-650.0, -350.0, -180.0];
const VESSELS: f64 = 170.0;
const BONE: [f64; 3] = [260.0, 500.0, 1500.0];
/// Share of the samples that bone has at least.
const LEAST_BONE: f64 = 5e-4;

/// Returns the points for the modality of a file, and whether they are lit. `None` if nothing is
/// known, or the values do not fit.
pub fn points(
    survey: &Survey,
    materials: &Materials,
    about: &About,
    hidden: &Hidden,
) -> Option<(Points, bool)> {
    let ramp: (&[[f64; 3]], bool) = match about.modality {
        Some(Modality::Ct) => return tomography(survey, about, hidden),
        Some(Modality::Mr) => (&colours::MAGNETIC, true),
        Some(Modality::Emission) => (&colours::HOT, false),
        Some(Modality::Ultrasound) => (&colours::SOUND, true),
        Some(Modality::Microscopy) => (&colours::GLOW, false),
        None if about.unit == "HU" || are_hounsfield(survey, materials) => {
            return tomography(survey, about, hidden);
        }
        None => return None,
    };
    if !survey.labels.is_empty() {
        return None;
    }
    // Electron microscopes show dark things before a bright background.
    let [below, above] = sides(survey, materials);
    if below.is_some() && about.modality == Some(Modality::Microscopy) {
        return None;
    }
    let side = above.or(below)?;
    let (ramp, is_lit) = ramp;
    let points =
        if is_lit && side.has_borders() { side.of_solids(ramp) } else { side.of_field(ramp) };
    Some((side.with_sign(points), is_lit))
}

/// Whether values look like Hounsfield units: whole or not, with air around and tissue inside.
fn are_hounsfield(survey: &Survey, materials: &Materials) -> bool {
    let [low, high] = survey.range;
    let is_air = (-1100.0..=-850.0).contains(&materials.mode) || materials.mode < -1100.0;
    let tissue = (-150.0..=150.0).contains(&materials.above.last().map_or(f64::NAN, |m| m.value))
        || materials.above.iter().any(|peak| (-150.0..=150.0).contains(&peak.value));
    (-5000.0..=-700.0).contains(&low) && (300.0..=40_000.0).contains(&high) && is_air && tissue
}

/// Shows computed tomography: skin as a shell, vessels with a contrast agent, and bone. Without
/// bone the skin is solid. A window of the lungs shows those.
fn tomography(survey: &Survey, about: &About, hidden: &Hidden) -> Option<(Points, bool)> {
    let all: f64 = survey.counts.iter().sum();
    let beyond = |from: f64, to: f64| {
        let within = |bin: &usize| (from..to).contains(&survey.value(*bin as f64));
        (0..survey.counts.len()).filter(within).map(|bin| survey.counts[bin]).sum::<f64>() / all
    };
    let has_skin =
        beyond(f64::NEG_INFINITY, SKIN[0]) > 0.01 && beyond(SKIN[2], f64::INFINITY) > 0.01;
    let has_bone = beyond(BONE[0], f64::INFINITY) > LEAST_BONE;
    if !(has_skin || has_bone) {
        return None;
    }
    let spacing = survey.spacing;
    let solid = 1.15 / spacing;
    let mut points = Points::default();
    let mut add = |value: f64, color: [f64; 3], depth: f64| {
        points.color.push((value, color));
        points.depth.push((value, depth));
    };
    let is_of_lungs = about.window.is_some_and(|[low, high]| 0.5 * (low + high) < -250.0);
    if is_of_lungs && has_skin {
        add(-950.0, [0.20, 0.35, 0.55], 0.0);
        add(-780.0, [0.35, 0.55, 0.75], 0.01 / spacing);
        add(-560.0, [0.62, 0.74, 0.86], 0.06 / spacing);
    }
    if has_skin {
        let share = if has_bone { hidden(SKIN[1], BONE[0]) } else { 0.0 };
        let opacity = 0.9 - 0.65 * (2.0 * share).min(1.0);
        let slope = survey.slopes[survey.bin(SKIN[1])];
        let length = if slope > 0.0 { 0.5 * (SKIN[2] - SKIN[0]) / slope } else { spacing };
        let depth = -f64::ln(1.0 - opacity) / length.max(0.5 * spacing);
        let skin = [0.80, 0.62, 0.52];
        add(SKIN[0], skin, 0.0);
        add(SKIN[1], skin, depth);
        let inside = if has_bone { 0.0 } else { solid };
        add(SKIN[2], skin, inside);
    }
    // Noise of soft tissue must not look like vessels.
    let first = VESSELS.max(60.0 + 3.5 * survey.noise).min(BONE[0] - 20.0);
    add(first, [0.66, 0.16, 0.13], if has_bone { 0.0 } else { solid });
    if has_bone {
        add(BONE[0], [0.80, 0.42, 0.32], 0.25 * solid);
        add(BONE[1], [0.93, 0.84, 0.68], solid);
        add(BONE[2], [1.0, 0.98, 0.93], solid);
    }
    Some((points, true))
}
