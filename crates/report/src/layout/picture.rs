//! Pictures as PNG files.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

/// Bytes of a picture, row by row from the top.
pub(super) struct Picture {
    /// Columns and rows.
    pub(super) size: [u32; 2],
    /// What the bytes of a pixel are.
    pub(super) color: ExtendedColorType,
    pub(super) bytes: Vec<u8>,
}

impl Picture {
    /// The PNG file.
    pub(super) fn encoded(&self) -> Vec<u8> {
        let mut file = Vec::new();
        let encoder = PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Adaptive);
        let [columns, rows] = self.size;
        // Writing to memory, of the size the picture has, cannot fail.
        if encoder
            .write_image(&self.bytes, columns, rows, self.color)
            .is_err()
        {
            file.clear();
        }
        file
    }
}
