//! The on-board driver: ticks in, wheel speeds out. It never sees a pose, only what its own odometry makes of ticks.
//!
//! A protocol becomes a list of legs (straights, arcs, turns on the spot). Each leg has a plan over time, a ramp up, a
//! cruise and a ramp down; the driver follows the plan in its believed pose and holds line and heading by feedback.

use crate::dataset::Protocol;
use crate::geometry::{Pose2, wrap_angle};
use crate::odometry::{DeadReckoning, OdometryParameters};
use crate::scene::DriverSettings;
use std::f64::consts::FRAC_PI_2;

/// What the driver asks of the left and right wheels \[rad/s\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Command {
    /// Left wheels.
    pub left: f64,
    /// Right wheels.
    pub right: f64,
}

/// Drives one protocol by its odometry.
#[derive(Debug, Clone)]
pub struct Driver {
    settings: DriverSettings,
    odometry: OdometryParameters,
    reckoning: DeadReckoning,
    legs: Vec<Leg>,
    /// Index of the current leg, when it began, and where the robot then believed it was.
    leg: usize,
    began: f64,
    from: Pose2,
}

/// One part of a protocol; poses and headings in the odometry's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Leg {
    /// Along a line or circle from `start`: `distance` \[m\], negative in reverse, with `curvature` \[1/m\].
    Along { start: Pose2, distance: f64, curvature: f64, ramp: Ramp },
    /// On the spot to `heading`.
    Turn { heading: f64, ramp: Ramp },
}

/// Cruising rate and acceleration of a leg, in units of the leg's way a second and second².
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ramp {
    rate: f64,
    acceleration: f64,
}

impl Ramp {
    /// Time to go `way` ≥ 0.
    fn duration(&self, way: f64) -> f64 {
        let ramp_way = self.rate * self.rate / self.acceleration;
        if way <= ramp_way {
            2.0 * (way / self.acceleration).sqrt()
        } else {
            2.0 * self.rate / self.acceleration + (way - ramp_way) / self.rate
        }
    }

    /// Planned way and rate at `time` since the start of a trapezoid over `way` ≥ 0.
    fn plan(&self, way: f64, time: f64) -> (f64, f64) {
        let total = self.duration(way);
        let time = time.clamp(0.0, total);
        let peak = self.rate.min((way * self.acceleration).sqrt());
        let ramp = peak / self.acceleration;
        if time < ramp {
            (0.5 * self.acceleration * time * time, self.acceleration * time)
        } else if time <= total - ramp {
            (0.5 * peak * ramp + peak * (time - ramp), peak)
        } else {
            let left = total - time;
            (way - 0.5 * self.acceleration * left * left, self.acceleration * left)
        }
    }
}

impl Driver {
    /// A driver for `protocol` at `speed` \[m/s\] and `turn_rate` \[rad/s\]. A path drives nothing; a circle of unstated
    /// turn is one circle.
    pub fn new(
        protocol: &Protocol,
        speed: f64,
        turn_rate: f64,
        settings: &DriverSettings,
        odometry: &OdometryParameters,
    ) -> Driver {
        Driver {
            settings: *settings,
            odometry: *odometry,
            reckoning: DeadReckoning::new(*odometry),
            legs: legs(protocol, speed, turn_rate, settings),
            leg: 0,
            began: 0.0,
            from: Pose2::IDENTITY,
        }
    }

    /// How long the plan takes \[s\].
    pub fn planned_duration(&self) -> f64 {
        let mut heading = 0.0;
        self.legs
            .iter()
            .map(|leg| {
                let way = match *leg {
                    Leg::Along { start, distance, curvature, ramp } => {
                        heading = start.heading + distance * curvature;
                        ramp.duration(distance.abs())
                    }
                    Leg::Turn { heading: target, ramp } => {
                        let turn = (target - heading).abs();
                        heading = target;
                        ramp.duration(turn)
                    }
                };
                way + self.settings.pause
            })
            .sum()
    }

    /// Where the robot believes it is, in the frame of its start.
    pub fn believed(&self) -> Pose2 {
        self.reckoning.pose()
    }

    /// Index of the leg that it drives.
    pub fn leg(&self) -> usize {
        self.leg
    }

    /// Takes the counts of the left and right wheels at `time` \[s\]; `None`: the protocol is done.
    pub fn decide(&mut self, time: f64, left_ticks: f64, right_ticks: f64) -> Option<Command> {
        let left = self.odometry.angle_of_ticks(left_ticks);
        let right = self.odometry.angle_of_ticks(right_ticks);
        let believed = self.reckoning.update(left, right);
        let since = time - self.began;
        let leg = *self.legs.get(self.leg)?;
        let (planned_duration, speed, yaw_rate) = match leg {
            Leg::Along { start, distance, curvature, ramp } => {
                let (way, rate) = ramp.plan(distance.abs(), since);
                let (way, rate) = (way.copysign(distance), rate.copysign(distance));
                let (gone, aside, off) = on_track(start, curvature, believed);
                let speed = rate + self.settings.distance_gain * (way - gone);
                let yaw_rate =
                    curvature * speed - self.settings.heading_gain * off - self.settings.line_gain * rate * aside;
                (ramp.duration(distance.abs()), speed, yaw_rate)
            }
            Leg::Turn { heading, ramp } => {
                let turn = heading - self.from.heading;
                let (way, rate) = ramp.plan(turn.abs(), since);
                let planned = self.from.heading + way.copysign(turn);
                let yaw_rate = rate.copysign(turn) + self.settings.heading_gain * (planned - believed.heading);
                (ramp.duration(turn.abs()), 0.0, yaw_rate)
            }
        };
        // The plan ends at rest; what is still missing is made good during the pause.
        if since >= planned_duration + self.settings.pause {
            self.leg += 1;
            self.began = time;
            self.from = believed;
        }
        Some(self.wheel_speeds(speed, yaw_rate))
    }

    fn wheel_speeds(&self, speed: f64, yaw_rate: f64) -> Command {
        let half = 0.5 * self.odometry.track_width * yaw_rate;
        Command {
            left: (speed - half) / self.odometry.left_wheel_radius,
            right: (speed + half) / self.odometry.right_wheel_radius,
        }
    }
}

/// The legs of a protocol, from the origin of the odometry's frame.
fn legs(protocol: &Protocol, speed: f64, turn_rate: f64, settings: &DriverSettings) -> Vec<Leg> {
    let straight = Ramp { rate: speed, acceleration: settings.acceleration };
    let on_the_spot = Ramp { rate: turn_rate, acceleration: settings.turn_acceleration };
    match *protocol {
        Protocol::Square { side, direction } => {
            let mut corner = Pose2::IDENTITY;
            let mut legs = Vec::with_capacity(8);
            for _ in 0..4 {
                legs.push(Leg::Along { start: corner, distance: side, curvature: 0.0, ramp: straight });
                corner = corner.compose(Pose2::new(side, 0.0, direction.sign() * FRAC_PI_2));
                legs.push(Leg::Turn { heading: corner.heading, ramp: on_the_spot });
            }
            legs
        }
        Protocol::Straight { length, direction } => vec![Leg::Along {
            start: Pose2::IDENTITY,
            distance: direction.sign() * length,
            curvature: 0.0,
            ramp: straight,
        }],
        Protocol::Spin { turn, direction } => {
            vec![Leg::Turn { heading: direction.sign() * turn, ramp: on_the_spot }]
        }
        Protocol::Circle { radius, turn, direction } => vec![Leg::Along {
            start: Pose2::IDENTITY,
            distance: radius * turn.unwrap_or(std::f64::consts::TAU),
            curvature: direction.sign() / radius,
            ramp: straight,
        }],
        Protocol::Path => Vec::new(),
    }
}

/// Where `pose` stands on the line or circle that leaves `start`: the way gone \[m\], how far it is aside to the left
/// \[m\], and how far its heading is off to the left \[rad\].
fn on_track(start: Pose2, curvature: f64, pose: Pose2) -> (f64, f64, f64) {
    let at = start.relative(pose);
    if curvature == 0.0 {
        return (at.x, at.y, at.heading);
    }
    // About the centre (0, 1/κ): the heading tells the turn, the position tells which way round it is.
    let radius = 1.0 / curvature;
    let bearing = at.x.atan2(radius - at.y);
    let turned = if radius > 0.0 { bearing } else { wrap_angle(bearing - std::f64::consts::PI) };
    let turned = at.heading + wrap_angle(turned - at.heading);
    let out = at.x.hypot(radius - at.y);
    let aside = (radius.abs() - out) * radius.signum();
    (turned / curvature, aside, at.heading - turned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn a_ramp_covers_its_way_whether_or_not_it_reaches_its_rate() {
        for way in [0.0, 0.1, 0.4, 3.0] {
            let ramp = Ramp { rate: 0.5, acceleration: 0.8 };
            let total = ramp.duration(way);
            assert!((ramp.plan(way, total).0 - way).abs() < 1e-12);
            assert!((ramp.plan(way, 0.5 * total).0 - 0.5 * way).abs() < 1e-12);
            // The plan's rate is the derivative of its way.
            for part in [0.1, 0.3, 0.6, 0.9] {
                let (t, h) = (part * total, 1e-6);
                let slope = (ramp.plan(way, t + h).0 - ramp.plan(way, t - h).0) / (2.0 * h);
                assert!(way == 0.0 || (slope - ramp.plan(way, t).1).abs() < 1e-6, "way {way}, part {part}");
            }
        }
    }

    #[test]
    fn a_circle_is_followed_from_both_sides() {
        for (curvature, sign) in [(0.5, 1.0), (-0.5, -1.0)] {
            // A quarter round a circle of 2 m, then beyond half, then a step to the left of the track.
            for turn in [FRAC_PI_2, 1.5 * PI] {
                let on = Pose2::IDENTITY.moved(2.0 * turn, 0.0, sign * turn);
                let (gone, aside, off) = on_track(Pose2::IDENTITY, curvature, on);
                assert!((gone - 2.0 * turn).abs() < 1e-12 && aside.abs() < 1e-12 && off.abs() < 1e-12);
                let (gone, aside, _) = on_track(Pose2::IDENTITY, curvature, on.compose(Pose2::new(0.0, 0.1, 0.0)));
                assert!((gone - 2.0 * turn).abs() < 1e-12 && (aside - 0.1).abs() < 1e-12);
            }
        }
    }
}
