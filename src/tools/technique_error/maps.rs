//! The maps that all techniques are given: one height map, and what follows from it.

use super::job::CompareJob;
use crate::demo;
use crate::import::{self, ImportError, ReadImage};
use crate::tools::maps::{
    HorizonOptions, NormalOptions, Raster, Relief, horizon_from_height, normal_from_height, offset_from_height,
};
use std::path::Path;
use systems::assets::displace::HeightMap;
use systems::assets::{Image, ImageKind, Sampler};

/// The depth that the shipped maps are made for.
const SHIPPED_SCALE: f32 = 0.06;
/// Texels along a side of a height map.
const MOST_TEXELS: u32 = 4096;

/// Images of a material.
pub(super) struct Maps {
    pub scale: f32,
    pub heights: HeightMap,
    pub height: Image,
    pub base: Option<Image>,
    pub specular: Option<Image>,
    pub normal: Image,
    pub horizon: [Image; 2],
    pub offset: Image,
    pub environment: Image,
}

/// Reads what the job names, and makes the rest.
pub(super) fn load(job: &CompareJob) -> Result<Maps, ImportError> {
    let shipped =
        |name: &str, kind| import::load_image(&demo::shipped(&format!("assets/textures/techniques_{name}")), kind);
    let scale = job.height_scale.unwrap_or(SHIPPED_SCALE);
    let path = job.height.clone().unwrap_or_else(|| demo::shipped("assets/textures/techniques_height.png"));
    let height = load_said(&path, ImageKind::Height)?;
    if height.width.max(height.height) > MOST_TEXELS {
        return Err(unfit(&path, &height, &format!("expected at most {MOST_TEXELS} texels along a side")));
    }
    let Some(heights) = HeightMap::new(&height, &Sampler::default()) else {
        return Err(unfit(&path, &height, "expected an image that is not compressed in blocks"));
    };
    let own_heights = job.height.is_some();
    let (base, specular) = match &job.base {
        Some(path) => (Some(load_said(path, ImageKind::Color)?), None),
        None if own_heights => (None, None),
        None => (Some(shipped("base.jpg", ImageKind::Color)?), Some(shipped("specular.png", ImageKind::Data)?)),
    };
    let made = own_heights || job.height_scale.is_some();
    let relief = Relief { height_scale: scale, ..Relief::default() };
    let slopes = NormalOptions { relief, ..NormalOptions::default() };
    let raster = raster(&heights);
    let normal = match &job.normal {
        Some(path) => load_said(path, ImageKind::Normal)?,
        None if made => normal_from_height(&raster, &slopes, &quiet).rgba8("normal", ImageKind::Normal),
        None => shipped("normal.png", ImageKind::Normal)?,
    };
    let (horizon, offset) = if made {
        let horizon = horizon_from_height(&raster, &HorizonOptions { relief, max_distance: None }, &quiet);
        let horizon = horizon.map(|map| map.rgba8("horizon", ImageKind::Data));
        (horizon, offset_from_height(&raster, &slopes, &quiet).rgba8("offset", ImageKind::Data))
    } else {
        let horizon = [shipped("horizon_0.png", ImageKind::Data)?, shipped("horizon_1.png", ImageKind::Data)?];
        (horizon, shipped("offset.png", ImageKind::Data)?)
    };
    let environment = shipped("environment.jpg", ImageKind::Color)?;
    Ok(Maps { scale, heights, height, base, specular, normal, horizon, offset, environment })
}

/// An image that the job names: what is corrected in it, or hardly as meant, is said.
fn load_said(path: &Path, kind: ImageKind) -> Result<Image, ImportError> {
    let ReadImage { image, notes } = import::read_image(path, kind)?;
    notes.iter().for_each(|note| tracing::warn!("{}: {note}", path.display()));
    Ok(image)
}

fn unfit(path: &Path, image: &Image, message: &str) -> ImportError {
    let message = format!("the height map has {}×{} texels; {message}", image.width, image.height);
    ImportError::Invalid { path: path.to_owned(), place: "size".into(), message }
}

/// The heights as the map tools take them.
fn raster(heights: &HeightMap) -> Raster {
    let (width, height) = heights.size();
    let texels = (0..width * height).map(|i| heights.texel((i % width) as i64, (i / width) as i64));
    Raster { width, height, channels: 1, values: texels.collect() }
}

fn quiet(_: usize, _: usize) {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn what_is_made_of_an_image_is_said() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let said = |name: &str, kind, texel: &dyn Fn(u8) -> [u8; 3]| {
            let path = folder.path().join(name);
            let image = image::RgbImage::from_fn(4, 1, |x, _| image::Rgb(texel(x as u8)));
            image.save(&path).expect("a file");
            let (said, writer) = std::io::pipe().expect("a pipe");
            let subscriber = tracing_subscriber::fmt().with_writer(Arc::new(writer)).with_ansi(false).finish();
            tracing::subscriber::with_default(subscriber, || load_said(&path, kind)).expect("an image");
            std::io::read_to_string(said).expect("text")
        };
        let lean = |x: u8| 128 + 20 * x;
        let two = said("two.png", ImageKind::Normal, &|x| [lean(x), 128, 0]);
        assert!(two.contains("WARN") && two.contains("two.png: has no z in blue"), "{two}");
        let coloured = said("coloured.png", ImageKind::Height, &|x| [x, 9, 90]);
        assert!(coloured.contains("coloured.png: is not a grey image"), "{coloured}");
        assert_eq!(said("flat.png", ImageKind::Normal, &|_| [128, 128, 255]), "");
    }
}
