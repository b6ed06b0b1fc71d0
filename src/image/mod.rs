//! Reading and writing pictures. Heights keep their precision; files appear by rename when complete.
//!
//! Pictures are read by content, not by the file's name: PNG, JPEG, TIFF, OpenEXR, Radiance HDR, WebP, BMP, PNM, PFM; TGA,
//! which has no signature, by its ending. A picture in memory is bottom row first (v points up) except for the environment,
//! whose first row is the zenith.
//!
//! A file is refused from its header alone when it claims more than [`MAX_PIXELS`]. Below that, memory is taken as pixels
//! are decoded, or what is claimed is held against the bytes there are: none is taken on the word of a few bytes.

mod channel;
mod color;
mod environment;
mod error;
mod exr_b44;
mod exr_blocks;
mod exr_chroma;
mod exr_dwa;
mod exr_file;
mod exr_picture;
mod format;
mod hdr_file;
mod heights;
mod jpeg_scan;
mod png_file;
mod pnm_file;
mod raster;
mod samples;
mod scalar;
mod source;
mod srgb;
mod tiff;
mod write;

pub use channel::Channel;
pub use color::{ColorImage, ColorPixels, ColorSpace, load_color};
pub use environment::{EnvironmentImage, load_environment};
pub use error::ImageError;
pub use exr_file::{read_exr, read_exr_header};
pub use exr_picture::{ExrChannel, ExrPicture, ExrSamples};
pub use format::Format;
pub use heights::load_heights;
pub use scalar::{ScalarImage, load_scalar};
pub use source::Source;
pub use srgb::{srgb_decode, srgb_encode};
pub(crate) use write::{stage_png_gray16, stage_png_rgb8};
pub use write::{write_exr, write_exr_picture, write_png_gray16, write_png_rgb8};

/// Most pixels of a picture that is read: 32768 x 16384.
pub const MAX_PIXELS: u64 = 1 << 29;

/// 32 hexadecimal digits for the bytes of a picture: XXH3, 128 bits. It tells pictures apart, not forgeries.
pub(crate) fn fingerprint(bytes: &[u8]) -> String {
    format!("{:032x}", twox_hash::XxHash3_128::oneshot(bytes))
}

#[cfg(test)]
mod test_files;
#[cfg(test)]
mod test_tiff;
