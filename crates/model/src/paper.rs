//! Tables 1 to 4 as printed in the paper (Cooper, Raquet, Patton 2018), in millimeters and degrees.

/// Table 1: distance in meters, height and width of the spot of three neighboring beams.
pub const TABLE_1: [(f64, f64, f64); 5] = [
    (0.5, 3.2, 15.9),
    (1.0, 4.0, 33.3),
    (2.0, 4.8, 55.6),
    (3.0, 5.6, 98.4),
    (4.0, 6.3, 136.5),
];

/// Table 2: distance in meters, mean error and standard deviation of each of three trials.
pub const TABLE_2: [(f64, [f64; 3], [f64; 3]); 3] = [
    (0.5, [-1.7, -3.2, -3.6], [4.1, 4.1, 4.2]),
    (2.0, [7.0, 5.8, 5.4], [3.8, 3.9, 3.9]),
    (4.0, [0.8, -0.4, -0.7], [4.7, 4.6, 4.6]),
];

/// Table 3: incidence as calculated, and mean error of each of three trials.
pub const TABLE_3: [(f64, [f64; 3]); 3] = [
    (0.9, [9.9, 8.8, 9.0]),
    (18.5, [27.1, 27.4, 27.7]),
    (-44.7, [35.4, 35.7, 33.0]),
];

/// A_a and B_a of the least-squares line through Table 3's means over cos θ_N, the paper's Eq. (4).
pub const EQUATION_4: [f64; 2] = [-70.3, 86.1];

/// Distances of Table 4, in meters.
pub const TABLE_4_RANGE_M: [f64; 4] = [0.493, 1.011, 1.600, 2.007];

/// Table 4: standard deviations at those distances, by color.
pub const TABLE_4: [(&str, [f64; 4]); 4] = [
    ("pure_white", [4.39, 4.64, 3.52, 3.71]),
    ("antique_white", [3.96, 4.69, 3.43, 3.55]),
    ("pencil_grey", [3.85, 4.71, 3.96, 4.18]),
    ("jet_black", [5.37, 6.06, 5.29, 5.00]),
];

/// Maximum difference from a distance of the paper for a comparison with it, as a fraction of that distance.
const SAME_DISTANCE: f64 = 0.04;

/// Maximum difference from an incidence of the paper for a comparison with it, in degrees.
const SAME_INCIDENCE_DEG: f64 = 1.5;

/// The row of a table whose distance is close enough to the given one.
pub fn at_distance<T: Copy>(rows: &[T], distance: impl Fn(&T) -> f64, wanted: f64) -> Option<T> {
    rows.iter()
        .find(|row| (distance(row) / wanted - 1.0).abs() < SAME_DISTANCE)
        .copied()
}

/// The row of Table 3 whose signed incidence is close enough to the given one.
pub fn at_incidence(wanted: f64) -> Option<(f64, [f64; 3])> {
    TABLE_3
        .into_iter()
        .find(|(at, _)| (at - wanted).abs() < SAME_INCIDENCE_DEG)
}

/// The paper's standard deviation for a color at a distance.
pub fn noise(color: &str, distance: f64) -> Option<f64> {
    let (_, sds) = TABLE_4.into_iter().find(|(name, _)| *name == color)?;
    let places: Vec<usize> = (0..TABLE_4_RANGE_M.len()).collect();
    at_distance(&places, |i| TABLE_4_RANGE_M[*i], distance).map(|i| sds[i])
}
