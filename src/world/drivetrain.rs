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

/// Play between encoder and wheel: on a reversal the encoder runs ahead until the play is taken up.
///
/// The encoder stands at w + (B/2)·h over the wheel's rotation w; h goes from −1 to 1 while the wheel turns by
/// `Play::TAKEN_UP` of B, so that a speed loop can live with it. Known difference: in a real gear the wheel stands still
/// meanwhile.
#[derive(Debug, Clone)]
pub struct Play {
    /// B \[rad\].
    width: f64,
    /// h
    side: f64,
}

impl Play {
    /// Way of the wheel over which the play is taken up, over B \[–\].
    const TAKEN_UP: f64 = 0.5;

    /// A play of `width` \[rad\], in its middle.
    pub fn new(width: f64) -> Play {
        Play { width, side: 0.0 }
    }

    /// How far the encoder turns \[rad\] while the wheel turns by `wheel` \[rad\].
    pub fn encoder(&mut self, wheel: f64) -> f64 {
        if self.width == 0.0 {
            return wheel;
        }
        let before = self.side;
        self.side = (before + 2.0 * wheel / (Play::TAKEN_UP * self.width)).clamp(-1.0, 1.0);
        wheel + 0.5 * self.width * (self.side - before)
    }

    /// How far the wheel turns \[rad\] while the encoder turns by `encoder` \[rad\]: the inverse of [`Play::encoder`].
    pub fn wheel(&mut self, encoder: f64) -> f64 {
        if self.width == 0.0 {
            return encoder;
        }
        let lead = 1.0 + 1.0 / Play::TAKEN_UP;
        let until_taken_up = 0.5 * Play::TAKEN_UP * self.width * (1.0 - self.side * encoder.signum());
        let inside = (encoder.abs() / lead).min(until_taken_up);
        let wheel = (inside + (encoder.abs() - lead * inside)) * encoder.signum();
        self.encoder(wheel);
        wheel
    }
}

/// What winds up between the side of a drivetrain that is counted and the tread: with θ by which the one leads the other, the
/// torque from the one to the other is T with θ + τ θ' = c T.
///
/// Taken implicitly, in one step with what both sides do, so that it is stable however stiff. Known difference: a rotor's
/// inertia stays on the tread's side.
#[derive(Debug, Clone)]
pub(super) struct WindUp {
    /// c \[rad/(N m)\]; 0 is rigid.
    compliance: f64,
    /// θ \[rad\]
    lead: f64,
    /// What the counted side turns by in the step under way \[rad\].
    turns: f64,
}

/// What turns one side of a wind-up: its speed at the step's end without the torque between both, and what a torque takes off.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mover {
    /// \[rad/s\]
    pub speed: f64,
    /// \[rad/(N m s)\]
    pub slows: f64,
}

impl WindUp {
    /// τ \[s\]: rubber loses about a tenth of what it stores in a swing, here of a wheel's few hertz.
    const DAMPING: f64 = 0.01;

    pub(super) fn new(compliance: f64) -> WindUp {
        WindUp { compliance, lead: 0.0, turns: 0.0 }
    }

    pub(super) fn is_rigid(&self) -> bool {
        self.compliance == 0.0
    }

    /// θ \[rad\]
    pub(super) fn lead(&self) -> f64 {
        self.lead
    }

    /// Torque on the tread's side \[N m\] over a step of `dt`.
    pub(super) fn torque(&mut self, counted: Mover, tread: Mover, dt: f64) -> f64 {
        let over = dt + WindUp::DAMPING;
        let torque = (self.lead + over * (counted.speed - tread.speed))
            / (self.compliance + over * (counted.slows + tread.slows));
        self.turns = (counted.speed - counted.slows * torque) * dt;
        torque
    }

    /// The tread's side has turned by `turned` \[rad\] in this step; returns by how much the counted one has.
    pub(super) fn counted(&mut self, turned: f64) -> f64 {
        if self.is_rigid() {
            return turned;
        }
        self.lead += self.turns - turned;
        self.turns
    }
}

/// Counts of one wheel as the controller gets them: quantised, and late by the latency.
#[derive(Debug, Clone)]
pub(super) struct Counter {
    per_radian: f64,
    /// Age of a count in readings, whole and fraction.
    late: f64,
    /// Past angles \[rad\], newest at `head`; long enough for the latency.
    past: Vec<f64>,
    head: usize,
}

impl Counter {
    /// A counter read at `encoder.rate`, of a wheel that loses `count_loss` of its counts.
    pub(super) fn new(encoder: &Encoder, count_loss: f64) -> Counter {
        let late = encoder.latency * encoder.rate;
        let per_radian = encoder.ticks_per_revolution * (1.0 - count_loss) / TAU;
        Counter { per_radian, late, past: vec![0.0; late as usize + 2], head: 0 }
    }

    /// The count at encoder angle `angle` \[rad\], now.
    pub(super) fn count(&self, angle: f64) -> i64 {
        (angle * self.per_radian).round() as i64
    }

    /// Reads the encoder; returns what the controller gets.
    pub(super) fn read(&mut self, angle: f64) -> i64 {
        let length = self.past.len();
        self.head = (self.head + 1) % length;
        self.past[self.head] = angle;
        let back = |readings: usize| self.past[(self.head + length - readings) % length];
        let (whole, part) = (self.late as usize, self.late.fract());
        self.count(back(whole) + part * (back(whole + 1) - back(whole)))
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
