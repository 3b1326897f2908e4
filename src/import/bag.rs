//! MCAP bags, as rosbag2 writes them: which topics are there, and the readings of two of them.
//!
//! A bag is read once and in order, record by record, so that hours of camera pictures beside the wheels cost time but
//! no memory: only messages of a type that may matter are kept, the rest is counted.

use super::cdr::{self, ChildPose, JointState, PoseStamped, Transforms};
use super::error::{ImportError, MessageProblem, Readable};
use super::finding::Finding;
use super::log::{FromAbove, Log, Planar, Row, Wheels};
use super::stamp::{Nanoseconds, seconds};
use super::{Clock, Options, PoseSource};
use crate::dataset::EncoderUnit;
use crate::geometry::Pose2;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Types that encoders come in.
const WHEEL_TYPES: &[&str] = &["sensor_msgs/msg/JointState"];
/// Types that poses come in.
const POSE_TYPES: &[&str] = &[
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "nav_msgs/msg/Odometry",
    "tf2_msgs/msg/TFMessage",
];

/// Bytes that are asked of the file at once.
const READ_AT_ONCE: usize = 1 << 20;
/// No message of joints or poses is longer; a length beyond it is a damaged one \[bytes\].
const LONGEST_RECORD: usize = 1 << 31;

/// A bag.
#[derive(Default)]
struct Bag {
    topics: BTreeMap<String, Topic>,
}

/// What is known of a topic.
#[derive(Default)]
struct Topic {
    /// `None`: the bag has no schema for it.
    kind: Option<String>,
    encoding: String,
    messages: u64,
    readings: Readings,
    /// The first message that could not be read, its number and when it was logged.
    problem: Option<(u64, Nanoseconds, MessageProblem)>,
}

#[derive(Default)]
enum Readings {
    /// Not kept.
    #[default]
    None,
    Joints(Vec<Row<Joints>>),
    /// By frame and child frame.
    Poses(BTreeMap<(String, String), Vec<Row<cdr::Pose>>>),
}

/// The joints of a message and where they are \[rad, or whatever was put there\].
struct Joints {
    names: Arc<[String]>,
    positions: Vec<f64>,
}

/// Reads the bag at `path`, a file or the folder of a rosbag2, and takes encoders and poses from it.
pub(super) fn read(path: &Path, options: &Options, findings: &mut Vec<Finding>) -> Result<Log, ImportError> {
    let mut bag = Bag::default();
    for file in files(path)? {
        bag.read(&file)?;
    }
    let name = super::stem(path);
    let (wheels, took_wheels) = bag.wheels(path, options)?;
    let (poses, took_poses, dropouts) = match &options.pose {
        PoseSource::Nowhere => (Vec::new(), "no poses".to_owned(), 0),
        PoseSource::Found => bag.poses(path, None, options)?,
        PoseSource::Topic(topic) => bag.poses(path, Some(topic), options)?,
    };
    findings.push(Finding::Took { log: name.clone(), wheels: took_wheels, poses: took_poses });
    if dropouts > 0 {
        findings.push(Finding::Dropouts { log: name.clone(), count: dropouts });
    }
    Ok(Log { name, path: path.to_owned(), wheels, poses, own_arrivals: true })
}

/// Whether `path` is a bag.
pub(super) fn is_bag(path: &Path) -> bool {
    path.is_dir() || super::has_ending(path, &["mcap"])
}

/// The files of a bag.
fn files(path: &Path) -> Result<Vec<PathBuf>, ImportError> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let cannot = |source| ImportError::Read { path: path.to_owned(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(cannot)? {
        let file = entry.map_err(cannot)?.path();
        if super::has_ending(&file, &["mcap"]) {
            files.push(file);
        }
    }
    if files.is_empty() {
        return Err(ImportError::Format { path: path.to_owned() });
    }
    files.sort();
    Ok(files)
}

impl Bag {
    /// Adds the messages of one file.
    fn read(&mut self, path: &Path) -> Result<(), ImportError> {
        let cannot = |source| ImportError::Read { path: path.to_owned(), source };
        let mut file = File::open(path).map_err(cannot)?;
        let mut reader = LinearReader::new_with_options(
            LinearReaderOptions::default().with_validate_chunk_crcs(true).with_record_length_limit(LONGEST_RECORD),
        );
        let mut schemas: HashMap<u16, String> = HashMap::new();
        let mut channels: HashMap<u16, String> = HashMap::new();
        let mut names: Option<Arc<[String]>> = None;
        let mut bytes: u64 = 0;
        while let Some(event) = reader.next_event() {
            let step = match event {
                Ok(LinearReadEvent::ReadRequest(wanted)) => {
                    let read = file.read(reader.insert(wanted.min(READ_AT_ONCE))).map_err(cannot)?;
                    reader.notify_read(read);
                    bytes += read as u64;
                    continue;
                }
                Ok(LinearReadEvent::Record { data, opcode }) => mcap::parse_record(opcode, data),
                Err(error) => Err(error),
            };
            match step {
                Ok(Record::Schema { header, .. }) => {
                    schemas.insert(header.id, header.name);
                }
                Ok(Record::Channel(channel)) => {
                    let topic = self.topics.entry(channel.topic.clone()).or_default();
                    topic.kind = schemas.get(&channel.schema_id).cloned();
                    topic.encoding = channel.message_encoding;
                    channels.insert(channel.id, channel.topic);
                }
                Ok(Record::Message { header, data }) => {
                    let topic = channels.get(&header.channel_id).and_then(|topic| self.topics.get_mut(topic));
                    let Some(topic) = topic else {
                        let source = mcap::McapError::UnknownChannel(header.sequence, header.channel_id).into();
                        return Err(self.damaged(path, bytes, source));
                    };
                    topic.take(header.log_time as Nanoseconds, &data, &mut names);
                }
                Ok(_) => {}
                Err(mcap::McapError::UnexpectedEof) => {
                    return Err(ImportError::Truncated { path: path.to_owned(), bytes, read: self.readable().into() });
                }
                Err(mcap::McapError::BadMagic) if self.topics.is_empty() => {
                    return Err(ImportError::Format { path: path.to_owned() });
                }
                Err(error) => return Err(self.damaged(path, bytes, error.into())),
            }
        }
        Ok(())
    }

    fn damaged(&self, path: &Path, byte: u64, source: Box<dyn std::error::Error + Send + Sync>) -> ImportError {
        ImportError::Damaged { path: path.to_owned(), byte, source, read: self.readable().into() }
    }

    /// What there is, for messages.
    fn readable(&self) -> Readable {
        let topics = self.topics.iter().map(|(name, topic)| (name.clone(), topic.type_name(), topic.messages));
        Readable { topics: topics.collect() }
    }

    /// The topic that was asked for, which must be of one of the `allowed` types.
    fn asked(
        &self,
        path: &Path,
        option: &'static str,
        name: &str,
        allowed: &'static [&'static str],
    ) -> Result<&Topic, ImportError> {
        let read = || Box::new(self.readable());
        let Some(topic) = self.topics.get(name) else {
            return Err(ImportError::NoTopic { path: path.to_owned(), option, topic: name.to_owned(), read: read() });
        };
        let Some(kind) = &topic.kind else {
            let (topic, messages) = (name.to_owned(), topic.messages);
            return Err(ImportError::NoSchema { path: path.to_owned(), topic, messages, read: read() });
        };
        if !allowed.contains(&kind.as_str()) || topic.encoding != "cdr" {
            let found = topic.type_name();
            return Err(ImportError::TopicType {
                path: path.to_owned(),
                option,
                topic: name.to_owned(),
                found,
                allowed,
            });
        }
        Ok(topic)
    }

    /// Topics of one of these types that have messages.
    fn of_types(&self, types: &[&str]) -> Vec<&str> {
        self.topics
            .iter()
            .filter(|(_, topic)| topic.encoding == "cdr" && topic.messages > 0)
            .filter(|(_, topic)| topic.kind.as_ref().is_some_and(|kind| types.contains(&kind.as_str())))
            .map(|(name, _)| name.as_str())
            .collect()
    }

    /// Where nothing fits although something without a type might: that is the error to tell.
    fn no_candidate(
        &self,
        path: &Path,
        what: &'static str,
        option: &'static str,
        doubtful: Vec<String>,
    ) -> ImportError {
        let path = path.to_owned();
        let read = Box::new(self.readable());
        match self.topics.iter().find(|(_, topic)| topic.kind.is_none() && topic.messages > 0) {
            Some((topic, facts)) if doubtful.is_empty() => {
                ImportError::NoSchema { path, topic: topic.clone(), messages: facts.messages, read }
            }
            _ => ImportError::NoCandidate { path, what, option, doubtful, read },
        }
    }

    /// The encoders, and in words where they come from.
    fn wheels(&self, path: &Path, options: &Options) -> Result<(Wheels, String), ImportError> {
        let what = "the encoders";
        let name = match &options.encoders {
            Some(name) => name.as_str(),
            None => match self.of_types(WHEEL_TYPES).as_slice() {
                [name] => name,
                [] => return Err(self.no_candidate(path, what, "--encoders", Vec::new())),
                several => {
                    let candidates = several.iter().map(|name| (*name).to_owned()).collect();
                    let option = "--encoders TOPIC";
                    return Err(ImportError::Ambiguous { path: path.to_owned(), what, option, candidates });
                }
            },
        };
        let topic = self.asked(path, "--encoders", name, WHEEL_TYPES)?;
        topic.check_read(path, name)?;
        let empty = Vec::new();
        let rows = if let Readings::Joints(rows) = &topic.readings { rows } else { &empty };
        let known: BTreeSet<&str> = rows.iter().flat_map(|row| row.value.names.iter().map(String::as_str)).collect();
        let [left, right] = sides(path, name, &known, options)?;
        let joints: Vec<&String> = left.iter().chain(&right).collect();
        let mut wheels = Wheels {
            unit: options.unit.unwrap_or(EncoderUnit::Radians),
            channels: channel_names(&left, "left").into_iter().chain(channel_names(&right, "right")).collect(),
            rows: Vec::new(),
        };
        for (index, row) in rows.iter().enumerate() {
            let at = |joint: &String| row.value.names.iter().position(|name| name == joint);
            let Some(places) = joints.iter().map(|joint| at(joint)).collect::<Option<Vec<usize>>>() else { continue };
            let mut value = Vec::with_capacity(places.len());
            for (place, joint) in places.into_iter().zip(&joints) {
                let position = row.value.positions[place];
                if !position.is_finite() {
                    let problem = MessageProblem::NotFinite { joint: (*joint).clone(), value: position };
                    return Err(message(path, name, index as u64 + 1, row.arrival, problem));
                }
                value.push(position);
            }
            wheels.rows.push(Row { stamp: options.clock.of(row), arrival: row.arrival, value });
        }
        if wheels.rows.is_empty() {
            let joints = joints.into_iter().cloned().collect();
            let topic = name.to_owned();
            return Err(ImportError::JointsApart { path: path.to_owned(), topic, messages: rows.len(), joints });
        }
        check_stamped(path, name, &wheels.rows)?;
        if options.unit.is_none() {
            check_unit(path, name, &joints, &wheels)?;
        }
        wheels.rows.sort_by_key(|row| row.arrival);
        Ok((wheels, format!("encoders from {name} (left: {}; right: {})", left.join(", "), right.join(", "))))
    }

    /// The surveyed poses, in words where they come from, and how many were not measured.
    fn poses(
        &self,
        path: &Path,
        asked: Option<&String>,
        options: &Options,
    ) -> Result<(Vec<Row<Pose2>>, String, usize), ImportError> {
        let what = "the surveyed pose";
        let name = match asked {
            Some(name) => name.as_str(),
            None => {
                let candidates: Vec<&str> =
                    self.of_types(POSE_TYPES).into_iter().filter(|name| self.topics[*name].messages > 1).collect();
                let (doubtful, sure): (Vec<&str>, Vec<&str>) =
                    candidates.into_iter().partition(|name| self.may_be_dead_reckoning(name, options));
                let owned = |names: Vec<&str>| names.into_iter().map(str::to_owned).collect::<Vec<_>>();
                match *sure.as_slice() {
                    [name] => name,
                    [] => return Err(self.no_candidate(path, what, "--pose", owned(doubtful))),
                    _ => {
                        let (candidates, option) = (owned(sure), "--pose TOPIC");
                        return Err(ImportError::Ambiguous { path: path.to_owned(), what, option, candidates });
                    }
                }
            }
        };
        let topic = self.asked(path, "--pose", name, POSE_TYPES)?;
        topic.check_read(path, name)?;
        let Readings::Poses(by_frames) = &topic.readings else { return Ok((Vec::new(), String::new(), 0)) };
        let pair = |(parent, child): &(String, String)| format!("{parent}/{child}");
        let there = || by_frames.keys().map(pair).collect::<Vec<_>>();
        let chosen = match &options.frame {
            Some(frame) => by_frames.get_key_value(frame).ok_or_else(|| ImportError::NotInTopic {
                path: path.to_owned(),
                option: "--frame",
                asked: pair(frame),
                topic: name.to_owned(),
                there: there(),
            })?,
            None if by_frames.len() > 1 => {
                return Err(ImportError::Ambiguous {
                    path: path.to_owned(),
                    what: "the surveyed pose, as parent/child frame,",
                    option: "--frame PARENT/CHILD",
                    candidates: there(),
                });
            }
            None => match by_frames.first_key_value() {
                Some(only) => only,
                None => return Ok((Vec::new(), format!("no poses ({name} is empty)"), 0)),
            },
        };
        let mut above = FromAbove::default();
        let mut rows = Vec::new();
        let fails = |number: usize, arrival, problem| {
            message(path, name, number as u64 + 1, arrival, MessageProblem::Pose(problem))
        };
        for (index, row) in chosen.1.iter().enumerate() {
            let seen = above.see(row.value.position, row.value.orientation);
            if let Planar::Pose(value) = seen.map_err(|problem| fails(index, row.arrival, problem))? {
                rows.push(Row { stamp: options.clock.of(row), arrival: row.arrival, value });
            }
        }
        let last = chosen.1.last().map_or(0, |row| row.arrival);
        above.check().map_err(|problem| fails(chosen.1.len().saturating_sub(1), last, problem))?;
        check_stamped(path, name, &rows)?;
        rows.sort_by_key(|row| row.arrival);
        Ok((rows, format!("poses from {name} ({})", pair(chosen.0)), above.dropouts))
    }

    /// A robot's own odometry is published in the same types as a survey; taken for one, it would find no error at all.
    fn may_be_dead_reckoning(&self, name: &str, options: &Options) -> bool {
        let topic = &self.topics[name];
        let odometry = |text: &str| text.to_lowercase().contains("odom");
        match &topic.readings {
            // Frames that were chosen were thought about.
            Readings::Poses(by_frames) if options.frame.as_ref().is_none_or(|frame| !by_frames.contains_key(frame)) => {
                odometry(name) || by_frames.keys().any(|(parent, _)| odometry(parent))
            }
            _ => false,
        }
    }
}

impl Topic {
    /// Its type for messages.
    fn type_name(&self) -> String {
        match &self.kind {
            None => "no schema".to_owned(),
            Some(kind) if self.encoding == "cdr" => kind.clone(),
            Some(kind) => format!("{kind} in `{}`, not `cdr`", self.encoding),
        }
    }

    /// Counts a message, and keeps it if it may matter.
    fn take(&mut self, arrival: Nanoseconds, data: &[u8], names: &mut Option<Arc<[String]>>) {
        self.messages += 1;
        if self.encoding != "cdr" || self.problem.is_some() {
            return;
        }
        let kind = self.kind.as_deref().unwrap_or("");
        let read = match kind {
            "sensor_msgs/msg/JointState" => self.take_joints(arrival, data, names),
            "geometry_msgs/msg/PoseStamped" | "geometry_msgs/msg/PoseWithCovarianceStamped" => {
                cdr::decode::<PoseStamped>(data).map(|PoseStamped { header, pose }| {
                    self.take_pose(arrival, ChildPose { header, child_frame_id: String::new(), pose });
                })
            }
            "nav_msgs/msg/Odometry" => cdr::decode::<ChildPose>(data).map(|pose| self.take_pose(arrival, pose)),
            "tf2_msgs/msg/TFMessage" => cdr::decode::<Transforms>(data).map(|message| {
                message.transforms.into_iter().for_each(|pose| self.take_pose(arrival, pose));
            }),
            _ => return,
        };
        self.problem = read.err().map(|problem| (self.messages, arrival, problem));
    }

    fn take_joints(
        &mut self,
        arrival: Nanoseconds,
        data: &[u8],
        names: &mut Option<Arc<[String]>>,
    ) -> Result<(), MessageProblem> {
        let message: JointState = cdr::decode(data)?;
        if message.name.len() != message.position.len() {
            let (names, positions) = (message.name.len(), message.position.len());
            return Err(MessageProblem::Positions { names, positions });
        }
        // As good as every message names the same joints.
        let known = match names {
            Some(known) if **known == *message.name => Arc::clone(known),
            _ => Arc::clone(names.insert(message.name.into())),
        };
        let row = Row {
            stamp: message.header.stamp.nanoseconds(),
            arrival,
            value: Joints { names: known, positions: message.position },
        };
        match &mut self.readings {
            Readings::Joints(rows) => rows.push(row),
            readings => *readings = Readings::Joints(vec![row]),
        }
        Ok(())
    }

    fn take_pose(&mut self, arrival: Nanoseconds, pose: ChildPose) {
        let frames = (pose.header.frame_id, pose.child_frame_id);
        let row = Row { stamp: pose.header.stamp.nanoseconds(), arrival, value: pose.pose };
        if !matches!(self.readings, Readings::Poses(_)) {
            self.readings = Readings::Poses(BTreeMap::new());
        }
        if let Readings::Poses(by_frames) = &mut self.readings {
            by_frames.entry(frames).or_default().push(row);
        }
    }

    /// That every message of it could be read.
    fn check_read(&self, path: &Path, name: &str) -> Result<(), ImportError> {
        match &self.problem {
            None => Ok(()),
            Some((number, arrival, problem)) => Err(message(path, name, *number, *arrival, problem.clone())),
        }
    }
}

impl Clock {
    fn of<T>(self, row: &Row<T>) -> Nanoseconds {
        match self {
            Clock::Header => row.stamp,
            Clock::Log => row.arrival,
        }
    }
}

fn message(path: &Path, topic: &str, number: u64, arrival: Nanoseconds, problem: MessageProblem) -> ImportError {
    let (path, topic, log_time) = (path.to_owned(), topic.to_owned(), seconds(arrival));
    ImportError::Message { path, topic, number, log_time, problem }
}

fn check_stamped<T>(path: &Path, topic: &str, rows: &[Row<T>]) -> Result<(), ImportError> {
    if rows.len() > 1 && rows.iter().all(|row| row.stamp == 0) {
        return Err(ImportError::NoStamps { path: path.to_owned(), topic: topic.to_owned() });
    }
    Ok(())
}

/// A wheel that turned through whole radians only is none.
fn check_unit(path: &Path, topic: &str, joints: &[&String], wheels: &Wheels) -> Result<(), ImportError> {
    for (channel, joint) in joints.iter().enumerate() {
        let values = || wheels.rows.iter().map(|row| row.value[channel]);
        let largest = values().fold(0.0, |largest: f64, value| largest.max(value.abs()));
        if largest > 0.0 && values().all(|value| value.fract() == 0.0) {
            let (path, topic, joint) = (path.to_owned(), topic.to_owned(), (*joint).clone());
            return Err(ImportError::UnitInDoubt { path, topic, joint, largest });
        }
    }
    Ok(())
}

/// The left and the right wheels among the joints of a topic.
fn sides(path: &Path, topic: &str, known: &BTreeSet<&str>, options: &Options) -> Result<[Vec<String>; 2], ImportError> {
    let there = || known.iter().map(|joint| (*joint).to_owned()).collect::<Vec<_>>();
    for (option, asked) in [("--left", &options.left), ("--right", &options.right)] {
        if let Some(joint) = asked.iter().find(|joint| !known.contains(joint.as_str())) {
            return Err(ImportError::NotInTopic {
                path: path.to_owned(),
                option,
                asked: joint.clone(),
                topic: topic.to_owned(),
                there: there(),
            });
        }
    }
    if !options.left.is_empty() && !options.right.is_empty() {
        return Ok([options.left.clone(), options.right.clone()]);
    }
    // Casters have wheels too, and arms have sides.
    let sided = |only_wheels: bool| {
        [("left", ["l", "fl", "rl", "bl", "ml"]), ("right", ["r", "fr", "rr", "br", "mr"])].map(|(side, short)| {
            let belongs = |joint: &&&str| {
                let name = joint.to_lowercase();
                let word = name.split(|c: char| !c.is_alphanumeric()).any(|word| short.contains(&word));
                (name.contains(side) || word)
                    && !["caster", "castor", "steer"].iter().any(|other| name.contains(other))
                    && (!only_wheels || name.contains("wheel"))
            };
            known.iter().filter(belongs).map(|joint| (*joint).to_owned()).collect::<Vec<String>>()
        })
    };
    let mut found = sided(true);
    if found.iter().all(Vec::is_empty) {
        found = sided(false);
        if found[0].len() > 1 {
            found = [Vec::new(), Vec::new()];
        }
    }
    let distinct = found[0].iter().all(|joint| !found[1].contains(joint));
    if found[0].is_empty() || found[0].len() != found[1].len() || !distinct {
        return Err(ImportError::Ambiguous {
            path: path.to_owned(),
            what: "the left and the right wheels",
            option: "--left JOINT[,JOINT] and --right JOINT[,JOINT]",
            candidates: there(),
        });
    }
    Ok(found)
}

/// Names of the columns of `encoders.csv`: they end with the side.
fn channel_names(joints: &[String], side: &str) -> Vec<String> {
    if joints.len() == 1 {
        return vec![side.to_owned()];
    }
    let place = |joint: &String| {
        let name = joint.to_lowercase();
        ["front", "rear", "back", "middle"].into_iter().find(|place| name.contains(place))
    };
    let places: BTreeSet<_> = joints.iter().filter_map(place).collect();
    joints
        .iter()
        .enumerate()
        .map(|(index, joint)| match place(joint).filter(|_| places.len() == joints.len()) {
            Some(place) => format!("{place}_{side}"),
            None => format!("{}_{side}", index + 1),
        })
        .collect()
}
