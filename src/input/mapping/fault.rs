//! Handles reads of a mapped file whose pages are gone: the SIGBUS handler, and the mappings that
//! it covers.
//!
//! The handler may interrupt anything, so it takes no lock and allocates nothing. It reads a list
//! of atomics that only ever grows, maps zeros over the rest of the mapping that was hit, and marks
//! it. POSIX does not list mmap among the functions that a handler may call; on Linux and macOS it
//! is a plain system call. Faults at other addresses go to the previous handler. For example,
//! Rust's runtime has one for stack overflows.
//!
//! A program that sets its own SIGBUS handler after the first file was opened must pass on the
//! faults that are not its own.

use std::sync::{
    Once, OnceLock,
    atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst},
};

/// Covers one mapping for as long as it lives.
pub struct Guard(&'static Slot);

impl Guard {
    /// Covers mapped bytes, which are whole pages starting at the first byte.
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

    /// Returns whether a part of the mapping was missing when it was read.
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

/// A slot for one mapping. Slots are never freed, but reused.
struct Slot {
    is_taken: AtomicBool,
    /// Odd while `start` and `length` are being changed.
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

    /// Returns the end of the mapping if it contains the address. A slot that is just being changed
    /// belongs to another mapping: the one being read is not dropped meanwhile.
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

/// The previous handler.
static PREVIOUS: OnceLock<libc::sigaction> = OnceLock::new();

/// Bytes per page.
static PAGE: AtomicUsize = AtomicUsize::new(0);

#[expect(unsafe_code, reason = "installing a signal handler")]
fn install() {
    static ONCE: Once = Once::new();
    // SAFETY: the calls get structures of the types they expect, and all zeros is a valid value of
    // each. The handler is safe to run at any time, as the module's documentation explains. It runs
    // on the stack that threads reserve for handlers. If a thread's own stack has overflowed, the
    // runtime's handler, which runs after ours, must still be reached.
    ONCE.call_once(|| unsafe {
        PAGE.store(usize::try_from(libc::sysconf(libc::_SC_PAGESIZE)).unwrap_or(4096), SeqCst);
        let mut previous: libc::sigaction = std::mem::zeroed();
        if libc::sigaction(libc::SIGBUS, std::ptr::null(), &raw mut previous) != 0 {
            return;
        }
        // Set before our handler is installed, which reads it.
        let _ = PREVIOUS.set(previous);
        let mut action: libc::sigaction = std::mem::zeroed();
        action.sa_sigaction = on_fault as *const () as usize;
        action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
        libc::sigemptyset(&raw mut action.sa_mask);
        libc::sigaction(libc::SIGBUS, &raw const action, std::ptr::null_mut());
    });
}

#[expect(unsafe_code, reason = "a signal handler")]
extern "C" fn on_fault(
    signal: libc::c_int,
    info: *mut libc::siginfo_t,
    context: *mut libc::c_void,
) {
    // SAFETY: the system passes a pointer to its description of the signal. A positive code means
    // that the signal is a fault and has an address.
    let address = unsafe { ((*info).si_code > 0).then(|| (*info).si_addr() as usize) };
    if !address.is_some_and(replace) {
        pass_on(signal, info, context);
    }
}

/// Maps zeros over a mapping from an address on. Returns whether the address belongs to one of our
/// mappings and the zeros could be mapped.
#[expect(unsafe_code, reason = "mapping zeros over missing pages")]
fn replace(address: usize) -> bool {
    let mut slot = Some(&FIRST);
    while let Some(at) = slot {
        if let Some(end) = at.end_around(address) {
            at.is_hit.store(true, SeqCst);
            let start = address & !(PAGE.load(SeqCst) - 1);
            let flags = libc::MAP_PRIVATE | libc::MAP_ANON | libc::MAP_FIXED;
            // SAFETY: the pages belong to one of our mappings. It is being read, so it is not
            // dropped, and it is read only. No other mapping shares its last page. Readers see the
            // same bytes or zeros.
            let mapped = unsafe {
                libc::mmap(start as *mut libc::c_void, end - start, libc::PROT_READ, flags, -1, 0)
            };
            return mapped != libc::MAP_FAILED;
        }
        slot = at.next.get().map(|next| &**next);
    }
    false
}

/// Passes the signal on to the previous handler.
#[expect(unsafe_code, reason = "calling the previous signal handler")]
fn pass_on(signal: libc::c_int, info: *mut libc::siginfo_t, context: *mut libc::c_void) {
    type Plain = extern "C" fn(libc::c_int);
    type Informed = extern "C" fn(libc::c_int, *mut libc::siginfo_t, *mut libc::c_void);
    // SAFETY: the system returned this address as a handler, of the kind that its flags say. If
    // there was no handler, the default action is restored: a faulting instruction is retried and
    // ends the process. A signal that another process sent is raised again.
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
