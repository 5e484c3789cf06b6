//! The outputs of cameras as films to look at: `DIR/ego/front/color.mp4`. Films are lossy; values are in other formats.

use super::format::{FileFormat, Makes, Poses, RunInfo, RunWriter};
use crate::data::pictures::Picture;
use crate::frame_time::FrameTime;
use crate::frames::FrameError;
use crate::output::{self, OutputError};
use crate::sense::captures::camera::CameraCapture;
use crate::sense::captures::capture::{Capture, SensorData};
use crate::video::{self, Film};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};
use systems::sensors::{CameraOutput, CameraOutputs, Classes, Sensor, SensorKind};

/// Metres at which a depth is half as bright as at the camera.
const HALF_BRIGHT: f32 = 10.0;

impl FileFormat {
    /// Film for each output.
    pub const VIDEO: Self = Self {
        name: "video",
        help: "NAME/OUTPUT.mp4 for each output of cameras, to look at; needs ffmpeg",
        endings: &["mp4"],
        needs: Some("a camera with an output that is a picture"),
        accepts: |_, output| output.is_some_and(is_filmed),
        // Of a part of a run there are pictures, which become films with those of the others.
        check: |run| if run.films.is_none() { Ok(video::check_encoder()?) } else { Ok(()) },
        makes: Makes::Run(|run| match run.films {
            Some(films) => Ok(Box::new(FilmPictures::new(run, films))),
            None => Ok(Box::new(FilmWriter::new(run))),
        }),
    };
}

fn is_filmed(output: CameraOutput) -> bool {
    !matches!(output, CameraOutput::Flow | CameraOutput::FlowBack)
}

/// Films that are being made.
struct FilmWriter {
    folder: PathBuf,
    classes: Classes,
    /// Filmed outputs of cameras, by their names.
    outputs: BTreeMap<String, CameraOutputs>,
    /// Time that a capture is shown, by names of sensors.
    times: BTreeMap<String, FrameTime>,
    films: BTreeMap<PathBuf, Film>,
}

/// The pictures of films of a part of a run, to be made films with those of the others:
/// `FILMS/ego/front/color/00012.png`.
struct FilmPictures {
    films: PathBuf,
    classes: Classes,
    /// Filmed outputs of cameras, by their names.
    outputs: BTreeMap<String, CameraOutputs>,
    written: Vec<PathBuf>,
}

/// Time that a capture of a sensor is shown.
pub(crate) fn time_of_capture(step_seconds: f64, every: u32) -> FrameTime {
    FrameTime::of(step_seconds * f64::from(every.max(1)))
}

/// The film of an output.
pub(crate) fn path_of_film(folder: &Path, sensor: &str, output: &str) -> PathBuf {
    folder.join(sensor).join(format!("{output}.mp4"))
}

/// Folder of a film's pictures.
pub(crate) fn folder_of_pictures(films: &Path, sensor: &str, output: &str) -> PathBuf {
    films.join(sensor).join(output)
}

impl FilmWriter {
    fn new(run: &RunInfo) -> Self {
        let time = |every: u32| time_of_capture(run.step_seconds, every);
        let times = run.sensors.iter().map(|(name, sensor)| (name.clone(), time(sensor.every)));
        Self {
            folder: run.folder.to_owned(),
            classes: run.classes.clone(),
            outputs: outputs_of(run),
            times: times.collect(),
            films: BTreeMap::new(),
        }
    }
}

impl RunWriter for FilmWriter {
    fn write(&mut self, capture: &Capture, _: &Poses) -> Result<(), FrameError> {
        for FilmFrame { sensor, output, size, rgb } in frames_of(capture, &self.outputs, &self.classes) {
            let path = path_of_film(&self.folder, sensor, output);
            let film = match self.films.entry(path) {
                Entry::Occupied(begun) => begun.into_mut(),
                Entry::Vacant(new) => {
                    output::make_folder(&self.folder.join(sensor))?;
                    let time = self.times.get(sensor).copied().unwrap_or(FrameTime::of(1.0));
                    let film = Film::begin(new.key(), size, time)?;
                    new.insert(film)
                }
            };
            film.add(&rgb)?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Vec<PathBuf>, FrameError> {
        self.films.into_values().map(|film| Ok(film.finish()?)).collect()
    }
}

impl FilmPictures {
    fn new(run: &RunInfo, films: &Path) -> Self {
        let (classes, outputs) = (run.classes.clone(), outputs_of(run));
        Self { films: films.to_owned(), classes, outputs, written: Vec::new() }
    }
}

impl RunWriter for FilmPictures {
    fn write(&mut self, capture: &Capture, _: &Poses) -> Result<(), FrameError> {
        for FilmFrame { sensor, output, size, rgb } in frames_of(capture, &self.outputs, &self.classes) {
            let folder = folder_of_pictures(&self.films, sensor, output);
            let path = folder.join(format!("{:05}.png", capture.step));
            let no_pixels = || OutputError::io(&path, std::io::Error::other("there are no pixels"));
            let picture = image::RgbImage::from_raw(size.0, size.1, rgb).ok_or_else(no_pixels)?;
            output::make_folder(&folder)?;
            output::write_png(&path, &picture.into())?;
            self.written.push(path);
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Vec<PathBuf>, FrameError> {
        Ok(self.written)
    }
}

/// A picture of a film.
struct FilmFrame<'a> {
    sensor: &'a str,
    output: &'static str,
    size: (u32, u32),
    rgb: Vec<u8>,
}

/// Filmed pictures of a capture.
fn frames_of<'a>(
    capture: &'a Capture,
    outputs: &'a BTreeMap<String, CameraOutputs>,
    classes: &'a Classes,
) -> impl Iterator<Item = FilmFrame<'a>> {
    let cameras = capture.sensors.iter().filter_map(|sensor| match &sensor.data {
        SensorData::Camera(camera) => Some((&sensor.name, camera)),
        _ => None,
    });
    cameras.flat_map(move |(sensor, camera)| {
        let outputs = outputs.get(sensor).copied().unwrap_or_default();
        let frames = outputs.iter().filter_map(move |(output, kind)| {
            let rgb = painted(camera, kind, classes)?;
            Some(FilmFrame { sensor, output, size: (camera.width, camera.height), rgb })
        });
        frames.collect::<Vec<_>>()
    })
}

/// Filmed outputs of cameras, by their names.
fn outputs_of(run: &RunInfo) -> BTreeMap<String, CameraOutputs> {
    run.sensors.iter().map(|(name, sensor)| (name.clone(), filmed(sensor))).collect()
}

/// Filmed outputs of a sensor.
fn filmed(sensor: &Sensor) -> CameraOutputs {
    let SensorKind::Camera(camera) = &sensor.kind else { return CameraOutputs::default() };
    let outputs = camera.outputs.iter().map(|(_, output)| output);
    outputs.filter(|output| is_filmed(*output)).collect()
}

/// Red, green and blue of each pixel; `None` of what was not captured. Distances are grey, nearer ones brighter, half
/// at 10 m, black where there is nothing: by colours that go with a picture's own distances, films would flicker.
fn painted(camera: &CameraCapture, output: CameraOutput, classes: &Classes) -> Option<Vec<u8>> {
    let rgb = match output {
        CameraOutput::Depth => of_distances(&camera.depth),
        CameraOutput::Range => of_distances(&camera.range),
        _ => Picture::of_camera(camera, output, classes, u32::MAX)?.image.into_raw(),
    };
    (!rgb.is_empty()).then_some(rgb)
}

fn of_distances(metres: &[f32]) -> Vec<u8> {
    metres.iter().flat_map(|metres| [(255.0 * HALF_BRIGHT / (HALF_BRIGHT + metres)).round() as u8; 3]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::pictures::rgb_of_number;

    #[test]
    fn what_is_painted_is_seen() {
        let camera = CameraCapture {
            width: 3,
            height: 1,
            depth: vec![0.0, 10.0, f32::INFINITY],
            class: vec![0, 26, 200],
            instance: vec![0, 1, 2],
            ..CameraCapture::default()
        };
        let painted = |output| painted(&camera, output, &Classes::default());
        assert_eq!(painted(CameraOutput::Depth), Some(vec![255, 255, 255, 128, 128, 128, 0, 0, 0]));
        assert_eq!(painted(CameraOutput::Class), Some([[0; 3], [0, 0, 142], rgb_of_number(200)].concat()));
        let numbers = painted(CameraOutput::Instance).unwrap();
        assert_eq!(numbers[..3], [0; 3]);
        let differs = |i: usize| numbers[i].abs_diff(numbers[i + 3]) > 50;
        assert!((3..6).any(differs), "{numbers:?}");
        assert_eq!(painted(CameraOutput::Color), None);
    }
}
