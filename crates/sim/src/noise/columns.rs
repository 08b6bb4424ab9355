//! All columns of a row at once: the numbers that [`Draws`] gives one by one, to the last bit.
//!
//! A column's words are one block of ChaCha, so that a row is one run of the stream. Deviates are made many at a time
//! by the operations of `libm`'s logarithm and cosine in their order, with choices in place of branches, which the
//! compiler turns into vectors. What is rare is left to `libm` itself.

use super::{Draws, Purpose, WORDS_PER_COLUMN, standard_uniform};
use rand::rand_core::Rng;

/// Bytes of a column.
const BLOCK: usize = 4 * WORDS_PER_COLUMN;

/// Deviates that are made together.
const LANES: usize = 8;

/// The draws of all columns of a row.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    bytes: Vec<u8>,
}

impl Columns {
    /// Draws a row of so many columns in place of what was here.
    pub fn draw(&mut self, columns: usize, seed: u64, purpose: Purpose, row: u64) {
        self.bytes.resize(columns * BLOCK, 0);
        Draws::new(seed, purpose, row).rng.fill_bytes(&mut self.bytes);
    }

    /// Forgets the row: there are no columns.
    pub fn clear(&mut self) {
        self.bytes.clear();
    }

    /// Number of columns.
    pub fn len(&self) -> usize {
        self.bytes.len() / BLOCK
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// What [`Draws::uniform`] is after so many uniform draws of a column; a normal draw counts as two.
    pub fn uniform(&self, column: usize, after: usize) -> f64 {
        standard_uniform(word(&self.bytes[column * BLOCK..], after))
    }

    /// [`Columns::uniform`] of every column.
    pub fn uniforms(&self, after: usize, out: &mut Vec<f64>) {
        let blocks = self.bytes.chunks_exact(BLOCK);
        out.clear();
        out.extend(blocks.map(|block| standard_uniform(word(block, after))));
    }

    /// What [`Draws::normal`] is in every column after so many uniform draws.
    pub fn normals(&self, after: usize, out: &mut Vec<f64>) {
        out.clear();
        out.reserve(self.len());
        let mut groups = self.bytes.chunks_exact(BLOCK * LANES);
        for group in &mut groups {
            let uniform = |after: usize| -> [f64; LANES] {
                std::array::from_fn(|lane| standard_uniform(word(&group[lane * BLOCK..], after)))
            };
            out.extend(normal(&uniform(after), &uniform(after + 1)));
        }
        for block in groups.remainder().chunks_exact(BLOCK) {
            let uniform = |after| standard_uniform(word(block, after));
            out.push(scalar(uniform(after), uniform(after + 1)));
        }
    }
}

/// A word of 64 bits of a block.
fn word(block: &[u8], index: usize) -> u64 {
    let mut bytes = [0; 8];
    bytes.copy_from_slice(&block[8 * index..8 * index + 8]);
    u64::from_le_bytes(bytes)
}

/// Box and Muller's transform as [`Draws::normal`] has it.
pub(super) fn scalar(first: f64, second: f64) -> f64 {
    let radius = (-2.0 * libm::log(first)).sqrt();
    radius * libm::cos(std::f64::consts::TAU * second)
}

/// The same of several pairs of numbers from (0, 1].
fn normal(first: &[f64; LANES], second: &[f64; LANES]) -> [f64; LANES] {
    let mut out = [0.0; LANES];
    let mut rare = false;
    for lane in 0..LANES {
        let turn = std::f64::consts::TAU * second[lane];
        let (cosine, near_root) = cosine(turn);
        rare |= near_root;
        out[lane] = (-2.0 * logarithm(first[lane])).sqrt() * cosine;
    }
    if rare {
        return std::array::from_fn(|lane| scalar(first[lane], second[lane]));
    }
    out
}

/// `libm::log` of a positive normal number.
#[inline(always)]
fn logarithm(x: f64) -> f64 {
    const LN2_HI: f64 = 6.931_471_803_691_238_164_90e-01;
    const LN2_LO: f64 = 1.908_214_929_270_587_700_02e-10;
    const LG: [f64; 7] = [
        6.666_666_666_666_735_130e-01,
        3.999_999_999_940_941_908e-01,
        2.857_142_874_366_239_149e-01,
        2.222_219_843_214_978_396e-01,
        1.818_357_216_161_805_012e-01,
        1.531_383_769_920_937_332e-01,
        1.479_819_860_511_658_591e-01,
    ];
    /// High word of √½.
    const ROOT_HALF: u64 = 0x3fe6_a09e << 32;
    const ONE: u64 = 0x3ff0_0000 << 32;
    let shifted = x.to_bits() + (ONE - ROOT_HALF);
    let exponent = small(shifted >> 52) - 1023.0;
    let mantissa = f64::from_bits((shifted & 0x000f_ffff_ffff_ffff) + ROOT_HALF);
    let f = mantissa - 1.0;
    let half_square = 0.5 * f * f;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let t1 = w * (LG[1] + w * (LG[3] + w * LG[5]));
    let t2 = z * (LG[0] + w * (LG[2] + w * (LG[4] + w * LG[6])));
    let r = t2 + t1;
    s * (half_square + r) + exponent * LN2_LO - half_square + f + exponent * LN2_HI
}

/// A whole number below 2⁵² as a floating-point number.
#[inline(always)]
fn small(number: u64) -> f64 {
    const UNIT: u64 = 0x4330_0000 << 32;
    f64::from_bits(number | UNIT) - 4_503_599_627_370_496.0
}

/// `libm::cos` of a number from 0 to 2π, and whether it is so near a multiple of π/2 that `libm` takes another way.
#[inline(always)]
fn cosine(x: f64) -> (f64, bool) {
    const PIO2_1: f64 = 1.570_796_326_734_125_614_17e+00;
    const PIO2_1T: f64 = 6.077_100_506_506_192_249_32e-11;
    /// High words up to which an argument is less than π/4, 3π/4, 5π/4 and 7π/4.
    const UP_TO: [u64; 4] = [0x3fe9_21fb, 0x4002_d97c, 0x400f_6a7a, 0x4015_fdbc];
    let beyond = |up_to: u64| f64::from(u8::from(x >= f64::from_bits((up_to + 1) << 32)));
    let quarter = beyond(UP_TO[0]) + beyond(UP_TO[1]) + beyond(UP_TO[2]) + beyond(UP_TO[3]);
    let z = x - quarter * PIO2_1;
    let y0 = z - quarter * PIO2_1T;
    let y1 = (z - y0) - quarter * PIO2_1T;
    let along = kernel_cosine(y0, y1);
    let across = kernel_sine(y0, y1);
    let odd = (quarter == 1.0) | (quarter == 3.0);
    let value = if odd { across } else { along };
    let negative = (quarter == 1.0) | (quarter == 2.0);
    let value = if negative { -value } else { value };
    (value, (quarter > 0.0) & (y0.abs() < 1e-5))
}

#[inline(always)]
fn kernel_cosine(x: f64, y: f64) -> f64 {
    const C: [f64; 6] = [
        4.166_666_666_666_660_190_37e-02,
        -1.388_888_888_887_410_957_49e-03,
        2.480_158_728_947_672_941_78e-05,
        -2.755_731_435_139_066_330_35e-07,
        2.087_572_321_298_174_827_90e-09,
        -1.135_964_755_778_819_482_65e-11,
    ];
    let z = x * x;
    let w = z * z;
    let r = z * (C[0] + z * (C[1] + z * C[2])) + w * w * (C[3] + z * (C[4] + z * C[5]));
    let half = 0.5 * z;
    let w = 1.0 - half;
    w + (((1.0 - w) - half) + (z * r - x * y))
}

#[inline(always)]
fn kernel_sine(x: f64, y: f64) -> f64 {
    const S: [f64; 6] = [
        -1.666_666_666_666_663_243_48e-01,
        8.333_333_333_322_489_461_24e-03,
        -1.984_126_982_985_794_931_34e-04,
        2.755_731_370_707_006_767_89e-06,
        -2.505_076_025_340_686_341_95e-08,
        1.589_690_995_211_550_102_21e-10,
    ];
    let z = x * x;
    let w = z * z;
    let r = S[1] + z * (S[2] + z * S[3]) + z * w * (S[4] + z * S[5]);
    let v = z * x;
    x - ((z * (0.5 * y - v * r) - y) - v * S[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_the_draws_one_by_one() {
        let mut columns = Columns::default();
        let (mut normals, mut later, mut uniforms) = (Vec::new(), Vec::new(), Vec::new());
        for (row, count) in [(0, 1081), (1, 8), (7, 5), (9, 40_000)] {
            columns.draw(count, 3, Purpose::Reading, row);
            columns.normals(0, &mut normals);
            columns.uniforms(2, &mut uniforms);
            columns.normals(3, &mut later);
            assert_eq!(
                (columns.len(), normals.len(), uniforms.len()),
                (count, count, count)
            );
            let mut draws = Draws::new(3, Purpose::Reading, row);
            for column in 0..count {
                draws.seek(column as u64);
                assert_eq!(draws.normal().to_bits(), normals[column].to_bits());
                let uniform = draws.uniform();
                assert_eq!(uniform, uniforms[column]);
                assert_eq!(uniform, columns.uniform(column, 2));
                assert_eq!(draws.normal().to_bits(), later[column].to_bits());
            }
        }
    }

    /// Near the places where `libm` changes its way, and at the ends.
    #[test]
    fn deviates_are_those_of_libm_where_it_changes_its_way() {
        let mut edges = vec![f64::EPSILON / 4.0, 0.5, 1.0, 2e-17, 1e-9, 3e-9, 0.999_999_999];
        for k in 1..16 {
            let place = f64::from(k) / 16.0;
            for step in -400..=400 {
                edges.push(place + f64::from(step) * 1e-17);
                edges.push(place + f64::from(step) * 1e-8);
            }
        }
        // √½ and √2, where the logarithm's argument is halved.
        for step in -400..=400 {
            edges.push(std::f64::consts::FRAC_1_SQRT_2 + f64::from(step) * 1e-9);
        }
        for pair in edges.chunks_exact(LANES) {
            let second: [f64; LANES] = std::array::from_fn(|lane| pair[lane]);
            for first in [[0.3; LANES], second] {
                let made = normal(&first, &second);
                for lane in 0..LANES {
                    let exact = scalar(first[lane], second[lane]);
                    assert_eq!(
                        made[lane].to_bits(),
                        exact.to_bits(),
                        "{} {}",
                        first[lane],
                        second[lane]
                    );
                }
            }
        }
    }
}
