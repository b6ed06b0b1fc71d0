//! Options of the picture: size, samples, filter, what is kept, how it is shown.

use clap::value_parser;

use super::error::CliError;
use super::heading::{PARTS, PICTURE, QUALITY};
use super::parse::{self, Limit, Size};
use crate::scene::{Adaptive, AovSet, Film, Filter, FilterShape, MAX_SPP, ToneCurve, Window, fits};

/// What is taken instead of the scene's film settings.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct FilmArgs {
    /// Width and height in pixels, instead of the scene's
    #[arg(long, value_name = "WxH", value_parser = parse::size, help_heading = PICTURE)]
    pub size: Option<Size>,
    /// Part of the picture to render: columns x0 to x1 - 1 of rows y0 to y1 - 1, from the top left
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = parse::window, help_heading = PARTS)]
    pub crop: Option<Window>,
    /// Samples per pixel, instead of the scene's
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=i64::from(MAX_SPP)), help_heading = QUALITY)]
    pub spp: Option<u32>,
    /// Seed of all randomness, instead of the scene's
    #[arg(long, value_name = "N", help_heading = QUALITY)]
    pub seed: Option<u32>,
    /// Reconstruction filter, instead of the scene's
    #[arg(long, value_name = "SHAPE", value_parser = parse::word(FilterShape::NAMES), help_heading = QUALITY)]
    pub filter: Option<FilterShape>,
    /// Half the filter's width in pixels [default: the scene's, or what is usual for --filter]
    #[arg(long, value_name = "PIXELS", value_parser = parse::filter_radius, help_heading = QUALITY)]
    pub filter_radius: Option<f32>,
    /// Scale samples down whose largest component is above this; "off" leaves them
    #[arg(long, value_name = "RADIANCE", value_parser = parse::limit, help_heading = QUALITY)]
    pub clamp: Option<Limit>,
    /// End pixels early whose error is below this, like 0.02; "off" gives all the same samples
    #[arg(long, value_name = "ERROR", value_parser = parse::limit, help_heading = QUALITY)]
    pub adaptive_threshold: Option<Limit>,
    /// Samples before a pixel may end, and between two looks [default: the scene's, or 16]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(2..=i64::from(MAX_SPP)), help_heading = QUALITY)]
    pub adaptive_min_spp: Option<u32>,
    /// Take samples in passes over the whole picture, and write the picture after each
    #[arg(long, help_heading = QUALITY)]
    pub progressive: bool,
    /// What EXR files hold beside the picture: names with commas between, "all" or "none"
    #[arg(long, value_name = "NAMES", value_parser = parse::aovs, help_heading = PICTURE)]
    pub aovs: Option<AovSet>,
    #[command(flatten)]
    pub tone: ToneArgs,
}

/// How PNG files show radiance.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct ToneArgs {
    /// Stops brighter, for PNG files
    #[arg(long, value_name = "STOPS", value_parser = parse::stops, allow_negative_numbers = true, help_heading = PICTURE)]
    pub exposure: Option<f32>,
    /// Tone curve of PNG files
    #[arg(long, value_name = "CURVE", value_parser = parse::word(ToneCurve::NAMES), help_heading = PICTURE)]
    pub tone: Option<ToneCurve>,
}

impl FilmArgs {
    /// What is said here wins over `film`.
    pub fn apply(&self, film: &mut Film) -> Result<(), CliError> {
        if let Some(Size { width, height }) = self.size {
            (film.width, film.height) = (width, height);
        }
        film.crop = self.crop.or(film.crop);
        let whole = Window::whole(film.width, film.height);
        if let Some(crop) = film.crop.filter(|crop| !fits(crop, &whole)) {
            let (width, height) = (film.width, film.height);
            return Err(CliError::Usage(format!(
                "the crop window {crop} is not inside of {width}x{height}; expected x0,y0,x1,y1 with \
                 0 <= x0 < x1 <= {width} and 0 <= y0 < y1 <= {height} (--crop, --size)"
            )));
        }
        film.spp = self.spp.unwrap_or(film.spp);
        film.seed = self.seed.unwrap_or(film.seed);
        film.filter = self.filter.map_or(film.filter, Filter::of);
        film.filter.radius = self.filter_radius.unwrap_or(film.filter.radius);
        film.clamp = self.clamp.map_or(film.clamp, |Limit(most)| most);
        self.apply_adaptive(film);
        film.progressive |= self.progressive;
        film.aovs = self.aovs.unwrap_or(film.aovs);
        self.tone.apply(film);
        Ok(())
    }

    fn apply_adaptive(&self, film: &mut Film) {
        let scene = film.adaptive;
        let threshold = match self.adaptive_threshold {
            Some(Limit(threshold)) => threshold,
            None => scene.map(|adaptive| adaptive.threshold),
        };
        let min_spp = self
            .adaptive_min_spp
            .or(scene.map(|adaptive| adaptive.min_spp));
        film.adaptive = threshold.map(|threshold| Adaptive {
            threshold,
            min_spp: min_spp.unwrap_or(Adaptive::USUAL_MIN_SPP),
        });
    }
}

impl ToneArgs {
    /// What is said here wins over `film`.
    pub fn apply(&self, film: &mut Film) {
        film.exposure = self.exposure.unwrap_or(film.exposure);
        film.tone = self.tone.unwrap_or(film.tone);
    }
}
