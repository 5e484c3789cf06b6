//! A scene once for each of its mesh variants, and all of these on one sheet: `relief gallery`.

use crate::frames::{self, Headless};
use crate::output;
use crate::renderer::Occlusion;
use crate::session::{LoadOptions, Session};
use crate::tools::error::ToolError;
use image::RgbImage;
use image::buffer::ConvertBuffer;
use image::imageops::{self, FilterType};
use std::path::PathBuf;
use systems::assets::{Library, MeshVariants};
use systems::run::inputs;
use systems::run::inputs::Inputs;
use systems::run::standard_inputs::NextMeshVariant;

/// Pixels along the longer side of the sheet.
const LONGEST_SHEET: u32 = 2560;
/// Pixels between the pictures on the sheet.
const GAP: u32 = 8;
/// The sheet's own name.
const SHEET: &str = "gallery";

/// Settings of a gallery.
#[derive(Clone, Debug)]
pub struct GalleryJob {
    /// A scene with mesh variants.
    pub scene: PathBuf,
    /// Options of loading the scene.
    pub load: LoadOptions,
    /// Folder for the pictures; made if missing.
    pub folder: PathBuf,
    /// Pixels of each picture.
    pub size: (u32, u32),
    /// Steps of the clock before the pictures.
    pub frame: u64,
}

/// Draws the pictures of a gallery and then the sheet; `progress` is called after each picture with how many are done,
/// and of how many. Returns the files written.
///
/// # Errors
/// [`ToolError`], [`ToolError::NoMeshVariants`] for a scene without mesh variants; pictures written before stay.
pub fn render(job: &GalleryJob, mut progress: impl FnMut(u64, u64)) -> Result<Vec<PathBuf>, ToolError> {
    let mut stage = frames::load_session(&job.scene, None, &job.load)?;
    let world = &mut stage.simulation.world;
    let mut figures = world.query::<&MeshVariants>();
    let longest = figures.iter(world).max_by_key(|figure| figure.meshes.len()).cloned();
    let Some(MeshVariants { meshes, .. }) = longest else {
        return Err(ToolError::NoMeshVariants { scene: job.scene.clone() });
    };
    let library = world.resource::<Library>();
    let names = meshes.iter().map(|&mesh| library.mesh(mesh).map_or("", |entry| entry.mesh.name.as_str()));
    let names = file_names(names);
    let picture = |name: &str| job.folder.join(name).with_added_extension("png");
    let pictures: Vec<PathBuf> = names.iter().map(String::as_str).chain([SHEET]).map(picture).collect();
    frames::check_outputs(&stage.scene.files, |path| pictures.iter().any(|picture| output::is_same(path, picture)))?;
    let Session { mut simulation, viewpoint, .. } = stage;

    let mut headless = Headless::new()?;
    output::make_folder(&job.folder)?;
    output::check_writable(&job.folder)?;
    // As in all frames that are written.
    headless.settings.occlusion = Occlusion::Off;
    for _ in 0..job.frame {
        simulation.step();
    }
    let mut sheet = Sheet::new(job.size, names.len());
    let mut written = Vec::new();
    for name in &names {
        let drawn: RgbImage = headless.draw(&mut simulation, viewpoint, job.size)?.convert();
        sheet.add(&drawn);
        let path = picture(name);
        output::write_png(&path, &drawn.into())?;
        written.push(path);
        progress(written.len() as u64, names.len() as u64);
        simulation.world.resource_mut::<Inputs>().push(NextMeshVariant);
        inputs::apply_queued(&mut simulation.world);
    }
    let path = picture(SHEET);
    output::write_png(&path, &sheet.picture.into())?;
    written.push(path);
    Ok(written)
}

/// Pictures of one size in rows and columns.
pub(crate) struct Sheet {
    /// All of them.
    pub picture: RgbImage,
    columns: u32,
    cell: (u32, u32),
    filled: u32,
}

impl Sheet {
    /// An empty sheet for so many.
    pub fn new((width, height): (u32, u32), count: usize) -> Self {
        let count = count as u32;
        let columns = (1..count).find(|columns| columns * columns >= count).unwrap_or(1);
        let rows = count.div_ceil(columns);
        let longest = (width * columns).max(height * rows);
        let scale = (f64::from(LONGEST_SHEET) / f64::from(longest)).min(1.0);
        let cell = (width, height);
        let cell = <[u32; 2]>::from(cell).map(|side| (f64::from(side) * scale).round().max(1.0) as u32);
        let size = |cells: u32, side: u32| cells * side + (cells - 1) * GAP;
        let picture = RgbImage::from_pixel(size(columns, cell[0]), size(rows, cell[1]), image::Rgb([24; 3]));
        Self { picture, columns, cell: cell.into(), filled: 0 }
    }

    /// Puts a picture at the next place.
    pub fn add(&mut self, picture: &RgbImage) {
        let (width, height) = self.cell;
        let (column, row) = (self.filled % self.columns, self.filled / self.columns);
        let small = imageops::resize(picture, width, height, FilterType::CatmullRom);
        let at = |cells: u32, side: u32| i64::from(cells * (side + GAP));
        imageops::replace(&mut self.picture, &small, at(column, width), at(row, height));
        self.filled += 1;
    }
}

/// Names of meshes as names of files: each once, none the sheet's, nothing in them that a file system may refuse.
fn file_names<'a>(meshes: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for mesh in meshes {
        let fit = |c: char| if c.is_alphanumeric() || " ._-".contains(c) { c } else { '_' };
        let name: String = mesh.trim_matches([' ', '.']).chars().take(100).map(fit).collect();
        let name = if name.is_empty() { "figure".to_owned() } else { name };
        let is_taken = |wanted: &str| {
            let alike = |known: &str| known.to_lowercase() == wanted.to_lowercase();
            alike(SHEET) || names.iter().any(|known| alike(known))
        };
        let numbered = (2..).map(|number| format!("{name} {number}"));
        names.extend(std::iter::once(name.clone()).chain(numbered).find(|wanted| !is_taken(wanted)));
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_of_any_name_get_files_of_their_own() {
        let meshes = ["ball", "Ball", "../../etc", "", "gallery", "a/b", "ball", "..."];
        let files = ["ball", "Ball 2", "_.._etc", "figure", "gallery 2", "a_b", "ball 3", "figure 2"];
        assert_eq!(file_names(meshes.into_iter()), files);
    }

    #[test]
    fn sheets_are_about_square_and_not_too_large() {
        let size = |size, count| Sheet::new(size, count).picture.dimensions();
        assert_eq!(size((1600, 900), 4), (2 * 1280 + 8, 2 * 720 + 8));
        assert_eq!(size((100, 50), 1), (100, 50));
        assert_eq!(size((100, 50), 3), (208, 108));
        assert_eq!(size((100, 50), 5), (316, 108));
        assert_eq!(size((16384, 1), 4), (2568, 10));
    }
}
