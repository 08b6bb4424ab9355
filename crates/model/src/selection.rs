//! The exact median of more numbers than fit in memory, from several passes over them.

/// Number of bits that one pass determines.
const BITS: u32 = 16;

/// The upper median of a sequence of numbers that is passed repeatedly, the same numbers in any order.
///
/// Every pass counts, in a histogram over the next bits, the numbers that agree with the median in the bits known so
/// far.
///
/// ```
/// use catoptric_model::selection::Median;
///
/// let numbers = [4.0, 1.0, 3.0, 2.0];
/// let mut median = Median::default();
/// while !median.is_found() {
///     numbers.iter().for_each(|x| median.add(*x));
///     median.end_pass();
/// }
/// assert_eq!(median.value(), Some(3.0));
/// ```
#[derive(Debug, Clone)]
pub struct Median {
    /// The known bits, and their number.
    prefix: u64,
    known: u32,
    /// The median's rank among the numbers that begin with them, from the second pass on.
    rank: Option<usize>,
    counts: Vec<usize>,
    is_empty: bool,
}

impl Default for Median {
    fn default() -> Self {
        Self {
            prefix: 0,
            known: 0,
            rank: None,
            counts: vec![0; 1 << BITS],
            is_empty: false,
        }
    }
}

impl Median {
    /// Adds a number in the current pass.
    pub fn add(&mut self, number: f64) {
        let key = key(number);
        // Shifting by the full width is not allowed.
        if self.known == 0 || key >> (u64::BITS - self.known) == self.prefix {
            let next = (key >> (u64::BITS - self.known - BITS)) & ((1 << BITS) - 1);
            // The mask leaves sixteen bits.
            #[allow(clippy::cast_possible_truncation)]
            let bin = next as usize;
            self.counts[bin] += 1;
        }
    }

    /// Ends a pass.
    pub fn end_pass(&mut self) {
        let all: usize = self.counts.iter().sum();
        let mut rank = self.rank.unwrap_or(all / 2);
        let mut bins = (0_u64..).zip(&mut self.counts);
        let Some((bin, _)) = bins.find(|(_, count)| {
            let is_here = rank < **count;
            rank -= if is_here { 0 } else { **count };
            is_here
        }) else {
            self.is_empty = true;
            return;
        };
        self.prefix = self.prefix << BITS | bin;
        self.known += BITS;
        self.rank = Some(rank);
        self.counts.fill(0);
    }

    /// Whether no further pass is needed.
    pub fn is_found(&self) -> bool {
        self.is_empty || self.known == u64::BITS
    }

    /// The median; `None` without numbers, or before it is found.
    pub fn value(&self) -> Option<f64> {
        (self.known == u64::BITS).then(|| number(self.prefix))
    }
}

/// Bits in the order of [`f64::total_cmp`].
fn key(number: f64) -> u64 {
    let bits = number.to_bits();
    if number.is_sign_negative() {
        !bits
    } else {
        bits | SIGN
    }
}

fn number(key: u64) -> f64 {
    f64::from_bits(if key & SIGN == 0 { !key } else { key ^ SIGN })
}

const SIGN: u64 = 1 << (u64::BITS - 1);

#[cfg(test)]
mod tests {
    use super::*;

    fn median(numbers: &[f64]) -> Option<f64> {
        let mut median = Median::default();
        while !median.is_found() {
            numbers.iter().for_each(|x| median.add(*x));
            median.end_pass();
        }
        median.value()
    }

    #[test]
    fn the_median_equals_the_one_found_by_sorting() {
        let mut state = 1_u64;
        for count in [1, 2, 3, 10, 101, 1000] {
            let mut numbers: Vec<f64> = (0..count)
                .map(|_| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    (state >> 40) as f64 * 1e-3 - 8000.0
                })
                .collect();
            numbers[0] = -0.0;
            let found = median(&numbers).expect("there are numbers");
            let (_, middle, _) = numbers.select_nth_unstable_by(count / 2, f64::total_cmp);
            assert_eq!(found.to_bits(), middle.to_bits(), "of {count}");
        }
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[2.5; 7]), Some(2.5));
    }
}
