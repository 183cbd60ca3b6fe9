//! How alike two pictures are: peak signal-to-noise ratios in dB, infinite for equal pictures. The
//! peak is 1, and colours are premultiplied.

use splatkit::{compare::compare_pictures, picture::Picture};

/// The ratio of colour and opacity, of opaque pictures too.
pub fn psnr(a: &Picture, b: &Picture) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let pairs = a.color.iter().flatten().zip(b.color.iter().flatten());
    let squares: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
    -10.0 * (squares / (4 * a.color.len()) as f64).log10()
}

/// The ratio that the library measures: of colour alone where both pictures are opaque.
pub fn measured(a: &Picture, b: &Picture) -> f64 {
    compare_pictures(a, b).expect("pictures of one size").psnr.unwrap_or(f64::INFINITY)
}
