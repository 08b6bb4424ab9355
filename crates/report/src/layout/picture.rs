//! Encoding of pictures as PNG files.

/// A picture, stored row by row from the top.
pub(super) struct Picture {
    /// Number of columns and rows.
    pub(super) size: [u32; 2],
    /// What the bytes of a pixel mean.
    pub(super) color: png::ColorType,
    pub(super) bytes: Vec<u8>,
}

impl Picture {
    /// Encodes the picture as PNG.
    pub(super) fn encoded(&self) -> Vec<u8> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.size[0], self.size[1]);
        encoder.set_color(self.color);
        encoder.set_compression(png::Compression::Fast);
        encoder.set_filter(png::Filter::Adaptive);
        let written = encoder
            .write_header()
            .and_then(|mut writer| writer.write_image_data(&self.bytes));
        // Writing a picture of the stated size to memory cannot fail.
        if written.is_err() {
            file.clear();
        }
        file
    }
}
