//! How much light a chain of mirrors returns, by Fresnel's equations and the polarization of the laser.
//!
//! A mirror reflects light polarized across its plane of incidence by r_s and light within it by r_p. Along a chain of
//! mirrors whose planes are turned against each other, the amplitudes are those of the product J of one matrix per mirror,
//! J = r_s·s·sᵀ − r_p·p′·pᵀ with s = d × m, p = s × d, p′ = s × d′ for light from d to d′ = d − 2(d·m)m; r_p counts the
//! component along the mirror, as Macleod, *Thin-Film Optical Filters*, does, so that r_p = r_s at normal incidence. The
//! laser's light e arrives at the target with |J·e|² of its power; a target that scatters depolarizes, and ½‖J‖² of what it
//! returns arrives at the receiver.
//!
//! Films are layers of index N = n − ik and phase thickness δ = 2π·N·t·cos θ/λ (Abelès 1950): with the admittances
//! η = N·cos θ for s and N/cos θ for p, (B, C) = Π [[cos δ, i·sin δ/η], [i·η·sin δ, cos δ]]·(1, η_substrate) and
//! r = (η₀B − C)/(η₀B + C).

use crate::scene::{Coating, CoatingTable, Facet, Mirror, Stack};
use nalgebra::{Complex, Unit, Vector3};

/// How a mirror reflects.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Finish {
    /// This share, whatever the incidence and polarization.
    Plain(f64),
    /// By its coating, times a share that passes dust.
    Coated(Coating, f64),
}

/// The finishes of all mirrors, if they are not all one number.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Finishes {
    pub(crate) of_facets: Vec<Finish>,
    /// Wavelength, in nanometers.
    pub(crate) wavelength_nm: f64,
    /// Angle of the laser's polarization from the long axis of the beam's ellipse, in radians; `None` if it has none.
    pub(crate) polarization: Option<f64>,
}

/// r_s and r_p.
type Amplitudes = [Complex<f64>; 2];

impl Finish {
    /// That of a mirror of the room, or of a facet with its own.
    pub(crate) fn of(mirror: &Mirror, facet: Option<&Facet>) -> Self {
        let own = facet.and_then(|f| f.coating.clone().map(Some).or(f.reflectivity.map(|_| None)));
        match own.unwrap_or_else(|| mirror.coating.clone()) {
            Some(coating) => Self::Coated(coating, mirror.dust.map_or(1.0, |dust| dust.passed())),
            None => {
                let reflectivity = facet.and_then(|f| f.reflectivity).unwrap_or(mirror.reflectivity);
                let plain = Mirror {
                    reflectivity,
                    ..mirror.clone()
                };
                Self::Plain(plain.reflected())
            }
        }
    }

    /// r_s and r_p at a cosine of the incidence.
    pub(crate) fn amplitudes(&self, cos_incidence: f64, wavelength_nm: f64) -> Amplitudes {
        let real = |share: f64| Complex::from(-share.sqrt());
        match self {
            Self::Plain(share) => [real(*share); 2],
            Self::Coated(Coating::Stack(stack), passed) => {
                stack_amplitudes(stack, cos_incidence, wavelength_nm).map(|r| r * passed.sqrt())
            }
            Self::Coated(Coating::Table(table), passed) => {
                let [across, within] = tabulated(table, cos_incidence);
                [real(across * passed), real(within * passed)]
            }
        }
    }
}

impl Finishes {
    /// Share of the power, as an amplitude: its square is the share of the round trip, for a ray via some mirrors.
    pub(crate) fn passed(
        &self,
        start: &Unit<Vector3<f64>>,
        wide: &Vector3<f64>,
        hops: impl Iterator<Item = (Option<usize>, Unit<Vector3<f64>>)>,
    ) -> f64 {
        let [there, back] = self.there_and_back(start, wide, hops);
        (there * back).sqrt()
    }

    /// Shares of the power that arrive at the target and, of what it returns, at the receiver: for a ray that starts in a
    /// direction, whose beam's ellipse has its long axis along `wide`, and that goes on from each facet in a direction.
    pub(crate) fn there_and_back(
        &self,
        start: &Unit<Vector3<f64>>,
        wide: &Vector3<f64>,
        hops: impl Iterator<Item = (Option<usize>, Unit<Vector3<f64>>)>,
    ) -> [f64; 2] {
        let along = Unit::new_normalize(wide - start.into_inner() * start.dot(wide));
        let mut fields = [along.into_inner(), start.cross(&along)].map(|v| v.map(Complex::from));
        let mut incoming = *start;
        for (facet, outgoing) in hops {
            // Both at right angles to d − d′, along the normal.
            let normal = outgoing.into_inner() - incoming.into_inner();
            let cos_incidence = 0.5 * normal.norm();
            // What the front of a glass reflects is counted elsewhere.
            let finish = facet.map_or(&Finish::Plain(1.0), |facet| &self.of_facets[facet]);
            let [r_s, r_p] = finish.amplitudes(cos_incidence, self.wavelength_nm);
            let across = incoming.cross(&outgoing);
            // Head-on there is no plane of incidence, and any will do.
            let s = Unit::try_new(across, 1e-12).unwrap_or_else(|| {
                let aside = Vector3::z().cross(&incoming);
                Unit::try_new(aside, 1e-6).unwrap_or_else(Vector3::x_axis)
            });
            let (p, p_out) = (s.cross(&incoming), s.cross(&outgoing));
            for field in &mut fields {
                let part = |axis: &Vector3<f64>| {
                    field
                        .iter()
                        .zip(axis.iter())
                        .map(|(f, a)| f * a)
                        .sum::<Complex<f64>>()
                };
                let (of_s, of_p) = (part(&s) * r_s, -part(&p) * r_p);
                *field = s.map(|a| of_s * a) + p_out.map(|a| of_p * a);
            }
            incoming = outgoing;
        }
        let power = |field: &Vector3<Complex<f64>>| field.iter().map(Complex::norm_sqr).sum::<f64>();
        let mean = 0.5 * (power(&fields[0]) + power(&fields[1]));
        let there = self.polarization.map_or(mean, |angle| {
            let (sin, cos) = libm::sincos(angle);
            power(&(fields[0].map(|f| f * cos) + fields[1].map(|f| f * sin)))
        });
        [there, mean]
    }
}

/// Fresnel's equations for films on a substrate.
fn stack_amplitudes(stack: &Stack, cos_incidence: f64, wavelength_nm: f64) -> Amplitudes {
    let one = Complex::from(1.0);
    let sin_squared = 1.0 - cos_incidence * cos_incidence;
    // With N = n − ik, waves decay into the medium on the branch with a positive real part.
    let cos_within = |index: Complex<f64>| {
        let cos = (one - Complex::from(sin_squared) / (index * index)).sqrt();
        if cos.re < 0.0 { -cos } else { cos }
    };
    [false, true].map(|within_plane| {
        let admittance = |index: Complex<f64>, cos: Complex<f64>| {
            if within_plane { index / cos } else { index * cos }
        };
        let substrate = Complex::new(stack.n, -stack.k);
        let (mut b, mut c) = (one, admittance(substrate, cos_within(substrate)));
        for film in stack.film.iter().rev() {
            let index = Complex::new(film.n, -film.k);
            let cos = cos_within(index);
            let eta = admittance(index, cos);
            let phase = index * cos * (std::f64::consts::TAU * film.thickness_nm / wavelength_nm);
            let (sin, cos) = (i_times(phase.sin()), phase.cos());
            (b, c) = (cos * b + sin / eta * c, sin * eta * b + cos * c);
        }
        let air = admittance(one, Complex::from(cos_incidence.max(f64::MIN_POSITIVE)));
        (air * b - c) / (air * b + c)
    })
}

fn i_times(value: Complex<f64>) -> Complex<f64> {
    Complex::new(-value.im, value.re)
}

/// Shares across and within the plane of incidence from a table.
fn tabulated(table: &CoatingTable, cos_incidence: f64) -> [f64; 2] {
    let at = libm::acos(cos_incidence.clamp(-1.0, 1.0)).to_degrees();
    let angles = &table.incidence_deg;
    let above = angles
        .partition_point(|a| *a <= at)
        .clamp(1, (angles.len() - 1).max(1));
    [&table.across, &table.within].map(|shares| {
        if angles.len() < 2 {
            return shares[0];
        }
        let (low, high) = (angles[above - 1], angles[above]);
        let part = ((at - low) / (high - low)).clamp(0.0, 1.0);
        shares[above - 1] + (shares[above] - shares[above - 1]) * part
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Film;
    use catoptric_model::mirror;

    fn stack(n: f64, k: f64, film: Vec<Film>) -> Finish {
        Finish::Coated(Coating::Stack(Stack { n, k, film }), 1.0)
    }

    fn shares(finish: &Finish, incidence_deg: f64) -> [f64; 2] {
        let cos = libm::cos(incidence_deg.to_radians());
        finish.amplitudes(cos, 905.0).map(|r| r.norm_sqr())
    }

    /// Fresnel by the real closed forms: for metals those of Born and Wolf, *Principles of Optics*, section 14.2, with
    /// a² and b² from n² − k² − sin²θ.
    #[test]
    fn metals_reflect_as_in_their_closed_form() {
        // Aluminum, gold and silver near 905 nm (n and k as tabulated by Rakić 1995, Johnson and Christy 1972).
        for (n, k) in [(2.1, 8.4), (0.18, 5.9), (0.04, 6.4), (1.51, 0.0)] {
            let finish = stack(n, k, Vec::new());
            for incidence in [0.0_f64, 20.0, 45.0, 60.0, 69.0, 85.0] {
                let (sin, cos) = libm::sincos(incidence.to_radians());
                let (difference, product) = (n * n - k * k - sin * sin, 2.0 * n * k);
                let root = libm::hypot(difference, product);
                let (a_squared, b_squared) = (0.5 * (root + difference), 0.5 * (root - difference));
                let a = a_squared.sqrt();
                let s = (a_squared + b_squared - 2.0 * a * cos + cos * cos)
                    / (a_squared + b_squared + 2.0 * a * cos + cos * cos);
                let p = if sin == 0.0 {
                    s
                } else {
                    let tan = sin / cos;
                    let (even, odd) = (a_squared + b_squared + sin * sin * tan * tan, 2.0 * a * sin * tan);
                    s * (even - odd) / (even + odd)
                };
                let found = shares(&finish, incidence);
                assert!(
                    (found[0] - s).abs() < 1e-12,
                    "{n} {k} {incidence}: {found:?}, s = {s}"
                );
                assert!(
                    (found[1] - p).abs() < 1e-12,
                    "{n} {k} {incidence}: {found:?}, p = {p}"
                );
            }
            let normal = ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k);
            assert!((shares(&finish, 0.0)[0] - normal).abs() < 1e-14);
        }
        // Bare aluminum at the incidences of the prototype: s and p differ by 1.3 to 1.6 over the round trip.
        let aluminum = stack(2.1, 8.4, Vec::new());
        for (incidence, low, high) in [(56.0, 1.2, 1.4), (69.0, 1.4, 1.7)] {
            let [s, p] = shares(&aluminum, incidence);
            assert!(
                ((s / p).powi(2) - low) * ((s / p).powi(2) - high) < 0.0,
                "{incidence}: {s} {p}"
            );
        }
    }

    #[test]
    fn films_of_a_quarter_and_of_half_a_wave() {
        let film = |n: f64, waves: f64| Film {
            n,
            k: 0.0,
            thickness_nm: waves * 905.0 / n,
        };
        // Half a wave is as if it were not there; a quarter gives ((n_s − n²)/(n_s + n²))².
        let bare = shares(&stack(1.52, 0.0, vec![]), 0.0)[0];
        assert!((shares(&stack(1.52, 0.0, vec![film(2.0, 0.5)]), 0.0)[0] - bare).abs() < 1e-14);
        for n in [1.38_f64, 2.3] {
            let exact = ((1.52 - n * n) / (1.52 + n * n)).powi(2);
            assert!((shares(&stack(1.52, 0.0, vec![film(n, 0.25)]), 0.0)[0] - exact).abs() < 1e-14);
        }
        // A mirror of eight pairs: 1 − 4·n_s·(n_L/n_H)^16, nearly; and films without loss lose nothing.
        let pair = || [film(2.3, 0.25), film(1.38, 0.25)];
        let mirror: Vec<Film> = (0..8).flat_map(|_| pair()).chain([film(2.3, 0.25)]).collect();
        let admittance = (2.3_f64 / 1.38).powi(16) * 2.3 * 2.3 / 1.52;
        let exact = ((1.0 - admittance) / (1.0 + admittance)).powi(2);
        assert!((shares(&stack(1.52, 0.0, mirror), 0.0)[0] - exact).abs() < 1e-12);
        // Head-on there is no difference between s and p.
        let [s, p] = stack(2.1, 8.4, vec![film(1.45, 0.3)]).amplitudes(1.0, 905.0);
        assert!((s - p).norm() < 1e-14);
    }

    #[test]
    fn brewster_s_angle_and_tables() {
        let glass = stack(1.51, 0.0, Vec::new());
        assert!(shares(&glass, libm::atan(1.51).to_degrees())[1] < 1e-28);
        let table = Finish::Coated(
            Coating::Table(CoatingTable {
                incidence_deg: vec![0.0, 45.0, 60.0],
                across: vec![0.9, 0.95, 0.97],
                within: vec![0.9, 0.85, 0.8],
            }),
            0.5,
        );
        let close = |found: [f64; 2], exact: [f64; 2]| {
            (found[0] - exact[0]).abs() + (found[1] - exact[1]).abs() < 1e-12
        };
        assert!(close(shares(&table, 52.5), [0.48, 0.4125]));
        assert!(close(shares(&table, 80.0), [0.485, 0.4]));
    }

    fn finishes(finish: Finish, polarization_deg: Option<f64>) -> Finishes {
        Finishes {
            of_facets: vec![finish],
            wavelength_nm: 905.0,
            polarization: polarization_deg.map(f64::to_radians),
        }
    }

    #[test]
    fn one_mirror_takes_the_share_of_the_polarization() {
        // Up at 45°: the plane of incidence is x–z, the long axis y is across it.
        let (x, up) = (Vector3::x_axis(), Vector3::z_axis());
        let finish = stack(2.1, 8.4, Vec::new());
        let [s, p] = shares(&finish, 45.0);
        let share = |polarization| {
            finishes(finish.clone(), polarization).there_and_back(
                &x,
                &Vector3::y(),
                [(Some(0), up)].into_iter(),
            )
        };
        let mean = 0.5 * (s + p);
        for (polarization, there) in [
            (None, mean),
            (Some(0.0), s),
            (Some(90.0), p),
            (Some(45.0), mean),
            (Some(30.0), 0.75 * s + 0.25 * p),
        ] {
            let found = share(polarization);
            assert!(
                (found[0] - there).abs() < 1e-14 && (found[1] - mean).abs() < 1e-14,
                "{found:?}"
            );
        }
    }

    #[test]
    fn plain_mirrors_multiply_and_crossed_ones_exchange_s_and_p() {
        let plain = finishes(Finish::Plain(0.9), Some(20.0));
        let turn = |d: &Unit<Vector3<f64>>, m: Vector3<f64>| mirror::reflect(d, &Unit::new_normalize(m));
        let x = Vector3::x_axis();
        let first = turn(&x, Vector3::new(-1.0, 0.3, 0.8));
        let second = turn(&first, Vector3::new(0.2, -0.5, -1.0));
        let hops = [(Some(0), first), (Some(0), second)];
        for share in plain.there_and_back(&x, &Vector3::y(), hops.into_iter()) {
            assert!((share - 0.81).abs() < 1e-14, "{share}");
        }
        // Up, then aside: what is s at the first mirror is p at the second.
        let finish = stack(1.51, 0.0, Vec::new());
        let [s, p] = shares(&finish, 45.0);
        let hops = [(Some(0), Vector3::z_axis()), (Some(0), Vector3::y_axis())];
        let found = finishes(finish, Some(0.0)).there_and_back(&x, &Vector3::y(), hops.into_iter());
        assert!(
            (found[0] - s * p).abs() < 1e-14 && (found[1] - s * p).abs() < 1e-14,
            "{found:?}"
        );
    }
}
