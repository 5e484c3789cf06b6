//! Files that a sensor's outputs become, a capture at a time, and what is in them.

use super::box_records;
use super::format::{CaptureFile, Encode, FileFormat, Makes};
use super::records::{self, archive};
use crate::export::array::{Array, Values};
use crate::export::exr::{self, Channel};
use crate::export::kitti::flow_steps;
use crate::export::{npy, picture};
use crate::frames::FrameError;
use crate::output;
use crate::sense::captures::camera::CameraCapture;
use crate::sense::captures::capture::SensorCapture;
use crate::sense::captures::flow::{Flow, flags};
use crate::sense::motion::kind::file_name;
use std::io::{Error, ErrorKind, Result};
use systems::sensors::{CameraOutput, Sensor, SensorKind};

impl FileFormat {
    /// Picture for each output.
    pub const PNG: Self = Self {
        name: "png",
        help: "A picture per output: 8 bits, 16 bits of 1/256 m, or ids as 24-bit colour; not linear colours",
        endings: &["png"],
        needs: None,
        accepts: png_holds,
        check: |run| {
            let things = run.classes.0.iter().filter(|class| class.is_thing);
            let beyond = things.map(|class| class.id).find(|&id| id > MOST_THINGS);
            let shown = run.sensors.iter().find(|(_, sensor)| has_panoptic_picture(sensor, run.formats));
            match shown.zip(beyond) {
                Some(((sensor, _), id)) => Err(FrameError::NoPanoptic { sensor: sensor.clone(), id }),
                None => Ok(()),
            }
        },
        makes: Makes::Captures(|sensor| of_outputs(sensor, png_holds, encode_picture)),
    };

    /// Array of numpy for each output.
    pub const NPY: Self = Self {
        name: "npy",
        help: "An array of numpy per output; of sensors that are no cameras one of records",
        endings: &["npy"],
        needs: None,
        accepts: |_, _| true,
        check: Self::accept_all,
        makes: Makes::Captures(|sensor| {
            let files = of_outputs(sensor, |_, _| true, encode_array).into_iter().flat_map(|file| {
                let is_flow = matches!(file.output, Some(CameraOutput::Flow | CameraOutput::FlowBack));
                let name = format!("{}_flags", file.name);
                let flags = is_flow.then(|| CaptureFile { name, encode: encode_flags, ..file.clone() });
                std::iter::once(file).chain(flags)
            });
            files.collect()
        }),
    };

    /// Archive of these for each capture.
    pub const NPZ: Self = Self {
        name: "npz",
        help: "The arrays of a capture in one file",
        endings: &["npz"],
        needs: None,
        accepts: npz_holds,
        check: Self::accept_all,
        makes: Makes::Captures(|sensor| of_all(sensor, npz_holds, encode_archive)),
    };

    /// Picture with named channels for each capture.
    pub const EXR: Self = Self {
        name: "exr",
        help: "A picture per capture with named channels: R G B (linear), Z, N.X N.Y N.Z, range, ids",
        endings: &["exr"],
        needs: None,
        accepts: exr_holds,
        check: Self::accept_all,
        makes: Makes::Captures(|sensor| of_all(sensor, exr_holds, encode_channels)),
    };
}

type Holds = fn(&SensorKind, Option<CameraOutput>) -> bool;

fn png_holds(_: &SensorKind, output: Option<CameraOutput>) -> bool {
    output.is_some_and(|output| !matches!(output, CameraOutput::Linear | CameraOutput::Boxes))
}

fn npz_holds(_: &SensorKind, output: Option<CameraOutput>) -> bool {
    // What is in one file is of one picture; flow to the next is known with that.
    output != Some(CameraOutput::Flow)
}

fn exr_holds(_: &SensorKind, output: Option<CameraOutput>) -> bool {
    output.is_some_and(|it| !matches!(it, CameraOutput::Color | CameraOutput::Boxes | CameraOutput::Flow))
}

/// A file for each output, or for the records of a sensor that is no camera.
fn of_outputs(sensor: &Sensor, holds: Holds, encode: Encode) -> Vec<CaptureFile> {
    let file =
        |name: &str, output| holds(&sensor.kind, output).then(|| CaptureFile { name: name.to_owned(), output, encode });
    match &sensor.kind {
        SensorKind::Camera(camera) => {
            camera.outputs.iter().filter_map(|(name, output)| file(name, Some(output))).collect()
        }
        kind => file(file_name(kind), None).into_iter().collect(),
    }
}

/// A file for all that is held of a capture.
fn of_all(sensor: &Sensor, holds: Holds, encode: Encode) -> Vec<CaptureFile> {
    let is_held = match &sensor.kind {
        SensorKind::Camera(camera) => camera.outputs.iter().any(|(_, output)| holds(&sensor.kind, Some(output))),
        kind => holds(kind, None),
    };
    is_held.then(|| CaptureFile { name: String::new(), output: None, encode }).into_iter().collect()
}

/// The names of a sensor's outputs that no format of these holds.
pub(crate) fn left_out<'a>(sensor: &'a Sensor, formats: &[FileFormat]) -> Vec<&'a str> {
    let is_left_out = |output| !formats.iter().any(|format| (format.accepts)(&sensor.kind, output));
    match &sensor.kind {
        SensorKind::Camera(camera) => {
            camera.outputs.iter().filter(|(_, output)| is_left_out(Some(*output))).map(|(name, _)| name).collect()
        }
        kind => is_left_out(None).then(|| file_name(kind)).into_iter().collect(),
    }
}

/// The largest class of things whose numbers fit into 16 bits: class · 1000 + 999.
const MOST_THINGS: u8 = 64;

/// Tells if panoptic numbers of a sensor become pictures.
pub(crate) fn has_panoptic_picture(sensor: &Sensor, formats: &[FileFormat]) -> bool {
    let has_output = matches!(&sensor.kind, SensorKind::Camera(camera) if camera.outputs.has(CameraOutput::Panoptic));
    has_output && formats.contains(&FileFormat::PNG)
}

/// The files of a sensor's capture after a step, that are of this capture alone, with their names in the sensor's
/// folder. Of captures before `first` there are none, so that flow from there is in no file.
pub(crate) fn files_of(
    sensor: &Sensor,
    formats: &[FileFormat],
    (step, first): (u64, u64),
) -> Vec<(String, CaptureFile)> {
    let before = step.checked_sub(sensor.every.into());
    let mut files = Vec::new();
    for format in formats {
        let Makes::Captures(of_sensor) = format.makes else { continue };
        let ending = format.endings.first().unwrap_or(&format.name);
        for file in of_sensor(sensor) {
            let step = match (file.output, before) {
                // It begins at the picture of the capture before, whose files it is beside.
                (Some(CameraOutput::Flow), Some(before)) if before >= first => before,
                (Some(CameraOutput::FlowBack), Some(_)) => step,
                (Some(CameraOutput::Flow | CameraOutput::FlowBack), _) => continue,
                _ => step,
            };
            let CaptureFile { name, .. } = &file;
            let joint = if name.is_empty() { "" } else { "_" };
            files.push((format!("{name}{joint}{step:05}.{ending}"), file));
        }
    }
    files
}

/// The camera that captured an output; `None` of flow where the capture before is not known.
fn captured(capture: &SensorCapture, output: CameraOutput) -> Option<&CameraCapture> {
    let is_unknown = |camera: &&CameraCapture| flow_of(camera, output).is_some_and(|flow| flow.flags.is_empty());
    capture.camera().filter(|camera| !is_unknown(camera))
}

fn encode_picture(capture: &SensorCapture, output: Option<CameraOutput>) -> Result<Option<Vec<u8>>> {
    let Some(output) = output else { return Ok(None) };
    captured(capture, output).map(|camera| png(camera, output)).transpose()
}

fn encode_array(capture: &SensorCapture, output: Option<CameraOutput>) -> Result<Option<Vec<u8>>> {
    let Some(output) = output else { return records::encode(&capture.data, npy::encode_records) };
    let array = |camera: &CameraCapture| match output {
        CameraOutput::Boxes => box_records::encode(&camera.boxes),
        _ => array_of(camera, output).encode(),
    };
    captured(capture, output).map(array).transpose()
}

fn encode_flags(capture: &SensorCapture, output: Option<CameraOutput>) -> Result<Option<Vec<u8>>> {
    let Some(output) = output else { return Ok(None) };
    captured(capture, output).map(|camera| flags_of(camera, output).encode()).transpose()
}

fn encode_archive(capture: &SensorCapture, _: Option<CameraOutput>) -> Result<Option<Vec<u8>>> {
    let Some(camera) = capture.camera() else { return records::encode(&capture.data, records::archive_of) };
    let held = CameraOutput::ALL.into_iter().filter(|(_, output)| *output != CameraOutput::Flow);
    let outputs = held.map(|(name, output)| (name, array_of(camera, output)));
    let flags = ("flow_back_flags", flags_of(camera, CameraOutput::FlowBack));
    let arrays = outputs.chain([flags]).filter(|(_, array)| !array.values.is_empty());
    let arrays = arrays.map(|(name, array)| Ok((name, array.encode()?)));
    let has_boxes = camera.outputs.has(CameraOutput::Boxes);
    let boxes = has_boxes.then(|| Ok(("boxes", box_records::encode(&camera.boxes)?)));
    archive(arrays.chain(boxes)).map(Some)
}

fn encode_channels(capture: &SensorCapture, _: Option<CameraOutput>) -> Result<Option<Vec<u8>>> {
    let channels = |camera: &CameraCapture| exr::encode((camera.width, camera.height), &channels(camera));
    capture.camera().map(channels).transpose()
}

/// The flow of an output that is one.
fn flow_of(camera: &CameraCapture, output: CameraOutput) -> Option<&Flow> {
    match output {
        CameraOutput::Flow => Some(&camera.flow),
        CameraOutput::FlowBack => Some(&camera.flow_back),
        _ => None,
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
