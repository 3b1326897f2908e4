//! The messages of ROS 2 that are read, and their CDR encoding [OMG DDSI-RTPS 2.3, § 10].
//!
//! Each type is stated as far as it is needed, from its beginning: what follows in the message is not looked at.

use super::error::MessageProblem;
use super::stamp::Nanoseconds;
use byteorder::{BigEndian, LittleEndian};
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// `builtin_interfaces/msg/Time`
#[derive(Debug, Deserialize)]
pub(super) struct Time {
    sec: i32,
    nanosec: u32,
}

/// `std_msgs/msg/Header`
#[derive(Debug, Deserialize)]
pub(super) struct Header {
    pub(super) stamp: Time,
    pub(super) frame_id: String,
}

/// `sensor_msgs/msg/JointState`
#[derive(Debug, Deserialize)]
pub(super) struct JointState {
    pub(super) header: Header,
    pub(super) name: Vec<String>,
    pub(super) position: Vec<f64>,
}

/// `geometry_msgs/msg/Pose` and `geometry_msgs/msg/Transform`, which are laid out alike.
#[derive(Debug, Deserialize)]
pub(super) struct Pose {
    pub(super) position: [f64; 3],
    /// x, y, z, w.
    pub(super) orientation: [f64; 4],
}

/// `geometry_msgs/msg/PoseStamped` and `geometry_msgs/msg/PoseWithCovarianceStamped`.
#[derive(Debug, Deserialize)]
pub(super) struct PoseStamped {
    pub(super) header: Header,
    pub(super) pose: Pose,
}

/// `nav_msgs/msg/Odometry`, and an element of `tf2_msgs/msg/TFMessage`, which begins alike.
#[derive(Debug, Deserialize)]
pub(super) struct ChildPose {
    pub(super) header: Header,
    pub(super) child_frame_id: String,
    pub(super) pose: Pose,
}

/// `tf2_msgs/msg/TFMessage`
#[derive(Debug, Deserialize)]
pub(super) struct Transforms {
    pub(super) transforms: Vec<ChildPose>,
}

impl Time {
    pub(super) fn nanoseconds(&self) -> Nanoseconds {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }
}

/// Reads a message with its four bytes of encapsulation.
pub(super) fn decode<T: DeserializeOwned>(data: &[u8]) -> Result<T, MessageProblem> {
    let Some((&[first, second, _, _], body)) = data.split_first_chunk::<4>() else {
        return Err(MessageProblem::Short { bytes: data.len() });
    };
    match (first, second) {
        (0, 0) => cdr_encoding::from_bytes::<T, BigEndian>(body),
        (0, 1) => cdr_encoding::from_bytes::<T, LittleEndian>(body),
        _ => return Err(MessageProblem::Encapsulation { first, second }),
    }
    .map(|(message, _)| message)
    .map_err(|source| MessageProblem::Cdr { source: source.into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A JointState of one joint `ab` at 1.5 rad, stamped 7.000000009 s, byte by byte as the standard lays it out.
    #[test]
    fn a_message_by_hand() {
        let mut data = vec![0, 1, 0, 0];
        data.extend(7_i32.to_le_bytes());
        data.extend(9_u32.to_le_bytes());
        data.extend([1, 0, 0, 0, 0, 0, 0, 0]); // frame_id: one byte, its null, and three of padding
        data.extend([1, 0, 0, 0, 3, 0, 0, 0, b'a', b'b', 0, 0]); // one name of three bytes, one of padding
        data.extend([1, 0, 0, 0]); // one position; then padding to a multiple of eight, counted after the encapsulation
        assert_eq!((data.len() - 4) % 8, 0);
        data.extend(1.5_f64.to_le_bytes());
        let message: JointState = decode(&data).expect("it is whole");
        assert_eq!(message.header.stamp.nanoseconds(), 7_000_000_009);
        assert_eq!((message.name, message.position), (vec!["ab".to_owned()], vec![1.5]));
        for cut in 0..data.len() {
            assert!(decode::<JointState>(&data[..cut]).is_err(), "{cut} bytes");
        }
        data[1] = 3;
        assert!(matches!(decode::<JointState>(&data), Err(MessageProblem::Encapsulation { first: 0, second: 3 })));
    }
}
