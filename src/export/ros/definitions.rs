//! Definitions of messages in the language of ROS 2's `.msg` files, as logs hold them (MCAP's `ros2msg`). A message has
//! its own fields ([`super::Message::FIELDS`]); those of its parts are here.
//!
//! Those of ROS are those of Humble to Kilted. Those of Foxglove are those of `foxglove_msgs` 3.0, to whose messages
//! later versions added fields: a reader goes by the text beside the message.

/// Types that messages consist of, and their own fields.
const PARTS: [(&str, &str); 28] = [
    ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"),
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    (
        "foxglove_msgs/ArrowPrimitive",
        "geometry_msgs/Pose pose\nfloat64 shaft_length\nfloat64 shaft_diameter\nfloat64 head_length\n\
         float64 head_diameter\nfoxglove_msgs/Color color\n",
    ),
    (
        "foxglove_msgs/CircleAnnotation",
        "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nfloat64 diameter\nfloat64 thickness\n\
         foxglove_msgs/Color fill_color\nfoxglove_msgs/Color outline_color\n",
    ),
    ("foxglove_msgs/Color", "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n"),
    ("foxglove_msgs/CubePrimitive", "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfoxglove_msgs/Color color\n"),
    (
        "foxglove_msgs/CylinderPrimitive",
        "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfloat64 bottom_scale\nfloat64 top_scale\n\
         foxglove_msgs/Color color\n",
    ),
    ("foxglove_msgs/KeyValuePair", "string key\nstring value\n"),
    (
        "foxglove_msgs/LinePrimitive",
        "uint8 type\ngeometry_msgs/Pose pose\nfloat64 thickness\nbool scale_invariant\n\
         geometry_msgs/Point[] points\nfoxglove_msgs/Color color\nfoxglove_msgs/Color[] colors\nuint32[] indices\n",
    ),
    (
        "foxglove_msgs/ModelPrimitive",
        "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nfoxglove_msgs/Color color\nbool override_color\n\
         string url\nstring media_type\nuint8[] data\n",
    ),
    ("foxglove_msgs/Point2", "float64 x\nfloat64 y\n"),
    (
        "foxglove_msgs/PointsAnnotation",
        "builtin_interfaces/Time timestamp\nuint8 type\nfoxglove_msgs/Point2[] points\n\
         foxglove_msgs/Color outline_color\nfoxglove_msgs/Color[] outline_colors\nfoxglove_msgs/Color fill_color\n\
         float64 thickness\n",
    ),
    (
        "foxglove_msgs/SceneEntity",
        "builtin_interfaces/Time timestamp\nstring frame_id\nstring id\nbuiltin_interfaces/Duration lifetime\n\
         bool frame_locked\nfoxglove_msgs/KeyValuePair[] metadata\nfoxglove_msgs/ArrowPrimitive[] arrows\n\
         foxglove_msgs/CubePrimitive[] cubes\nfoxglove_msgs/SpherePrimitive[] spheres\n\
         foxglove_msgs/CylinderPrimitive[] cylinders\nfoxglove_msgs/LinePrimitive[] lines\n\
         foxglove_msgs/TriangleListPrimitive[] triangles\nfoxglove_msgs/TextPrimitive[] texts\n\
         foxglove_msgs/ModelPrimitive[] models\n",
    ),
    ("foxglove_msgs/SceneEntityDeletion", "builtin_interfaces/Time timestamp\nuint8 type\nstring id\n"),
    (
        "foxglove_msgs/SpherePrimitive",
        "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfoxglove_msgs/Color color\n",
    ),
    (
        "foxglove_msgs/TextAnnotation",
        "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nstring text\nfloat64 font_size\n\
         foxglove_msgs/Color text_color\nfoxglove_msgs/Color background_color\n",
    ),
    (
        "foxglove_msgs/TextPrimitive",
        "geometry_msgs/Pose pose\nbool billboard\nfloat64 font_size\nbool scale_invariant\n\
         foxglove_msgs/Color color\nstring text\n",
    ),
    (
        "foxglove_msgs/TriangleListPrimitive",
        "geometry_msgs/Pose pose\ngeometry_msgs/Point[] points\nfoxglove_msgs/Color color\n\
         foxglove_msgs/Color[] colors\nuint32[] indices\n",
    ),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"),
    ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"),
    ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    ),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("sensor_msgs/NavSatStatus", "int8 status\nuint16 service\n"),
    ("sensor_msgs/PointField", "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"),
    (
        "sensor_msgs/RegionOfInterest",
        "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n",
    ),
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"),
];

/// Line before the definition of a type that another consists of (MCAP registry, "ros2msg").
const SEPARATOR: &str = "================================================================================\nMSG: ";

/// The definition of a message whose own fields these are, with those of all that they consist of.
pub fn definition(fields: &str) -> String {
    let mut text = fields.to_owned();
    let mut parts = parts(fields);
    let mut next = 0;
    while let Some(&part) = parts.get(next) {
        let fields = own(part);
        text += &format!("{SEPARATOR}{part}\n{fields}");
        let new: Vec<&str> = self::parts(fields).into_iter().filter(|new| !parts.contains(new)).collect();
        parts.extend(new);
        next += 1;
    }
    text
}

fn own(wanted: &str) -> &'static str {
    PARTS.iter().find(|(name, _)| *name == wanted).map_or("", |(_, fields)| fields)
}

/// The types that fields have, each once; not those that every language has.
fn parts(fields: &str) -> Vec<&str> {
    let mut parts = Vec::new();
    for line in fields.lines() {
        let field_type = line.split(['[', ' ']).next().unwrap_or_default();
        if field_type.contains('/') && !parts.contains(&field_type) {
            parts.push(field_type);
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::ros::{Message, TfMessage};

    #[test]
    fn a_definition_brings_those_of_its_parts_each_once() {
        let expected = format!(
            "geometry_msgs/TransformStamped[] transforms\n\
             {SEPARATOR}geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n\
             geometry_msgs/Transform transform\n\
             {SEPARATOR}std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
             {SEPARATOR}geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\n\
             geometry_msgs/Quaternion rotation\n\
             {SEPARATOR}builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n\
             {SEPARATOR}geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n\
             {SEPARATOR}geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
        );
        assert_eq!(definition(TfMessage::FIELDS), expected);
    }

    #[test]
    fn every_part_is_defined() {
        for (name, fields) in PARTS {
            assert!(fields.ends_with('\n'), "{name}");
            parts(fields).into_iter().for_each(|part| assert_ne!(own(part), "", "{part} of {name}"));
        }
    }
}
