//! An EXR file of one layer, in memory.

/// An EXR file of one layer.
#[derive(Clone, Debug, PartialEq)]
pub struct ExrPicture {
    /// Pixels across and down of the whole picture: the display window, from (0, 0).
    pub display: (usize, usize),
    /// Column and row, from the top left of the whole, of the top left pixel there is: the start of the data window.
    pub position: (i32, i32),
    /// Pixels across that there are.
    pub width: usize,
    /// Pixels down that there are.
    pub height: usize,
    /// Channels, in any order.
    pub channels: Vec<ExrChannel>,
    /// Text attributes: (name, value).
    pub attributes: Vec<(String, String)>,
}

/// One channel of an EXR file.
#[derive(Clone, Debug, PartialEq)]
pub struct ExrChannel {
    /// `R`, `G`, `B`, `A`, or `layer.channel`, as OpenEXR names the channels of layers.
    pub name: String,
    /// Samples, bottom row first.
    pub samples: ExrSamples,
}

/// The samples of a channel.
#[derive(Clone, Debug, PartialEq)]
pub enum ExrSamples {
    /// FLOAT; HALF is widened when it is read.
    F32(Vec<f32>),
    /// UINT.
    U32(Vec<u32>),
}

impl ExrChannel {
    /// A channel of floats.
    pub fn floats(name: impl Into<String>, samples: Vec<f32>) -> Self {
        Self {
            name: name.into(),
            samples: ExrSamples::F32(samples),
        }
    }

    /// A channel of whole numbers.
    pub fn integers(name: impl Into<String>, samples: Vec<u32>) -> Self {
        Self {
            name: name.into(),
            samples: ExrSamples::U32(samples),
        }
    }

    /// The channels of an RGB picture; with a layer's name, those of that layer.
    pub fn rgb(layer: Option<&str>, pixels: &[[f32; 3]]) -> [Self; 3] {
        [("R", 0), ("G", 1), ("B", 2)].map(|(channel, index)| {
            let name = match layer {
                Some(layer) => format!("{layer}.{channel}"),
                None => channel.to_owned(),
            };
            Self::floats(name, pixels.iter().map(|pixel| pixel[index]).collect())
        })
    }
}
