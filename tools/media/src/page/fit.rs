//! A page that may not have more than so many bytes: how much of the inputs it shows is found by
//! trying.

use super::Page;
use crate::Failure;

/// How often it is tried.
const TRIES: usize = 5;

/// A page is good if it has this share of the bytes that it may have.
const GOOD: f64 = 0.85;

/// The share of the bytes for inputs that is aimed at.
const AIM: f64 = 0.95;

/// The least share of the inputs that is shown.
const LEAST: f64 = 1e-3;

/// Returns the page with the largest share of the inputs that has no more bytes than `limit`.
/// `make` makes a page that shows a share, and says how many bytes it has in all and without the
/// files of its inputs. It is first tried with `share`.
pub fn fitted(
    limit: u64,
    mut share: f64,
    mut make: impl FnMut(f64) -> Result<(Page, [u64; 2]), Failure>,
) -> Result<Page, Failure> {
    let megabytes = |bytes: u64| bytes as f64 / 1e6;
    // The best page, and the smallest.
    let (mut best, mut least) = (None, u64::MAX);
    let (mut fits, mut exceeds) = (0.0, f64::INFINITY);
    for number in 0..TRIES {
        let (page, [all, fixed]) = make(share)?;
        if fixed >= limit {
            return Err(Failure::Usage(format!(
                "--limit: the viewer alone has {:.2} MB; a page needs more than that",
                megabytes(fixed)
            )));
        }
        least = least.min(all);
        if all <= limit {
            fits = share;
            best = Some(page);
            let is_good = all as f64 >= GOOD * limit as f64;
            if number == 0 || is_good {
                break;
            }
        } else {
            exceeds = share;
        }
        // Bytes grow about as the share does.
        let room = (limit - fixed) as f64 / (all - fixed).max(1) as f64;
        let mut next = share * room * AIM;
        if !(fits < next && next < exceeds) {
            next = if exceeds.is_finite() { (fits * exceeds).sqrt() } else { fits };
        }
        // Nothing below the least share fits either.
        let next = next.clamp(LEAST, 1.0);
        if next == share || (fits > 0.0 && exceeds / fits < 1.02) {
            break;
        }
        share = next;
    }
    best.ok_or_else(|| {
        Failure::Usage(format!(
            "--limit: the page has {:.2} MB, with little of the inputs that can be thinned; raise \
             the limit, or publish fewer inputs (hierarchies of surfaces, cells, lines and bricks \
             stay whole)",
            megabytes(least)
        ))
    })
}
