//! The picture as asked for: size and part of it, samples, filter, and what is kept beside radiance.

use std::fmt;

use glam::UVec2;

/// How linear radiance becomes an 8-bit picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// A filmic shoulder and toe per channel, then sRGB.
    #[default]
    Filmic,
    /// A sigmoid over stops; bright colours fade to white instead of changing hue, then sRGB.
    Agx,
    /// sRGB only, clipped.
    Standard,
}

impl ToneCurve {
    /// Every curve under the name that scene files and options have for it.
    pub const NAMES: &'static [(&'static str, Self)] = &[
        ("filmic", Self::Filmic),
        ("agx", Self::Agx),
        ("standard", Self::Standard),
    ];
}

/// The shape of the reconstruction filter, the same across and down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FilterShape {
    /// Constant.
    Box,
    /// Falls linearly to 0.
    Triangle,
    /// A Gaussian of standard deviation radius / 3, lowered so that it ends at 0.
    Gaussian,
    /// Mitchell and Netravali's cubic with B = C = 1/3: sharp, with negative lobes.
    Mitchell,
    /// The four-term Blackman-Harris window: nearly a Gaussian.
    #[default]
    BlackmanHarris,
}

impl FilterShape {
    /// Every shape under the name that scene files and options have for it.
    pub const NAMES: &'static [(&'static str, Self)] = &[
        ("box", Self::Box),
        ("triangle", Self::Triangle),
        ("gaussian", Self::Gaussian),
        ("mitchell", Self::Mitchell),
        ("blackman-harris", Self::BlackmanHarris),
    ];

    /// Half the usual width, in pixels.
    pub fn usual_radius(self) -> f32 {
        match self {
            Self::Box => 0.5,
            Self::Triangle => 1.0,
            Self::Gaussian | Self::BlackmanHarris => 1.5,
            Self::Mitchell => 2.0,
        }
    }
}

/// The reconstruction filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    /// Its shape.
    pub shape: FilterShape,
    /// Half its width in pixels, above 0.
    pub radius: f32,
}

impl Filter {
    /// The radii a filter may have.
    pub const RADII: std::ops::RangeInclusive<f32> = 0.01..=16.0;

    /// `shape` at its usual width.
    pub fn of(shape: FilterShape) -> Self {
        Self {
            shape,
            radius: shape.usual_radius(),
        }
    }
}

impl Default for Filter {
    /// Blackman-Harris, 1.5 pixels.
    fn default() -> Self {
        Self::of(FilterShape::default())
    }
}

/// When a pixel has had samples enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive {
    /// The error to reach: the standard errors of the means of R, G and B, summed, over the square root of the sum of these means.
    pub threshold: f32,
    /// Samples before the first look, and between two looks; at least 2.
    pub min_spp: u32,
}

impl Adaptive {
    /// Samples between two looks where nothing else is said.
    pub const USUAL_MIN_SPP: u32 = 16;
}

/// A rectangle of pixels; (0, 0) is the top left one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Window {
    /// Top left pixel.
    pub start: UVec2,
    /// One past the bottom right pixel.
    pub end: UVec2,
}

impl Window {
    /// All of a picture of this size.
    pub fn whole(width: u32, height: u32) -> Self {
        Self {
            start: UVec2::ZERO,
            end: UVec2::new(width, height),
        }
    }

    /// Pixels across and down; 0 for a window that ends where it starts or before.
    pub fn size(&self) -> UVec2 {
        self.end.saturating_sub(self.start)
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        let size = self.size();
        size.x as usize * size.y as usize
    }

    /// Index of `pixel`, row by row from the top, if it is inside.
    pub fn index(&self, pixel: UVec2) -> Option<usize> {
        let inside = pixel.cmpge(self.start).all() && pixel.cmplt(self.end).all();
        let at = pixel.wrapping_sub(self.start);
        inside.then(|| at.y as usize * self.size().x as usize + at.x as usize)
    }

    /// What both cover; empty if nothing.
    pub fn intersection(&self, other: &Self) -> Self {
        let start = self.start.max(other.start);
        Self {
            start,
            end: self.end.min(other.end).max(start),
        }
    }

    /// The smallest window around both.
    pub fn union(&self, other: &Self) -> Self {
        Self {
            start: self.start.min(other.start),
            end: self.end.max(other.end),
        }
    }
}

/// `x0,y0,x1,y1`.
impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { start, end } = self;
        write!(f, "{},{},{},{}", start.x, start.y, end.x, end.y)
    }
}

/// What an EXR file holds beside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// `albedo.R` `.G` `.B`: what the surface reflects of white light from all around.
    Albedo,
    /// `N.X` `.Y` `.Z`: unit shading normal in world space.
    Normal,
    /// `P.X` `.Y` `.Z`: the displaced point in world space.
    Position,
    /// `Z`: depth along the view.
    Depth,
    /// `UV.U` `.V`: texture coordinates of the mesh.
    Uv,
    /// `displacement`: signed, in the object's units.
    Displacement,
    /// `CryptoObject00.R` ...: objects by name and coverage, Cryptomatte 1.2.
    Object,
    /// `prim`: base triangle of the first sample that hit anything.
    Prim,
    /// `variance.R` `.G` `.B`: variance of one sample.
    Variance,
    /// `cost`: steps of the march. Not to be asked for: pictures of the [cost view](super::View::Cost) have it, and no others.
    Cost,
}

impl Aov {
    /// Every AOV that can be asked for, under the name that scene files and options have for it.
    pub const NAMES: &'static [(&'static str, Self)] = &[
        ("albedo", Self::Albedo),
        ("N", Self::Normal),
        ("P", Self::Position),
        ("Z", Self::Depth),
        ("UV", Self::Uv),
        ("displacement", Self::Displacement),
        ("object", Self::Object),
        ("prim", Self::Prim),
        ("variance", Self::Variance),
    ];

    /// The name of the one that cannot.
    const COST: (&'static str, Self) = ("cost", Self::Cost);
}

/// A set of AOVs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AovSet(u16);

impl AovSet {
    /// None.
    pub const NONE: Self = Self(0);

    /// All that can be asked for.
    pub const ALL: Self = Self((1 << Aov::NAMES.len()) - 1);

    /// With one more.
    pub const fn with(self, aov: Aov) -> Self {
        Self(self.0 | 1 << aov as u16)
    }

    /// Whether it is one of them.
    pub const fn has(self, aov: Aov) -> bool {
        self.0 >> aov as u16 & 1 == 1
    }

    /// The set that is displayed like this, if any is.
    pub(crate) fn parse(names: &str) -> Option<Self> {
        let known = |name: &str| Self::named().find(|(known, _)| *known == name);
        let aovs = names.split_ascii_whitespace();
        aovs.map(|name| Some(known(name)?.1)).collect()
    }

    fn named() -> impl Iterator<Item = (&'static str, Aov)> {
        Aov::NAMES.iter().copied().chain([Aov::COST])
    }
}

/// Their names, with spaces between.
impl fmt::Display for AovSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let aovs = Self::named().filter(|(_, aov)| self.has(*aov));
        let names: Vec<&str> = aovs.map(|(name, _)| name).collect();
        f.write_str(&names.join(" "))
    }
}

impl FromIterator<Aov> for AovSet {
    fn from_iter<I: IntoIterator<Item = Aov>>(aovs: I) -> Self {
        aovs.into_iter().fold(Self::NONE, Self::with)
    }
}

/// Size and sampling of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// The part that is rendered, inside the picture and not empty; `None` for all of it.
    pub crop: Option<Window>,
    /// Samples per pixel, at least 1; the most of them where sampling is adaptive.
    pub spp: u32,
    /// Seed of all randomness.
    pub seed: u32,
    /// Weighs what lands beside a pixel's centre.
    pub filter: Filter,
    /// A sample whose largest component is above this is scaled down to it; `None` leaves all as they are.
    pub clamp: Option<f32>,
    /// Ends pixels that have converged before they have had all samples; `None` gives every pixel the same.
    pub adaptive: Option<Adaptive>,
    /// Whether samples are taken in passes over the whole picture, each as long as all before.
    pub progressive: bool,
    /// What EXR files hold beside the picture.
    pub aovs: AovSet,
    /// Stops: radiance is multiplied by 2^exposure. For PNG; EXR stays as it is.
    pub exposure: f32,
    /// For PNG; EXR stays linear.
    pub tone: ToneCurve,
}

impl Film {
    /// The pixels that are rendered.
    pub fn window(&self) -> Window {
        self.crop
            .unwrap_or_else(|| Window::whole(self.width, self.height))
    }
}

impl Default for Film {
    /// 640x480, 16 samples per pixel, filmic.
    fn default() -> Self {
        Self {
            width: 640,
            height: 480,
            crop: None,
            spp: 16,
            seed: 0,
            filter: Filter::default(),
            clamp: None,
            adaptive: None,
            progressive: false,
            aovs: AovSet::ALL,
            exposure: 0.0,
            tone: ToneCurve::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_counts_its_pixels_from_the_top_left() {
        let window = Window {
            start: UVec2::new(2, 3),
            end: UVec2::new(5, 5),
        };
        assert_eq!(window.to_string(), "2,3,5,5");
        assert_eq!(window.pixels(), 6);
        assert_eq!(window.index(UVec2::new(2, 3)), Some(0));
        assert_eq!(window.index(UVec2::new(3, 4)), Some(4));
        for outside in [UVec2::new(1, 3), UVec2::new(5, 3), UVec2::new(2, 5)] {
            assert_eq!(window.index(outside), None);
        }
        let apart = window.intersection(&Window::whole(1, 9));
        assert_eq!(apart.pixels(), 0);
        assert_eq!(Window::whole(1, 1).union(&window), Window::whole(5, 5));
    }

    #[test]
    fn sets_are_read_as_they_are_shown() {
        for set in [
            AovSet::NONE,
            AovSet::ALL,
            AovSet::ALL.with(Aov::Cost),
            AovSet::NONE.with(Aov::Cost),
        ] {
            assert_eq!(AovSet::parse(&set.to_string()), Some(set));
        }
        assert_eq!(AovSet::parse("N speed"), None);
        assert!(!AovSet::ALL.has(Aov::Cost));
    }

    #[test]
    fn the_set_of_all_has_every_aov_and_none_has_none() {
        for &(_, aov) in Aov::NAMES {
            assert!(AovSet::ALL.has(aov) && !AovSet::NONE.has(aov));
            assert_eq!(
                [aov].into_iter().collect::<AovSet>(),
                AovSet::NONE.with(aov)
            );
        }
    }
}
