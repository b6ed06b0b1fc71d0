//! Which channel of a picture is meant.

use std::convert::Infallible;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

use super::ImageError;

/// The channel that holds the heights.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Channel {
    /// The only channel there is, or all colour channels, which must agree.
    #[default]
    Luminance,
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// Alpha.
    A,
    /// A channel by its name in the file; `layer.channel` where there are layers, the number from 1 but in EXR.
    Named(String),
}

impl FromStr for Channel {
    type Err = Infallible;

    /// `luminance`, `r`, `g`, `b`, `a` in any case; everything else is a name.
    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(match text.to_ascii_lowercase().as_str() {
            "luminance" => Self::Luminance,
            "r" => Self::R,
            "g" => Self::G,
            "b" => Self::B,
            "a" => Self::A,
            _ => Self::Named(text.to_owned()),
        })
    }
}

impl fmt::Display for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Luminance => "luminance",
            Self::R => "R",
            Self::G => "G",
            Self::B => "B",
            Self::A => "A",
            Self::Named(name) => name,
        })
    }
}

/// Indices into `names`, the channels of the file at `path`: one, or for luminance those of red, green and blue.
///
/// A name fits the channel that has it in full, else the only one whose part after the last dot it is. The one
/// channel of a grey picture is its red, green and blue too.
pub(super) fn select(
    channel: &Channel,
    names: &[String],
    path: &Path,
) -> Result<Vec<usize>, ImageError> {
    let one = |index| Ok(vec![index]);
    match channel {
        Channel::Luminance => color(names, path),
        Channel::R | Channel::G | Channel::B => {
            match find(&channel.to_string(), names, path)?.or(grey(names)) {
                Some(index) => one(index),
                None => Err(missing(channel, names, path)),
            }
        }
        Channel::A | Channel::Named(_) => match find(&channel.to_string(), names, path)? {
            Some(index) => one(index),
            None => Err(missing(channel, names, path)),
        },
    }
}

/// As [`select`] for interleaved channels, which a number names too: the first is 1, as GDAL counts bands.
pub(super) fn select_band(
    channel: &Channel,
    names: &[String],
    path: &Path,
) -> Result<Vec<usize>, ImageError> {
    if let Channel::Named(name) = channel
        && let Ok(number @ 1..) = name.parse::<usize>()
        && number <= names.len()
    {
        return Ok(vec![number - 1]);
    }
    select(channel, names, path)
}

fn color(names: &[String], path: &Path) -> Result<Vec<usize>, ImageError> {
    let rgb = ["R", "G", "B"]
        .map(|name| find(name, names, path))
        .into_iter()
        .collect::<Result<Option<Vec<_>>, _>>()?;
    if let Some(rgb) = rgb {
        return Ok(rgb);
    }
    let single = match find("Y", names, path)? {
        None if names.len() == 1 => Some(0),
        found => found,
    };
    match single {
        Some(index) => Ok(vec![index]),
        None => Err(missing(&Channel::Luminance, names, path)),
    }
}

fn grey(names: &[String]) -> Option<usize> {
    // Beside chroma, luminance is no colour.
    let is_color = |name: &&String| matches!(name.as_str(), "R" | "G" | "B" | "RY" | "BY");
    match names.iter().find(is_color) {
        Some(_) => None,
        None => names.iter().position(|name| name == "Y"),
    }
}

fn find(wanted: &str, names: &[String], path: &Path) -> Result<Option<usize>, ImageError> {
    if let Some(index) = names.iter().position(|name| name == wanted) {
        return Ok(Some(index));
    }
    let fits: Vec<usize> = (0..names.len())
        .filter(|&index| names[index].rsplit('.').next() == Some(wanted))
        .collect();
    match fits[..] {
        [] => Ok(None),
        [index] => Ok(Some(index)),
        _ => Err(ImageError::AmbiguousChannel {
            path: path.to_owned(),
            wanted: wanted.to_owned(),
            found: list(fits.iter().map(|&index| &names[index])),
        }),
    }
}

fn missing(channel: &Channel, names: &[String], path: &Path) -> ImageError {
    ImageError::NoSuchChannel {
        path: path.to_owned(),
        wanted: channel.to_string(),
        found: list(names),
    }
}

/// `R, G, B`, for messages.
pub(super) fn list<'a>(names: impl IntoIterator<Item = &'a String>) -> String {
    let names: Vec<&str> = names.into_iter().map(String::as_str).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pick(channel: &str, names: &[&str]) -> Result<Vec<usize>, ImageError> {
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        let Ok(channel) = channel.parse();
        select(&channel, &names, Path::new("map.exr"))
    }

    #[test]
    fn channels_are_found_by_name() {
        assert_eq!(pick("r", &["A", "B", "G", "R"]).unwrap(), [3]);
        assert_eq!(pick("luminance", &["A", "B", "G", "R"]).unwrap(), [3, 2, 1]);
        assert_eq!(pick("Luminance", &["height"]).unwrap(), [0]);
        assert_eq!(pick("luminance", &["A", "Y"]).unwrap(), [1]);
        assert_eq!(pick("g", &["Y", "A"]).unwrap(), [0]);
        assert_eq!(pick("disp.Z", &["base.Z", "disp.Z"]).unwrap(), [1]);
        assert_eq!(pick("height", &["base.R", "disp.height"]).unwrap(), [1]);
    }

    #[test]
    fn bands_are_found_by_their_number_too() {
        let names = ["R", "G", "B", "4"].map(str::to_owned);
        let pick = |channel: &str| {
            let Ok(channel) = channel.parse();
            select_band(&channel, &names, Path::new("map.tif"))
        };
        assert_eq!(pick("1").unwrap(), [0]);
        assert_eq!(pick("4").unwrap(), [3]);
        assert_eq!(pick("g").unwrap(), [1]);
        for missing in ["0", "5", "-1"] {
            assert!(matches!(
                pick(missing),
                Err(ImageError::NoSuchChannel { .. })
            ));
        }
    }

    #[test]
    fn a_missing_channel_lists_what_there_is() {
        let error = pick("depth", &["R", "G", "B"]).unwrap_err().to_string();
        assert!(
            error.contains("depth") && error.contains("R, G, B"),
            "{error}"
        );
        assert!(matches!(
            pick("a", &["R", "G", "B"]),
            Err(ImageError::NoSuchChannel { .. })
        ));
        assert!(matches!(
            pick("luminance", &["u", "v"]),
            Err(ImageError::NoSuchChannel { .. })
        ));
    }

    #[test]
    fn a_short_name_that_fits_twice_is_refused() {
        let error = pick("Z", &["base.Z", "disp.Z"]).unwrap_err().to_string();
        assert!(error.contains("base.Z, disp.Z"), "{error}");
    }
}
