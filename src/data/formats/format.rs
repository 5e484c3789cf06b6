//! Forms of files, and what they hold.

use systems::sensors::{CameraOutput, CameraSensor, Sensor, SensorKind};

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
    /// Labels of things and of all pixels, of the whole run.
    Coco,
    /// A folder of that data set for each camera.
    Kitti,
    /// A film for each output.
    Video,
}

impl FileFormat {
    /// All, with their names. Those that have files for each capture end the names of these.
    pub const ALL: [(&'static str, Self); 8] = [
        ("png", Self::Png),
        ("npy", Self::Npy),
        ("npz", Self::Npz),
        ("exr", Self::Exr),
        ("mcap", Self::Mcap),
        ("coco", Self::Coco),
        ("kitti", Self::Kitti),
        ("video", Self::Video),
    ];

    /// Tells if it has files of their own for each sensor's captures; else it is made of a run as a whole.
    pub(crate) fn is_per_capture(self) -> bool {
        matches!(self, Self::Png | Self::Npy | Self::Npz | Self::Exr)
    }

    /// Endings of its files' names, in sensors' folders and in its own.
    pub(crate) fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Png => &["png"],
            Self::Npy => &["npy"],
            Self::Npz => &["npz"],
            Self::Exr => &["exr"],
            Self::Mcap => &[],
            Self::Coco => &["png", "json"],
            Self::Kitti => &["png", "txt", "bin", "label"],
            Self::Video => &["mp4"],
        }
    }

    /// Tells if it has a form for an output of a camera.
    pub(super) fn has_form(self, output: CameraOutput) -> bool {
        use CameraOutput::{Boxes, Class, Color, Depth, Flow, FlowBack, Instance, Linear};
        match self {
            Self::Png => !matches!(output, Linear | Boxes),
            Self::Npy => true,
            // What is in one file is of one picture; flow to the next is known with that.
            Self::Npz => output != Flow,
            Self::Exr => !matches!(output, Color | Boxes | Flow),
            Self::Mcap => matches!(output, Color | Depth | Class | Instance | Boxes),
            Self::Coco => matches!(output, Color | Class | Instance),
            Self::Kitti => matches!(output, Color | Depth | Class | Boxes | Flow),
            Self::Video => !matches!(output, Flow | FlowBack),
        }
    }

    /// Tells if it holds an output of a camera that has it.
    pub(crate) fn holds(self, camera: &CameraSensor, output: CameraOutput) -> bool {
        let has = |output| camera.outputs.has(output);
        let is_for_camera = match self {
            // Labels are of pictures.
            Self::Coco => [CameraOutput::Color, CameraOutput::Instance, CameraOutput::Class].into_iter().all(has),
            // Its pictures are those of pinholes.
            Self::Kitti => has(CameraOutput::Color) && camera.intrinsics().is_some() && !camera.lens.has_distortion(),
            _ => true,
        };
        is_for_camera && self.has_form(output)
    }

    /// Tells if it holds something of a sensor.
    pub(crate) fn holds_any(self, sensor: &Sensor) -> bool {
        match &sensor.kind {
            SensorKind::Camera(camera) => camera.outputs.iter().any(|(_, output)| self.holds(camera, output)),
            kind => self.holds_records(kind),
        }
    }
    /// Tells if it has a form for the records of a sensor that is no camera.
    fn holds_records(self, kind: &SensorKind) -> bool {
        match self {
            Self::Npy | Self::Npz => true,
            // No message that readers know is of these.
            Self::Mcap => !matches!(kind, SensorKind::Collision(_) | SensorKind::Lane(_)),
            Self::Kitti => matches!(kind, SensorKind::Lidar(_)),
            _ => false,
        }
    }
}
