//! The outputs of cameras as films to look at: `DIR/ego/front/color.mp4`. Films are lossy; values are in other formats.

use super::CameraCapture;
use super::capture::{Capture, SensorData};
use super::files::FileFormat;
use super::run_writer::{RunInfo, RunWriter};
use crate::frame_time::FrameTime;
use crate::frames::FrameError;
use crate::output;
use crate::sensors::pictures::Picture;
use crate::video::Film;
use std::collections::BTreeMap;
use std::path::PathBuf;
use systems::sensors::{CameraOutput, CameraOutputs, Classes, Sensor, SensorKind};

/// Metres at which a depth is half as bright as at the camera.
const HALF_BRIGHT: f32 = 10.0;

/// Films that are being made.
pub(super) struct FilmWriter {
    folder: PathBuf,
    classes: Classes,
    /// What of cameras is filmed, by their names.
    outputs: BTreeMap<String, CameraOutputs>,
    /// How long a capture is shown, by names of sensors.
    times: BTreeMap<String, FrameTime>,
    films: BTreeMap<PathBuf, Film>,
}

impl FilmWriter {
    pub fn new(run: &RunInfo) -> Self {
        let time = |every: u32| FrameTime::of(run.step_seconds * f64::from(every.max(1)));
        let times = run.sensors.iter().map(|(name, sensor)| (name.clone(), time(sensor.every)));
        Self {
            folder: run.folder.to_owned(),
            classes: run.classes.clone(),
            outputs: run.sensors.iter().map(|(name, sensor)| (name.clone(), filmed(sensor))).collect(),
            times: times.collect(),
            films: BTreeMap::new(),
        }
    }

    fn add(&mut self, sensor: &str, output: &str, size: (u32, u32), rgb: &[u8]) -> Result<(), FrameError> {
        let folder = self.folder.join(sensor);
        let path = folder.join(format!("{output}.mp4"));
        if !self.films.contains_key(&path) {
            output::make_folder(&folder)?;
            let time = self.times.get(sensor).copied().unwrap_or(FrameTime::of(1.0));
            self.films.insert(path.clone(), Film::begin(&path, size, time)?);
        }
        if let Some(film) = self.films.get_mut(&path) {
            film.add(rgb)?;
        }
        Ok(())
    }
}

impl RunWriter for FilmWriter {
    fn write(&mut self, capture: &Capture) -> Result<(), FrameError> {
        for sensor in &capture.sensors {
            let SensorData::Camera(camera) = &sensor.data else { continue };
            let outputs = self.outputs.get(&sensor.name).copied().unwrap_or_default();
            for (name, output) in outputs.iter() {
                if let Some(rgb) = painted(camera, output, &self.classes) {
                    self.add(&sensor.name, name, (camera.width, camera.height), &rgb)?;
                }
            }
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Vec<PathBuf>, FrameError> {
        self.films.into_values().map(|film| Ok(film.finish()?)).collect()
    }
}

/// What of a sensor is filmed.
fn filmed(sensor: &Sensor) -> CameraOutputs {
    let SensorKind::Camera(camera) = &sensor.kind else { return CameraOutputs::default() };
    let outputs = camera.outputs.iter().map(|(_, output)| output);
    outputs.filter(|output| FileFormat::Video.holds(camera, *output)).collect()
}

/// Red, green and blue of each pixel; `None` of what was not captured. Distances are grey, nearer ones brighter, half at
/// 10 m, black where there is nothing: by colours that go with a picture's own distances, films would flicker.
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
    use crate::sensors::pictures::rgb_of_number;

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
