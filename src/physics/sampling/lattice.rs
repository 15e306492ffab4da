//! Low-discrepancy sets of any number of points: a lattice of the golden ratio in the unit square, and radical inverses in 0..1.

/// Fractional part of the golden ratio.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Returns point `number` of `count` (at least 1), both coordinates in 0..1, of the lattice shifted by `shift` as by Cranley and Patterson
/// (1976); for a random shift every point is uniform. `number` may be any number from 0 below `count`, `shift` in 0..1.
#[inline]
pub fn point(number: f64, count: f64, [u, v]: [f64; 2]) -> [f64; 2] {
    [(number + u) / count, (number * GOLDEN + v).fract()]
}

/// Mirrors the binary digits of a number at the point (radical inverse, van der Corput 1935): consecutive numbers are uniform in 0..1.
pub fn radical_inverse(number: u64) -> f64 {
    (number.reverse_bits() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_follow_each_other_are_even() {
        assert_eq!([0, 1, 2, 3, 4].map(radical_inverse), [0.0, 0.5, 0.25, 0.75, 0.125]);
        let mut seen = [0; 16];
        (160..176).for_each(|number| seen[(radical_inverse(number) * 16.0) as usize] += 1);
        assert_eq!(seen, [1; 16]);
    }

    /// With 144 points, a Fibonacci number, each of 12 x 12 squares has about one.
    #[test]
    fn points_are_even() {
        let mut seen = [0; 144];
        for number in 0..144 {
            let [x, y] = point(f64::from(number), 144.0, [0.3, 0.9]);
            seen[(x * 12.0) as usize * 12 + (y * 12.0) as usize] += 1;
        }
        assert!(seen.iter().all(|count| *count <= 2), "{seen:?}");
        assert!(seen.iter().filter(|count| **count == 0).count() < 30, "{seen:?}");
    }
}
