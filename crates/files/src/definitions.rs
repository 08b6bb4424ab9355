//! The message types of a recording, as ROS 2 packages define them, fields only.
//!
//! A recording includes them so that readers need no ROS installation: each definition is followed by those it
//! refers to, separated as the `ros2msg` schema encoding of MCAP prescribes. The markers follow `mocap4r2_msgs`,
//! which the drivers of common motion-capture systems publish.

/// A message type: its name, its own fields and the types it refers to.
#[derive(Debug, Clone, Copy)]
pub struct Definition {
    /// Name with package, such as `sensor_msgs/msg/LaserScan`.
    pub name: &'static str,
    fields: &'static str,
    parts: &'static [Part],
}

/// A type referred to by another: name without `msg/`, and fields.
type Part = (&'static str, &'static str);

const TIME: Part = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const HEADER: Part = (
    "std_msgs/Header",
    "builtin_interfaces/Time stamp\nstring frame_id\n",
);
const POINT: Part = ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n");
const VECTOR: Part = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");
const QUATERNION: Part = (
    "geometry_msgs/Quaternion",
    "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
);
const POSE: Part = (
    "geometry_msgs/Pose",
    "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
);
const TRANSFORM: Part = (
    "geometry_msgs/Transform",
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
);
const TRANSFORM_STAMPED: Part = (
    "geometry_msgs/TransformStamped",
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
);
const POINT_FIELD: Part = (
    "sensor_msgs/PointField",
    "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\nuint8 FLOAT32=7\n\
     uint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n",
);
const LASER_ECHO: Part = ("sensor_msgs/LaserEcho", "float32[] echoes\n");
const MARKER: Part = (
    "mocap4r2_msgs/Marker",
    "int8 USE_NAME=0\nint8 USE_INDEX=1\nint8 USE_BOTH=2\nint8 id_type\nint32 marker_index\nstring marker_name\n\
     geometry_msgs/Point translation\n",
);

/// A text.
pub const STRING: Definition = Definition {
    name: "std_msgs/msg/String",
    fields: "string data\n",
    parts: &[],
};

/// One scan of the laser.
pub const LASER_SCAN: Definition = Definition {
    name: "sensor_msgs/msg/LaserScan",
    fields: "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\n\
             float32 time_increment\nfloat32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\n\
             float32[] intensities\n",
    parts: &[HEADER, TIME],
};

/// Every echo of one scan of the laser.
pub const MULTI_ECHO_SCAN: Definition = Definition {
    name: "sensor_msgs/msg/MultiEchoLaserScan",
    fields: "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\n\
             float32 time_increment\nfloat32 scan_time\nfloat32 range_min\nfloat32 range_max\n\
             sensor_msgs/LaserEcho[] ranges\nsensor_msgs/LaserEcho[] intensities\n",
    parts: &[HEADER, TIME, LASER_ECHO],
};

/// Points of one scan.
pub const POINT_CLOUD: Definition = Definition {
    name: "sensor_msgs/msg/PointCloud2",
    fields: "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n\
             bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
    parts: &[HEADER, TIME, POINT_FIELD],
};

/// A tracked body.
pub const POSE_STAMPED: Definition = Definition {
    name: "geometry_msgs/msg/PoseStamped",
    fields: "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
    parts: &[HEADER, TIME, POSE, POINT, QUATERNION],
};

/// The labeled markers of one motion-capture frame.
pub const MARKERS: Definition = Definition {
    name: "mocap4r2_msgs/msg/Markers",
    fields: "std_msgs/Header header\nuint32 frame_number\nmocap4r2_msgs/Marker[] markers\n",
    parts: &[HEADER, TIME, MARKER, POINT],
};

/// Frames and their poses.
pub const TF_MESSAGE: Definition = Definition {
    name: "tf2_msgs/msg/TFMessage",
    fields: "geometry_msgs/TransformStamped[] transforms\n",
    parts: &[TRANSFORM_STAMPED, HEADER, TIME, TRANSFORM, VECTOR, QUATERNION],
};

impl Definition {
    /// The complete text: the fields, then every type they refer to.
    pub fn text(&self) -> String {
        let rule = "=".repeat(80);
        let mut text = self.fields.to_owned();
        for (name, fields) in self.parts {
            text += &format!("{rule}\nMSG: {name}\n{fields}");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Does not check the fields against ROS: `tests/mcap_peers.py` decodes with third-party readers.
    #[test]
    fn every_type_referred_to_is_included() {
        for definition in [
            LASER_SCAN,
            MULTI_ECHO_SCAN,
            POINT_CLOUD,
            POSE_STAMPED,
            MARKERS,
            TF_MESSAGE,
        ] {
            let text = definition.text();
            for line in text.lines().filter(|l| !l.starts_with("MSG:")) {
                let Some((referred, _)) = line.split_once(' ') else {
                    continue;
                };
                let referred = referred.trim_end_matches("[]");
                if referred.contains('/') {
                    assert!(
                        text.contains(&format!("MSG: {referred}\n")),
                        "{}: {referred}",
                        definition.name
                    );
                }
            }
        }
    }
}
