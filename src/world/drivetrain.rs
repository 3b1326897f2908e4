//! One wheel's friction, encoder and speed loop. The motor itself is [`Drivetrain::motor_torque`].

use crate::scene::{Drivetrain, Encoder};
use std::f64::consts::TAU;

/// Wind-up of dry friction before it slips \[rad\]: it holds like a stiff spring and then drags, so that a parked wheel
/// does not creep (Dahl's model with an infinite exponent, an elastic–perfectly plastic bristle
/// [Dahl, *AIAA Journal* 14 (1976) 1675–1682]).
const PRESLIDING: f64 = 1.0e-3;

/// Dry and viscous friction between wheel and chassis.
#[derive(Debug, Clone, Default)]
pub(super) struct Friction {
    wind_up: f64,
}

impl Friction {
    /// Torque on the wheel \[N m\] after it has turned for `dt` at `speed` \[rad/s\].
    pub(super) fn torque(&mut self, drivetrain: &Drivetrain, speed: f64, dt: f64) -> f64 {
        self.wind_up = (self.wind_up + speed * dt).clamp(-PRESLIDING, PRESLIDING);
        -drivetrain.dry_friction * (self.wind_up / PRESLIDING) - drivetrain.viscous_friction * speed
    }
}

/// Counts of one wheel as the controller gets them: quantised, and late by the latency.
#[derive(Debug, Clone)]
pub(super) struct Counter {
    per_radian: f64,
    /// Past counts, newest at `head`; long enough for the latency.
    past: Vec<i64>,
    head: usize,
}

impl Counter {
    /// A counter read at `encoder.rate`.
    pub(super) fn new(encoder: &Encoder) -> Counter {
        let late = (encoder.latency * encoder.rate).round() as usize;
        Counter { per_radian: encoder.ticks_per_revolution / TAU, past: vec![0; late + 1], head: 0 }
    }

    /// The count at wheel angle `angle` \[rad\], now.
    pub(super) fn count(&self, angle: f64) -> i64 {
        (angle * self.per_radian).round() as i64
    }

    /// Reads the encoder; returns what the controller gets.
    pub(super) fn read(&mut self, angle: f64) -> i64 {
        self.past[self.head] = self.count(angle);
        self.head = (self.head + 1) % self.past.len();
        self.past[self.head]
    }
}

/// PI on wheel speed, from counts alone. The integral of the speed error is the angle still missing.
#[derive(Debug, Clone)]
pub(super) struct SpeedLoop {
    period: f64,
    angle_per_tick: f64,
    /// Counts over the speed window, newest at `head`.
    past: Vec<i64>,
    head: usize,
    /// Angle that the commands so far add up to \[rad\].
    wanted: f64,
}

impl SpeedLoop {
    pub(super) fn new(drivetrain: &Drivetrain, encoder: &Encoder) -> SpeedLoop {
        let window = (drivetrain.speed_window * drivetrain.loop_rate).round().max(1.0) as usize;
        SpeedLoop {
            period: 1.0 / drivetrain.loop_rate,
            angle_per_tick: TAU / encoder.ticks_per_revolution,
            past: vec![0; window],
            head: 0,
            wanted: 0.0,
        }
    }

    /// Voltage given to the motor, −1 to 1 of the full one: that at which it would run at `commanded` \[rad/s\] unloaded,
    /// and the loop's correction.
    pub(super) fn voltage(&mut self, drivetrain: &Drivetrain, commanded: f64, ticks: i64) -> f64 {
        let oldest = std::mem::replace(&mut self.past[self.head], ticks);
        self.head = (self.head + 1) % self.past.len();
        let speed = (ticks - oldest) as f64 * self.angle_per_tick / (self.past.len() as f64 * self.period);
        let turned = ticks as f64 * self.angle_per_tick;
        self.wanted += commanded * self.period;
        let proportional = drivetrain.proportional_gain * (commanded - speed);
        let integral = drivetrain.integral_gain * (self.wanted - turned);
        let feed_forward = commanded / drivetrain.no_load_speed();
        let asked = feed_forward + (proportional + integral) / drivetrain.stall_torque();
        let given = asked.clamp(-1.0, 1.0);
        if given != asked && drivetrain.integral_gain > 0.0 {
            // Out of voltage: the integral stands where it just saturates, so that it does not wind up.
            let integral = (given - feed_forward) * drivetrain.stall_torque() - proportional;
            self.wanted = turned + integral / drivetrain.integral_gain;
        }
        given
    }
}
