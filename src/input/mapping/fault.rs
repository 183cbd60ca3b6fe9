//! What is done where a mapped file is not there any more: the handler of SIGBUS, and the mappings that it answers for.
//!
//! The handler may interrupt anything, so it takes no lock and no memory: it reads a list of atomics that only ever grows, maps
//! zeros over the rest of the mapping that was hit, and marks it. mmap is not on the list of what POSIX lets handlers call; on
//! Linux and macOS it is a plain call of the system. A fault elsewhere goes to the handler that was there before, among them
//! that of Rust's runtime for stacks that overflow.
//!
//! A program that sets its own handler of SIGBUS after the first file was opened has to pass on what is not its own.

use std::sync::{
    Once, OnceLock,
    atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst},
};

/// Answers for one mapping as long as it lives.
pub struct Guard(&'static Slot);

impl Guard {
    /// For bytes that are mapped, whole pages from the first one.
    pub fn new(mapped: &[u8]) -> Self {
        install();
        let mut slot = &FIRST;
        while slot.is_taken.swap(true, SeqCst) {
            slot = slot.next.get_or_init(Box::default);
        }
        slot.is_hit.store(false, SeqCst);
        slot.set(mapped.as_ptr() as usize, mapped.len());
        Self(slot)
    }

    /// Whether a part of the mapping was not there when it was read.
    pub fn is_hit(&self) -> bool {
        self.0.is_hit.load(SeqCst)
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        self.0.set(0, 0);
        self.0.is_taken.store(false, SeqCst);
    }
}

/// A place for one mapping. Places are never given back, but used again.
struct Slot {
    is_taken: AtomicBool,
    /// Odd while the two after it are being changed.
    version: AtomicUsize,
    start: AtomicUsize,
    length: AtomicUsize,
    is_hit: AtomicBool,
    next: OnceLock<Box<Self>>,
}

static FIRST: Slot = Slot::new();

impl Slot {
    const fn new() -> Self {
        Self {
            is_taken: AtomicBool::new(false),
            version: AtomicUsize::new(0),
            start: AtomicUsize::new(0),
            length: AtomicUsize::new(0),
            is_hit: AtomicBool::new(false),
            next: OnceLock::new(),
        }
    }

    fn set(&self, start: usize, length: usize) {
        self.version.fetch_add(1, SeqCst);
        self.start.store(start, SeqCst);
        self.length.store(length, SeqCst);
        self.version.fetch_add(1, SeqCst);
    }

    /// The end of the mapping, if an address is in it. One that is just being set is another: what is read is not dropped.
    fn end_around(&self, address: usize) -> Option<usize> {
        let version = self.version.load(SeqCst);
        let [start, length] = [&self.start, &self.length].map(|number| number.load(SeqCst));
        let is_settled = version.is_multiple_of(2) && self.version.load(SeqCst) == version;
        (is_settled && address.checked_sub(start)? < length).then_some(start + length)
    }
}

impl Default for Slot {
    fn default() -> Self {
        Self::new()
    }
}

/// The handler that was there before.
static PREVIOUS: OnceLock<libc::sigaction> = OnceLock::new();

/// Bytes of a page.
static PAGE: AtomicUsize = AtomicUsize::new(0);

#[expect(unsafe_code, reason = "setting a handler of a signal")]
fn install() {
    static ONCE: Once = Once::new();
    // SAFETY: the structures are those that the calls ask for, all zeros being a value of each; what the handler does is safe
    // at any time, as told above. It runs on the stack that threads keep for handlers: where their own has overflowed, the
    // runtime's handler, which comes after it, has to get that far.
    ONCE.call_once(|| unsafe {
        PAGE.store(usize::try_from(libc::sysconf(libc::_SC_PAGESIZE)).unwrap_or(4096), SeqCst);
        let mut previous: libc::sigaction = std::mem::zeroed();
        if libc::sigaction(libc::SIGBUS, std::ptr::null(), &raw mut previous) != 0 {
            return;
        }
        // Before ours, which asks for it, is there.
        let _ = PREVIOUS.set(previous);
        let mut own: libc::sigaction = std::mem::zeroed();
        own.sa_sigaction = on_fault as *const () as usize;
        own.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
        libc::sigemptyset(&raw mut own.sa_mask);
        libc::sigaction(libc::SIGBUS, &raw const own, std::ptr::null_mut());
    });
}

#[expect(unsafe_code, reason = "a handler of a signal")]
extern "C" fn on_fault(
    signal: libc::c_int,
    info: *mut libc::siginfo_t,
    context: *mut libc::c_void,
) {
    // SAFETY: the system calls this with a pointer to what it knows of the signal. A positive code tells that the signal is a
    // fault and has an address.
    let address = unsafe { ((*info).si_code > 0).then(|| (*info).si_addr() as usize) };
    if !address.is_some_and(replace) {
        pass_on(signal, info, context);
    }
}

/// Puts zeros in the place of a mapping from an address on; tells whether there is one of ours.
#[expect(unsafe_code, reason = "mapping zeros over what is not there")]
fn replace(address: usize) -> bool {
    let mut slot = Some(&FIRST);
    while let Some(at) = slot {
        if let Some(end) = at.end_around(address) {
            at.is_hit.store(true, SeqCst);
            let start = address & !(PAGE.load(SeqCst) - 1);
            let flags = libc::MAP_PRIVATE | libc::MAP_ANON | libc::MAP_FIXED;
            // SAFETY: the pages belong to a mapping that is ours, is being read, so is not dropped, and is read only; its last page
            // is its own to the end. Readers see the same bytes or zeros.
            let mapped = unsafe {
                libc::mmap(start as *mut libc::c_void, end - start, libc::PROT_READ, flags, -1, 0)
            };
            return mapped != libc::MAP_FAILED;
        }
        slot = at.next.get().map(|next| &**next);
    }
    false
}

/// Has the handler that was there before answer.
#[expect(unsafe_code, reason = "calling a handler of a signal")]
fn pass_on(signal: libc::c_int, info: *mut libc::siginfo_t, context: *mut libc::c_void) {
    type Plain = extern "C" fn(libc::c_int);
    type Informed = extern "C" fn(libc::c_int, *mut libc::siginfo_t, *mut libc::c_void);
    // SAFETY: what the system gave as a handler is one, of the form that its flags tell. The default action is set where there
    // was none: what faulted is tried again and ends the process; a signal that somebody sent is sent again.
    unsafe {
        match PREVIOUS.get() {
            Some(previous) if ![libc::SIG_DFL, libc::SIG_IGN].contains(&previous.sa_sigaction) => {
                if previous.sa_flags & libc::SA_SIGINFO != 0 {
                    std::mem::transmute::<usize, Informed>(previous.sa_sigaction)(
                        signal, info, context,
                    );
                } else {
                    std::mem::transmute::<usize, Plain>(previous.sa_sigaction)(signal);
                }
            }
            _ => {
                libc::signal(signal, libc::SIG_DFL);
                if (*info).si_code <= 0 {
                    libc::raise(signal);
                }
            }
        }
    }
}
