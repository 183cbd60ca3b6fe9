//! A server of one object on the loopback, with latency, a bounded rate, and faults.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::{TcpListener, TcpStream},
    ops::Range,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst},
    },
    time::{Duration, Instant},
};

/// What the server does wrong in an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    None,
    /// Ends the connection after this many bytes of the body.
    Cut(usize),
    /// Sends the whole object instead of a range.
    Whole,
    Status(u16),
    /// Changes every byte.
    Wrong,
    /// Sends the head of the answer, and then nothing.
    Stall,
    /// Sends the range with another tag.
    Changed,
    /// Sends these bytes instead of an answer, then one byte again and again with pauses of so many
    /// milliseconds for at most this long. Without a pause, it sends as fast as the line takes it.
    Raw {
        head: &'static str,
        then: Then,
    },
}

/// What follows the bytes of [`Fault::Raw`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Then {
    /// The connection ends.
    End,
    /// This many bytes more, and the connection ends.
    Bytes(usize),
    /// Bytes as fast as the line takes them, until the reader has enough.
    Endless,
    /// A byte every this many milliseconds, until the reader has enough.
    Drip(u64),
    /// Nothing, until the reader has enough.
    Silence,
}

/// A server gives up after so long, so that no test leaves threads behind.
const GIVE_UP: Duration = Duration::from_secs(20);

/// What decides the fault of an answer: the number of the request, and its range.
type Decide = Box<dyn Fn(usize, &Range<u64>) -> Fault + Send>;

struct State {
    object: Vec<u8>,
    tag: Option<String>,
    decide: Decide,
    latency: Duration,
    /// Bytes per second of all connections together.
    rate: Option<f64>,
    /// When the line is free again.
    free: Instant,
    asked: Vec<Range<u64>>,
}

/// The server, until it is dropped.
pub struct Server {
    port: u16,
    state: Arc<Mutex<State>>,
    most: Arc<AtomicUsize>,
    is_over: Arc<AtomicBool>,
}

impl Server {
    /// Serves an object without faults.
    pub fn of(object: Vec<u8>) -> Self {
        let listener = TcpListener::bind(("127.0.0.1", 0)).unwrap();
        let port = listener.local_addr().unwrap().port();
        let state = Arc::new(Mutex::new(State {
            object,
            tag: Some("\"first\"".into()),
            decide: Box::new(|_, _| Fault::None),
            latency: Duration::ZERO,
            rate: None,
            free: Instant::now(),
            asked: Vec::new(),
        }));
        let (most, is_over) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicBool::new(false)));
        let server =
            Self { port, state: state.clone(), most: most.clone(), is_over: is_over.clone() };
        std::thread::spawn(move || {
            let now = Arc::new(AtomicUsize::new(0));
            for connection in listener.incoming().flatten() {
                if is_over.load(SeqCst) {
                    return;
                }
                let (state, now, most) = (state.clone(), now.clone(), most.clone());
                std::thread::spawn(move || serve(connection, &state, &now, &most));
            }
        });
        server
    }

    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns an address of the object; any name will do.
    pub fn address(&self, name: &str) -> String {
        format!("http://127.0.0.1:{}/{name}", self.port)
    }

    /// Sets the faults of answers from now on, by the number of the request and its range.
    pub fn fail(&self, decide: impl Fn(usize, &Range<u64>) -> Fault + Send + 'static) {
        self.state().decide = Box::new(decide);
    }

    /// Sets the time before each answer, and the bytes per second of all answers together.
    pub fn slow(&self, latency: Duration, rate: Option<f64>) {
        let mut state = self.state();
        (state.latency, state.rate) = (latency, rate);
    }

    pub fn tag(&self, tag: Option<&str>) {
        self.state().tag = tag.map(str::to_owned);
    }

    /// Returns the ranges asked for since the last call.
    pub fn asked(&self) -> Vec<Range<u64>> {
        std::mem::take(&mut self.state().asked)
    }

    /// Returns the most requests that ran at once.
    pub fn most_at_once(&self) -> usize {
        self.most.load(SeqCst)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.is_over.store(true, SeqCst);
        TcpStream::connect(("127.0.0.1", self.port)).ok();
    }
}

/// Answers the requests of a connection.
fn serve(connection: TcpStream, state: &Mutex<State>, now: &AtomicUsize, most: &AtomicUsize) {
    connection.set_nodelay(true).ok();
    let mut lines = BufReader::new(connection.try_clone().unwrap());
    let mut out = connection;
    while let Some(range) = request(&mut lines) {
        most.fetch_max(now.fetch_add(1, SeqCst) + 1, SeqCst);
        let is_open = answer(&mut out, state, range);
        now.fetch_sub(1, SeqCst);
        if is_open.is_none() {
            out.shutdown(std::net::Shutdown::Both).ok();
            return;
        }
    }
}

/// Reads a request, and returns the range that it asks for: its start and its end, exclusive.
fn request(lines: &mut BufReader<TcpStream>) -> Option<Option<Range<u64>>> {
    let mut range = None;
    for number in 0.. {
        let mut line = String::new();
        if lines.by_ref().take(1 << 16).read_line(&mut line).ok()? == 0 {
            return None;
        }
        if line.trim().is_empty() && number > 0 {
            break;
        }
        let lower = line.trim().to_ascii_lowercase();
        if let Some(ends) = lower.strip_prefix("range: bytes=") {
            let (start, end) = ends.split_once('-')?;
            range = Some(start.parse().ok()?..end.parse::<u64>().ok()? + 1);
        }
    }
    Some(range)
}

/// Answers a request; `None` if the connection is to be closed.
fn answer(out: &mut TcpStream, state: &Mutex<State>, range: Option<Range<u64>>) -> Option<()> {
    let (head, body, fault, latency, rate) = {
        let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
        let size = state.object.len() as u64;
        let range = range.map_or(0..size, |range| range.start..range.end.min(size));
        let number = state.asked.len();
        state.asked.push(range.clone());
        let fault = (state.decide)(number, &range);
        let (status, range) = match fault {
            Fault::Whole => (200, 0..size),
            Fault::Status(status) => (status, 0..0),
            _ => (206, range),
        };
        let mut body = state.object[range.start as usize..range.end as usize].to_vec();
        if fault == Fault::Wrong {
            body.iter_mut().for_each(|byte| *byte ^= 0x55);
        }
        let mut head = format!("HTTP/1.1 {status} Told\r\ncontent-length: {}\r\n", body.len());
        if status == 206 {
            head += &format!("content-range: bytes {}-{}/{size}\r\n", range.start, range.end - 1);
        }
        let tag = if fault == Fault::Changed { Some("\"other\"") } else { state.tag.as_deref() };
        if let Some(tag) = tag {
            head += &format!("etag: {tag}\r\n");
        }
        (head + "\r\n", body, fault, state.latency, state.rate)
    };
    std::thread::sleep(latency);
    if let Fault::Raw { head, then } = fault {
        return raw(out, head, then);
    }
    out.write_all(head.as_bytes()).ok()?;
    match fault {
        Fault::Stall => {
            std::thread::sleep(Duration::from_secs(3));
            return None;
        }
        Fault::Cut(bytes) => {
            out.write_all(&body[..bytes.min(body.len())]).ok()?;
            return None;
        }
        _ => {}
    }
    let Some(rate) = rate else { return out.write_all(&body).ok() };
    for part in body.chunks(32 << 10) {
        let until = {
            let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
            state.free =
                state.free.max(Instant::now()) + Duration::from_secs_f64(part.len() as f64 / rate);
            state.free
        };
        std::thread::sleep(until.saturating_duration_since(Instant::now()));
        out.write_all(part).ok()?;
    }
    Some(())
}

/// Sends what is no proper answer; then the connection is to be closed.
fn raw(out: &mut TcpStream, head: &str, then: Then) -> Option<()> {
    out.write_all(head.as_bytes()).ok()?;
    let begun = Instant::now();
    let is_over = |connection: &mut TcpStream| {
        connection.set_read_timeout(Some(Duration::from_millis(20))).ok();
        let is_closed = connection.read(&mut [0; 64]).is_ok_and(|bytes| bytes == 0);
        is_closed || begun.elapsed() > GIVE_UP
    };
    match then {
        Then::End => {}
        Then::Bytes(bytes) => out.write_all(&vec![b'x'; bytes]).ok()?,
        Then::Endless => {
            while begun.elapsed() < GIVE_UP {
                out.write_all(&[b'x'; 1 << 16]).ok()?;
            }
        }
        Then::Drip(pause) => {
            while !is_over(out) {
                out.write_all(b"x").ok()?;
                std::thread::sleep(Duration::from_millis(pause));
            }
        }
        Then::Silence => while !is_over(out) {},
    }
    None
}
