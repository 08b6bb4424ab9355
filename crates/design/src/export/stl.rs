//! Binary STL: a header, the number of triangles, and for each its normal and corners as 32-bit floats, in millimetres.

use super::Solid;
use nalgebra::Vector3;

/// Bytes of the header; it must not begin with "solid", which text files do.
const HEADER: usize = 80;

/// Solids as binary STL in millimetres.
pub fn stl(solids: &[Solid]) -> Vec<u8> {
    let triangles: Vec<_> = solids.iter().flat_map(|s| &s.triangles).collect();
    let mut bytes = b"catoptric, millimetres, sensor frame".to_vec();
    bytes.resize(HEADER, b' ');
    // A layout has thousands of triangles, not thousands of millions.
    let count = u32::try_from(triangles.len()).unwrap_or(u32::MAX);
    bytes.extend(count.to_le_bytes());
    for [a, b, c] in triangles {
        let normal = (b - a)
            .cross(&(c - a))
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::zeros);
        for v in [normal, a.coords * 1e3, b.coords * 1e3, c.coords * 1e3] {
            bytes.extend(single(&v));
        }
        bytes.extend([0, 0]);
    }
    bytes
}

/// A vector as three 32-bit floats.
pub(super) fn single(v: &Vector3<f64>) -> impl Iterator<Item = u8> + use<> {
    // The format holds no more; at a metre that is 0.06 µm.
    #[allow(clippy::cast_possible_truncation)]
    let parts = [v.x as f32, v.y as f32, v.z as f32];
    parts.into_iter().flat_map(f32::to_le_bytes)
}
