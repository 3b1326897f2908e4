//! What can be driven, as data: the `protocol` and shape columns of `runs.csv`.

use crate::geometry::Pose2;
use std::f64::consts::TAU;

/// Which way round.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Rotation {
    /// `cw`
    Clockwise,
    /// `ccw`
    CounterClockwise,
}

/// Which way along.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Travel {
    /// `forward`
    Forward,
    /// `reverse`
    Reverse,
}

/// What a run drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Protocol {
    /// Four straights of `side` \[m\], each followed by a turn on the spot, the last one included.
    Square {
        /// \[m\]
        side: f64,
        /// Which way round.
        direction: Rotation,
    },
    /// One straight.
    Straight {
        /// \[m\]
        length: f64,
        /// Forward or reverse.
        direction: Travel,
    },
    /// A turn on the spot.
    Spin {
        /// Total turn, unsigned \[rad\].
        turn: f64,
        /// Which way round.
        direction: Rotation,
    },
    /// Part of a circle, or several circles.
    Circle {
        /// \[m\]
        radius: f64,
        /// Total turn, unsigned \[rad\]; `None`: not stated, only the logs tell.
        turn: Option<f64>,
        /// Which way round.
        direction: Rotation,
    },
    /// No fixed shape: needs logs.
    Path,
}

impl Rotation {
    /// +1 counter-clockwise, −1 clockwise.
    pub fn sign(self) -> f64 {
        match self {
            Rotation::Clockwise => -1.0,
            Rotation::CounterClockwise => 1.0,
        }
    }

    /// `cw` or `ccw`, as the files spell it.
    pub fn as_str(self) -> &'static str {
        match self {
            Rotation::Clockwise => "cw",
            Rotation::CounterClockwise => "ccw",
        }
    }
}

impl Travel {
    /// +1 forward, −1 reverse.
    pub fn sign(self) -> f64 {
        match self {
            Travel::Forward => 1.0,
            Travel::Reverse => -1.0,
        }
    }

    /// `forward` or `reverse`, as the files spell it.
    pub fn as_str(self) -> &'static str {
        match self {
            Travel::Forward => "forward",
            Travel::Reverse => "reverse",
        }
    }
}

impl Protocol {
    /// The `protocol` column.
    pub fn kind(&self) -> &'static str {
        match self {
            Protocol::Square { .. } => "square",
            Protocol::Straight { .. } => "straight",
            Protocol::Spin { .. } => "spin",
            Protocol::Circle { .. } => "circle",
            Protocol::Path => "path",
        }
    }

    /// The `direction` column.
    pub fn direction(&self) -> Option<&'static str> {
        match self {
            Protocol::Square { direction, .. }
            | Protocol::Spin { direction, .. }
            | Protocol::Circle { direction, .. } => Some(direction.as_str()),
            Protocol::Straight { direction, .. } => Some(direction.as_str()),
            Protocol::Path => None,
        }
    }

    /// The side, length or radius of a shape that has one \[m\].
    pub fn size(&self) -> Option<f64> {
        match *self {
            Protocol::Square { side, .. } => Some(side),
            Protocol::Straight { length, .. } => Some(length),
            Protocol::Circle { radius, .. } => Some(radius),
            Protocol::Spin { .. } | Protocol::Path => None,
        }
    }

    /// Where a perfect run ends, in the frame of its start \[m, m, rad\]; `None` for a path and for a circle
    /// of unstated turn.
    pub fn nominal_end(&self) -> Option<Pose2> {
        match *self {
            Protocol::Square { direction, .. } => Some(Pose2::new(0.0, 0.0, direction.sign() * TAU)),
            Protocol::Straight { length, direction } => Some(Pose2::new(direction.sign() * length, 0.0, 0.0)),
            Protocol::Spin { turn, direction } => Some(Pose2::new(0.0, 0.0, direction.sign() * turn)),
            Protocol::Circle { radius, turn, direction } => {
                turn.map(|turn| Pose2::IDENTITY.moved(radius * turn, 0.0, direction.sign() * turn))
            }
            Protocol::Path => None,
        }
    }
}
