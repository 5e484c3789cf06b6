//! Definitions of messages in the language of ROS 2's `.msg` files, as logs hold them (MCAP's `ros2msg`).
//!
//! Those of ROS are those of Humble to Kilted. Those of Foxglove are those of `foxglove_msgs` 3.0, to whose messages
//! later versions added fields: a reader goes by the text beside the message.

/// Types and their own fields.
const DEFINITIONS: [(&str, &str); 38] = [
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
    (
        "foxglove_msgs/ImageAnnotations",
        "foxglove_msgs/CircleAnnotation[] circles\nfoxglove_msgs/PointsAnnotation[] points\n\
         foxglove_msgs/TextAnnotation[] texts\n",
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
        "foxglove_msgs/SceneUpdate",
        "foxglove_msgs/SceneEntityDeletion[] deletions\nfoxglove_msgs/SceneEntity[] entities\n",
    ),
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
    ("rosgraph_msgs/Clock", "builtin_interfaces/Time clock\n"),
    (
        "sensor_msgs/CameraInfo",
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\n\
         float64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n",
    ),
    ("sensor_msgs/FluidPressure", "std_msgs/Header header\nfloat64 fluid_pressure\nfloat64 variance\n"),
    (
        "sensor_msgs/Image",
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\n\
         uint8[] data\n",
    ),
    (
        "sensor_msgs/Imu",
        "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
         geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
         geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
    ),
    (
        "sensor_msgs/NavSatFix",
        "std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\nfloat64 longitude\n\
         float64 altitude\nfloat64[9] position_covariance\nuint8 position_covariance_type\n",
    ),
    ("sensor_msgs/NavSatStatus", "int8 status\nuint16 service\n"),
    (
        "sensor_msgs/PointCloud2",
        "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\n\
         uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
    ),
    ("sensor_msgs/PointField", "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"),
    (
        "sensor_msgs/RegionOfInterest",
        "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n",
    ),
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"),
    ("tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"),
];

/// Line before the definition of a type that another consists of (MCAP registry, "ros2msg").
const SEPARATOR: &str = "================================================================================\nMSG: ";

/// The definition of a type (`sensor_msgs/msg/Image`) and of all that it consists of. Empty for a type that is unknown.
pub fn definition(message: &str) -> String {
    let wanted = message.replacen("/msg/", "/", 1);
    let mut text = own(&wanted).to_owned();
    let mut parts = parts(&wanted);
    let mut next = 0;
    while let Some(&part) = parts.get(next) {
        text += &format!("{SEPARATOR}{part}\n{}", own(part));
        let new: Vec<&str> = self::parts(part).into_iter().filter(|new| !parts.contains(new)).collect();
        parts.extend(new);
        next += 1;
    }
    text
}

fn own(wanted: &str) -> &'static str {
    DEFINITIONS.iter().find(|(name, _)| *name == wanted).map_or("", |(_, fields)| fields)
}

/// The types that the fields of one have, each once; not those that every language has.
fn parts(wanted: &str) -> Vec<&'static str> {
    let mut parts = Vec::new();
    for line in own(wanted).lines() {
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
        assert_eq!(definition("tf2_msgs/msg/TFMessage"), expected);
    }

    #[test]
    fn every_part_is_defined() {
        for (name, fields) in DEFINITIONS {
            assert!(fields.ends_with('\n'), "{name}");
            parts(name).into_iter().for_each(|part| assert_ne!(own(part), "", "{part} of {name}"));
        }
    }
}
