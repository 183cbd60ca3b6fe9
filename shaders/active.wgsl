// The runs of each chunk of which a pass draws something: number of the run and a bit for each of its candidates. Two words a
// run; those before a chunk's first hold how many there are.

fn active_count(first_run: u32) -> u32 {
    return 2u * (first_run - 1u);
}

fn active_run(first_run: u32, number: u32) -> u32 {
    return 2u * (first_run + number);
}
