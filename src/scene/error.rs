//! What can be wrong with a robot or a world file.

use super::misread::Misread;
use crate::strict::TomlProblem;
use std::path::PathBuf;

/// A robot or world that cannot be loaded. Each message names the file, the place, the value and what is allowed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A file that cannot be read.
    #[error("{}: cannot be read: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Neither a file nor a shipped name.
    #[error("{given}: no such {kind} file, and no shipped {kind} of that name; shipped are: {}", shipped.join(", "))]
    NotFound {
        /// `robot` or `world`.
        kind: &'static str,
        /// What was asked for.
        given: String,
        /// Names that exist.
        shipped: Vec<&'static str>,
    },
    /// TOML that does not parse, an unknown or missing key, a value out of range.
    #[error("{}, {source}", file.display())]
    Toml {
        /// The file.
        file: PathBuf,
        /// Where and what is wrong, with the key, the value and what is allowed.
        source: TomlProblem,
    },
    /// URDF that does not parse.
    #[error("{}, line {}: not a valid URDF: {}", file.display(), misread.line, misread.what)]
    Misread {
        /// The file.
        file: PathBuf,
        /// Where and what is wrong, with the value and what is allowed.
        misread: Misread,
    },
    /// URDF that does not parse, by its reader's own word.
    #[error("{}: not a valid URDF: {source}", file.display())]
    Urdf {
        /// The file.
        file: PathBuf,
        /// The parser's reason.
        source: Box<urdf_rs::UrdfError>,
    },
    /// A URDF that cannot be read, in which a macro's expression was left.
    #[error("{}: not a valid URDF: {source}; `{expression}` in line {line} is a xacro's: expand it first: xacro robot.urdf.xacro > robot.urdf", file.display())]
    Unexpanded {
        /// The file.
        file: PathBuf,
        /// Counted from 1.
        line: usize,
        /// As far as its bracket.
        expression: String,
        /// The parser's reason.
        source: Box<urdf_rs::UrdfError>,
    },
    /// A macro file where a URDF is wanted.
    #[error("{0}: is a xacro, not a URDF; expand it first: xacro {0} > robot.urdf", file.display())]
    Xacro {
        /// The file.
        file: PathBuf,
    },
    /// A URDF in which no driven wheels are found on one side.
    #[error("{}: no wheel stands on the {side}: no continuous joint turns about the lateral axis and hangs on the chassis there; {}{}",
        urdf.display(), they_are(continuous), faces_aside(about_x))]
    NoWheels {
        /// The URDF.
        urdf: PathBuf,
        /// `left` or `right`.
        side: &'static str,
        /// The joints that turn without end.
        continuous: Vec<String>,
        /// Those of them that turn about the x axis of the base.
        about_x: Vec<String>,
    },
    /// A wheel that is drawn as no cylinder.
    #[error("{}: joint `{joint}`: its wheel is drawn without a cylinder or sphere, so its radius is not known; say --wheel-radius", urdf.display())]
    NoRadius {
        /// The URDF.
        urdf: PathBuf,
        /// The joint.
        joint: String,
    },
    /// A robot that stands on one axle alone.
    #[error("{}: it stands on one axle and on nothing else, no link being called a caster; name the link where one is with --caster; its links are: {}",
        urdf.display(), links.join(", "))]
    NoSupport {
        /// The URDF.
        urdf: PathBuf,
        /// The links that exist.
        links: Vec<String>,
    },
    /// A joint that the model file names and the URDF lacks.
    #[error("{}: wheel `{wheel}` names joint `{joint}`, which {} does not have; its joints are: {}",
        model.display(), urdf.display(), joints.join(", "))]
    MissingJoint {
        /// The model file.
        model: PathBuf,
        /// The URDF.
        urdf: PathBuf,
        /// The wheel.
        wheel: String,
        /// The joint that was named.
        joint: String,
        /// The joints that exist.
        joints: Vec<String>,
    },
    /// A link that the model file names and the URDF lacks.
    #[error("{}: caster names link `{link}`, which {} does not have; its links are: {}",
        model.display(), urdf.display(), links.join(", "))]
    MissingLink {
        /// The model file.
        model: PathBuf,
        /// The URDF.
        urdf: PathBuf,
        /// The link that was named.
        link: String,
        /// The links that exist.
        links: Vec<String>,
    },
    /// A joint between links of which the URDF lacks one.
    #[error("{}: joint `{joint}` holds or hangs on link `{link}`, which is not there; the links are: {}", urdf.display(), links.join(", "))]
    LooseJoint {
        /// The URDF.
        urdf: PathBuf,
        /// The joint.
        joint: String,
        /// The link that it names.
        link: String,
        /// The links that exist.
        links: Vec<String>,
    },
    /// A joint that cannot be a driven wheel's.
    #[error("{}: joint `{joint}` of wheel `{wheel}` {problem}", urdf.display())]
    NotAWheel {
        /// The URDF.
        urdf: PathBuf,
        /// The wheel.
        wheel: String,
        /// The joint.
        joint: String,
        /// Why not.
        problem: WheelProblem,
    },
    /// A joint that cannot be a caster's.
    #[error("{}: joint `{joint}` of caster `{link}` {problem}", urdf.display())]
    NotASwivel {
        /// The URDF.
        urdf: PathBuf,
        /// The caster's link.
        link: String,
        /// The joint.
        joint: String,
        /// Why not.
        problem: SwivelProblem,
    },
    /// A link without a usable mass or inertia.
    #[error("{}: link `{link}`: {quantity} is {value}; {allowed}", urdf.display())]
    Inertia {
        /// The URDF.
        urdf: PathBuf,
        /// The link.
        link: String,
        /// `mass`, `inertia`, …
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A chassis that the robot would stand on.
    #[error("{}: link `{link}`: its collision shape reaches {:.1} mm below where the wheels stand, so the robot would rest on it; shorten the shape, or, if a caster is there, name the link as one", urdf.display(), 1e3 * depth)]
    Grounded {
        /// The URDF.
        urdf: PathBuf,
        /// The link.
        link: String,
        /// \[m\]
        depth: f64,
    },
    /// A shape that is smaller than nothing.
    #[error("{}: link `{link}`: a shape of it has a size of {size} m; it must be 0 or above", urdf.display())]
    Size {
        /// The URDF.
        urdf: PathBuf,
        /// The link.
        link: String,
        /// \[m\]
        size: f64,
    },
    /// A number in the URDF that is not finite.
    #[error("{}: {place} has a value that is not a finite number", urdf.display())]
    NotFinite {
        /// The URDF.
        urdf: PathBuf,
        /// Link or joint.
        place: String,
    },
    /// A robot without driven wheels on one side.
    #[error("{}: no wheel has side = \"{side}\"; a robot needs at least one driven wheel on the left and one on the right", model.display())]
    NoWheel {
        /// The model file.
        model: PathBuf,
        /// `left` or `right`.
        side: &'static str,
    },
    /// Links that form no single tree.
    #[error("{}: the links form no single tree: {} are all without a parent", urdf.display(), roots.join(", "))]
    NotATree {
        /// The URDF.
        urdf: PathBuf,
        /// Links without parent.
        roots: Vec<String>,
    },
    /// A model of another robot than a dataset's.
    #[error("{}: is hardly the robot of dataset `{dataset}`: {what} is {stated} there, and {has} by the model; name its model with --robot, or mend the dataset", model.display())]
    OtherRobot {
        /// The model file.
        model: PathBuf,
        /// The dataset's name.
        dataset: String,
        /// What differs, as the dataset calls it.
        what: &'static str,
        /// By the model.
        has: f64,
        /// By the dataset.
        stated: f64,
    },
    /// A world without anything to stand on.
    #[error("{}: a world without ground: it has neither a [plane] table nor any [[obstacles]]; a [plane] table, even an empty one, makes a level floor", file.display())]
    NoGround {
        /// The world file.
        file: PathBuf,
    },
}

/// Why a caster cannot swivel about a joint.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SwivelProblem {
    /// Its link is not below it.
    #[error("does not carry it; the joints between it and the chassis are: {}", if above.is_empty() { "none".to_owned() } else { above.join(", ") })]
    NotAbove {
        /// The joints that do.
        above: Vec<String>,
    },
    /// It does not turn.
    #[error("is {kind}; a caster swivels about a joint that is continuous or revolute")]
    DoesNotTurn {
        /// The joint's type.
        kind: String,
    },
    /// Its axis does not stand upright.
    #[error(
        "turns about ({0:.3}, {1:.3}, {2:.3}) in the base frame; a caster swivels about the vertical, z, within a degree"
    )]
    NotUpright(f64, f64, f64),
    /// Its wheel does not trail.
    #[error("passes its wheel's centre at {:.1} mm; a wheel that swivels trails by {:.0} mm or more, one that does not is a ball: leave `swivel` out", 1e3 * trail, 1e3 * least)]
    NoTrail {
        /// \[m\]
        trail: f64,
        /// The least that will do \[m\].
        least: f64,
    },
}

/// Why a joint cannot be a driven wheel's.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WheelProblem {
    /// It does not turn.
    #[error("is {kind}; a driven wheel's joint is continuous or revolute")]
    DoesNotTurn {
        /// The joint's type.
        kind: String,
    },
    /// Its axis has no direction.
    #[error("turns about no axis: its <axis> is 0 0 0; a driven wheel turns about the lateral axis, y")]
    NoAxis,
    /// Its axis is not across the robot.
    #[error(
        "turns about ({0:.3}, {1:.3}, {2:.3}) in the base frame; a driven wheel turns about the lateral axis, y, within 20 degrees"
    )]
    NotLateral(f64, f64, f64),
    /// It stands on the other side.
    #[error("stands at y = {y:.4} m, but the model file says side = \"{side}\"; left is y > 0")]
    WrongSide {
        /// Lateral position \[m\].
        y: f64,
        /// Stated side.
        side: &'static str,
    },
    /// It hangs on what turns about an axis that is not lateral.
    #[error(
        "hangs on `{parent}`, which itself turns; a driven wheel's parent is the chassis, fixed to it or a suspension"
    )]
    NotOnChassis {
        /// The parent link.
        parent: String,
    },
}

fn they_are(continuous: &[String]) -> String {
    if continuous.is_empty() { "it has none".to_owned() } else { format!("they are: {}", continuous.join(", ")) }
}

/// A robot that is drawn with its wheels ahead and behind.
fn faces_aside(about_x: &[String]) -> String {
    if about_x.is_empty() {
        String::new()
    } else {
        format!("; about the x axis turn: {}; x must point ahead of the robot (REP 103)", about_x.join(", "))
    }
}
