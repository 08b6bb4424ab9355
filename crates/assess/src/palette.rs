//! The color of a facet, the same on every page, in every picture and in every exported model.

/// The colors of Okabe and Ito, which color-blind readers can distinguish; the yellow is darkened for a white background.
const PALETTE: [[u8; 3]; 8] = [
    [0x00, 0x72, 0xB2],
    [0xD5, 0x5E, 0x00],
    [0x00, 0x9E, 0x73],
    [0xCC, 0x79, 0xA7],
    [0x56, 0xB4, 0xE9],
    [0xE6, 0x9F, 0x00],
    [0xB5, 0xA8, 0x1E],
    [0x8A, 0x5A, 0x9E],
];

/// Returns the color of a facet by its number, as sRGB.
pub fn facet_color(facet: usize) -> [u8; 3] {
    PALETTE[facet % PALETTE.len()]
}
