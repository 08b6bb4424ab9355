//! Logarithm, exponential and cosine of many numbers at once, bit for bit as in `libm`.
//!
//! The operations are those of `libm` in the same order, with selections instead of its branches, so that the compiler
//! vectorizes loops over them. Each function states which arguments it accepts, and which of them are rare and left to
//! `libm` itself.

/// Number of values that are processed together.
pub(crate) const LANES: usize = 8;

/// `libm::exp` of a number that is not positive, and whether the number is from −746 to −700, which is left to `libm`.
#[inline(always)]
pub(crate) fn exponential(x: f64) -> (f64, bool) {
    const LN2_HI: f64 = 6.931_471_803_691_238e-1;
    const LN2_LO: f64 = 1.908_214_929_270_587_7e-10;
    const INVERSE_LN2: f64 = std::f64::consts::LOG2_E;
    const P: [f64; 5] = [
        1.666_666_666_666_660_2e-1,
        -2.777_777_777_701_559_3e-3,
        6.613_756_321_437_934e-5,
        -1.653_390_220_546_525_2e-6,
        4.138_136_797_057_238_5e-8,
    ];
    /// Adding this rounds a number to an integer.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    /// High words of ½·ln 2 and 3/2·ln 2, and of the number below which the result is 1 + x.
    const HALF: u64 = 0x3fd6_2e42;
    const THREE_HALVES: u64 = 0x3ff0_a2b2;
    const TINY: u64 = 0x3e30_0000;
    const ZERO_BELOW: f64 = -746.0;
    const RARE_BELOW: f64 = -700.0;
    let size = -x;
    let beyond = |high: u64| size >= f64::from_bits(high << 32);
    let kept = if x < RARE_BELOW { RARE_BELOW } else { x };
    // Truncated toward zero, like a conversion to an integer.
    let scaled = INVERSE_LN2 * kept - 0.5;
    let nearest = (scaled + ROUND) - ROUND;
    let cut = if nearest < scaled { nearest + 1.0 } else { nearest };
    let k = if beyond(THREE_HALVES) { cut } else { -1.0 };
    let k = if beyond(HALF + 1) { k } else { 0.0 };
    let hi = kept - k * LN2_HI;
    let lo = k * LN2_LO;
    let reduced = hi - lo;
    let xx = reduced * reduced;
    let c = reduced - xx * (P[0] + xx * (P[1] + xx * (P[2] + xx * (P[3] + xx * P[4]))));
    let y = 1.0 + (reduced * c / (2.0 - c) - lo + hi);
    let power = f64::from_bits((k + (1023.0 + 4_503_599_627_370_496.0)).to_bits() << 52);
    let value = if beyond(TINY + 1) { y * power } else { 1.0 + x };
    let value = if x < ZERO_BELOW { 0.0 } else { value };
    (value, (ZERO_BELOW..RARE_BELOW).contains(&x))
}

/// `libm::log` of a positive normal number.
#[inline(always)]
pub(crate) fn logarithm(x: f64) -> f64 {
    const LN2_HI: f64 = 6.931_471_803_691_238e-1;
    const LN2_LO: f64 = 1.908_214_929_270_587_7e-10;
    const LG: [f64; 7] = [
        6.666_666_666_666_735e-1,
        3.999_999_999_940_942e-1,
        2.857_142_874_366_239e-1,
        2.222_219_843_214_978_4e-1,
        1.818_357_216_161_805e-1,
        1.531_383_769_920_937_3e-1,
        1.479_819_860_511_658_6e-1,
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

/// An integer below 2⁵² as a floating-point number.
#[inline(always)]
fn small(number: u64) -> f64 {
    const UNIT: u64 = 0x4330_0000 << 32;
    f64::from_bits(number | UNIT) - 4_503_599_627_370_496.0
}

/// `libm::cos` of a number from 0 to 2π, and whether it is so close to a multiple of π/2 that `libm` uses another
/// method.
#[inline(always)]
pub(crate) fn cosine(x: f64) -> (f64, bool) {
    const PIO2_1: f64 = 1.570_796_326_734_125_6;
    const PIO2_1T: f64 = 6.077_100_506_506_192e-11;
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
        4.166_666_666_666_66e-2,
        -1.388_888_888_887_411e-3,
        2.480_158_728_947_673e-5,
        -2.755_731_435_139_066_3e-7,
        2.087_572_321_298_175e-9,
        -1.135_964_755_778_819_5e-11,
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
        -1.666_666_666_666_663_2e-1,
        8.333_333_333_322_49e-3,
        -1.984_126_982_985_795e-4,
        2.755_731_370_707_006_8e-6,
        -2.505_076_025_340_686_3e-8,
        1.589_690_995_211_55e-10,
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
    fn exponentials_are_those_of_libm() {
        let mut arguments: Vec<f64> = (0..2_000_000).map(|i| -f64::from(i) * 4.1e-4).collect();
        arguments.extend((0..200_000).map(|i| -f64::from(i) * 1e-5));
        // Consecutive floating-point numbers around those where the method changes.
        for place in [
            0x3fd6_2e42_u64,
            0x3fd6_2e43,
            0x3ff0_a2b1,
            0x3ff0_a2b2,
            0x3e30_0000,
            0x3e30_0001,
        ] {
            for step in 0..2000 {
                arguments.push(-f64::from_bits((place << 32) + step));
                arguments.push(-f64::from_bits((place << 32) - step));
            }
        }
        arguments.extend((0..2000).map(|i| -f64::from(i) * 1e-11));
        arguments.extend([0.0, -0.0, -700.0, -746.0, -1e9, f64::NEG_INFINITY]);
        let mut rare = 0;
        for x in arguments {
            let (found, left) = exponential(x);
            if left {
                rare += 1;
            } else {
                assert_eq!(found.to_bits(), libm::exp(x).to_bits(), "{x:e}");
            }
        }
        assert!(rare > 0 && rare < 200_000, "{rare}");
    }
}
