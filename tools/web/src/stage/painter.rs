//! What draws the frames of a stage. The processor draws at once; a GPU draws while the page hears
//! the hand.

use splatkit::{
    Device, FrameStats, Renderer, Result, Stop,
    math::View,
    picture::Picture,
    scene::{Scene, Settings},
    volume::TransferFunction,
};
use std::{
    future::poll_fn,
    pin::Pin,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    task::{Context, Poll, Wake, Waker},
};

/// The renderer, on loan while a GPU draws, and the picture that the GPU has drawn.
type Drawing = Pin<Box<dyn Future<Output = (Renderer, Result<(Picture, FrameStats)>)>>>;

/// A renderer, and the picture that a GPU draws.
pub struct Painter {
    is_gpu: bool,
    /// The renderer, unless a GPU draws.
    renderer: Option<Renderer>,
    drawing: Option<(Drawing, Stop)>,
    /// The transfer functions of items that were set while a GPU draws.
    transfers: Vec<(usize, TransferFunction)>,
    bell: Arc<Bell>,
    /// Whether pages that the frame needs did not find room.
    is_missing: bool,
}

impl Painter {
    /// Prepares a scene on a device.
    pub fn new(device: &Device, scene: &Scene) -> Result<Self> {
        Ok(Self {
            is_gpu: !matches!(device, Device::Cpu),
            renderer: Some(Renderer::new(device, scene)?),
            drawing: None,
            transfers: Vec::new(),
            bell: Arc::default(),
            is_missing: false,
        })
    }

    /// Whether a GPU draws the frames.
    pub fn is_gpu(&self) -> bool {
        self.is_gpu
    }

    /// Whether a GPU draws now.
    pub fn is_drawing(&self) -> bool {
        self.drawing.is_some()
    }

    /// A frame begins.
    pub fn renew(&mut self) {
        self.is_missing = false;
    }

    /// Returns whether pages of hierarchies that the frame needs did not find room in memory.
    pub fn is_missing(&self) -> bool {
        self.is_missing
    }

    /// Draws at once, on the processor.
    pub fn draw(&mut self, view: &View, settings: &Settings) -> Result<Picture> {
        let Some(renderer) = &mut self.renderer else { return Ok(Picture::blank(settings.size)) };
        let (picture, stats) = renderer.render(view, settings)?;
        self.is_missing |= stats.missing_pages > 0;
        Ok(picture)
    }

    /// Begins a picture on a GPU. [`poll`](Self::poll) returns it.
    pub fn begin(&mut self, view: View, mut settings: Settings) {
        let Some(mut renderer) = self.renderer.take() else { return };
        let stop = settings.controls.stop.child();
        settings.controls.stop = stop.clone();
        let drawing = async move {
            let drawn = renderer.render_async(&view, &settings).await;
            (renderer, drawn)
        };
        self.drawing = Some((Box::pin(drawing), stop));
    }

    /// Asks a GPU to end its picture, which nobody needs any more.
    pub fn stop(&self) {
        if let Some((_, stop)) = &self.drawing {
            stop.request();
        }
    }

    /// Returns the picture that was begun, or `None` while a GPU draws.
    pub fn poll(&mut self) -> Option<Result<Picture>> {
        let (drawing, _) = self.drawing.as_mut()?;
        self.bell.still();
        let waker = Waker::from(self.bell.clone());
        let Poll::Ready((mut renderer, drawn)) =
            drawing.as_mut().poll(&mut Context::from_waker(&waker))
        else {
            return None;
        };
        let mut set = self.transfers.drain(..);
        let all = set.try_for_each(|(item, transfer)| renderer.set_transfer(item, &transfer));
        drop(set);
        self.renderer = Some(renderer);
        self.drawing = None;
        Some(all.and(drawn).map(|(picture, stats)| {
            self.is_missing |= stats.missing_pages > 0;
            picture
        }))
    }

    /// Returns a future that is ready when [`poll`](Self::poll) may have more to say.
    pub fn more(&self) -> impl Future<Output = ()> + use<> {
        let bell = self.bell.clone();
        poll_fn(move |context| bell.poll(context.waker()))
    }

    /// Sets the transfer function of an item. If a GPU draws, it counts from the next picture on.
    pub fn set_transfer(&mut self, item: usize, transfer: &TransferFunction) -> Result<()> {
        match &mut self.renderer {
            Some(renderer) => renderer.set_transfer(item, transfer),
            None => {
                self.transfers.push((item, transfer.clone()));
                Ok(())
            }
        }
    }
}

impl Drop for Painter {
    fn drop(&mut self) {
        // Nobody waits for ever.
        self.bell.clone().wake();
    }
}

/// Rings when a GPU has done what it was asked for.
#[derive(Debug, Default)]
struct Bell(Mutex<Ring>);

#[derive(Debug, Default)]
struct Ring {
    is_rung: bool,
    waker: Option<Waker>,
}

impl Bell {
    fn lock(&self) -> MutexGuard<'_, Ring> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn still(&self) {
        self.lock().is_rung = false;
    }

    fn poll(&self, waker: &Waker) -> Poll<()> {
        let mut ring = self.lock();
        if ring.is_rung {
            return Poll::Ready(());
        }
        ring.waker = Some(waker.clone());
        Poll::Pending
    }
}

impl Wake for Bell {
    fn wake(self: Arc<Self>) {
        let mut ring = self.lock();
        ring.is_rung = true;
        let waker = ring.waker.take();
        drop(ring);
        waker.into_iter().for_each(Waker::wake);
    }
}
