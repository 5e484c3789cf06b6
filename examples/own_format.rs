//! A form of files of one's own, beside those of the library: a table of all things that cameras see in a run.
//!
//! `cargo run --release --example own_format`

use relief::data::{DatasetOptions, FileFormat, Makes, Poses, RunInfo, RunWriter, SensorJob, render_sensors};
use relief::frames::{FrameError, Frames, RunJob};
use relief::output;
use relief::sense::Capture;
use std::error::Error;
use std::path::{Path, PathBuf};
use systems::sensors::{CameraOutput, Class, Classes};

/// `things.csv` of the cameras with boxes.
const TABLE: FileFormat = FileFormat {
    name: "table",
    help: "things.csv, a line for each thing that a camera sees",
    endings: &["csv"],
    needs: Some("a camera with boxes"),
    accepts: |_, output| output == Some(CameraOutput::Boxes),
    check: FileFormat::accept_all,
    makes: Makes::Run(|run| Ok(Box::new(Table::new(run)))),
};

struct Table {
    path: PathBuf,
    classes: Classes,
    text: String,
}

impl Table {
    fn new(run: &RunInfo) -> Self {
        let text = "step,camera,thing,class,metres,pixels\n".to_owned();
        Self { path: run.folder.join("things.csv"), classes: run.classes.clone(), text }
    }
}

impl RunWriter for Table {
    fn write(&mut self, capture: &Capture, _: &Poses) -> Result<(), FrameError> {
        for sensor in &capture.sensors {
            for thing in sensor.camera().into_iter().flat_map(|camera| &camera.boxes) {
                let class = self.classes.get(Class(thing.class)).map_or("", |class| &class.name);
                let [x, y, z] = thing.center;
                let metres = (x * x + y * y + z * z).sqrt();
                let (step, name) = (capture.step, &sensor.name);
                self.text += &format!("{step},{name},{},{class},{metres:.2},{}\n", thing.id, thing.pixels);
            }
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Vec<PathBuf>, FrameError> {
        output::write_whole(&self.path, self.text.as_bytes())?;
        Ok(vec![self.path])
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/sensors.ron");
    let job = SensorJob {
        run: RunJob { frames: Frames::First(13), ..RunJob::new(scene) },
        dataset: DatasetOptions {
            sensors: Some(vec!["ego/front".to_owned(), "ego/top".to_owned()]),
            formats: vec![FileFormat::NPY, TABLE],
            ..DatasetOptions::new("own_format")
        },
    };
    for file in render_sensors(&job, |_, _| ())? {
        println!("{}", file.display());
    }
    Ok(())
}
