//! A fixed generator of normal deviates, the same on every machine: SplitMix64 and the Box–Muller transform.

/// The generator's state.
pub(crate) struct Sample(u64);

impl Sample {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Between 0 and 1, both excluded.
    pub(crate) fn uniform(&mut self) -> f64 {
        ((self.bits() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Mean 0, standard deviation 1.
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(self.uniform())).sqrt();
        radius * libm::cos(std::f64::consts::TAU * self.uniform())
    }
}

#[test]
fn deviates_have_the_moments_of_a_normal_distribution() {
    let mut sample = Sample::new(1);
    let values: Vec<f64> = (0..100_000).map(|_| sample.normal()).collect();
    let moment = |power: i32| values.iter().map(|v| v.powi(power)).sum::<f64>() / values.len() as f64;
    // Four standard errors: √(1/n), √(2/n), √(96/n).
    assert!(moment(1).abs() < 0.0127 && (moment(2) - 1.0).abs() < 0.0179 && (moment(4) - 3.0).abs() < 0.124);
}
