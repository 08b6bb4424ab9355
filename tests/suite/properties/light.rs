//! Footprints, Eq. (1), glass, error tables, and the keyed draws.

use super::{cases, direction, vector};
use catoptric::model::beam;
use catoptric::model::bias::{interpolate, interpolation_weights};
use catoptric::sim::light::footprint::{self, ENERGY_INSIDE, SubRay, sub_rays};
use catoptric::sim::light::glass;
use catoptric::sim::light::power::{Illumination, received};
use catoptric::sim::noise::{Draws, Purpose};
use catoptric::sim::scene::{BeamShape, Glass, Light};
use nalgebra::Unit;
use proptest::collection::vec;
use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn sub_rays_of_any_count_have_the_energy_and_moments_of_the_beam(count in 1..5000_usize) {
        let rays = sub_rays(count);
        prop_assert_eq!(rays.len(), count);
        let sum = |f: &dyn Fn(&SubRay) -> f64| rays.iter().map(|r| r.weight * f(r)).sum::<f64>();
        prop_assert!(rays.iter().all(|r| r.weight > 0.0));
        // The tolerance allows for summing thousands of numbers.
        prop_assert!((sum(&|_| 1.0) - 1.0).abs() < 1e-12);
        prop_assert!(sum(&|r| r.wide).abs() < 1e-12 && sum(&|r| r.narrow).abs() < 1e-12);
        if count >= 7 {
            prop_assert!((sum(&|r| r.wide * r.wide) - 0.25).abs() < 1e-12);
            prop_assert!((sum(&|r| r.narrow * r.narrow) - 0.25).abs() < 1e-12);
            prop_assert!(sum(&|r| r.wide * r.narrow).abs() < 1e-12);
        }
        if count >= 9 {
            let inside = rays.iter().filter(|r| libm::hypot(r.wide, r.narrow) < 1.0);
            prop_assert!((inside.map(|r| r.weight).sum::<f64>() - ENERGY_INSIDE).abs() < 1e-12);
        }
    }

    #[test]
    fn a_sub_ray_on_the_contour_is_off_axis_by_half_the_full_angle(
        wide_full_mrad in 0.1..50.0_f64, narrow_full_mrad in 0.1..50.0_f64, azimuth in -2.35..2.35_f64, turns: bool,
    ) {
        let shape = BeamShape {
            wide_full_mrad, narrow_full_mrad, wide_aperture_mm: 0.0, narrow_aperture_mm: 0.0, turns,
        };
        for (wide, narrow, full) in [(1.0, 0.0, wide_full_mrad), (0.0, -1.0, narrow_full_mrad)] {
            let edge = footprint::ray(&shape, azimuth, &SubRay { wide, narrow, weight: 1.0 });
            let angle = beam::angle_between(&edge.direction, &beam::direction(azimuth));
            prop_assert!((angle - 0.5e-3 * full).abs() < 1e-15);
        }
        // The spot rotates with the azimuth and keeps its shape.
        let at = |azimuth: f64| footprint::ray(&shape, azimuth, &SubRay { wide: 1.0, narrow: 0.0, weight: 1.0 });
        let rise = at(azimuth).direction.z / libm::tan(0.5e-3 * wide_full_mrad) * (1.0
            + libm::tan(0.5e-3 * wide_full_mrad) * libm::tan(0.5e-3 * wide_full_mrad)).sqrt();
        let expected = if turns { libm::sin(azimuth) } else { 0.0 };
        prop_assert!((rise - expected).abs() < 1e-14);
    }

    #[test]
    fn equation_1_scales_as_it_is_written(
        reflectivity in 0.01..1.0_f64, cos in 0.01..1.0_f64, range in 0.1..30.0_f64, mirrors in 0.1..1.0_f64,
        share in 0.0..1.0_f64, k in 0.1..10.0_f64,
    ) {
        let light = Light::default();
        let on = Illumination { reflectivity, cos_incidence: cos, share: 0.7, range, mirrors, seen: 1.0 };
        let base = received(&light, &on);
        let ratio = |light: &Light, on: Illumination| received(light, &on) / base;
        let near = |found: f64, expected: f64| (found / expected - 1.0).abs() < 2e-15;
        let other = Illumination { range: k * range, ..on };
        prop_assert!(near(ratio(&light, other), 1.0 / (k * k)));
        let other = Illumination { cos_incidence: k * cos, ..on };
        prop_assert!(near(ratio(&light, other), k));
        let other = Illumination { mirrors: k * mirrors, ..on };
        prop_assert!(near(ratio(&light, other), k * k));
        let other = Illumination { reflectivity: k * reflectivity, ..on };
        prop_assert!(near(ratio(&light, other), k));
        let wider = Light { receiver_diameter_mm: k * light.receiver_diameter_mm, ..light.clone() };
        prop_assert!(near(ratio(&wider, on), k * k));
        let hazy = Light { air_transmission: 0.5, ..light.clone() };
        prop_assert!(near(ratio(&hazy, on), 0.25));
        // Parts of a spot are additive.
        let part = |share: f64| ratio(&light, Illumination { share: 0.7 * share, ..on });
        prop_assert!((part(share) + part(1.0 - share) - 1.0).abs() < 2e-15);
    }

    #[test]
    fn glass_is_snell_in_angles(
        index in 1.0..2.5_f64, thickness_mm in 0.1..20.0_f64, incidence in 0.0..1.5_f64, m in direction(), v in vector(),
    ) {
        prop_assume!(m.cross(&v).norm() > 0.1);
        let across = Unit::new_normalize(m.cross(&v));
        let u = Unit::new_normalize(across.into_inner() * libm::sin(incidence) - m.into_inner() * libm::cos(incidence));
        let found = glass::pass(&Glass { index, thickness_mm, ghost: false }, &u, &m);
        let inside = libm::asin(libm::sin(incidence) / index);
        let t = thickness_mm * 1e-3;
        // 86° in glass of index 1 makes paths of 15 thicknesses.
        prop_assert!((found.path - 2.0 * index * t / libm::cos(inside)).abs() < 1e-13 * found.path / libm::cos(inside));
        let walk = across.into_inner() * (2.0 * t * libm::tan(inside));
        prop_assert!((found.walk - walk).norm() < 1e-13 * (t + found.walk.norm()) / libm::cos(inside));
        // To the silvering, and half of the path along the plate.
        prop_assert!((found.to_silver - (walk * 0.5 - m.into_inner() * t)).norm() < 1e-13 * (t + walk.norm()) / libm::cos(inside));
        prop_assert!((0.0..=1.0).contains(&found.fresnel));
        if index > 1.01 && incidence < FRAC_PI_2 - 0.1 {
            // Fresnel's equations for the two polarizations in angles; at normal incidence their limit.
            let (s, d) = (incidence + inside, incidence - inside);
            let square = |x: f64| x * x;
            let expected = if incidence < 1e-3 {
                square((index - 1.0) / (index + 1.0))
            } else {
                0.5 * (square(libm::sin(d) / libm::sin(s)) + square(libm::tan(d) / libm::tan(s)))
            };
            let tolerance = if incidence < 1e-3 { 1e-6 } else { 1e-12 };
            prop_assert!((found.fresnel - expected).abs() < tolerance);
        }
    }

    #[test]
    fn tables_are_interpolated_between_their_nodes(
        start in -5.0..5.0_f64, steps in vec((0.01..3.0_f64, -10.0..10.0_f64), 1..8), at in -0.5..1.5_f64,
        slope in -3.0..3.0_f64,
    ) {
        let mut nodes = vec![start];
        for (step, _) in &steps {
            nodes.push(nodes[nodes.len() - 1] + step);
        }
        let values: Vec<f64> = [0.0].into_iter().chain(steps.iter().map(|s| s.1)).collect();
        let (first, last) = (nodes[0], nodes[nodes.len() - 1]);
        let x = first + at * (last - first);
        let weights = interpolation_weights(&nodes, x);
        prop_assert!((weights[0].1 + weights[1].1 - 1.0).abs() < 1e-15 && weights.iter().all(|w| w.1 >= 0.0));
        let found = interpolate(&nodes, &values, x);
        let around = weights.map(|(i, w)| if w > 0.0 { values[i] } else { values[weights[0].0] });
        prop_assert!(found >= around[0].min(around[1]) - 1e-14 && found <= around[0].max(around[1]) + 1e-14);
        for (node, value) in nodes.iter().zip(&values) {
            prop_assert_eq!(interpolate(&nodes, &values, *node), *value);
        }
        prop_assert_eq!(interpolate(&nodes, &values, first - 1.0), values[0]);
        prop_assert_eq!(interpolate(&nodes, &values, last + 1.0), values[values.len() - 1]);
        // A straight line is interpolated exactly; steps of a hundredth cost two digits.
        let line: Vec<f64> = nodes.iter().map(|n| slope * n).collect();
        prop_assert!((interpolate(&nodes, &line, x) - slope * x.clamp(first, last)).abs() < 1e-14);
    }

    #[test]
    fn draws_are_the_same_in_any_order(seed: u64, row: u64, columns in vec(0..2000_u64, 1..20)) {
        let draw = |draws: &mut Draws, column| {
            draws.seek(column);
            [draws.normal(), draws.uniform(), draws.normal(), draws.within(3.0)]
        };
        let mut shared = Draws::new(seed, Purpose::Reading, row);
        for &column in &columns {
            let alone = draw(&mut Draws::new(seed, Purpose::Reading, row), column);
            prop_assert_eq!(draw(&mut shared, column), alone);
            for other in [
                draw(&mut Draws::new(seed ^ 1, Purpose::Reading, row), column),
                draw(&mut Draws::new(seed, Purpose::Detection, row), column),
                draw(&mut Draws::new(seed, Purpose::Reading, row ^ 1), column),
                draw(&mut Draws::new(seed, Purpose::Reading, row), column + 1),
            ] {
                prop_assert!(alone.iter().zip(other).all(|(a, b)| *a != b));
            }
        }
    }
}
