//! The steps of an axis, drawn and timed.

use super::{
    asked::Asked,
    plan::{Plan, Step},
    ratio::{CLIFF, Ratio},
};
use crate::suite::measure::{reopen, require_content};
use splatkit::{Device, Error, FrameStats, Renderer, Result, scene::Evaluate};
use splatkit_tools::{
    progress::Progress,
    timing::{Times, milliseconds},
};
use std::time::Instant;

/// How many frames of a step are drawn: at least `least`, and more, up to `most`, until they have
/// taken `enough` milliseconds.
#[derive(Debug, Clone, Copy)]
pub struct Frames {
    pub least: usize,
    pub most: usize,
    pub enough: f64,
}

impl Frames {
    fn take_more(self, times: &[f64]) -> bool {
        times.len() < self.least
            || times.len() < self.most && times.iter().sum::<f64>() < self.enough
    }
}

/// A step with this excess cost is a cliff on an idle machine as well as on a busy one.
const HIGH: f64 = 2.0 * CLIFF;

/// A planned step and its measurement, or why it was not drawn.
pub struct Outcome {
    pub name: String,
    pub against: Option<usize>,
    pub result: Result<Measured>,
}

pub struct Measured {
    pub size: [u32; 2],
    pub asked: Asked,
    pub times: Times,
    pub stats: FrameStats,
}

impl Outcome {
    /// Whether measuring failed although the engine draws such scenes.
    pub fn has_failed(&self) -> bool {
        self.result.as_ref().is_err_and(|error| !is_undrawn(error))
    }
}

/// Whether an error says that the engine does not draw such a scene.
fn is_undrawn(error: &Error) -> bool {
    matches!(error, Error::Argument(_))
}

/// Returns the outcome that `outcome` is compared with, and the comparison. It uses the shortest
/// frame times, because other programs do not lower them.
pub fn compared<'a>(outcomes: &'a [Outcome], outcome: &Outcome) -> Option<(&'a Outcome, Ratio)> {
    let neighbour = &outcomes[outcome.against?];
    let (measured, other) = (outcome.result.as_ref().ok()?, neighbour.result.as_ref().ok()?);
    Some((
        neighbour,
        Ratio::of((measured.times.min, &measured.asked), (other.times.min, &other.asked)),
    ))
}

/// How steps are measured.
pub struct Measure<'a> {
    pub device: &'a mut Device,
    pub evaluate: Evaluate,
    pub frames: Frames,
    pub progress: &'a Progress,
}

impl Measure<'_> {
    pub fn outcomes(&mut self, axis: &str, plans: Vec<Plan>) -> Vec<Outcome> {
        let mut outcomes = Vec::new();
        for plan in &plans {
            let result = self.result(axis, plan);
            outcomes.push(Outcome { name: plan.name.clone(), against: plan.against, result });
        }
        self.remeasure(axis, &plans, &mut outcomes);
        outcomes
    }

    /// Measures both sides of each low cliff once more, because another program may have used the
    /// processor. That would not explain a high cliff.
    fn remeasure(&mut self, axis: &str, plans: &[Plan], outcomes: &mut [Outcome]) {
        let mut sides: Vec<usize> = Vec::new();
        for (at, outcome) in outcomes.iter().enumerate() {
            if let (Some(other), Some((_, ratio))) = (outcome.against, compared(outcomes, outcome))
                && ratio.is_cliff()
                && ratio.beyond() < HIGH
            {
                sides.extend(
                    [other, at].iter().filter(|side| !sides.contains(side)).collect::<Vec<_>>(),
                );
            }
        }
        for side in sides {
            if let (Ok(again), Ok(first)) =
                (self.result(axis, &plans[side]), &mut outcomes[side].result)
                && again.times.min < first.times.min
            {
                *first = again;
            }
        }
    }

    /// Makes a plan's scene, measures it and drops it.
    fn result(&mut self, axis: &str, plan: &Plan) -> Result<Measured> {
        let name = &plan.name;
        self.progress.stage(format!("Making {axis}, {name}"));
        let result = (plan.make)().and_then(|step| {
            self.progress.stage(format!("Drawing {axis}, {name}"));
            self.measured(step)
        });
        if let Err(error) = &result {
            reopen(self.device, error);
        }
        result
    }

    fn measured(&self, step: Step) -> Result<Measured> {
        let Step { scene, content, camera, mut settings } = step;
        settings.evaluate = self.evaluate;
        let mut renderer = Renderer::new(self.device, &scene)?;
        let (picture, stats) = renderer.render(&camera, &settings)?;
        require_content(&stats)?;
        let mut times = Vec::new();
        while self.frames.take_more(&times) {
            let start = Instant::now();
            renderer.draw(&camera, &settings)?;
            times.push(milliseconds(start));
        }
        let asked = content.asked(&camera, &settings, &picture)?;
        Ok(Measured { size: settings.size, asked, times: Times::of(times), stats })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quick_frames_are_drawn_more_often() {
        let frames = Frames { least: 2, most: 4, enough: 100.0 };
        let more = |times: &[f64]| frames.take_more(times);
        assert!(more(&[500.0]) && !more(&[500.0, 500.0]));
        assert!(more(&[1.0, 1.0, 1.0]) && !more(&[1.0; 4]));
    }
}
