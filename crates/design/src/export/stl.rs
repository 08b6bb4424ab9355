//! Export to binary STL: a header, the number of triangles, and for each its normal and corners as 32-bit floats, in
//! millimeters.

use super::Solid;
use nalgebra::Vector3;

/// Size of the header in bytes. It must not begin with "solid", as STL text files do.
const HEADER: usize = 80;

/// Returns solids as binary STL in millimeters.
pub fn stl(solids: &[Solid]) -> Vec<u8> {
    let triangles: Vec<_> = solids.iter().flat_map(|s| &s.triangles).collect();
    let mut bytes = b"catoptric, millimeters, sensor frame".to_vec();
    bytes.resize(HEADER, b' ');
    // A layout has thousands of triangles, far below the limit.
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

/// Returns a vector as three 32-bit floats.
pub(super) fn single(v: &Vector3<f64>) -> impl Iterator<Item = u8> + use<> {
    // The format has single precision; at one meter that is 0.06 µm.
    #[allow(clippy::cast_possible_truncation)]
    let parts = [v.x as f32, v.y as f32, v.z as f32];
    parts.into_iter().flat_map(f32::to_le_bytes)
}
