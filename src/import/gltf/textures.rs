//! Textures, samplers and the images behind them.
//!
//! Materials request images while they are read; all requests are then decoded in parallel, each once. Until the
//! model joins a library, a map's `ImageId` is the number of its request.

use super::document::{Document, id_of, uint, vec2};
use super::report::{Fault, Read, Report};
use super::shape::{declared, whole};
use crate::import::image::{self as decoder, Unfit};
use bevy_tasks::ComputeTaskPool;
use glam::{Affine2, Vec2};
use image::imageops::{self, FilterType};
use image::{DynamicImage, ImageFormat, RgbaImage};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use systems::images::{Image, ImageKind};
use systems::library::{Filter, ImageId, Map, MipFilter, Sampler, Wrap};

/// What an image of the library is made of.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Source {
    /// An image of the file, read as that kind.
    Plain(usize, ImageKind),
    /// KHR_materials_specular: the colour of one image and the alpha of another; white where there is none.
    Specular { color: Option<usize>, strength: Option<usize> },
}

/// A texture as a material names it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Texture {
    pub image: usize,
    pub sampler: Sampler,
    pub uv_set: u32,
    pub image_from_mesh_uv: Affine2,
}

impl Texture {
    pub fn map(self, image: ImageId) -> Map {
        let Self { sampler, uv_set, image_from_mesh_uv, .. } = self;
        Map { image, sampler, uv_set, image_from_mesh_uv }
    }
}

/// The texture of a `textureInfo` property; `None` where there is none that we can read.
pub fn texture(document: &Document, holder: &Value, key: &str, place: &str, report: &mut Report) -> Option<Texture> {
    let info = holder.get(key)?;
    let id = uint(info, "index");
    let texture = &document.root["textures"][id];
    let extension = |name: &str| id_of(&texture["extensions"][name], "source");
    let source =
        extension("EXT_texture_webp").or_else(|| extension("MSFT_texture_dds")).or_else(|| id_of(texture, "source"));
    let Some(image) = source else {
        report.warn(format!("textures[{id}]"), "names no image that can be read: drawn without it");
        return None;
    };
    let image = document.first_alike(image);
    let transform = &info["extensions"]["KHR_texture_transform"];
    let mut uv_set = id_of(transform, "texCoord").unwrap_or(uint(info, "texCoord"));
    if uv_set > 1 {
        report.warn(format!("{place}.{key}.texCoord"), format!("only the first two UV sets are read, not {uv_set}"));
        uv_set = 0;
    }
    let rotation = transform["rotation"].as_f64().unwrap_or(0.0) as f32;
    // Counter-clockwise as seen, with v pointing down: the negative angle in (u, v).
    let image_from_mesh_uv = Affine2::from_scale_angle_translation(
        vec2(transform, "scale", Vec2::ONE),
        -rotation,
        vec2(transform, "offset", Vec2::ZERO),
    );
    let sampler = id_of(texture, "sampler").map_or(Sampler::default(), |s| sampler(&document.root["samplers"][s]));
    Some(Texture { image, sampler, uv_set: uv_set as u32, image_from_mesh_uv })
}

fn sampler(json: &Value) -> Sampler {
    let wrap = |key: &str| match whole(&json[key]) {
        Some(33071) => Wrap::Clamp,
        Some(33648) => Wrap::Mirror,
        _ => Wrap::Repeat,
    };
    let mag = if whole(&json["magFilter"]) == Some(9728) { Filter::Nearest } else { Filter::Linear };
    let (min, mip) = match whole(&json["minFilter"]) {
        Some(9728) => (Filter::Nearest, MipFilter::None),
        Some(9729) => (Filter::Linear, MipFilter::None),
        Some(9984) => (Filter::Nearest, MipFilter::Nearest),
        Some(9985) => (Filter::Linear, MipFilter::Nearest),
        Some(9986) => (Filter::Nearest, MipFilter::Linear),
        _ => (Filter::Linear, MipFilter::Linear),
    };
    Sampler { wrap_u: wrap("wrapS"), wrap_v: wrap("wrapT"), mag, min, mip }
}

/// The images that the materials of a model need.
#[derive(Default)]
pub struct Images {
    requests: Vec<Source>,
    known: BTreeMap<Source, usize>,
}

impl Images {
    /// The request's number as the id that stands for the image until it is in a library.
    pub fn request(&mut self, source: Source) -> ImageId {
        let next = self.requests.len();
        let id = *self.known.entry(source).or_insert(next);
        if id == next {
            self.requests.push(source);
        }
        ImageId(id as u32)
    }

    /// Decodes all requests in parallel, in their order. `None` for an image of a format that we do not know, as glTF
    /// allows them: drawn as if the map were absent.
    pub fn decode(&self, document: &Document, report: &mut Report) -> Vec<Option<Image>> {
        let mut encoded = BTreeMap::new();
        for id in self.requests.iter().flat_map(|r| r.images()) {
            let bytes = encoded.entry(id).or_insert_with(|| Encoded::new(document, id));
            if let Err(fault) = bytes {
                report.error(std::mem::replace(fault, Fault::invalid("", "")));
                *bytes = Ok(Encoded::default());
            }
        }
        let encoded: BTreeMap<usize, Encoded> = encoded.into_iter().filter_map(|(id, e)| Some((id, e.ok()?))).collect();
        systems::set_threads(None);
        let decoded = ComputeTaskPool::get().scope(|scope| {
            for request in &self.requests {
                scope.spawn(async { request.decode(&encoded) });
            }
        });
        decoded
            .into_iter()
            .map(|image| image.map_err(|(id, unfit)| complain(id, &unfit, &encoded, report)).ok())
            .collect()
    }
}

fn complain(id: usize, unfit: &Unfit, encoded: &BTreeMap<usize, Encoded>, report: &mut Report) {
    let Some(Encoded { place, bytes, .. }) = encoded.get(&id) else { return };
    match unfit {
        // Its bytes could not be had, which has been said.
        _ if bytes.is_empty() && place.is_empty() => {}
        Unfit::UnknownFormat => report.warn(&**place, format!("{unfit}: drawn without it")),
        Unfit::Damaged(_) => report.invalid(&**place, unfit.to_string()),
    }
}

/// Checks all images against glTF's rules, and the headers of those that nothing draws.
pub fn check(document: &Document, images: &Images, report: &mut Report) {
    let used: BTreeSet<usize> = images.requests.iter().flat_map(|r| r.images()).collect();
    for id in 0..document.array("images").len() {
        let view = id_of(&document.root["images"][id], "bufferView");
        if view.is_some_and(|v| document.root["bufferViews"][v].get("byteStride").is_some()) {
            report.warn(format!("images[{id}].bufferView"), "the view of an image may have no byteStride");
        }
        let used = used.contains(&id);
        match Encoded::new(document, id) {
            Err(fault) if !used => report.fault(false, fault),
            Err(_) => {}
            Ok(encoded) => {
                check_format(document, &encoded, report);
                if let (false, Err(unfit)) = (used, decoder::size(&encoded.bytes, encoded.format)) {
                    report.fault(false, Fault::invalid(encoded.place, unfit.to_string()));
                }
            }
        }
    }
}

/// glTF itself knows PNG and JPEG; extensions add WebP and DDS.
fn check_format(document: &Document, encoded: &Encoded, report: &mut Report) {
    let Some(format) = decoder::guess(&encoded.bytes, encoded.format) else { return };
    let allowed = match format {
        ImageFormat::Png | ImageFormat::Jpeg => true,
        ImageFormat::WebP => declared(&document.root, "extensionsUsed", "EXT_texture_webp"),
        ImageFormat::Dds => declared(&document.root, "extensionsUsed", "MSFT_texture_dds"),
        _ => false,
    };
    if !allowed {
        report.warn(
            &*encoded.place,
            format!("{format:?} is read, though glTF allows PNG and JPEG alone without an extension"),
        );
    } else if encoded.format.is_some_and(|stated| stated != format) {
        report.warn(&*encoded.place, format!("its media type or name says otherwise, it is {format:?}"));
    }
}

/// An image as it lies in its file.
#[derive(Default)]
struct Encoded {
    place: String,
    name: String,
    bytes: Vec<u8>,
    /// What its media type or name says.
    format: Option<ImageFormat>,
}

impl Encoded {
    fn new(document: &Document, id: usize) -> Read<Self> {
        let json = &document.root["images"][id];
        let uri = json["uri"].as_str().filter(|uri| !uri.starts_with("data:"));
        let by_type = json["mimeType"].as_str().and_then(ImageFormat::from_mime_type);
        let stem = uri.and_then(|uri| Path::new(uri).file_stem()).map(|stem| stem.to_string_lossy().into_owned());
        let name = json["name"].as_str().map(str::to_owned).or(stem).unwrap_or_else(|| format!("image {id}"));
        let place = match uri {
            Some(uri) => format!("images[{id}] ({uri})"),
            None => format!("images[{id}]"),
        };
        let format = by_type.or_else(|| ImageFormat::from_path(uri?).ok());
        Ok(Self { place, name, bytes: document.image_bytes(id)?, format })
    }

    fn decode(&self) -> Result<DynamicImage, Unfit> {
        decoder::decode(&self.bytes, self.format)
    }
}

impl Source {
    fn images(self) -> impl Iterator<Item = usize> {
        let (a, b) = match self {
            Self::Plain(id, _) => (Some(id), None),
            Self::Specular { color, strength } => (color, strength),
        };
        a.into_iter().chain(b)
    }

    fn decode(self, encoded: &BTreeMap<usize, Encoded>) -> Result<Image, (usize, Unfit)> {
        let get = |id: usize| encoded.get(&id).ok_or((id, Unfit::UnknownFormat));
        let pixels = |id: usize| get(id)?.decode().map_err(|unfit| (id, unfit));
        match self {
            Self::Plain(id, kind) => Ok(decoder::with_levels(&get(id)?.name, kind, pixels(id)?)),
            Self::Specular { color, strength } => {
                let name = color.or(strength).map_or(Ok(""), |id| get(id).map(|e| e.name.as_str()))?;
                let combined = combine(color.map(pixels).transpose()?, strength.map(pixels).transpose()?);
                Ok(Image::rgba8(name, combined.width(), combined.height(), ImageKind::Color, combined.into_raw()))
            }
        }
    }
}

/// The colour of one image with the alpha of another, at the larger size.
fn combine(color: Option<DynamicImage>, strength: Option<DynamicImage>) -> RgbaImage {
    let both = [&color, &strength];
    let side = |of: fn(&DynamicImage) -> u32| both.iter().filter_map(|i| i.as_ref().map(of)).max().unwrap_or(1);
    let (width, height) = (side(DynamicImage::width), side(DynamicImage::height));
    let fit = |image: DynamicImage| {
        let image = image.into_rgba8();
        let fits = image.dimensions() == (width, height);
        if fits { image } else { imageops::resize(&image, width, height, FilterType::Triangle) }
    };
    let white = || RgbaImage::from_pixel(width, height, image::Rgba([255; 4]));
    let mut combined = color.map_or_else(white, fit);
    let strength = strength.map_or_else(white, fit);
    for (to, from) in combined.pixels_mut().zip(strength.pixels()) {
        to.0[3] = from.0[3];
    }
    combined
}
