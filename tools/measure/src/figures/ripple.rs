//! How even the sum of a kernel's copies is, with one copy at each sample of a lattice.

use crate::report::{Cell, Table};
use glam::DVec3;
use splatkit::math::Kernel;

/// Positions along each edge of a cell at which the sum is computed.
const PLACES: i32 = 20;

pub fn table() -> splatkit::Result<Table> {
    let mut table = Table::new(
        "Ripple of the kernel sum.",
        "(largest − smallest) / mean over a cell, in percent. Every picture is divided by this \
         sum, so that the ripple does not show.",
        &["kernel", "Cartesian", "body-centred"],
    );
    for (name, kernel) in [
        ("Gaussian, σ 0.35, extent 2", Kernel::gaussian(0.35, 2.0)?),
        ("Gaussian, σ 0.5, extent 2", Kernel::gaussian(0.5, 2.0)?),
        ("Gaussian, σ 0.6, extent 2 (default)", Kernel::gaussian(0.6, 2.0)?),
        ("Gaussian, σ 0.7, extent 3", Kernel::gaussian(0.7, 3.0)?),
        ("Gaussian, σ 1, extent 3.5", Kernel::gaussian(1.0, 3.5)?),
        ("B-spline, extent 2", Kernel::b_spline(2.0)?),
        ("Hann, extent 3", Kernel::hann(3.0)?),
    ] {
        let percent = |body_centred| Cell::Number(100.0 * ripple(&kernel, body_centred), 2);
        table.row(name, vec![percent(false), percent(true)]);
    }
    Ok(table)
}

fn ripple(kernel: &Kernel, body_centred: bool) -> f64 {
    // A body-centred cell is √2 as long if its spectrum repeats at the same distance.
    let edge = if body_centred { std::f64::consts::SQRT_2 } else { 1.0 };
    let reach = (kernel.extent / edge).ceil() as i32 + 1;
    let corners = |shift: f64| {
        let steps = -reach..=reach;
        let at = move |i: i32| edge * (f64::from(i) + shift);
        let cells = steps.clone().flat_map(move |x| steps.clone().map(move |y| (x, y)));
        cells.flat_map(move |(x, y)| (-reach..=reach).map(move |z| DVec3::new(at(x), at(y), at(z))))
    };
    let mut samples: Vec<DVec3> = corners(0.0).collect();
    if body_centred {
        samples.extend(corners(0.5));
    }
    let place = |i: i32| edge * f64::from(i) / f64::from(PLACES);
    let (mut low, mut high, mut sum) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
    for at in 0..PLACES.pow(3) {
        // Exactly at a sample, others lie exactly at the extent, and rounding would decide about
        // them. Beside it, half of them are inside.
        let beside = DVec3::new(1e-7, 2e-7, 3e-7);
        let p = beside
            + DVec3::new(
                place(at % PLACES),
                place(at / PLACES % PLACES),
                place(at / PLACES.pow(2)),
            );
        let value: f64 = samples.iter().map(|sample| kernel.value((p - sample).length())).sum();
        (low, high, sum) = (low.min(value), high.max(value), sum + value);
    }
    (high - low) / (sum / f64::from(PLACES.pow(3)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_ripples_little() {
        let kernel = Kernel::default();
        let [cartesian, body_centred] = [false, true].map(|lattice| ripple(&kernel, lattice));
        assert!((0.01..0.016).contains(&cartesian), "{cartesian}");
        assert!((0.01..0.018).contains(&body_centred), "{body_centred}");
        assert!(ripple(&Kernel::gaussian(0.35, 2.0).unwrap(), false) > 0.3);
    }
}
