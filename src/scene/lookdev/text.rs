//! The scene as the text of a scene file, with comments for who goes on from there.

use std::fmt::Write;
use std::path::Path;

use glam::{Vec2, Vec3};

use super::error::LookdevError;
use super::scale::Scale;
use super::value::{float, near, point, quoted, relative, uv, word, wrap};
use super::view::Framing;
use super::{Amount, Light, Lookdev};
use crate::prism::{EditBounds, Lod, March, PrismOptions, Step};
use crate::scene::file::TEXCOORDS;
use crate::scene::{Aov, Film, FilterShape, Integrator, ToneCurve};
use crate::surface::Wrap;

/// The vertical field of view, degrees.
const FOV: f32 = 35.0;
/// The floor's own side is twice this, in diagonals of the mesh: its far edge is lost in the haze.
const FLOOR: f32 = 100.0;
/// The floor is below what stands on it by this, in diagonals.
const GAP: f32 = 1e-3;
/// Between where a mesh is looked at from and its sun, degrees: light from the left shows relief.
const SUN_ASIDE: f32 = -60.0;

/// What is found out about the mesh, or stands in for it in the draft.
pub(super) struct Numbers {
    pub scale: Scale,
    /// None: the loader's framing.
    pub framing: Option<Framing>,
    /// The mesh's diagonal as it stands, world units.
    pub size: f32,
    /// The middle of the displaced mesh's lowest side.
    pub foot: Vec3,
    /// Where the view is from without orbit, degrees: light stays while the camera goes around.
    pub azimuth: f32,
    /// Every part of the mesh has a material of the file.
    pub has_materials: bool,
    pub film: Film,
    pub integrator: Integrator,
    pub prisms: PrismOptions,
}

/// The scene file, for the folder that it will be in.
pub(super) fn scene(
    request: &Lookdev,
    numbers: &Numbers,
    folder: Option<&Path>,
) -> Result<String, LookdevError> {
    let mut text = Text {
        out: String::new(),
        folder,
    };
    text.head(request);
    text.camera(request, numbers);
    text.film(&numbers.film);
    text.integrator(&numbers.integrator);
    text.mesh(request, numbers)?;
    text.material(request, numbers)?;
    text.light(request, numbers)?;
    if request.floor {
        text.floor(numbers);
    }
    Ok(text.out)
}

/// Whether files of this kind may have lights: what is here for a first look has its own.
fn brings_lights(mesh: &Path) -> bool {
    let ending = mesh.extension().unwrap_or_default();
    ending.eq_ignore_ascii_case("gltf") || ending.eq_ignore_ascii_case("glb")
}

struct Text<'a> {
    out: String,
    folder: Option<&'a Path>,
}

impl Text<'_> {
    fn line(&mut self, line: impl AsRef<str>) {
        self.out += line.as_ref();
        self.out += "\n";
    }

    fn key(&mut self, key: &str, value: impl std::fmt::Display) {
        // Writing to a string does not fail.
        let _ = writeln!(self.out, "{key} = {value}");
    }

    /// A path as a scene in the folder names it.
    fn path(&self, path: &Path) -> Result<String, LookdevError> {
        let path = match self.folder {
            Some(folder) => relative(path, folder),
            None => path.to_owned(),
        };
        match path.to_str() {
            Some(text) => Ok(quoted(text)),
            None => Err(LookdevError::Name { path }),
        }
    }

    fn head(&mut self, request: &Lookdev) {
        let name = |path: &Path| {
            let name = path.file_name().unwrap_or(path.as_os_str());
            name.to_string_lossy().replace(char::is_control, " ")
        };
        let mesh = name(&request.mesh);
        let what = match &request.maps.displacement {
            Some(map) => format!("{mesh}, displaced by {}", name(map)),
            None => mesh,
        };
        self.line(format!("# {what}."));
        self.line("# Made by `prismarch render`; docs/scene.md has every key. Lengths are world units, angles degrees, +Y is up.");
    }

    fn camera(&mut self, request: &Lookdev, numbers: &Numbers) {
        let view = request.view.name();
        self.line(format!(
            "\n# The {view} view; without position and target the whole scene is framed."
        ));
        self.line("[camera]");
        if let Some(framing) = &numbers.framing {
            self.key("position", point(framing.position, numbers.size));
            self.key("target", point(framing.target, numbers.size));
            let view = (framing.target - framing.position).normalize_or_zero();
            // Looked at from above or below: nothing upright is left.
            if view.y.abs() > 0.99 {
                self.key("up", point(framing.up, 1.0));
            }
        }
        self.key("fov", float(FOV));
    }

    /// What differs from the usual film, and what one changes first.
    fn film(&mut self, film: &Film) {
        let usual = Film::default();
        self.line("\n# The picture: more samples per pixel (spp), less noise.");
        self.line("[film]");
        self.key("width", film.width);
        self.key("height", film.height);
        self.key("spp", film.spp);
        if let Some(crop) = film.crop {
            self.key("crop", format!("[{crop}]"));
        }
        if film.seed != usual.seed {
            self.key("seed", film.seed);
        }
        if film.filter != usual.filter {
            self.key("filter", word(FilterShape::NAMES, film.filter.shape));
            self.key("filter_radius", float(film.filter.radius));
        }
        if let Some(clamp) = film.clamp {
            self.key("clamp", float(clamp));
        }
        if let Some(adaptive) = film.adaptive {
            self.key("adaptive_threshold", float(adaptive.threshold));
            self.key("adaptive_min_spp", adaptive.min_spp);
        }
        if film.progressive {
            self.key("progressive", true);
        }
        if film.aovs != usual.aovs {
            let aovs = Aov::NAMES.iter().filter(|(_, aov)| film.aovs.has(*aov));
            let aovs: Vec<String> = aovs.map(|(name, _)| quoted(name)).collect();
            self.key("aovs", format!("[{}]", aovs.join(", ")));
        }
        if film.exposure != usual.exposure {
            self.key("exposure", float(film.exposure));
        }
        if film.tone != usual.tone {
            self.key("tone", word(ToneCurve::NAMES, film.tone));
        }
    }

    fn integrator(&mut self, integrator: &Integrator) {
        self.line("\n# \"beauty\" is quick, \"path\" has light from surface to surface.");
        self.line("[integrator]");
        self.key("type", quoted(integrator.name()));
    }

    fn mesh(&mut self, request: &Lookdev, numbers: &Numbers) -> Result<(), LookdevError> {
        self.line("\n# The mesh.");
        self.line("[[mesh]]");
        let file = self.path(&request.mesh)?;
        self.key("file", file);
        if let Some(up) = &request.up {
            self.key("up", quoted(up));
        }
        if let Some(unit) = &request.unit {
            match unit.parse::<f32>() {
                Ok(number) => self.key("unit", float(number)),
                Err(_) => self.key("unit", quoted(unit)),
            }
        }
        if brings_lights(&request.mesh) {
            self.key(
                "lights",
                "\"ignore\"  # \"file\": those that the file brings",
            );
        }
        if let Some(levels) = request.subdivide {
            self.key("subdivide", levels);
        }
        if request.smooth_normals {
            self.key("normals", quoted("smooth"));
        }
        if let Some(projection) = request.texcoords {
            self.key("texcoords", word(&TEXCOORDS, Some(projection)));
        }
        if self.has_own_material(request, numbers) {
            self.key("material", quoted("surface"));
        }
        let Some(map) = &request.maps.displacement else {
            return Ok(());
        };
        self.line(
            "\n# Its relief: the surface is moved along its normals by scale * (height - midlevel).",
        );
        self.line("[mesh.displacement]");
        let map = self.path(map)?;
        self.key("map", map);
        if let Some(channel) = &request.channel {
            self.key("channel", quoted(channel));
        }
        let Scale {
            scale,
            midlevel,
            why,
        } = &numbers.scale;
        let guessed = why.as_ref().map_or(String::new(), |why| format!("; {why}"));
        self.key(
            "scale",
            format!("{}  # from height 0 to height 1{guessed}", float(*scale)),
        );
        self.key(
            "midlevel",
            format!("{}  # the height that stays on the mesh", float(*midlevel)),
        );
        if request.wrap != Wrap::default() {
            self.key("wrap", quoted(wrap(request.wrap)));
        }
        if let Some(nodata) = request.nodata {
            self.key("nodata", float(nodata));
        }
        if request.uv_scale != Vec2::ONE {
            self.key("uv", uv(request.uv_scale));
        }
        self.prisms(&numbers.prisms);
        Ok(())
    }

    /// How it is traced, where that is not as usual.
    fn prisms(&mut self, prisms: &PrismOptions) {
        if let March::Uniform { step, jitter } = prisms.march {
            self.key("march", quoted("uniform"));
            match step {
                Step::Texels(texels) => self.key("dt", float(texels)),
                Step::World(length) => self.key("dt_world", float(length)),
            }
            if jitter {
                self.key("jitter", true);
            }
        }
        if prisms.lod != Lod::default() {
            self.key("lod", quoted(prisms.lod.name()));
        }
        if prisms.edit_bounds != EditBounds::default() {
            self.key("edit_bounds", quoted(prisms.edit_bounds.name()));
        }
    }

    fn has_own_material(&self, request: &Lookdev, numbers: &Numbers) -> bool {
        request.maps.has_look() || !numbers.has_materials
    }

    fn material(&mut self, request: &Lookdev, numbers: &Numbers) -> Result<(), LookdevError> {
        if !self.has_own_material(request, numbers) {
            return Ok(());
        }
        self.line("\n# What it is made of.");
        self.line("[[material]]");
        self.key("name", quoted("surface"));
        let maps = &request.maps;
        let color = match &maps.base_color {
            Some(file) => self.texture(request, file)?,
            None => "[0.5, 0.5, 0.5]".into(),
        };
        self.key("base_color", color);
        let roughness = self.amount(request, &maps.roughness, 0.8)?;
        self.key("roughness", roughness);
        let metallic = self.amount(request, &maps.metallic, 0.0)?;
        self.key("metallic", metallic);
        if let Some(file) = &maps.normal_map {
            let map = self.texture(request, file)?;
            self.key("normal_map", map);
        }
        Ok(())
    }

    fn amount(
        &self,
        request: &Lookdev,
        amount: &Option<Amount>,
        usual: f32,
    ) -> Result<String, LookdevError> {
        match amount {
            None => Ok(float(usual)),
            Some(Amount::Number(number)) => Ok(float(*number)),
            Some(Amount::File(file)) => self.texture(request, file),
        }
    }

    /// A picture laid on like the displacement map.
    fn texture(&self, request: &Lookdev, file: &Path) -> Result<String, LookdevError> {
        let mut table = format!("{{ file = {}", self.path(file)?);
        if request.wrap != Wrap::default() {
            table += &format!(", wrap = {}", quoted(wrap(request.wrap)));
        }
        if request.uv_scale != Vec2::ONE {
            table += &format!(", uv = {}", uv(request.uv_scale));
        }
        Ok(table + " }")
    }

    fn light(&mut self, request: &Lookdev, numbers: &Numbers) -> Result<(), LookdevError> {
        match &request.light {
            Light::Daylight => {
                let azimuth = numbers.azimuth + SUN_ASIDE;
                let azimuth = azimuth - 360.0 * (azimuth / 360.0).round();
                self.line("\n# A sun, from the left of the view, and the sky around it.");
                self.line("[[light]]");
                self.key("type", quoted("sun"));
                self.key("elevation", "35.0");
                let azimuth = format!("{}  # from +Z towards +X", near(azimuth, 1e3));
                self.key("azimuth", azimuth);
                self.line("\n[[light]]");
                self.key("type", quoted("sky"));
            }
            Light::Environment(file) => {
                self.line("\n# A picture of light from all around.");
                self.line("[[light]]");
                self.key("type", quoted("environment"));
                let file = self.path(file)?;
                self.key("file", file);
                self.key("rotate", "0.0  # about +Y");
                self.key("strength", "1.0");
            }
        }
        Ok(())
    }

    fn floor(&mut self, numbers: &Numbers) {
        let Numbers { foot, size, .. } = *numbers;
        self.line("\n# The floor: a square of side 2, scaled.");
        self.line("[[mesh]]");
        self.key("name", quoted("floor"));
        self.key("shape", quoted("plane"));
        self.key("material", quoted("floor"));
        let place = point(foot - Vec3::new(0.0, GAP * size, 0.0), size);
        let scale = near(FLOOR * size, size);
        let transform = format!("{{ translate = {place}, scale = {scale} }}");
        self.key("transform", transform);
        self.line("\n[[material]]");
        self.key("name", quoted("floor"));
        self.key("base_color", "[0.3, 0.3, 0.3]");
        self.key("roughness", "0.9");
    }
}
