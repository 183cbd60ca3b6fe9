// The active batches of each chunk: those that a pass draws candidates of. Two words per batch: its
// number, and a bit for each of its candidates. The words before a chunk's first batch contain the
// number of active batches.

fn active_count(first_run: u32) -> u32 {
    return 2u * (first_run - 1u);
}

fn active_run(first_run: u32, number: u32) -> u32 {
    return 2u * (first_run + number);
}
