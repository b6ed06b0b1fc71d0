//! JPEG in TIFF (technical note 2): every strip or tile is a picture of its own, with tables in common.

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// What the picture in a strip or tile must be.
pub(super) struct Expected {
    pub width: usize,
    /// Rows that are wanted; a strip or tile may have more.
    pub rows: usize,
    pub samples: usize,
    /// The samples are YCbCr, and RGB is wanted.
    pub to_rgb: bool,
}

const START: [u8; 2] = [0xff, 0xd8];
const END: [u8; 2] = [0xff, 0xd9];

/// The rows that are wanted, interleaved.
pub(super) fn decode(tables: &[u8], data: &[u8], expected: &Expected) -> Result<Vec<u8>, String> {
    /// A block of 8x8 pixels takes a bit at least.
    const PIXELS_PER_BYTE: usize = 8 * 64;
    let picture = data.strip_prefix(&START).ok_or("it is no JPEG picture")?;
    // What decoders fill up with grey.
    if !data.ends_with(&END) && !data.windows(2).rev().take(64).any(|pair| pair == END) {
        return Err("the end of its JPEG picture is missing".to_owned());
    }
    let tables = tables.strip_suffix(&END).unwrap_or(tables);
    let stream = match tables.is_empty() {
        true => data.to_vec(),
        false => [tables, picture].concat(),
    };
    let options = DecoderOptions::default().set_strict_mode(true);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(&stream), options);
    decoder.decode_headers().map_err(|e| e.to_string())?;
    let info = decoder.info().ok_or("its JPEG picture has no header")?;
    let (width, height) = (usize::from(info.width), usize::from(info.height));
    let samples = usize::from(info.components);
    if width != expected.width || height < expected.rows || samples != expected.samples {
        return Err(format!(
            "its JPEG picture is {width}x{height} with {samples} channels; {}x{} with {} are expected",
            expected.width, expected.rows, expected.samples
        ));
    }
    if width * height / PIXELS_PER_BYTE > data.len() {
        let found = data.len();
        return Err(format!(
            "{found} bytes cannot be a JPEG picture of {width}x{height}"
        ));
    }
    let stored = decoder.input_colorspace().unwrap_or(ColorSpace::Unknown);
    let wanted = if expected.to_rgb {
        ColorSpace::RGB
    } else {
        stored
    };
    decoder.set_options(options.jpeg_set_out_colorspace(wanted));
    let mut pixels = decoder.decode().map_err(|e| e.to_string())?;
    pixels.truncate(width * expected.rows * samples);
    Ok(pixels)
}
