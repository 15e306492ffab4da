//! Distances between two RGB images: the measures of the thesis' section 6.1.

/// Computes the Euclidean distance of the three channels of each pixel; channels are interleaved.
pub fn euclidean(image: &[f64], reference: &[f64]) -> Vec<f64> {
    let pixels = image.chunks_exact(3).zip(reference.chunks_exact(3));
    pixels.map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()).collect()
}

/// Computes the difference of one channel (0..3) of each pixel: image minus reference.
pub fn difference(image: &[f64], reference: &[f64], channel: usize) -> Vec<f64> {
    let of = |image: &[f64]| image.iter().skip(channel).step_by(3).copied().collect::<Vec<_>>();
    of(image).into_iter().zip(of(reference)).map(|(a, b)| a - b).collect()
}

/// Computes the length of each pixel's three channels as a vector.
pub fn lengths(image: &[f64]) -> Vec<f64> {
    euclidean(image, &vec![0.0; image.len()])
}

/// Lowest, highest and mean of a set of values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Least value; infinity for an empty set.
    pub lowest: f64,
    /// Greatest value; minus infinity for an empty set.
    pub highest: f64,
    /// Mean value; NaN for an empty set.
    pub mean: f64,
}

impl Spread {
    /// Computes lowest, highest and mean of the values whose index `counts` accepts.
    pub fn of(values: &[f64], counts: impl Fn(usize) -> bool) -> Self {
        let (mut lowest, mut highest, mut sum, mut number) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0);
        for (_, value) in values.iter().enumerate().filter(|(index, _)| counts(*index)) {
            lowest = value.min(lowest);
            highest = value.max(highest);
            sum += value;
            number += 1.0;
        }
        Self { lowest, highest, mean: sum / number }
    }
}

/// Fits the slope of ln y over ln x by least squares; NaN with fewer than two points.
pub fn logarithmic_slope(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (libm::log(*x), libm::log(*y))).collect();
    let number = logs.len() as f64;
    let (mean_x, mean_y) =
        (logs.iter().map(|p| p.0).sum::<f64>() / number, logs.iter().map(|p| p.1).sum::<f64>() / number);
    let (mut products, mut squares) = (0.0, 0.0);
    for (x, y) in logs {
        products += (x - mean_x) * (y - mean_y);
        squares += (x - mean_x) * (x - mean_x);
    }
    products / squares
}
