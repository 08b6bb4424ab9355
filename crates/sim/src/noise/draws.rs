//! The draws of one row, one by one.

use rand::SeedableRng;
use rand::rand_core::Rng;
use rand::rngs::ChaCha8Rng;

/// What a draw is for. The numbers are part of the file format: they never change; new ones are added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// Pose of the sensor in the rig.
    Mount = 1,
    /// Pose of a facet as built; row = facet.
    FacetPose = 2,
    /// Surface of a facet; row = facet.
    FacetSlope = 3,
    /// Errors of a person who places a board; row = pose.
    Placement = 4,
    /// Constant error of a marker; row = placement, column = subject and marker.
    MarkerConstant = 5,
    /// Jitter of a marker; row = motion-capture frame, column = subject and marker.
    MarkerJitter = 6,
    /// Drift of a pose; row = pose.
    Drift = 7,
    /// Noise and dropout of a reading; row = scan, column = beam.
    Reading = 8,
    /// Errors of the characterization in step 1.
    Characterization = 9,
    /// Whether echoes near the threshold are detected; row = scan, column = beam, one draw per echo.
    Detection = 10,
    /// Innovation of the correlated noise; row = scan, column = beam.
    Correlated = 11,
    /// Steps due to interference; row = scan, column = beam.
    Interference = 12,
    /// Errors of a person who reads the edges of a spot; row = pose.
    SpotReading = 13,
    /// Constant error of a beam in a pose; row = pose, column = beam.
    Element = 14,
    /// Board poses that are set up at random; row = group, column = pose and attempt.
    Design = 15,
    /// Distance to the bare structure, measured without the scanner; row = facet.
    BareDistance = 16,
    /// Thickness of a mirror as built; row = facet.
    MirrorThickness = 17,
    /// Innovation of the noise that all beams share; row = scan.
    Common = 18,
    /// Noise of the intensities; row = scan, column = beam.
    Intensity = 19,
}

/// The draws of one row.
pub struct Draws {
    rng: ChaCha8Rng,
}

/// 32-bit words of the stream that belong to one column: eight uniform draws or four normal ones.
pub(super) const WORDS_PER_COLUMN: usize = 16;

impl Draws {
    /// The draws for a purpose and row, at column 0.
    pub fn new(seed: u64, purpose: Purpose, row: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&(purpose as u64).to_le_bytes());
        key[16..24].copy_from_slice(&row.to_le_bytes());
        key[24..].copy_from_slice(b"catoptr1");
        Self {
            rng: ChaCha8Rng::from_seed(key),
        }
    }

    /// Moves to the first draw of a column.
    pub fn seek(&mut self, column: u64) {
        const WORDS: u128 = WORDS_PER_COLUMN as u128;
        let word = u128::from(column) * WORDS;
        match word.checked_sub(self.rng.get_word_pos()) {
            // The next column: its words have most likely been computed already, and a jump would compute them again.
            Some(ahead) if ahead <= WORDS => {
                for _ in 0..ahead {
                    self.rng.next_u32();
                }
            }
            _ => self.rng.set_word_pos(word),
        }
    }

    /// The next words of the stream, byte by byte.
    pub(super) fn fill(&mut self, bytes: &mut [u8]) {
        self.rng.fill_bytes(bytes);
    }

    /// The next draw, uniform on the open interval (0, 1).
    pub fn uniform(&mut self) -> f64 {
        standard_uniform(self.rng.next_u64())
    }

    /// The next draw, uniform within ±`limit`.
    pub fn within(&mut self, limit: f64) -> f64 {
        (2.0 * self.uniform() - 1.0) * limit
    }

    /// The next draw, standard normal.
    pub fn normal(&mut self) -> f64 {
        let (first, second) = (self.uniform(), self.uniform());
        box_muller(first, second)
    }

    /// Three standard normal draws.
    pub fn normal3(&mut self) -> nalgebra::Vector3<f64> {
        nalgebra::Vector3::from_fn(|_, _| self.normal())
    }
}

/// A number in the open interval (0, 1) from 64 random bits.
#[inline(always)]
pub(super) fn standard_uniform(bits: u64) -> f64 {
    ((bits >> 11) as f64 + 0.5) * (1.0 / (1_u64 << 53) as f64)
}

/// The Box–Muller transform of two numbers in (0, 1].
pub(super) fn box_muller(first: f64, second: f64) -> f64 {
    let radius = (-2.0 * libm::log(first)).sqrt();
    radius * libm::cos(std::f64::consts::TAU * second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_drawn_alone_is_the_column_drawn_in_turn() {
        let mut in_turn = Draws::new(7, Purpose::Reading, 3);
        let row: Vec<[f64; 2]> = (0..50)
            .map(|column| {
                in_turn.seek(column);
                [in_turn.normal(), in_turn.uniform()]
            })
            .collect();
        for column in [49, 0, 17, 16] {
            let mut alone = Draws::new(7, Purpose::Reading, 3);
            alone.seek(column);
            assert_eq!(
                [alone.normal(), alone.uniform()],
                row[usize::try_from(column).expect("small")]
            );
        }
    }

    #[test]
    fn rows_purposes_and_seeds_share_nothing() {
        let first = |seed, purpose, row| Draws::new(seed, purpose, row).uniform();
        let all = [
            first(1, Purpose::Reading, 0),
            first(2, Purpose::Reading, 0),
            first(1, Purpose::Drift, 0),
            first(1, Purpose::Reading, 1),
        ];
        for (i, a) in all.iter().enumerate() {
            assert!(all[i + 1..].iter().all(|b| a != b));
        }
    }

    #[test]
    fn normal_draws_have_the_moments_of_a_normal() {
        let n = 200_000;
        let (mut sum, mut squares, mut fourth, mut lagged, mut before) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let mut draws = Draws::new(1, Purpose::Reading, 0);
        for column in 0..n {
            draws.seek(column);
            let x = draws.normal();
            sum += x;
            squares += x * x;
            fourth += x * x * x * x;
            lagged += x * before;
            before = x;
        }
        // 4.4172 standard errors of each statistic: a false alarm by any of them once in 25 000 seeds.
        let (n, z) = (n as f64, 4.4172);
        assert!((sum / n).abs() < z / n.sqrt());
        assert!((squares / n - 1.0).abs() < z * (2.0 / n).sqrt());
        assert!((fourth / n - 3.0).abs() < z * (96.0 / n).sqrt());
        assert!((lagged / n).abs() < z / n.sqrt());
    }
}
