//! Wheels that coast on after a stop while the controller does not count.

use super::run::Logger;
use crate::world::World;
use std::f64::consts::TAU;

/// How long wheels coast on after a stop, and then stand \[s\].
const COASTING: [f64; 2] = [0.4, 0.2];

/// Wheels that coast on after each stop, each in the direction of its last way, while the controller does not count.
#[derive(Clone)]
pub(super) struct Overrun {
    angle: f64,
    /// The driver's leg, and the wheels' angles where it began.
    leg: usize,
    began_at: Vec<f64>,
    /// When coasting began, and the counts and angles then.
    since: Option<(f64, Vec<i64>, Vec<f64>)>,
    direction: Vec<f64>,
    /// Counts that the controller never got.
    lost: Vec<i64>,
    /// Time spent coasting, which the driver does not see \[s\].
    pub lasted: f64,
}

impl Overrun {
    pub fn new(world: &World) -> Overrun {
        let wheels = world.scene().robot.wheels.len();
        Overrun {
            angle: world.scene().robot.drivetrain.stop_overrun,
            leg: 0,
            began_at: (0..wheels).map(|wheel| world.counted_angle(wheel)).collect(),
            since: None,
            direction: vec![0.0; wheels],
            lost: vec![0; wheels],
            lasted: 0.0,
        }
    }

    pub fn lost(&self, wheel: usize) -> i64 {
        self.lost[wheel]
    }

    /// The driver has decided, and is now in `leg`: where that is a new one the wheels have stopped, and coast.
    pub fn after(&mut self, world: &World, leg: usize, time: f64) {
        if self.angle == 0.0 || leg == self.leg {
            return;
        }
        self.leg = leg;
        for wheel in 0..self.direction.len() {
            self.direction[wheel] = (world.counted_angle(wheel) - self.began_at[wheel]).signum();
        }
        let counts = (0..self.direction.len()).map(|wheel| world.ticks_now(wheel)).collect();
        let angles = (0..self.direction.len()).map(|wheel| world.counted_angle(wheel)).collect();
        self.since = Some((time, counts, angles));
    }

    /// Takes coasting wheels along in the coming step. What carries them on is not the motor: a speed loop would leave up to
    /// a quarter of the way to dry friction. Its commands go along all the same, so that it holds the wheels where they end.
    pub fn carry(&self, world: &mut World, time: f64) {
        let Some((began, _, angles)) = &self.since else { return };
        let [coast, _] = COASTING;
        let part = ((time + world.scene().time_step - began) / coast).clamp(0.0, 1.0);
        let way = self.angle * (part - (TAU * part).sin() / TAU);
        for (wheel, (angle, direction)) in angles.iter().zip(&self.direction).enumerate() {
            world.follow(wheel, angle + direction * way);
        }
    }

    /// Commands coasting wheels; whether they coast.
    pub fn coasts(&mut self, world: &mut World, logger: &mut Logger, time: f64) -> bool {
        let Some((began, counts, _)) = &self.since else { return false };
        let since = time - began;
        let [coast, stand] = COASTING;
        logger.held = true;
        if since < coast + stand - 1e-9 {
            let rate = if since < coast { self.angle / coast * (1.0 - (TAU * since / coast).cos()) } else { 0.0 };
            for (wheel, direction) in self.direction.iter().enumerate() {
                world.command(wheel, direction * rate);
            }
            return true;
        }
        for (wheel, before) in counts.iter().enumerate() {
            let lost = world.ticks_now(wheel) - before;
            self.lost[wheel] += lost;
            logger.zero[wheel] += lost;
            self.began_at[wheel] = world.counted_angle(wheel);
            world.release(wheel);
        }
        logger.held = false;
        self.lasted += since;
        self.since = None;
        false
    }
}
