//! What counts as converged: the standard starts of Moré, Garbow, Hillstrom (1981) end at a stationary point; starts ten
//! or a hundred times as far may end where steps become short without one, and must not be called converged.

use super::classics::{
    Bard, BrownBadlyScaled, BrownDennis, FreudensteinRoth, HelicalValley, Jennrich, KowalikOsborne, Meyer,
    PowellSingular, Rosenbrock, far, solve,
};
use super::duals::Formula;
use catoptric_calib::lsq::{Solution, Termination};
use num_dual::DualNumCopy;

struct BoxThreeDimensional;
struct Chebyquad;
struct Watson;
struct BrownAlmostLinear;

impl Formula for BoxThreeDimensional {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        (1..=10)
            .map(|i| {
                let t = 0.1 * f64::from(i);
                let known = libm::exp(-t) - libm::exp(-10.0 * t);
                (x[0] * -t).exp() - (x[1] * -t).exp() - x[2] * known
            })
            .collect()
    }
}

/// Shifted Chebyshev polynomials Tᵢ(2x − 1): their means over the points against their integrals.
impl Formula for Chebyquad {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        let n = x.len();
        let mut sums = vec![x[0] * 0.0; n];
        for value in x {
            let y = *value * 2.0 - 1.0;
            let (mut before, mut now) = (*value * 0.0 + 1.0, y);
            for sum in &mut sums {
                *sum += now;
                (before, now) = (now, y * now * 2.0 - before);
            }
        }
        let integral = |i: usize| {
            if i.is_multiple_of(2) {
                -1.0 / (i * i - 1) as f64
            } else {
                0.0
            }
        };
        sums.iter()
            .enumerate()
            .map(|(i, sum)| *sum * (1.0 / n as f64) - integral(i + 1))
            .collect()
    }
}

impl Formula for Watson {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        let mut f: Vec<D> = (1..=29)
            .map(|i| {
                let t = f64::from(i) / 29.0;
                let (mut slope, mut value) = (x[0] * 0.0, x[0] * 0.0);
                let mut power = 1.0;
                for (j, c) in x.iter().enumerate() {
                    value += *c * power;
                    if let Some(next) = x.get(j + 1) {
                        slope += *next * (power * (j + 1) as f64);
                    }
                    power *= t;
                }
                slope - value * value - 1.0
            })
            .collect();
        f.push(x[0]);
        f.push(x[1] - x[0] * x[0] - 1.0);
        f
    }
}

impl Formula for BrownAlmostLinear {
    fn residuals<D: DualNumCopy<Primitive = f64>>(&self, x: &[D]) -> Vec<D> {
        let n = x.len();
        let sum = x.iter().fold(x[0] * 0.0, |s, v| s + *v);
        let product = x.iter().fold(x[0] * 0.0 + 1.0, |s, v| s * *v);
        let mut f: Vec<D> = x[..n - 1].iter().map(|v| *v + sum - (n + 1) as f64).collect();
        f.push(product - 1.0);
        f
    }
}

/// Starts of Chebyquad: i/(n + 1).
fn spread(n: u32) -> Vec<f64> {
    (1..=n).map(|i| f64::from(i) / f64::from(n + 1)).collect()
}

#[test]
fn the_standard_starts_end_at_a_stationary_point() {
    let mut starts = 0;
    macro_rules! from {
        ($formula:expr, $starts:expr) => {
            for start in $starts {
                let found = solve($formula, &start);
                let name = stringify!($formula);
                assert!(found.stop.converged(), "{name} from {start:?}: {found:?}");
                starts += 1;
            }
        };
    }
    from!(Rosenbrock, far(&[-1.2, 1.0]));
    from!(HelicalValley, far(&[-1.0, 0.0, 0.0]));
    from!(PowellSingular, far(&[3.0, -1.0, 0.0, 1.0]));
    from!(FreudensteinRoth, far(&[0.5, -2.0]));
    // From afar, two parameters run to infinity, where Σf² is 17.4: a minimum in the limit.
    from!(Bard, far(&[1.0, 1.0, 1.0]));
    from!(KowalikOsborne, far(&[0.25, 0.39, 0.415, 0.39]));
    from!(Meyer, [vec![0.02, 4000.0, 250.0]]);
    from!(Watson, [2, 6, 9, 12].map(|n| vec![0.0; n]));
    from!(Watson, [6, 9, 12].map(|n| vec![10.0; n]));
    from!(
        BoxThreeDimensional,
        [vec![0.0, 10.0, 20.0], vec![0.0, 100.0, 200.0]]
    );
    from!(Jennrich, [vec![0.3, 0.4]]);
    from!(BrownDennis, far(&[25.0, 5.0, -5.0, -1.0]));
    from!(Chebyquad, [1, 5, 6, 7, 8, 9, 10].map(spread));
    from!(BrownAlmostLinear, [10, 30, 40].map(|n| vec![0.5; n]));
    from!(BrownBadlyScaled, [vec![1.0, 1.0]]);
    assert_eq!(starts, 43);
}

#[test]
fn where_steps_become_short_on_a_slope_nothing_has_converged() {
    let stalled = |name: &str, found: Solution| {
        assert_eq!(found.stop, Termination::Stalled, "{name}: {found:?}");
        assert!(
            !found.stop.converged() && found.gradient_cosine > 1e-4,
            "{name}: {found:?}"
        );
    };
    stalled("Box3D × 100", solve(BoxThreeDimensional, &[0.0, 1000.0, 2000.0]));
    stalled("Jennrich × 10", solve(Jennrich, &[3.0, 4.0]));
    let afar: Vec<f64> = spread(10).iter().map(|x| 10.0 * x).collect();
    stalled("Chebyquad-10 × 10", solve(Chebyquad, &afar));
}
