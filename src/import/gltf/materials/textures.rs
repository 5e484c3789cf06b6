//! Textures, samplers and the images behind them.
//!
//! Materials request images while they are read; all requests are then decoded in parallel, each once. Until the
//! model joins a library, a map's `ImageId` is the number of its request.

use crate::import::gltf::document::data::{Document, id_of};
use crate::import::gltf::files::uri;
use crate::import::gltf::report::{Fault, Read, Report};
use crate::import::images::channels::rgba8;
use crate::import::images::decode;
use crate::import::images::levels::{ReadImage, with_levels};
use crate::import::images::unfit::{self, Unfit};
use crate::import::progress;
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
use systems::assets::{Filter, Image, ImageId, ImageKind, Map, MipFilter, Sampler, Wrap};
use systems::ecs::parallel::map_in_parallel;

/// Texels that the images of any model may have, however small it is.
const FREE_TEXELS: u64 = unfit::MAX_TEXELS;
/// Texels per byte of encoded images, beyond that: a few kilobytes of nothing but black do not fill the memory.
const TEXELS_PER_BYTE: u64 = 64;
/// Texels that the images of a model may have, however large it is: 1.4 GB with their levels.
const MAX_TEXELS: u64 = 256 << 20;

/// Extensions whose images are drawn rather than a texture's source, the preferred first.
const OF_EXTENSIONS: [&str; 2] = ["EXT_texture_webp", "MSFT_texture_dds"];

/// The images that a texture names, the preferred first: where one cannot be decoded, the next is drawn.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Choice {
    preferred: usize,
    instead: [Option<usize>; OF_EXTENSIONS.len()],
}

impl Choice {
    fn images(self) -> impl Iterator<Item = usize> {
        std::iter::once(self.preferred).chain(self.instead.into_iter().flatten())
    }
}

/// Source of an image of the library.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Source {
    /// An image of the file, read as that kind.
    Plain(Choice, ImageKind),
    /// KHR_materials_specular: the colour of one image and the alpha of another; white where there is none.
    Specular { color: Option<Choice>, strength: Option<Choice> },
}

/// A texture as a material names it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Texture {
    pub image: Choice,
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
    let Some(image) = choice(document, &texture) else {
        let place = format!("textures[{}]", texture.index());
        report.warn(place, "no readable image: drawn without it");
        return None;
    };
    if uv_set > 1 {
        report.warn(format!("{place}.texCoord"), format!("only the first two UV sets are read, not {uv_set}"));
        uv_set = 0;
    }
    let sampler = id_of(json.sampler).map(|id| sampler(&document.json().samplers[id])).unwrap_or_default();
    Some(Texture { image, sampler, uv_set, image_from_mesh_uv })
}

/// The images that a texture names and that may be drawn: none instead of one whose extension the file requires.
fn choice(document: &Document, texture: &gltf::Texture) -> Option<Choice> {
    let of = |name: &'static str| Some((Some(name), texture.extension_value(name)?["source"].as_u64()? as usize));
    let own = (None, document.json().textures[texture.index()].source.value());
    // The crate gives an absent source the greatest index.
    let exists = |&(_, id): &(Option<&str>, usize)| id < document.gltf.images().len();
    let mut ids = Vec::new();
    for (extension, id) in OF_EXTENSIONS.into_iter().filter_map(of).chain([own]).filter(exists) {
        ids.push(document.first_alike(id));
        if extension.is_some_and(|name| document.requires(name)) {
            break;
        }
    }
    ids.dedup();
    let mut ids = ids.into_iter();
    Some(Choice { preferred: ids.next()?, instead: std::array::from_fn(|_| ids.next()) })
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

/// Image that a material asks for.
struct Request {
    source: Source,
    /// The file is refused if it cannot be decoded.
    needed: bool,
}

/// The images that the materials of a model need.
#[derive(Default)]
pub struct Images {
    requests: Vec<Request>,
    known: BTreeMap<Source, usize>,
}

impl Images {
    /// The request's number as the id that stands for the image until it is in a library. `needed`: whether the file is
    /// refused without it.
    pub fn request(&mut self, source: Source, needed: bool) -> ImageId {
        let id = *self.known.entry(source).or_insert(self.requests.len());
        match self.requests.get_mut(id) {
            Some(request) => request.needed |= needed,
            None => self.requests.push(Request { source, needed }),
        }
        ImageId::from_slot(id as u32)
    }

    /// Decodes all requests in parallel, in their order. `None` for an image that the model is drawn without: of a
    /// format that we do not know, as glTF allows them, or damaged and not needed.
    pub fn decode(&self, document: &Document, report: &mut Report) -> Vec<Option<Image>> {
        let mut encoded = BTreeMap::new();
        for id in self.requests.iter().flat_map(|request| request.source.choices()).flat_map(Choice::images) {
            encoded.entry(id).or_insert_with(|| {
                let missing = |fault| Encoded { fault: Some(fault), ..Encoded::default() };
                Encoded::new(document, id).unwrap_or_else(missing)
            });
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
                sum <= unfit::MAX_TEXELS
            });
            let end = start + fit.count().max(1);
            decoded.extend(map_in_parallel(self.requests[start..end].iter(), |request| {
                let image = request.source.decode(&encoded);
                progress::done(1);
                image
            }));
            start = end;
        }
        let decoded = decoded.into_iter().zip(&self.requests);
        decoded.map(|(decoded, request)| decoded.told(request.needed, document, &encoded, report)).collect()
    }

    /// Texels of each request by the images' headers; an error where they are too many for one model.
    fn texels(&self, encoded: &BTreeMap<usize, Encoded>) -> Read<Vec<u64>> {
        let bytes: u64 = encoded.values().map(|e| e.bytes.len() as u64).sum();
        let most = (FREE_TEXELS + bytes.saturating_mul(TEXELS_PER_BYTE)).min(MAX_TEXELS);
        let mut total = 0;
        let mut texels = vec![0; self.requests.len()];
        for (texels, request) in texels.iter_mut().zip(&self.requests) {
            for choice in request.source.choices() {
                // The largest, whichever is drawn. What cannot be read is said when it is decoded.
                let of = |e: &Encoded| decode::texels(&e.bytes, e.format).unwrap_or(0);
                let choices = choice.images().filter_map(|id| encoded.get(&id));
                let Some((largest, place)) = choices.map(|e| (of(e), &e.place)).max() else { continue };
                *texels += largest;
                if total + *texels > most {
                    let message = format!("too many texels in all: of this model's images, {most} are read");
                    return Err(Fault::unsupported(place, message));
                }
            }
            total += *texels;
        }
        Ok(texels)
    }
}

/// Says why an image is not drawn: an error, or a warning where the model is drawn without it.
fn complain(
    document: &Document,
    (id, unfit): (usize, Unfit),
    needed: bool,
    encoded: &BTreeMap<usize, Encoded>,
    report: &mut Report,
) {
    let Some(encoded) = encoded.get(&id) else { return };
    // glTF leaves other schemes and formats to the reader.
    let may_lack = match &encoded.fault {
        Some(_) => document.json().images[id].uri.as_deref().is_some_and(uri::is_remote),
        None => matches!(unfit, Unfit::UnknownFormat),
    };
    let fault = encoded.why(&unfit);
    if needed && !may_lack {
        report.error(fault);
    } else {
        report.warn(fault.place, format!("{}: drawn without it", fault.message));
    }
}

/// Checks all images against glTF's rules, and the headers of those that nothing draws.
pub fn check(document: &Document, images: &Images, report: &mut Report) {
    let used = images.requests.iter().flat_map(|request| request.source.choices());
    let used: BTreeSet<usize> = used.map(|choice| choice.preferred).collect();
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
                if let (false, Err(unfit)) = (used, decode::texels(&encoded.bytes, encoded.format)) {
                    report.fault(false, Fault::invalid(encoded.place, unfit.to_string()));
                }
            }
        }
    }
}

/// glTF itself knows PNG and JPEG; extensions add WebP and DDS.
fn check_format(document: &Document, encoded: &Encoded, report: &mut Report) {
    let Some(format) = decode::guess(&encoded.bytes, encoded.format) else { return };
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
            format!("{} is read, though glTF allows PNG and JPEG alone without an extension", unfit::name(format)),
        );
    } else if encoded.format.is_some_and(|stated| stated != format) {
        report.warn(
            &*encoded.place,
            format!("does not match its media type or name: the data is {}", unfit::name(format)),
        );
    }
}

/// An image as it lies in its file.
#[derive(Default)]
struct Encoded {
    place: String,
    name: String,
    bytes: Vec<u8>,
    /// Format by its media type or name.
    format: Option<ImageFormat>,
    /// Fault that kept its bytes from being read.
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
        decode::decode(&self.bytes, self.format)
    }

    /// Reason for which it is not drawn.
    fn why(&self, unfit: &Unfit) -> Fault {
        self.fault.clone().unwrap_or_else(|| Fault::invalid(&*self.place, unfit.to_string()))
    }
}

/// Result of a request.
#[derive(Default)]
struct Decoded {
    read: Option<ReadImage>,
    /// The images that it was made of.
    drawn: Vec<usize>,
    /// Images that could not be decoded and were replaced.
    replaced: Vec<(usize, Unfit)>,
    /// Images that could not be decoded, with nothing instead of them.
    lost: Vec<(usize, Unfit)>,
}

impl Decoded {
    fn pixels<'a>(&mut self, choice: Choice, encoded: &'a BTreeMap<usize, Encoded>) -> Option<(&'a str, DynamicImage)> {
        let mut unfit = Vec::new();
        for id in choice.images() {
            let Some(encoded) = encoded.get(&id) else { continue };
            match encoded.decode() {
                Ok(pixels) => {
                    self.drawn.push(id);
                    self.replaced.append(&mut unfit);
                    return Some((&encoded.name, pixels));
                }
                Err(why) => unfit.push((id, why)),
            }
        }
        self.lost.extend(unfit.pop());
        None
    }

    /// The image, and to the report what there is to say of it.
    fn told(
        self,
        needed: bool,
        document: &Document,
        encoded: &BTreeMap<usize, Encoded>,
        report: &mut Report,
    ) -> Option<Image> {
        for (id, unfit) in self.replaced {
            let Some(encoded) = encoded.get(&id) else { continue };
            let Fault { place, message, .. } = encoded.why(&unfit);
            report.warn(place, format!("{message}: the source beside it is drawn"));
        }
        for lost in self.lost {
            complain(document, lost, needed, encoded, report);
        }
        let read = self.read?;
        for (note, id) in read.notes.iter().flat_map(|note| self.drawn.iter().map(move |id| (note, id))) {
            report.warn(encoded.get(id).map_or("", |e| &e.place), note);
        }
        Some(read.image)
    }
}

impl Source {
    fn choices(self) -> impl Iterator<Item = Choice> {
        let (a, b) = match self {
            Self::Plain(choice, _) => (Some(choice), None),
            Self::Specular { color, strength } => (color, strength),
        };
        a.into_iter().chain(b)
    }

    fn decode(self, encoded: &BTreeMap<usize, Encoded>) -> Decoded {
        let mut decoded = Decoded::default();
        decoded.read = match self {
            Self::Plain(choice, kind) => {
                let pixels = decoded.pixels(choice, encoded);
                pixels.map(|(name, pixels)| with_levels(name, kind, pixels))
            }
            Self::Specular { color, strength } => {
                // One is drawn without the other.
                let [color, strength] = [color, strength].map(|choice| decoded.pixels(choice?, encoded));
                let name = color.as_ref().or(strength.as_ref()).map(|(name, _)| *name);
                name.map(|name| {
                    let combined = combine(color.map(|(_, pixels)| pixels), strength.map(|(_, pixels)| pixels));
                    let (width, height) = combined.dimensions();
                    let image = Image::rgba8(name, width, height, ImageKind::Color, combined.into_raw());
                    ReadImage { image, notes: Vec::new() }
                })
            }
        };
        decoded
    }
}

/// The colour of one image with the alpha of another, at the larger size.
fn combine(color: Option<DynamicImage>, strength: Option<DynamicImage>) -> RgbaImage {
    let both = [&color, &strength];
    let side = |of: fn(&DynamicImage) -> u32| both.iter().filter_map(|i| i.as_ref().map(of)).max().unwrap_or(1);
    let (width, height) = (side(DynamicImage::width), side(DynamicImage::height));
    let fit = |image: DynamicImage| {
        let image = rgba8(image);
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
