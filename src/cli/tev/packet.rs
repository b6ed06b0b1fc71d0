//! The packets that tev understands: a u32 with the length of all, a byte that tells the kind, then fields without padding. Numbers are
//! little-endian, texts end in a zero byte. By `IpcPacket` of tev's `Ipc.h` and `Ipc.cpp`.

use crate::scene::Window;

const CREATE_IMAGE: u8 = 4;
/// The version that tells where each channel's values are: here pixel after pixel.
const UPDATE_IMAGE_V3: u8 = 6;

/// Makes an image of `size` pixels, black and transparent, in place of an older one of that name, and turns tev to it.
pub fn create_image(name: &str, size: [u32; 2], channels: &[&str]) -> Vec<u8> {
    let mut packet = Packet::new(CREATE_IMAGE);
    packet.flag(true);
    packet.text(name);
    packet.ints(size);
    packet.channels(channels);
    packet.finish()
}

/// Puts `values` into `window` of the image: for each pixel, row by row from the top, those of all channels.
pub fn update_image(name: &str, channels: &[&str], window: Window, values: &[f32]) -> Vec<u8> {
    let mut packet = Packet::new(UPDATE_IMAGE_V3);
    packet.flag(false);
    packet.text(name);
    packet.channels(channels);
    packet.ints(window.start.to_array());
    packet.ints(window.size().to_array());
    let strides = channels.iter().map(|_| channels.len());
    for place in (0..channels.len()).chain(strides) {
        packet.0.extend((place as i64).to_le_bytes());
    }
    for value in values {
        packet.0.extend(value.to_le_bytes());
    }
    packet.finish()
}

/// A packet in the making. The length in front is filled in last.
struct Packet(Vec<u8>);

impl Packet {
    fn new(kind: u8) -> Self {
        Self(vec![0, 0, 0, 0, kind])
    }

    fn flag(&mut self, is_set: bool) {
        self.0.push(is_set.into());
    }

    fn text(&mut self, text: &str) {
        // A zero byte inside would end it.
        self.0.extend(text.bytes().filter(|&byte| byte != 0));
        self.0.push(0);
    }

    /// Coordinates, which are far below 2^31.
    fn ints(&mut self, values: [u32; 2]) {
        self.0.extend(values.into_iter().flat_map(u32::to_le_bytes));
    }

    fn channels(&mut self, names: &[&str]) {
        self.0.extend((names.len() as i32).to_le_bytes());
        for name in names {
            self.text(name);
        }
    }

    fn finish(mut self) -> Vec<u8> {
        // Pictures go in cells of a few hundred kilobytes at most.
        let length = self.0.len() as u32;
        self.0[..4].copy_from_slice(&length.to_le_bytes());
        self.0
    }
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    #[test]
    fn packets_are_those_of_tev_byte_by_byte() {
        let create = create_image("a.exr", [640, 2], &["R", "N.X"]);
        let expected = b"\x1e\0\0\0\x04\x01a.exr\0\x80\x02\0\0\x02\0\0\0\x02\0\0\0R\0N.X\0";
        assert_eq!(create, expected);
        let window = Window {
            start: UVec2::new(3, 4),
            end: UVec2::new(4, 6),
        };
        let update = update_image("a", &["R", "G"], window, &[1.0, -2.0, 0.5, 0.0]);
        let expected: Vec<u8> = [
            &b"\x50\0\0\0\x06\0a\0\x02\0\0\0R\0G\0"[..],
            b"\x03\0\0\0\x04\0\0\0\x01\0\0\0\x02\0\0\0",
            b"\0\0\0\0\0\0\0\0\x01\0\0\0\0\0\0\0",
            b"\x02\0\0\0\0\0\0\0\x02\0\0\0\0\0\0\0",
            b"\0\0\x80\x3f\0\0\0\xc0\0\0\0\x3f\0\0\0\0",
        ]
        .concat();
        assert_eq!(update, expected);
    }
}
