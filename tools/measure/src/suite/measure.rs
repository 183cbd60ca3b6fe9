//! A case, drawn and timed.

use super::{
    case::{Case, Plan, Seed, Series},
    memory,
};
use splatkit::{
    Device, Error, FrameStats, Renderer, Result,
    picture::Picture,
    scene::{Evaluate, Settings},
};
use splatkit_tools::{
    progress::Progress,
    timing::{STEP, Times, milliseconds},
};
use std::time::Instant;

/// A planned case and its measurement, or why it was not drawn.
pub struct Outcome {
    pub name: String,
    pub result: Result<Measured>,
}

pub struct Measured {
    pub drawn: String,
    pub size: [u32; 2],
    pub effective: u64,
    pub seed: Option<Seed>,
    pub series: Option<Series>,
    pub times: Times,
    pub stats: FrameStats,
    /// The peak memory of the process from the upload on, including the scene's own.
    pub cpu_peak: Option<u64>,
    /// Milliseconds of each step of the first view.
    pub steps: Vec<(&'static str, f64)>,
    /// The same scene gathered, if it can be.
    pub gathered: Option<Gathered>,
    /// Whether every run drew the same bytes; `None` if there was only one run.
    pub same_bytes: Option<bool>,
}

/// A scene whose lattice is gathered instead of scattered.
pub struct Gathered {
    pub times: Times,
    /// Milliseconds of each step of the first view.
    pub steps: Vec<(&'static str, f64)>,
    /// Bytes of the scene's buffers and the frame's.
    pub bytes: u64,
}

/// How many frames are measured, and how many runs are compared.
#[derive(Debug, Clone, Copy)]
pub struct Counts {
    pub frames: u32,
    pub runs: u32,
}

/// Measures one plan after another.
pub fn outcomes(
    plans: Vec<Plan>,
    device: &mut Device,
    counts: Counts,
    progress: &Progress,
) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for plan in plans {
        let outcome = outcome(plan, device, counts, progress);
        if let Err(error) = &outcome.result {
            reopen(device, error);
        }
        outcomes.push(outcome);
    }
    outcomes
}

/// Reopens the device if the error says that it is lost, because all later cases would fail too. If
/// it does not reopen, the next case fails with that error and tries again.
pub fn reopen(device: &mut Device, error: &Error) {
    if matches!(error, Error::DeviceLost(_))
        && let Device::Gpu(gpu, _) = device
        && let Ok(anew) = gpu.reopened()
    {
        *gpu = anew;
    }
}

/// Returns an error if a picture draws nothing of a scene.
pub fn require_content(stats: &FrameStats) -> Result<()> {
    if stats.splats == 0 && stats.gathered == 0 {
        return Err(Error::NothingToDraw("the camera sees no splat that has opacity".into()));
    }
    Ok(())
}

/// Makes a plan's scene, measures it and drops it.
fn outcome(plan: Plan, device: &Device, counts: Counts, progress: &Progress) -> Outcome {
    let Plan { name, make } = plan;
    progress.stage(format!("Making {name}"));
    let result = make().and_then(|case| {
        progress.stage(format!("Drawing {name}"));
        measure(case, device, counts)
    });
    Outcome { name, result }
}

fn measure(case: Case, device: &Device, counts: Counts) -> Result<Measured> {
    memory::reset_peak();
    // A new renderer: one that has drawn before keeps the largest buffers that it has needed.
    let mut renderer = Renderer::new(device, &case.scene)?;
    let stats = renderer.draw(&case.camera(0.0), &case.settings)?;
    require_content(&stats)?;
    let (times, steps) = timed(&mut renderer, &case, &case.settings, counts)?;
    let cpu_peak = memory::peak();
    drop(renderer);
    let gathered = gathered(&case, device, counts)?;
    let same_bytes =
        if counts.runs > 1 { Some(same_bytes(&case, device, counts.runs)?) } else { None };
    Ok(Measured {
        drawn: case.drawn,
        size: case.settings.size,
        effective: case.effective,
        seed: case.seed,
        series: case.series,
        times,
        stats,
        cpu_peak,
        steps,
        gathered,
        same_bytes,
    })
}

/// Times the case's frames, and the steps of its first view in milliseconds.
fn timed(
    renderer: &mut Renderer,
    case: &Case,
    settings: &Settings,
    counts: Counts,
) -> Result<(Times, Vec<(&'static str, f64)>)> {
    let mut times = Vec::new();
    for frame in 1..=counts.frames {
        let camera = case.camera(STEP * f64::from(frame));
        let start = Instant::now();
        renderer.draw(&camera, settings)?;
        times.push(milliseconds(start));
    }
    Ok((Times::of(times), renderer.profile(&case.camera(0.0), settings)?.steps))
}

/// Measures the case as the engine draws it by default. Returns `None` if the scene has no lattice
/// or the engine does not gather it.
fn gathered(case: &Case, device: &Device, counts: Counts) -> Result<Option<Gathered>> {
    if case.scene.items.iter().all(|item| item.lattice().is_none()) {
        return Ok(None);
    }
    let settings = Settings { evaluate: Evaluate::Auto, ..case.settings.clone() };
    let mut renderer = Renderer::new(device, &case.scene)?;
    let stats = renderer.draw(&case.camera(0.0), &settings)?;
    if stats.gathered == 0 {
        return Ok(None);
    }
    let (times, steps) = timed(&mut renderer, case, &settings, counts)?;
    Ok(Some(Gathered { times, steps, bytes: stats.gpu_bytes }))
}

/// Draws a case anew so many times and compares the pictures, bit by bit.
fn same_bytes(case: &Case, device: &Device, runs: u32) -> Result<bool> {
    let draw = || {
        let mut renderer = Renderer::new(device, &case.scene)?;
        Ok(renderer.render(&case.camera(0.0), &case.settings)?.0)
    };
    let first = draw()?;
    for _ in 1..runs {
        if !same(&first, &draw()?) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Whether two pictures are the same bit by bit: a NaN equals itself, and zeros of different sign
/// differ.
fn same(a: &Picture, b: &Picture) -> bool {
    let bits = |picture: &Picture| {
        let numbers = picture.color.as_flattened().iter().chain(&picture.depth);
        numbers.map(|number| number.to_bits()).collect::<Vec<_>>()
    };
    bits(a) == bits(b)
}

impl Measured {
    pub fn fps(&self) -> f64 {
        1e3 / self.times.median
    }

    /// Returns a count per frame as a rate per second.
    pub fn per_second(&self, count: u64) -> f64 {
        count as f64 * self.fps()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_compared_bit_by_bit() {
        let picture = |red: f32| Picture {
            width: 1,
            height: 1,
            color: vec![[red, 0.0, 0.0, 1.0]],
            depth: vec![1.0],
        };
        assert!(same(&picture(f32::NAN), &picture(f32::NAN)));
        assert!(
            !same(&picture(0.0), &picture(-0.0))
                && !same(&picture(0.5), &picture(0.5 + f32::EPSILON))
        );
    }
}
