//! Which files a sensor's outputs become, and what is in them.

use super::{CameraCapture, LidarCapture, SensorCapture, SensorData};
use crate::export::array::{Array, Column, Values};
use crate::export::exr::{self, Channel};
use crate::export::{npy, npz, picture};
use crate::output;
use std::io::{Error, ErrorKind, Result};
use systems::sensors::{CameraOutput, Sensor, SensorKind};

/// A form of files.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum FileFormat {
    /// A picture for each output.
    Png,
    /// An array of numpy for each output.
    Npy,
    /// An archive of these for each capture.
    Npz,
    /// A picture with named channels for each capture.
    Exr,
    /// One log of ROS 2 for the whole run.
    Mcap,
}

impl FileFormat {
    /// All, with their names, which end the names of their files.
    pub const ALL: [(&'static str, Self); 5] =
        [("png", Self::Png), ("npy", Self::Npy), ("npz", Self::Npz), ("exr", Self::Exr), ("mcap", Self::Mcap)];

    /// Whether it has files of their own for each capture.
    pub(super) fn is_per_capture(self) -> bool {
        self != Self::Mcap
    }

    /// Whether it has a form for an output of a camera.
    fn holds(self, output: CameraOutput) -> bool {
        match self {
            Self::Png => output != CameraOutput::Linear,
            Self::Npy | Self::Npz => true,
            Self::Exr => output != CameraOutput::Color,
            Self::Mcap => matches!(
                output,
                CameraOutput::Color | CameraOutput::Depth | CameraOutput::Class | CameraOutput::Instance
            ),
        }
    }
}

/// The records of a lidar in names of files.
const POINTS: &str = "points";

/// The names of a sensor's outputs that no format of these holds.
pub(super) fn left_out(sensor: &Sensor, formats: &[FileFormat]) -> Vec<&'static str> {
    match &sensor.kind {
        SensorKind::Camera(camera) => {
            let is_left_out = |output| !formats.iter().any(|format| format.holds(output));
            camera.outputs.iter().filter(|(_, output)| is_left_out(*output)).map(|(name, _)| name).collect()
        }
        SensorKind::Lidar(_) => {
            let has_records = |format: &FileFormat| !matches!(format, FileFormat::Png | FileFormat::Exr);
            let holds = formats.iter().any(has_records);
            if holds { Vec::new() } else { vec![POINTS] }
        }
    }
}

/// The largest class of things whose numbers fit into 16 bits: class · 1000 + 999.
pub(super) const MOST_THINGS: u8 = 64;

/// Whether panoptic numbers of a sensor become pictures.
pub(super) fn has_panoptic_picture(sensor: &Sensor, formats: &[FileFormat]) -> bool {
    let has_output = matches!(&sensor.kind, SensorKind::Camera(camera) if camera.outputs.has(CameraOutput::Panoptic));
    has_output && formats.contains(&FileFormat::Png)
}

/// A file of a capture.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct OutputFile {
    /// In the sensor's folder.
    pub name: String,
    pub format: FileFormat,
    /// The output that is in it alone.
    output: Option<CameraOutput>,
}

/// The files of a sensor's capture after a step, that are of this capture alone.
pub(super) fn files_of(sensor: &Sensor, formats: &[FileFormat], step: u64) -> Vec<OutputFile> {
    let mut files = Vec::new();
    let asked_for = |format: &FileFormat| formats.contains(format) && format.is_per_capture();
    for &(extension, format) in FileFormat::ALL.iter().filter(|(_, format)| asked_for(format)) {
        let mut file = |name: &str, output| {
            let name = if name.is_empty() {
                format!("{step:05}.{extension}")
            } else {
                format!("{name}_{step:05}.{extension}")
            };
            files.push(OutputFile { name, format, output });
        };
        match (&sensor.kind, format) {
            (SensorKind::Camera(camera), FileFormat::Png | FileFormat::Npy) => {
                let held = camera.outputs.iter().filter(|(_, output)| format.holds(*output));
                held.for_each(|(name, output)| file(name, Some(output)));
            }
            (SensorKind::Camera(camera), _) if camera.outputs.iter().any(|(_, output)| format.holds(output)) => {
                file("", None);
            }
            (SensorKind::Lidar(_), FileFormat::Npy) => file(POINTS, None),
            (SensorKind::Lidar(_), FileFormat::Npz) => file("", None),
            _ => {}
        }
    }
    files
}

/// The bytes of a file.
///
/// # Errors
/// What does not fit into the form.
pub(super) fn encode(capture: &SensorCapture, file: &OutputFile) -> Result<Vec<u8>> {
    match &capture.data {
        SensorData::Camera(camera) => of_camera(camera, file),
        SensorData::Lidar(lidar) => of_lidar(lidar, file.format),
    }
}

fn of_camera(camera: &CameraCapture, file: &OutputFile) -> Result<Vec<u8>> {
    match (file.format, file.output) {
        (FileFormat::Png, Some(output)) => png(camera, output),
        (FileFormat::Npy, Some(output)) => array_of(camera, output).encode(),
        (FileFormat::Exr, _) => exr::encode((camera.width, camera.height), &channels(camera)),
        _ => {
            let outputs = CameraOutput::ALL.into_iter().map(|(name, output)| (name, array_of(camera, output)));
            let arrays = outputs.filter(|(_, array)| !array.values.is_empty());
            archive(arrays.map(|(name, array)| Ok((name, array.encode()?))))
        }
    }
}

/// An array with an element, or a few, for each pixel.
struct PixelArray<'a> {
    shape: Vec<usize>,
    values: Values<'a>,
}

impl PixelArray<'_> {
    fn encode(&self) -> Result<Vec<u8>> {
        npy::encode(&Array::new(&self.shape, self.values))
    }
}

fn array_of(camera: &CameraCapture, output: CameraOutput) -> PixelArray<'_> {
    let (values, parts) = match output {
        CameraOutput::Color => (camera.color.as_flattened().into(), Some(3)),
        CameraOutput::Linear => (camera.linear.as_flattened().into(), Some(3)),
        CameraOutput::Depth => (camera.depth[..].into(), None),
        CameraOutput::Range => (camera.range[..].into(), None),
        CameraOutput::Normal => (camera.normal.as_flattened().into(), Some(3)),
        CameraOutput::Instance => (camera.instance[..].into(), None),
        CameraOutput::Part => (camera.part[..].into(), None),
        CameraOutput::Class => (camera.class[..].into(), None),
        CameraOutput::Panoptic => (camera.panoptic[..].into(), None),
    };
    let shape = [camera.height as usize, camera.width as usize].into_iter().chain(parts).collect();
    PixelArray { shape, values }
}

fn channels(camera: &CameraCapture) -> Vec<Channel<'_>> {
    let colors = Channel::parts(["R", "G", "B"], camera.linear.as_flattened());
    let normals = Channel::parts(["N.X", "N.Y", "N.Z"], camera.normal.as_flattened());
    let others: [(&str, Values); 6] = [
        ("Z", camera.depth[..].into()),
        ("range", camera.range[..].into()),
        ("instance", camera.instance[..].into()),
        ("part", camera.part[..].into()),
        ("class", camera.class[..].into()),
        ("panoptic", camera.panoptic[..].into()),
    ];
    let colors = colors.into_iter().filter(|_| !camera.linear.is_empty());
    let normals = normals.into_iter().filter(|_| !camera.normal.is_empty());
    let others = others.into_iter().filter(|(_, values)| !values.is_empty());
    colors.chain(normals).chain(others.map(|(name, values)| Channel::new(name, values))).collect()
}

fn archive<'a>(arrays: impl Iterator<Item = Result<(&'a str, Vec<u8>)>>) -> Result<Vec<u8>> {
    let arrays: Vec<(&str, Vec<u8>)> = arrays.collect::<Result<_>>()?;
    let arrays: Vec<(&str, &[u8])> = arrays.iter().map(|(name, bytes)| (*name, &bytes[..])).collect();
    let mut bytes = Vec::new();
    npz::write(&mut bytes, &arrays)?;
    Ok(bytes)
}

/// Depths and ranges in 1/256 m, 0 for nothing; normals 0.5 + 0.5·n; numbers as 24-bit colour, red the lowest byte.
fn png(camera: &CameraCapture, output: CameraOutput) -> Result<Vec<u8>> {
    let size = (camera.width, camera.height);
    let picture = match output {
        CameraOutput::Color => {
            let pixels = camera.color.as_flattened().to_vec();
            image::RgbImage::from_raw(size.0, size.1, pixels).map(image::DynamicImage::from)
        }
        CameraOutput::Depth => picture::of_metres(size, &camera.depth),
        CameraOutput::Range => picture::of_metres(size, &camera.range),
        CameraOutput::Normal => picture::of_normals(size, &camera.normal),
        CameraOutput::Instance => picture_of_numbers(size, &camera.instance)?,
        CameraOutput::Part => picture_of_numbers(size, &camera.part)?,
        CameraOutput::Class => {
            image::GrayImage::from_raw(size.0, size.1, camera.class.clone()).map(image::DynamicImage::from)
        }
        CameraOutput::Panoptic => {
            let fit = |number: &u32| u16::try_from(*number).map_err(|_| too_large("panoptic", *number, 16));
            picture::of_grey(size, camera.panoptic.iter().map(fit).collect::<Result<_>>()?)
        }
        CameraOutput::Linear => None,
    };
    let picture = picture.ok_or_else(|| Error::new(ErrorKind::InvalidInput, "PNG: there are no pixels"))?;
    output::encode_png(&picture).map_err(Error::other)
}

fn picture_of_numbers(size: (u32, u32), numbers: &[u32]) -> Result<Option<image::DynamicImage>> {
    match numbers.iter().find(|number| **number >= 1 << 24) {
        Some(number) => Err(too_large("entity", *number, 24)),
        None => Ok(picture::of_numbers(size, numbers.iter().copied())),
    }
}

fn too_large(what: &str, number: u32, bits: u32) -> Error {
    let message = format!("PNG: the {what} number {number} does not fit into {bits} bits; npy and npz hold it");
    Error::new(ErrorKind::InvalidInput, message)
}

fn of_lidar(lidar: &LidarCapture, format: FileFormat) -> Result<Vec<u8>> {
    let LidarCapture { scan, instance, class, .. } = lidar;
    let columns = [
        Column::new("xyz", &[3], scan.xyz.as_flattened()),
        Column::new("range", &[], &scan.range[..]),
        Column::new("intensity", &[], &scan.intensity[..]),
        Column::new("ring", &[], &scan.ring[..]),
        Column::new("time", &[], &scan.time[..]),
        Column::new("instance", &[], &instance[..]),
        Column::new("class", &[], &class[..]),
        Column::new("hit", &[], &scan.hit[..]),
    ];
    if format == FileFormat::Npy {
        return npy::encode_records(scan.len(), &columns);
    }
    archive(columns.iter().map(|column| {
        let shape: Vec<usize> = std::iter::once(scan.len()).chain(column.shape.iter().copied()).collect();
        Ok((column.name, npy::encode(&Array::new(&shape, column.values))?))
    }))
}
