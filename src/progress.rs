//! How far a long piece of work is.

/// Called after each finished part, with the number of parts done and their total. `None`: nobody
/// wants to know.
pub type Watch<'a> = Option<&'a (dyn Fn(u64, u64) + Sync)>;

/// Says how far the work is.
pub(crate) fn tell(watch: Watch<'_>, done: u64, total: u64) {
    if let Some(watch) = watch {
        watch(done, total);
    }
}
