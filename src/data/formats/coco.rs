//! The labels of a run in the form of COCO, of all its cameras with colours, instances and classes.
//!
//! ```text
//! DIR/coco/instances.json              things: masks as runs, boxes, classes
//! DIR/coco/panoptic.json               things and stuff
//! DIR/coco/panoptic/ego/front/00012.png    numbers of segments as colours
//! DIR/ego/front/color_00012.png        the pictures, which both files name from DIR on
//! ```

use super::files;
use super::format::{FileFormat, Makes, Poses, RunInfo, RunWriter};
use super::run_folder::RunFolder;
use crate::export::coco::{self, Category, Instances, Panoptic, Picture, Segments};
use crate::export::picture;
use crate::frames::FrameError;
use crate::output::{self, OutputError};
use crate::sense::captures::camera::CameraCapture;
use crate::sense::captures::capture::{Capture, SensorCapture, SensorData};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::PathBuf;
use systems::sensors::{CameraOutput, ClassInfo, SensorKind};

/// Things, of all pictures.
pub(crate) const INSTANCES: &str = "coco/instances.json";
/// Things and stuff, of all pictures.
pub(crate) const PANOPTIC: &str = "coco/panoptic.json";

/// Outputs of a labelled camera.
const LABELLED: [CameraOutput; 3] = [CameraOutput::Color, CameraOutput::Instance, CameraOutput::Class];

impl FileFormat {
    /// Labels of things and of all pixels, of the whole run.
    pub const COCO: Self = Self {
        name: "coco",
        help: "coco/instances.json and panoptic.json for the run, of cameras with color, instance and class; with the \
               color pictures",
        endings: &["png", "json"],
        needs: Some("a camera with color, instance and class"),
        accepts: |kind, output| {
            let has_all =
                matches!(kind, SensorKind::Camera(camera) if LABELLED.iter().all(|one| camera.outputs.has(*one)));
            has_all && output.is_some_and(|output| LABELLED.contains(&output))
        },
        check: Self::accept_all,
        makes: Makes::Run(|run| Ok(Box::new(CocoWriter::new(run)))),
    };
}

/// Labels that are being collected; their files are written at the end, the pictures at once.
struct CocoWriter {
    folder: RunFolder,
    things: BTreeSet<u8>,
    /// Colours have no other format that writes their pictures.
    writes_colors: bool,
    instances: Instances,
    panoptic: Panoptic,
}

impl CocoWriter {
    fn new(run: &RunInfo) -> Self {
        // What has no class is labelled by none.
        let classes = || run.classes.0.iter().filter(|class| class.id != 0);
        let categories =
            |is_wanted: fn(&ClassInfo) -> bool| classes().filter(move |class| is_wanted(class)).map(category);
        Self {
            folder: RunFolder::new(run.folder),
            things: classes().filter(|class| class.is_thing).map(|class| class.id).collect(),
            writes_colors: !run.formats.contains(&FileFormat::PNG),
            instances: Instances { categories: categories(|class| class.is_thing).collect(), ..Instances::default() },
            panoptic: Panoptic { categories: categories(|_| true).collect(), ..Panoptic::default() },
        }
    }

    fn add(&mut self, sensor: &SensorCapture, camera: &CameraCapture, step: u64) -> Result<(), FrameError> {
        let size = (camera.width, camera.height);
        let file_name = format!("{}/color_{step:05}.png", sensor.name);
        if self.writes_colors {
            self.folder.write(&file_name, files::png(camera, CameraOutput::Color))?;
        }
        let segments_name = format!("{}/{step:05}.png", sensor.name);
        let segments_path = format!("coco/panoptic/{segments_name}");
        let unfit = |error| OutputError::io(&self.folder.path.join(&segments_path), error);
        let is_thing = |class| self.things.contains(&class);
        let (ids, segments) = coco::segments(size, &camera.class, &camera.instance, is_thing).map_err(unfit)?;
        // Of a thing's pixels most have its class.
        let classes: BTreeMap<u32, u8> =
            segments.iter().filter_map(|segment| Some((segment.instance()?, segment.category_id))).collect();
        let image_id = self.panoptic.images.len() as u64 + 1;
        let image = Picture { id: image_id, file_name, width: camera.width, height: camera.height };
        let added = self.instances.add(image.clone(), &camera.instance, |instance| classes.get(&instance).copied());
        added.map_err(unfit)?;
        self.panoptic.images.push(image);
        self.panoptic.annotations.push(Segments { image_id, file_name: segments_name, segments_info: segments });
        let numbers = picture::of_numbers(size, ids.into_iter());
        let numbers = numbers.ok_or_else(|| io::Error::other("there are no pixels"));
        self.folder.write(&segments_path, numbers.and_then(|it| output::encode_png(&it).map_err(io::Error::other)))
    }
}

impl RunWriter for CocoWriter {
    fn write(&mut self, capture: &Capture, _: &Poses) -> Result<(), FrameError> {
        for sensor in &capture.sensors {
            let SensorData::Camera(camera) = &sensor.data else { continue };
            let is_whole = !camera.color.is_empty() && !camera.instance.is_empty() && !camera.class.is_empty();
            if is_whole {
                self.add(sensor, camera, capture.step)?;
            }
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<Vec<PathBuf>, FrameError> {
        let (mut instances, mut panoptic) = (Vec::new(), Vec::new());
        let encoded = coco::write(&mut instances, &self.instances);
        self.folder.write(INSTANCES, encoded.map(|()| instances))?;
        let encoded = coco::write(&mut panoptic, &self.panoptic);
        self.folder.write(PANOPTIC, encoded.map(|()| panoptic))?;
        Ok(self.folder.written)
    }
}

fn category(class: &ClassInfo) -> Category {
    Category {
        id: class.id,
        name: class.name.clone(),
        supercategory: class.name.clone(),
        isthing: class.is_thing.into(),
        color: class.color,
    }
}
