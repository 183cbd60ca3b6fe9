//! The thread that draws: a coarse frame at once, then finer ones, up to the exact picture.

use crate::job::{Finish, Loaded};
use splatkit::{
    Device, Error, FrameStats, Renderer, Stop,
    about::Modality,
    interaction::{Effort, Histogram, Pace},
    math::Camera,
    picture::Picture,
    scene::{Item, Settings},
    volume::TransferFunction,
};
use std::{
    sync::{Arc, Condvar, Mutex, MutexGuard},
    thread::JoinHandle,
    time::{Duration, Instant},
};

/// The wanted time of a moving frame, in milliseconds. An input waits for the frame before it, and
/// without a GPU the window itself takes about 15 ms of both processors: together 50 ms.
const MOVING: f64 = 17.0;

/// A view that changed less than this ago may still move: it is not refined yet. A finer frame
/// would delay the next moving one.
const CALM: Duration = Duration::from_millis(70);

/// A loaded scene, and the device that draws it.
pub struct Stage {
    pub loaded: Arc<Loaded>,
    pub device: Device,
    /// How often the values of the fields are, with the numbers of their items.
    pub histograms: Arc<[(usize, Histogram)]>,
    /// The thickness of a sheet that the volume's spacing asks for, in world units.
    pub sheet: Option<f64>,
}

impl Stage {
    /// Returns the smallest and the largest value of an item's field; 0 and 1 if it has none.
    pub fn values(&self, item: usize) -> [f64; 2] {
        let item = self.loaded.scene.items.get(item);
        item.and_then(Item::value_range).unwrap_or([0.0, 1.0])
    }

    /// Returns whether the values of an item's field are Hounsfield units: because the file says
    /// so, or, if it says nothing, because they reach from air to bone.
    pub fn is_hounsfield(&self, item: usize) -> bool {
        let [low, high] = self.values(item);
        let is_likely = (-4096.0..=-200.0).contains(&low) && (200.0..=32768.0).contains(&high);
        match self.loaded.scene.items.get(item) {
            Some(Item::Volume(volume, ..)) => match volume.about.modality {
                Some(modality) => modality == Modality::Ct,
                None => volume.about.unit == "HU" || (volume.about.unit.is_empty() && is_likely),
            },
            Some(Item::Bricks(..)) => is_likely,
            _ => false,
        }
    }

    /// Returns how often the values of an item's field are.
    pub fn histogram(&self, item: usize) -> Option<&Histogram> {
        let entry = self.histograms.iter().find(|(number, _)| *number == item);
        entry.map(|(_, histogram)| histogram)
    }

    /// Returns the transfer functions that the scene was loaded with, with the numbers of their
    /// items.
    pub fn transfers(&self) -> Vec<(usize, TransferFunction)> {
        let items = self.loaded.scene.items.iter().enumerate();
        items.filter_map(|(number, item)| Some((number, item.transfer()?.clone()))).collect()
    }
}

/// What is to be drawn.
#[derive(Clone)]
pub struct Order {
    pub stage: Arc<Stage>,
    pub camera: Camera,
    /// The settings of the exact picture, before it is averaged down.
    pub settings: Settings,
    pub finish: Arc<Finish>,
    /// The transfer functions of the fields, with the numbers of their items.
    pub transfers: Vec<(usize, TransferFunction)>,
}

/// A frame that was drawn.
pub struct Frame {
    /// The number of its order.
    pub number: u64,
    /// The finished picture. A frame that is not exact has fewer pixels and no texts.
    pub picture: Picture,
    pub camera: Camera,
    pub effort: Effort,
    pub stats: FrameStats,
    pub milliseconds: f64,
    /// When it was ordered.
    pub ordered: Instant,
}

impl Frame {
    pub fn is_exact(&self) -> bool {
        self.effort == Effort::EXACT
    }
}

/// The thread that draws.
pub struct Painter {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    state: Mutex<State>,
    wake: Condvar,
    /// Called when there is a frame or an error.
    tell: Box<dyn Fn() + Send + Sync>,
}

#[derive(Default)]
struct State {
    order: Option<Order>,
    /// The number of the order, and when it came.
    number: u64,
    since: Option<Instant>,
    /// Stops the frame that is drawn now, if it only refines.
    refining: Option<Stop>,
    frame: Option<Frame>,
    error: Option<String>,
    /// Whether the current order is drawn exactly, or failed.
    rests: bool,
    ends: bool,
}

impl Shared {
    /// Nothing panics while it holds the lock.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

impl Painter {
    /// Starts the thread. `tell` is called when there is something new.
    pub fn start(tell: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            state: Mutex::default(),
            wake: Condvar::new(),
            tell: Box::new(tell),
        });
        let thread_shared = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("painter".into())
            .spawn(move || run(&thread_shared))?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Gives an order, which replaces the one before. Returns its number.
    pub fn order(&self, order: Order) -> u64 {
        let mut state = self.shared.lock();
        state.order = Some(order);
        state.number += 1;
        state.since = Some(Instant::now());
        state.rests = false;
        if let Some(stop) = &state.refining {
            stop.request();
        }
        self.shared.wake.notify_one();
        state.number
    }

    /// Forgets the order: nothing is drawn.
    pub fn clear(&self) {
        let mut state = self.shared.lock();
        (state.order, state.frame) = (None, None);
        state.number += 1;
        state.rests = true;
    }

    /// Takes the newest frame, if there is a new one.
    pub fn take_frame(&self) -> Option<Frame> {
        self.shared.lock().frame.take()
    }

    /// Takes the error of the last order.
    pub fn take_error(&self) -> Option<String> {
        self.shared.lock().error.take()
    }
}

impl Drop for Painter {
    fn drop(&mut self) {
        {
            let mut state = self.shared.lock();
            state.ends = true;
            if let Some(stop) = &state.refining {
                stop.request();
            }
        }
        self.shared.wake.notify_one();
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
    }
}

/// A renderer, the scene that it draws, and the transfer functions that it has.
struct Prepared {
    stage: Arc<Stage>,
    renderer: Renderer,
    transfers: Vec<(usize, TransferFunction)>,
}

/// A frame that is to be drawn.
struct Step {
    order: Order,
    number: u64,
    ordered: Instant,
    effort: Effort,
    stop: Stop,
}

fn run(shared: &Shared) {
    let mut pace = Pace::new(MOVING);
    let mut prepared: Option<Prepared> = None;
    let mut drawn = 0;
    while let Some(step) = next(shared, &mut pace, &mut drawn, &mut prepared) {
        let Step { order, number, ordered, effort, stop } = step;
        let start = Instant::now();
        let done = draw(&mut prepared, &order, effort, stop);
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        let mut state = shared.lock();
        state.refining = None;
        match done {
            Ok((picture, stats)) => {
                pace.took(effort, milliseconds);
                let camera = order.camera;
                state.frame =
                    Some(Frame { number, picture, camera, effort, stats, milliseconds, ordered });
                state.rests = state.number == number && effort == Effort::EXACT;
            }
            Err(Error::Stopped) => continue,
            Err(error) => {
                if state.number == number {
                    state.error = Some(error.to_string());
                    state.rests = true;
                }
                if matches!(error, Error::DeviceLost(_)) {
                    prepared = None;
                }
            }
        }
        drop(state);
        (shared.tell)();
    }
}

/// Waits for the next frame that is to be drawn; `None` at the end. `drawn` is the number of the
/// last order of which a frame was begun.
fn next(
    shared: &Shared,
    pace: &mut Pace,
    drawn: &mut u64,
    prepared: &mut Option<Prepared>,
) -> Option<Step> {
    let mut state = shared.lock();
    loop {
        while !state.ends && (state.order.is_none() || state.rests) {
            if state.order.is_none() {
                *prepared = None;
            }
            state = shared.wake.wait(state).unwrap_or_else(std::sync::PoisonError::into_inner);
        }
        if state.ends {
            return None;
        }
        let number = state.number;
        let is_new = number != *drawn;
        if is_new {
            pace.changed();
            *drawn = number;
        }
        let ordered = state.since.unwrap_or_else(Instant::now);
        let calm = ordered.elapsed();
        let Some(effort) = pace.next() else {
            state.rests = true;
            continue;
        };
        if !is_new && calm < CALM {
            let wait = shared.wake.wait_timeout(state, CALM - calm);
            state = wait.unwrap_or_else(std::sync::PoisonError::into_inner).0;
            continue;
        }
        let stop = Stop::default();
        state.refining = (!is_new).then(|| stop.clone());
        let order = state.order.clone()?;
        return Some(Step { order, number, ordered, effort, stop });
    }
}

/// Draws a frame.
fn draw(
    prepared: &mut Option<Prepared>,
    order: &Order,
    effort: Effort,
    stop: Stop,
) -> splatkit::Result<(Picture, FrameStats)> {
    let is_other = |kept: &mut Prepared| !Arc::ptr_eq(&kept.stage, &order.stage);
    prepared.take_if(is_other);
    let current = match prepared {
        Some(current) => current,
        none => {
            let renderer = Renderer::new(&order.stage.device, &order.stage.loaded.scene)?;
            let (stage, transfers) = (Arc::clone(&order.stage), order.stage.transfers());
            none.insert(Prepared { stage, renderer, transfers })
        }
    };
    for new in order.transfers.iter().filter(|new| !current.transfers.contains(new)) {
        current.renderer.set_transfer(new.0, &new.1)?;
    }
    current.transfers.clone_from(&order.transfers);
    let mut exact = order.settings.clone();
    exact.controls.stop = stop;
    let settings = effort.settings(&exact, exact.sheet_thickness.or(order.stage.sheet));
    let (picture, stats) = current.renderer.render(&order.camera, &settings)?;
    if effort != Effort::EXACT {
        return Ok((picture, stats));
    }
    Ok((order.finish.finished(picture, &order.camera, &order.stage.loaded)?, stats))
}
