//! Files that a sensor's outputs become, a capture at a time, and what is in them.

use super::format::FileFormat;
use super::records::archive;
use super::{box_records, records};
use crate::export::array::{Array, Values};
use crate::export::exr::{self, Channel};
use crate::export::kitti::flow_steps;
use crate::export::{npy, picture};
use crate::output;
use crate::sense::captures::camera::CameraCapture;
use crate::sense::captures::capture::{SensorCapture, SensorData};
use crate::sense::captures::flow::{Flow, flags};
use std::io::{Error, ErrorKind, Result};
use systems::sensors::{CameraOutput, Sensor, SensorKind};

/// The names of a sensor's outputs that no format of these holds.
pub(crate) fn left_out(sensor: &Sensor, formats: &[FileFormat]) -> Vec<&'static str> {
    match &sensor.kind {
        SensorKind::Camera(camera) => {
            let is_left_out = |output| !formats.iter().any(|format| format.holds(camera, output));
            camera.outputs.iter().filter(|(_, output)| is_left_out(*output)).map(|(name, _)| name).collect()
        }
        other => {
            let holds = formats.iter().any(|format| format.holds_any(sensor));
            if holds { Vec::new() } else { vec![records::name(other)] }
        }
    }
}

/// The largest class of things whose numbers fit into 16 bits: class · 1000 + 999.
pub(crate) const MOST_THINGS: u8 = 64;

/// Tells if panoptic numbers of a sensor become pictures.
pub(crate) fn has_panoptic_picture(sensor: &Sensor, formats: &[FileFormat]) -> bool {
    let has_output = matches!(&sensor.kind, SensorKind::Camera(camera) if camera.outputs.has(CameraOutput::Panoptic));
    has_output && formats.contains(&FileFormat::Png)
}

/// A file of a capture.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct OutputFile {
    /// In the sensor's folder.
    pub name: String,
    pub format: FileFormat,
    /// The output that is in it alone.
    output: Option<CameraOutput>,
    /// Flags of flow, rather than flow.
    is_flags: bool,
    /// The sensor has boxes, though there may be none.
    has_boxes: bool,
}

/// The files of a sensor's capture after a step, that are of this capture alone. Of captures before `first` there are
/// none, so that flow from there is in no file.
pub(crate) fn files_of(sensor: &Sensor, formats: &[FileFormat], (step, first): (u64, u64)) -> Vec<OutputFile> {
    let mut files = Vec::new();
    let before = step.checked_sub(sensor.every.into());
    let has_boxes = matches!(&sensor.kind, SensorKind::Camera(camera) if camera.outputs.has(CameraOutput::Boxes));
    let asked_for = |format: &FileFormat| formats.contains(format) && format.is_per_capture();
    for &(extension, format) in FileFormat::ALL.iter().filter(|(_, format)| asked_for(format)) {
        let mut push = |name: String, output, is_flags| {
            files.push(OutputFile { name: format!("{name}.{extension}"), format, output, is_flags, has_boxes });
        };
        let mut file = |name: &str, output: Option<CameraOutput>| {
            let step = match (output, before) {
                // It begins at the picture of the capture before, whose files it is beside.
                (Some(CameraOutput::Flow), Some(before)) if before >= first => before,
                (Some(CameraOutput::FlowBack), Some(_)) => step,
                (Some(CameraOutput::Flow | CameraOutput::FlowBack), _) => return,
                _ => step,
            };
            if name.is_empty() {
                return push(format!("{step:05}"), output, false);
            }
            push(format!("{name}_{step:05}"), output, false);
            if matches!(output, Some(CameraOutput::Flow | CameraOutput::FlowBack)) && format == FileFormat::Npy {
                push(format!("{name}_flags_{step:05}"), output, true);
            }
        };
        match (&sensor.kind, format) {
            (SensorKind::Camera(camera), FileFormat::Png | FileFormat::Npy) => {
                let held = camera.outputs.iter().filter(|(_, output)| format.holds(camera, *output));
                held.for_each(|(name, output)| file(name, Some(output)));
            }
            (SensorKind::Camera(_), _) if format.holds_any(sensor) => file("", None),
            (SensorKind::Camera(_), _) => {}
            (other, FileFormat::Npy) => file(records::name(other), None),
            (_, FileFormat::Npz) => file("", None),
            _ => {}
        }
    }
    files
}

/// The bytes of a file; `None` of flow where the capture before is not known.
///
/// # Errors
/// A value that does not fit into the format.
pub(crate) fn encode(capture: &SensorCapture, file: &OutputFile) -> Result<Option<Vec<u8>>> {
    match &capture.data {
        SensorData::Camera(camera) => {
            let flow = file.output.and_then(|output| flow_of(camera, output));
            if flow.is_some_and(|flow| flow.flags.is_empty()) {
                return Ok(None);
            }
            of_camera(camera, file).map(Some)
        }
        SensorData::Lidar(lidar) => records::of_lidar(lidar, file.format).map(Some),
        SensorData::Imu(imu) => records::of_imu(imu, file.format).map(Some),
        SensorData::Gnss(gnss) => records::of_gnss(gnss, file.format).map(Some),
        SensorData::Collision(collisions) => records::of_collisions(collisions, file.format).map(Some),
        SensorData::Lane(lane) => records::of_lane(lane, file.format).map(Some),
    }
}

/// The flow of an output that is one.
fn flow_of(camera: &CameraCapture, output: CameraOutput) -> Option<&Flow> {
    match output {
        CameraOutput::Flow => Some(&camera.flow),
        CameraOutput::FlowBack => Some(&camera.flow_back),
        _ => None,
    }
}

fn of_camera(camera: &CameraCapture, file: &OutputFile) -> Result<Vec<u8>> {
    let has_boxes = file.has_boxes;
    match (file.format, file.output) {
        (FileFormat::Png, Some(output)) => png(camera, output),
        (FileFormat::Npy, Some(CameraOutput::Boxes)) => box_records::encode(&camera.boxes),
        (FileFormat::Npy, Some(output)) if file.is_flags => flags_of(camera, output).encode(),
        (FileFormat::Npy, Some(output)) => array_of(camera, output).encode(),
        (FileFormat::Exr, _) => exr::encode((camera.width, camera.height), &channels(camera)),
        _ => {
            let held = CameraOutput::ALL.into_iter().filter(|(_, output)| file.format.has_form(*output));
            let outputs = held.map(|(name, output)| (name, array_of(camera, output)));
            let flags = ("flow_back_flags", flags_of(camera, CameraOutput::FlowBack));
            let arrays = outputs.chain([flags]).filter(|(_, array)| !array.values.is_empty());
            let arrays = arrays.map(|(name, array)| Ok((name, array.encode()?)));
            let boxes = has_boxes.then(|| Ok(("boxes", box_records::encode(&camera.boxes)?)));
            archive(arrays.chain(boxes))
        }
    }
}

/// The flags of a flow, for each pixel.
fn flags_of(camera: &CameraCapture, output: CameraOutput) -> PixelArray<'_> {
    let flags = flow_of(camera, output).map_or(&[][..], |flow| &flow.flags);
    PixelArray { shape: vec![camera.height as usize, camera.width as usize], values: flags.into() }
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
        CameraOutput::Flow => (camera.flow.pixels.as_flattened().into(), Some(2)),
        CameraOutput::FlowBack => (camera.flow_back.pixels.as_flattened().into(), Some(2)),
        // Records have no pixels.
        CameraOutput::Boxes => ((&[] as &[u8]).into(), None),
    };
    let shape = [camera.height as usize, camera.width as usize].into_iter().chain(parts).collect();
    PixelArray { shape, values }
}

fn channels(camera: &CameraCapture) -> Vec<Channel<'_>> {
    let colors = Channel::parts(["R", "G", "B"], camera.linear.as_flattened());
    let normals = Channel::parts(["N.X", "N.Y", "N.Z"], camera.normal.as_flattened());
    let others: [(&str, Values); 7] = [
        ("Z", camera.depth[..].into()),
        ("range", camera.range[..].into()),
        ("instance", camera.instance[..].into()),
        ("part", camera.part[..].into()),
        ("class", camera.class[..].into()),
        ("panoptic", camera.panoptic[..].into()),
        ("flow_back.flags", camera.flow_back.flags[..].into()),
    ];
    let colors = colors.into_iter().filter(|_| !camera.linear.is_empty());
    let normals = normals.into_iter().filter(|_| !camera.normal.is_empty());
    let flow = Channel::parts(["flow_back.U", "flow_back.V"], camera.flow_back.pixels.as_flattened());
    let flow = flow.into_iter().filter(|_| !camera.flow_back.flags.is_empty());
    let others = others.into_iter().filter(|(_, values)| !values.is_empty());
    colors.chain(normals).chain(flow).chain(others.map(|(name, values)| Channel::new(name, values))).collect()
}

/// Depths and ranges in 1/256 m, 0 for nothing; normals 0.5 + 0.5·n; numbers as 24-bit colour, red the lowest byte;
/// flow in three times 16 bits.
pub(crate) fn png(camera: &CameraCapture, output: CameraOutput) -> Result<Vec<u8>> {
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
        CameraOutput::Flow => picture_of_flow(size, &camera.flow),
        CameraOutput::FlowBack => picture_of_flow(size, &camera.flow_back),
        CameraOutput::Linear | CameraOutput::Boxes => None,
    };
    let picture = picture.ok_or_else(|| Error::new(ErrorKind::InvalidInput, "PNG: there are no pixels"))?;
    output::encode_png(&picture).map_err(Error::other)
}

/// Picture of flow, as KITTI has it.
fn picture_of_flow(size: (u32, u32), flow: &Flow) -> Option<image::DynamicImage> {
    let is_valid = |flags: u8| flags & flags::VALID != 0;
    let steps = flow.pixels.iter().zip(&flow.flags).flat_map(|(pixel, flags)| flow_steps(*pixel, is_valid(*flags)));
    picture::of_color16(size, steps.collect())
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
