//! Textures, samplers and the images behind them.
//!
//! Materials request images while they are read; all requests are then decoded in parallel, each once. Until the
//! model joins a library, a map's `ImageId` is the number of its request.

use super::document::{Document, id_of};
use super::report::{Fault, Read, Report};
use super::uri;
use crate::import::image::{self as decoder, Unfit};
use crate::import::{ReadImage, progress};
use glam::Affine2;
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::validation::Checked;
use gltf::texture::{MagFilter, MinFilter, WrappingMode};
use image::imageops::{self, FilterType};
use image::{DynamicImage, ImageFormat, RgbaImage};
use serde::Deserialize;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use systems::images::{Image, ImageKind};
use systems::library::{Filter, ImageId, Map, MipFilter, Sampler, Wrap};
use systems::parallel::map_in_parallel;

/// Texels that the images of any model may have, however small it is.
const FREE_TEXELS: u64 = decoder::MAX_TEXELS;
/// Texels per byte of encoded images, beyond that: a few kilobytes of nothing but black do not fill the memory.
const TEXELS_PER_BYTE: u64 = 64;
/// Texels that the images of a model may have, however large it is: 1.4 GB with their levels.
const MAX_TEXELS: u64 = 256 << 20;

/// Extensions whose images are drawn rather than a texture's source, the preferred first.
const OF_EXTENSIONS: [&str; 2] = ["EXT_texture_webp", "MSFT_texture_dds"];

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

/// A `textureInfo` property: a texture and how it is placed.
pub struct Info<'a> {
    texture: gltf::Texture<'a>,
    pub uv_set: u32,
    image_from_mesh_uv: Affine2,
}

impl<'a> From<gltf::texture::Info<'a>> for Info<'a> {
    fn from(info: gltf::texture::Info<'a>) -> Self {
        let (texture, uv_set) = (info.texture(), info.tex_coord());
        let Some(transform) = info.texture_transform() else {
            return Self { texture, uv_set, image_from_mesh_uv: Affine2::IDENTITY };
        };
        let image_from_mesh_uv = placement(transform.offset(), transform.rotation(), transform.scale());
        Self { texture, uv_set: transform.tex_coord().unwrap_or(uv_set), image_from_mesh_uv }
    }
}

impl<'a> From<gltf::material::NormalTexture<'a>> for Info<'a> {
    fn from(info: gltf::material::NormalTexture<'a>) -> Self {
        Self::untyped(info.texture(), info.tex_coord(), info.extension_value("KHR_texture_transform"))
    }
}

impl<'a> From<gltf::material::OcclusionTexture<'a>> for Info<'a> {
    fn from(info: gltf::material::OcclusionTexture<'a>) -> Self {
        Self::untyped(info.texture(), info.tex_coord(), info.extension_value("KHR_texture_transform"))
    }
}

impl<'a> Info<'a> {
    /// The crate knows the extension in plain texture infos alone.
    fn untyped(texture: gltf::Texture<'a>, uv_set: u32, transform: Option<&Value>) -> Self {
        let transform = transform.and_then(|value| TextureTransform::deserialize(value).ok()).unwrap_or_default();
        let image_from_mesh_uv = placement(transform.offset.0, transform.rotation.0, transform.scale.0);
        Self { texture, uv_set: transform.tex_coord.unwrap_or(uv_set), image_from_mesh_uv }
    }
}

/// KHR_texture_transform turns counter-clockwise as seen; with v pointing down that is the negative angle in (u, v).
fn placement(offset: [f32; 2], rotation: f32, scale: [f32; 2]) -> Affine2 {
    Affine2::from_scale_angle_translation(scale.into(), -rotation, offset.into())
}

/// The texture that a property names; `None` where there is none that we can read.
pub fn texture(document: &Document, info: Info, place: &str, report: &mut Report) -> Option<Texture> {
    let Info { texture, mut uv_set, image_from_mesh_uv } = info;
    let json = &document.json().textures[texture.index()];
    let Some((_, source)) = sources(document, &texture).into_iter().next() else {
        let place = format!("textures[{}]", texture.index());
        report.warn(place, "names no image that can be read: drawn without it");
        return None;
    };
    if uv_set > 1 {
        report.warn(format!("{place}.texCoord"), format!("only the first two UV sets are read, not {uv_set}"));
        uv_set = 0;
    }
    let sampler = id_of(json.sampler).map(|id| sampler(&document.json().samplers[id])).unwrap_or_default();
    Some(Texture { image: document.first_alike(source), sampler, uv_set, image_from_mesh_uv })
}

/// The images that a texture names, the preferred first; those of extensions with the extension.
fn sources(document: &Document, texture: &gltf::Texture) -> Vec<(Option<&'static str>, usize)> {
    let of = |name: &'static str| Some((Some(name), texture.extension_value(name)?["source"].as_u64()? as usize));
    let own = (None, document.json().textures[texture.index()].source.value());
    // The crate gives an absent source the greatest index.
    let exists = |&(_, id): &(Option<&str>, usize)| id < document.gltf.images().len();
    OF_EXTENSIONS.into_iter().filter_map(of).chain([own]).filter(exists).collect()
}

/// What is drawn where an image cannot be decoded: what the same texture names beside it. Not for an extension that the
/// file requires.
fn instead(document: &Document) -> BTreeMap<usize, usize> {
    let mut instead = BTreeMap::new();
    for texture in document.gltf.textures() {
        for pair in sources(document, &texture).windows(2) {
            let (extension, [from, to]) = (pair[0].0, [pair[0].1, pair[1].1].map(|id| document.first_alike(id)));
            let required = document.gltf.extensions_required().any(|name| Some(name) == extension);
            if !required && from != to {
                instead.entry(from).or_insert(to);
            }
        }
    }
    instead
}

fn sampler(json: &gltf::json::texture::Sampler) -> Sampler {
    let wrap = |mode| match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        _ => Wrap::Repeat,
    };
    let nearest = json.mag_filter == Some(Checked::Valid(MagFilter::Nearest));
    let (min, mip) = match json.min_filter {
        Some(Checked::Valid(MinFilter::Nearest)) => (Filter::Nearest, MipFilter::None),
        Some(Checked::Valid(MinFilter::Linear)) => (Filter::Linear, MipFilter::None),
        Some(Checked::Valid(MinFilter::NearestMipmapNearest)) => (Filter::Nearest, MipFilter::Nearest),
        Some(Checked::Valid(MinFilter::LinearMipmapNearest)) => (Filter::Linear, MipFilter::Nearest),
        Some(Checked::Valid(MinFilter::NearestMipmapLinear)) => (Filter::Nearest, MipFilter::Linear),
        _ => (Filter::Linear, MipFilter::Linear),
    };
    let mag = if nearest { Filter::Nearest } else { Filter::Linear };
    Sampler { wrap_u: wrap(json.wrap_s), wrap_v: wrap(json.wrap_t), mag, min, mip }
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
        let instead = instead(document);
        let mut encoded = BTreeMap::new();
        for mut id in self.requests.iter().flat_map(|r| r.images()) {
            // With what may be needed instead of it; the chain has no more links than there are extensions.
            for _ in 0..=OF_EXTENSIONS.len() {
                let next = instead.get(&id).copied();
                encoded.entry(id).or_insert_with(|| {
                    let missing = |fault| Encoded { fault: Some(fault), ..Encoded::default() };
                    Encoded::new(document, id).unwrap_or_else(missing)
                });
                let Some(next) = next else { break };
                id = next;
            }
        }
        let texels = match self.texels(&encoded) {
            Ok(texels) => texels,
            Err(fault) => {
                report.error(fault);
                return Vec::new();
            }
        };
        systems::set_threads(None);
        progress::expect(self.requests.len());
        let (mut decoded, mut start) = (Vec::new(), 0);
        while start < self.requests.len() {
            // At once what takes no more memory than a single image may: at least one.
            let mut sum = 0;
            let fit = texels[start..].iter().take_while(|&&texels| {
                sum += texels;
                sum <= decoder::MAX_TEXELS
            });
            let end = start + fit.count().max(1);
            decoded.extend(map_in_parallel(self.requests[start..end].iter(), |request| {
                let image = request.decode(&encoded, &instead);
                progress::done(1);
                image
            }));
            start = end;
        }
        decoded
            .into_iter()
            .zip(&self.requests)
            .map(|(read, request)| match read {
                Ok((read, left)) => {
                    for (id, unfit) in left {
                        let Some(Encoded { place, fault, .. }) = encoded.get(&id) else { continue };
                        let why = fault.as_ref().map_or((place.clone(), unfit.to_string()), |fault| {
                            (fault.place.clone(), fault.message.clone())
                        });
                        report.warn(why.0, format!("{}: the source beside it is drawn", why.1));
                    }
                    for (note, id) in read.notes.iter().flat_map(|note| request.images().map(move |id| (note, id))) {
                        report.warn(encoded.get(&id).map_or("", |e| &e.place), note);
                    }
                    Some(read.image)
                }
                Err((id, unfit)) => {
                    complain(document, id, &unfit, &encoded, report);
                    None
                }
            })
            .collect()
    }

    /// Texels of each request by the images' headers; an error where they are too many for one model.
    fn texels(&self, encoded: &BTreeMap<usize, Encoded>) -> Read<Vec<u64>> {
        let bytes: u64 = encoded.values().map(|e| e.bytes.len() as u64).sum();
        let most = (FREE_TEXELS + bytes.saturating_mul(TEXELS_PER_BYTE)).min(MAX_TEXELS);
        let mut total = 0;
        let mut texels = vec![0; self.requests.len()];
        for (texels, request) in texels.iter_mut().zip(&self.requests) {
            for encoded in request.images().filter_map(|id| encoded.get(&id)) {
                // What cannot be read is said when it is decoded.
                *texels += decoder::texels(&encoded.bytes, encoded.format).unwrap_or(0);
                if total + *texels > most {
                    let message = format!("too many texels in all: of this model's images, {most} are read");
                    return Err(Fault::unsupported(&*encoded.place, message));
                }
            }
            total += *texels;
        }
        Ok(texels)
    }
}

fn complain(document: &Document, id: usize, unfit: &Unfit, encoded: &BTreeMap<usize, Encoded>, report: &mut Report) {
    let Some(Encoded { place, fault, .. }) = encoded.get(&id) else { return };
    match (fault, unfit) {
        // glTF leaves other schemes to the reader.
        (Some(fault), _) if document.json().images[id].uri.as_deref().is_some_and(uri::is_remote) => {
            report.warn(&*fault.place, format!("{}: drawn without it", fault.message));
        }
        (Some(fault), _) => report.error(fault.clone()),
        (None, Unfit::UnknownFormat) => report.warn(&**place, format!("{unfit}: drawn without it")),
        (None, Unfit::Damaged(_)) => report.invalid(&**place, unfit.to_string()),
    }
}

/// Checks all images against glTF's rules, and the headers of those that nothing draws.
pub fn check(document: &Document, images: &Images, report: &mut Report) {
    let used: BTreeSet<usize> = images.requests.iter().flat_map(|r| r.images()).collect();
    for (id, json) in document.json().images.iter().enumerate() {
        if id_of(json.buffer_view).is_some_and(|view| document.stride(view).is_some()) {
            report.warn(format!("images[{id}].bufferView"), "the view of an image may have no byteStride");
        }
        let used = used.contains(&id);
        match Encoded::new(document, id) {
            Err(fault) if !used => report.fault(false, fault),
            Err(_) => {}
            Ok(encoded) => {
                check_format(document, &encoded, report);
                if let (false, Err(unfit)) = (used, decoder::texels(&encoded.bytes, encoded.format)) {
                    report.fault(false, Fault::invalid(encoded.place, unfit.to_string()));
                }
            }
        }
    }
}

/// glTF itself knows PNG and JPEG; extensions add WebP and DDS.
fn check_format(document: &Document, encoded: &Encoded, report: &mut Report) {
    let Some(format) = decoder::guess(&encoded.bytes, encoded.format) else { return };
    let declared = |extension: &str| document.gltf.extensions_used().any(|name| name == extension);
    let allowed = match format {
        ImageFormat::Png | ImageFormat::Jpeg => true,
        ImageFormat::WebP => declared("EXT_texture_webp"),
        ImageFormat::Dds => declared("MSFT_texture_dds"),
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
    /// Why its bytes could not be had.
    fault: Option<Fault>,
}

impl Encoded {
    fn new(document: &Document, id: usize) -> Read<Self> {
        let json = &document.json().images[id];
        let uri = json.uri.as_deref().filter(|uri| !uri.starts_with("data:"));
        let by_type = json.mime_type.as_ref().and_then(|kind| ImageFormat::from_mime_type(&kind.0));
        let stem = uri.and_then(|uri| Path::new(uri).file_stem()).map(|stem| stem.to_string_lossy().into_owned());
        let name = json.name.clone().or(stem).unwrap_or_else(|| format!("image {id}"));
        let place = match uri {
            Some(uri) => format!("images[{id}] ({uri})"),
            None => format!("images[{id}]"),
        };
        let format = by_type.or_else(|| ImageFormat::from_path(uri?).ok());
        Ok(Self { place, name, bytes: document.image_bytes(id)?, format, fault: None })
    }

    fn decode(&self) -> Result<DynamicImage, Unfit> {
        decoder::decode(&self.bytes, self.format)
    }
}

/// An image, and what could not be decoded and was replaced.
type Decoded = (ReadImage, Vec<(usize, Unfit)>);

impl Source {
    fn images(self) -> impl Iterator<Item = usize> {
        let (a, b) = match self {
            Self::Plain(id, _) => (Some(id), None),
            Self::Specular { color, strength } => (color, strength),
        };
        a.into_iter().chain(b)
    }

    /// The image, and what could not be decoded and was replaced.
    fn decode(
        self,
        encoded: &BTreeMap<usize, Encoded>,
        instead: &BTreeMap<usize, usize>,
    ) -> Result<Decoded, (usize, Unfit)> {
        let get = |id: usize| encoded.get(&id).ok_or((id, Unfit::UnknownFormat));
        let mut left = Vec::new();
        let mut pixels = |mut id: usize| loop {
            match (get(id)?.decode(), instead.get(&id)) {
                (Ok(pixels), _) => return Ok((get(id)?.name.as_str(), pixels)),
                (Err(unfit), Some(&next)) if left.len() < OF_EXTENSIONS.len() * 2 => {
                    left.push((id, unfit));
                    id = next;
                }
                (Err(unfit), _) => return Err((id, unfit)),
            }
        };
        let read = match self {
            Self::Plain(id, kind) => {
                let (name, pixels) = pixels(id)?;
                decoder::with_levels(name, kind, pixels)
            }
            Self::Specular { color, strength } => {
                let (color, strength) = (color.map(&mut pixels).transpose()?, strength.map(&mut pixels).transpose()?);
                let name = color.as_ref().or(strength.as_ref()).map_or("", |(name, _)| name);
                let combined = combine(color.map(|(_, pixels)| pixels), strength.map(|(_, pixels)| pixels));
                let (width, height) = combined.dimensions();
                let image = Image::rgba8(name, width, height, ImageKind::Color, combined.into_raw());
                ReadImage { image, notes: Vec::new() }
            }
        };
        Ok((read, left))
    }
}

/// The colour of one image with the alpha of another, at the larger size.
fn combine(color: Option<DynamicImage>, strength: Option<DynamicImage>) -> RgbaImage {
    let both = [&color, &strength];
    let side = |of: fn(&DynamicImage) -> u32| both.iter().filter_map(|i| i.as_ref().map(of)).max().unwrap_or(1);
    let (width, height) = (side(DynamicImage::width), side(DynamicImage::height));
    let fit = |image: DynamicImage| {
        let image = super::super::image::rgba8(image);
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
