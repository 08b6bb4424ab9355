//! A scanner that reports the median of neighboring readings, as recordings of UTM-30LX units look: equal neighbors, and
//! noise that is correlated over as many beams.

use super::sensor::Sensor;

impl Sensor {
    /// Replaces every range of a scan by the median of the ranges around it; of an even number, by the smaller middle one.
    ///
    /// Codes stay what they are, and do not count. Where a scan ends, there are fewer neighbors.
    pub fn smooth(&self, scan: &mut [f64]) {
        let reach = self.detection.median_of_beams as usize / 2;
        if reach == 0 {
            return;
        }
        let before = scan.to_vec();
        let mut around = Vec::with_capacity(2 * reach + 1);
        for (beam, range) in scan.iter_mut().enumerate().filter(|(_, range)| range.is_finite()) {
            around.clear();
            around.push(before[beam]);
            for side in [0, 1] {
                let next = |from: &usize| self.scan.neighbors(*from)[side];
                let beside = std::iter::successors(next(&beam), next).take(reach);
                around.extend(beside.map(|beam| before[beam]).filter(|range| range.is_finite()));
            }
            around.sort_unstable_by(f64::total_cmp);
            *range = around[(around.len() - 1) / 2];
        }
    }
}
