//! JPEG-LS, lossless and near-lossless (ITU-T T.87; Weinberger, Seroussi and Sapiro 2000).

/// The orders of run lengths.
const ORDERS: [u32; 32] = [
    0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 9, 10, 11, 12, 13,
    14, 15,
];

/// Contexts of regular samples; two of interrupted runs follow.
const REGULAR: usize = 365;

/// A picture: its channels one after the other.
pub struct Picture {
    /// Bits per number.
    pub bits: u8,
    pub numbers: Vec<u16>,
}

/// What a stream says before its scans.
#[derive(Default)]
struct Frame {
    columns: usize,
    rows: usize,
    channels: usize,
    bits: u8,
    /// The highest number, three thresholds and the period of resets; 0 for the usual.
    preset: [i32; 5],
}

/// Returns the picture of a stream, which must have this size. `is_over` says whether to give up;
/// it is asked once a line.
///
/// # Errors
/// A message for a damaged stream, another size, interleaving by samples, and for giving up.
pub fn decode(
    bytes: &[u8],
    size: [usize; 2],
    channels: usize,
    is_over: &dyn Fn() -> bool,
) -> Result<Picture, String> {
    let mut frame = Frame::default();
    let mut numbers = Vec::new();
    let mut at = 2;
    let short = |at: usize| {
        let pair = bytes.get(at..).and_then(|rest| rest.first_chunk());
        pair.map(|&pair| usize::from(u16::from_be_bytes(pair))).ok_or("it is cut off".to_owned())
    };
    loop {
        let (mark, length) = (short(at)?, short(at + 2)?);
        let body = bytes.get(at + 4..at + 2 + length).ok_or("it is cut off")?;
        match mark {
            0xfff7 => {
                let &[bits, a, b, c, d, count, ..] = body else {
                    return Err("it is cut off".into());
                };
                let [rows, columns] = [[a, b], [c, d]].map(|n| usize::from(u16::from_be_bytes(n)));
                let channels_found = usize::from(count);
                if [columns, rows] != size || channels_found != channels {
                    return Err(format!(
                        "a picture of {columns} × {rows} × {channels_found}, not of {} × {} × \
                         {channels}",
                        size[0], size[1]
                    ));
                }
                if !(2..=16).contains(&bits) {
                    return Err(format!("{bits} bits per number"));
                }
                frame = Frame { columns, rows, channels, bits, preset: frame.preset };
            }
            0xfff8 if body.first() == Some(&1) && body.len() >= 11 => {
                let of = |i: usize| u16::from_be_bytes([body[1 + 2 * i], body[2 + 2 * i]]).into();
                frame.preset = std::array::from_fn(of);
            }
            0xffda => {
                if frame.channels == 0 {
                    return Err("a scan comes before the picture's size".into());
                }
                let rest = &bytes[at + 2 + length..];
                let used = scan(&frame, body, rest, &mut numbers, is_over)?;
                at += used;
            }
            0xffd9 => return Err("it ends before all channels".into()),
            0xffc0..=0xffff => {}
            _ => return Err(format!("a mark was expected at byte {at}")),
        }
        at += 2 + length;
        let Frame { columns, rows, channels, bits, .. } = frame;
        if channels > 0 && numbers.len() == columns * rows * channels {
            return Ok(Picture { bits, numbers });
        }
    }
}

/// Decodes a scan: one channel, or all line by line. Returns the bytes that it took.
fn scan(
    frame: &Frame,
    head: &[u8],
    bytes: &[u8],
    out: &mut Vec<u16>,
    is_over: &dyn Fn() -> bool,
) -> Result<usize, String> {
    let count = usize::from(*head.first().ok_or("it is cut off")?);
    let &[near, interleave, ..] = head.get(1 + 2 * count..).unwrap_or_default() else {
        return Err("it is cut off".into());
    };
    if count != 1 && (interleave != 1 || count != frame.channels) {
        return Err("channels interleaved by samples are not read".into());
    }
    let Frame { columns, rows, .. } = *frame;
    let mut coder = Coder::new(frame, near.into(), bytes);
    let start = out.len();
    out.resize(start + columns * rows * count, 0);
    // The line above and the current one, with one number before and after, of each channel.
    let mut lines = vec![[vec![0i32; columns + 2], vec![0i32; columns + 2]]; count];
    let mut orders = vec![0; count];
    for row in 0..rows {
        if is_over() {
            return Err("the time is over".into());
        }
        for channel in 0..count {
            let [above, line] = &mut lines[channel];
            std::mem::swap(above, line);
            above[columns + 1] = above[columns];
            line[0] = above[1];
            coder.order = orders[channel];
            coder.line(above, line)?;
            orders[channel] = coder.order;
            let place = start + (channel * rows + row) * columns;
            for (out, &number) in out[place..][..columns].iter_mut().zip(&line[1..]) {
                *out = number as u16;
            }
        }
    }
    Ok(coder.bits.used())
}

/// What is known of a context.
#[derive(Clone)]
struct Context {
    /// The sum of errors' sizes.
    size: i32,
    /// The sum of errors, for the correction; or the number of negative errors of runs.
    bias: i32,
    correction: i32,
    count: i32,
}

struct Coder<'a> {
    bits: Bits<'a>,
    near: i32,
    most: i32,
    thresholds: [i32; 3],
    reset: i32,
    range: i32,
    /// Bits of an error that is not coded by its length.
    plain: u32,
    limit: u32,
    contexts: Vec<Context>,
    /// The index of the order of run lengths.
    order: usize,
}

fn bits_of(values: i32) -> u32 {
    32 - ((values - 1).max(0) as u32).leading_zeros()
}

impl<'a> Coder<'a> {
    fn new(frame: &Frame, near: i32, bytes: &'a [u8]) -> Self {
        let [most, t1, t2, t3, reset] = frame.preset;
        let most = if most > 0 { most } else { (1 << frame.bits) - 1 };
        let near = near.min(most / 2);
        let usual = usual_thresholds(most, near);
        let or = |given: i32, usual: i32| if given > 0 { given } else { usual };
        let range = (most + 2 * near) / (2 * near + 1) + 1;
        let wide = bits_of(most + 1).max(2);
        let size = ((range + 32) / 64).max(2);
        let context = Context { size, bias: 0, correction: 0, count: 1 };
        Self {
            bits: Bits { bytes, at: 0, held: 0, count: 0, was_full: false },
            near,
            most,
            thresholds: [or(t1, usual[0]), or(t2, usual[1]), or(t3, usual[2])],
            reset: or(reset, 64),
            range,
            plain: bits_of(range),
            limit: 2 * (wide + wide.max(8)),
            contexts: vec![context; REGULAR + 2],
            order: 0,
        }
    }

    /// Decodes a line. Both lines have one number before the first.
    fn line(&mut self, above: &[i32], line: &mut [i32]) -> Result<(), String> {
        let columns = line.len() - 2;
        let mut x = 1;
        while x <= columns {
            let (left, up, corner, next) = (line[x - 1], above[x], above[x - 1], above[x + 1]);
            let steps = [next - up, up - corner, corner - left];
            if steps.iter().all(|step| step.abs() <= self.near) {
                x = self.run(above, line, x, columns)?;
            } else {
                line[x] = self.regular(left, up, corner, steps)?;
                x += 1;
            }
        }
        Ok(())
    }

    fn quantised(&self, step: i32) -> i32 {
        let [t1, t2, t3] = self.thresholds;
        let size = step.abs();
        let level = match size {
            _ if size <= self.near => 0,
            _ if size < t1 => 1,
            _ if size < t2 => 2,
            _ if size < t3 => 3,
            _ => 4,
        };
        level * step.signum()
    }

    /// Decodes a sample from its context.
    fn regular(&mut self, a: i32, b: i32, c: i32, steps: [i32; 3]) -> Result<i32, String> {
        let [q1, q2, q3] = steps.map(|step| self.quantised(step));
        let index = 81 * q1 + 9 * q2 + q3;
        let (sign, index) = if index < 0 { (-1, -index) } else { (1, index) };
        let context = self.contexts[index as usize].clone();
        let guess = if c >= a.max(b) {
            a.min(b)
        } else if c <= a.min(b) {
            a.max(b)
        } else {
            a + b - c
        };
        let guess = (guess + sign * context.correction).clamp(0, self.most);
        let k = length(context.count, context.size);
        let coded = self.golomb(k, self.limit)?;
        let is_turned = self.near == 0 && k == 0 && 2 * context.bias <= -context.count;
        let error = match (is_turned, coded & 1) {
            (true, 1) => (coded - 1) / 2,
            (true, _) => -(coded / 2) - 1,
            (false, 0) => coded / 2,
            (false, _) => -((coded + 1) / 2),
        };
        self.learn(index as usize, error);
        Ok(self.sum(guess, sign * error))
    }

    fn learn(&mut self, index: usize, error: i32) {
        let (step, reset) = (2 * self.near + 1, self.reset);
        let context = &mut self.contexts[index];
        context.bias = context.bias.saturating_add(error.saturating_mul(step));
        context.size = context.size.saturating_add(error.saturating_abs());
        if context.count >= reset {
            context.size >>= 1;
            context.bias >>= 1;
            context.count >>= 1;
        }
        context.count += 1;
        if context.bias <= -context.count {
            context.bias = (context.bias + context.count).max(1 - context.count);
            context.correction = (context.correction - 1).max(-128);
        } else if context.bias > 0 {
            context.bias = (context.bias - context.count).min(0);
            context.correction = (context.correction + 1).min(127);
        }
    }

    /// Returns a guess and its error, modulo the range.
    fn sum(&self, guess: i32, error: i32) -> i32 {
        let step = 2 * self.near + 1;
        let mut value = guess.saturating_add(error.saturating_mul(step));
        if value < -self.near {
            value = value.saturating_add(self.range * step);
        } else if value > self.most + self.near {
            value -= self.range * step;
        }
        value.clamp(0, self.most)
    }

    /// Decodes a run of equal samples and the one that interrupts it. Returns the next place.
    fn run(
        &mut self,
        above: &[i32],
        line: &mut [i32],
        mut x: usize,
        columns: usize,
    ) -> Result<usize, String> {
        let value = line[x - 1];
        while self.bits.read(1)? == 1 {
            let whole = 1 << ORDERS[self.order];
            let count = whole.min(columns + 1 - x);
            line[x..x + count].fill(value);
            x += count;
            if count == whole && self.order < 31 {
                self.order += 1;
            }
            if x > columns {
                return Ok(x);
            }
        }
        let count = self.bits.read(ORDERS[self.order])? as usize;
        if count > columns - x {
            return Err("a run is longer than its line".into());
        }
        line[x..x + count].fill(value);
        x += count;
        let up = above[x];
        let is_flat = (value - up).abs() <= self.near;
        let kind = i32::from(is_flat);
        let (guess, sign) =
            if is_flat { (value, 1) } else { (up, if value > up { -1 } else { 1 }) };
        let index = REGULAR + usize::from(is_flat);
        let Context { size, bias: negative, count, .. } = self.contexts[index].clone();
        let k = length(count, if is_flat { size.saturating_add(count >> 1) } else { size });
        let coded = self.golomb(k, self.limit - ORDERS[self.order] - 1)?;
        let both = coded + kind;
        let odd = both & 1;
        let size_of_error = (both + odd) / 2;
        let is_negative = (k != 0 || 2 * negative >= count) == (odd == 1);
        let error = if is_negative { -size_of_error } else { size_of_error };
        let context = &mut self.contexts[index];
        context.bias += i32::from(error < 0);
        context.size = context.size.saturating_add((coded + 1 - kind) >> 1);
        if context.count >= self.reset {
            context.size >>= 1;
            context.bias >>= 1;
            context.count >>= 1;
        }
        context.count += 1;
        line[x] = self.sum(guess, sign * error);
        self.order = self.order.saturating_sub(1);
        Ok(x + 1)
    }

    /// Reads a number coded by its length, or plainly if it is long.
    fn golomb(&mut self, k: u32, limit: u32) -> Result<i32, String> {
        let longest = limit.saturating_sub(self.plain + 1);
        let mut zeros = 0;
        while self.bits.read(1)? == 0 {
            zeros += 1;
            if zeros > longest {
                return Err("a number is too long".into());
            }
        }
        if zeros < longest {
            return Ok((zeros << k | self.bits.read(k)?) as i32);
        }
        Ok(self.bits.read(self.plain)? as i32 + 1)
    }
}

/// Returns how many bits of an error follow its length.
fn length(count: i32, size: i32) -> u32 {
    (0..16).find(|&k| i64::from(count) << k >= i64::from(size)).unwrap_or(16)
}

fn usual_thresholds(most: i32, near: i32) -> [i32; 3] {
    let within = |value: i32, least: i32| if value > most || value < least { least } else { value };
    let [a, b, c] = if most >= 128 {
        let factor = (most.min(4095) + 128) / 256;
        [factor + 2 + 3 * near, 4 * factor + 3 + 5 * near, 17 * factor + 4 + 7 * near]
    } else {
        let factor = 256 / (most + 1);
        [
            (3 / factor + 3 * near).max(2),
            (7 / factor + 5 * near).max(3),
            (21 / factor + 7 * near).max(4),
        ]
    };
    let first = within(a, near + 1);
    let second = within(b, first);
    [first, second, within(c, second)]
}

/// Bits of a scan, the highest first. A byte after 255 has seven.
struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
    held: u64,
    count: u32,
    was_full: bool,
}

impl Bits<'_> {
    /// Reads at most 32 bits.
    fn read(&mut self, bits: u32) -> Result<u32, String> {
        while self.count < bits {
            let byte = self.bytes.get(self.at).copied().ok_or("it ends too early")?;
            if self.was_full && byte >= 0x80 {
                return Err("it ends too early".into());
            }
            let width = if self.was_full { 7 } else { 8 };
            self.held = self.held << width | u64::from(byte);
            self.count += width;
            self.was_full = byte == 0xff;
            self.at += 1;
        }
        self.count -= bits;
        let mask = (1u64 << bits) - 1;
        Ok((self.held >> self.count & mask) as u32)
    }

    /// Returns the bytes up to the mark that ends the scan.
    fn used(&self) -> usize {
        let from = self.at.saturating_sub(1);
        let rest = self.bytes.get(from..).unwrap_or_default();
        let mark = rest.windows(2).position(|pair| pair[0] == 0xff && pair[1] >= 0x80);
        mark.map_or(self.bytes.len(), |at| from + at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn it_is_given_up_between_lines() {
        const ROWS: u8 = 50;
        let mut stream = vec![0xff, 0xd8, 0xff, 0xf7, 0, 11, 8, 0, ROWS, 0, 64, 1, 1, 0x11, 0];
        stream.extend([0xff, 0xda, 0, 8, 1, 1, 0, 0, 0, 0]);
        // Runs to the end of each line.
        stream.extend([0xff, 0x7f].repeat(1000));
        stream.extend([0xff, 0xd9]);
        let decode = |most: usize| {
            let asked = Cell::new(0);
            let is_over = || asked.replace(asked.get() + 1) >= most;
            let decoded = decode(&stream, [64, ROWS.into()], 1, &is_over);
            (decoded.map(|picture| picture.numbers), asked.get())
        };
        assert_eq!(decode(9999), (Ok(vec![0; 64 * usize::from(ROWS)]), ROWS.into()));
        assert_eq!(decode(10), (Err("the time is over".into()), 11));
    }
}
