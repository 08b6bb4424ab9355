//! All columns of a row at once: the numbers that [`Draws`] draws one by one, bit for bit.
//!
//! The words of a column are one block of ChaCha, so a row is one run of the stream.

use super::draws::{Draws, Purpose, WORDS_PER_COLUMN, box_muller, standard_uniform};
use crate::lanes::{LANES, cosine, logarithm};
use fearless_simd::{Level, dispatch};

/// Bytes per column.
const BLOCK: usize = 4 * WORDS_PER_COLUMN;

/// The draws of all columns of a row.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    bytes: Vec<u8>,
}

impl Columns {
    /// Draws a row with a given number of columns, in place of the previous one.
    pub fn draw(&mut self, columns: usize, seed: u64, purpose: Purpose, row: u64) {
        self.bytes.resize(columns * BLOCK, 0);
        Draws::new(seed, purpose, row).fill(&mut self.bytes);
    }

    /// Clears the row, leaving no columns.
    pub fn clear(&mut self) {
        self.bytes.clear();
    }

    /// Number of columns.
    pub fn len(&self) -> usize {
        self.bytes.len() / BLOCK
    }

    /// Whether there are no columns.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// The result of [`Draws::uniform`] after `after` uniform draws of a column; a normal draw counts as two.
    pub fn uniform(&self, column: usize, after: usize) -> f64 {
        standard_uniform(word(&self.bytes[column * BLOCK..], after))
    }

    /// [`Columns::uniform`] of every column.
    pub fn uniforms(&self, after: usize, out: &mut Vec<f64>) {
        let blocks = self.bytes.chunks_exact(BLOCK);
        out.clear();
        out.extend(blocks.map(|block| standard_uniform(word(block, after))));
    }

    /// The result of [`Draws::normal`] in every column after `after` uniform draws.
    pub fn normals(&self, after: usize, out: &mut Vec<f64>) {
        dispatch!(Level::new(), _simd => self.normals_in_lanes(after, out));
    }

    /// [`Columns::normals`] with the instructions of its caller: wider ones are faster, and the bits are the same.
    #[inline(always)]
    fn normals_in_lanes(&self, after: usize, out: &mut Vec<f64>) {
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
            out.push(box_muller(uniform(after), uniform(after + 1)));
        }
    }
}

/// A 64-bit word of a block.
#[inline(always)]
fn word(block: &[u8], index: usize) -> u64 {
    let mut bytes = [0; 8];
    bytes.copy_from_slice(&block[8 * index..8 * index + 8]);
    u64::from_le_bytes(bytes)
}

/// [`box_muller`] of several pairs.
#[inline(always)]
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
        return std::array::from_fn(|lane| box_muller(first[lane], second[lane]));
    }
    out
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

    /// Near the values where `libm` changes its method, and at the ends.
    #[test]
    fn deviates_are_those_of_libm_where_it_changes_its_method() {
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
                    let exact = box_muller(first[lane], second[lane]);
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
