//! Replay: the simulated wheels follow the rotation that a run logged, and the body moves by physics.

use super::error::DriveError;
use super::run::{SETTLE, at_time, in_world, stream};
use super::smooth;
use crate::dataset::{EncoderLog, Run, Stop};
use crate::geometry::{Pose2, Trace};
use crate::odometry::{DeadReckoning, OdometryParameters};
use crate::scene::{Drivetrain, Scene, Side, Wheel};
use crate::world::{Play, World, WorldError};
use std::f64::consts::TAU;
use std::sync::atomic::{AtomicBool, Ordering};

/// How often a trace is kept \[Hz\].
const TRACE_RATE: f64 = 50.0;
/// Time over which wheels that were turning when a log began are brought to their speed, and then held at it \[s\].
const RUN_UP: [f64; 2] = [0.8, 0.4];
/// The latter where drivetrains wind up, which takes the way of a slow turn \[s\].
const WOUND_UP: f64 = 2.4;
/// How far a wheel has turned at least on what is a way \[rad\].
const WAY: f64 = 9e-3;
/// How long they are taken to do so \[s\]: no log tells, and it matters to readings within a stop alone. Wheels that are let go
/// take less; those of a simulated run take twice as long, so that tyres do not wind up.
const COASTS: f64 = 0.2;

/// Replays the encoder log of `run` in `scene`, from its surveyed start pose or the mark. `counted` turns the log's ticks
/// into radians.
///
/// Each wheel follows its own column where the log has one, its side's mean otherwise. What the scene's encoders do
/// (losses, play, overrun) is undone first, so that the wheels turn as they must have turned for these counts. A log that
/// begins in motion is preceded by a run-up.
///
/// # Errors
/// The run has no log, the world cannot be built or is left, or the replay was stopped.
pub fn replay(scene: &Scene, run: &Run, counted: &OdometryParameters, stop: &AtomicBool) -> Result<Trace, DriveError> {
    let log = log_of(run)?;
    let wheels = rotations(scene, run, log, counted);
    let mut going = Replaying::begin(scene, run, log, &wheels)?;
    let rows = (going.steps / going.keep_every + 2) as usize;
    let mut trace = Trace { time: Vec::with_capacity(rows), poses: Vec::with_capacity(rows) };
    loop {
        trace.time.push(going.time());
        trace.poses.push(going.world.pose());
        if stop.load(Ordering::Relaxed) {
            return Err(DriveError::Interrupted { run: run.name.clone() });
        }
        if !going.go_on().map_err(in_world(&run.name))? {
            return Ok(trace);
        }
    }
}

/// The log that a replay is of.
pub(super) fn log_of(run: &Run) -> Result<&EncoderLog, DriveError> {
    run.log().ok_or_else(|| DriveError::NoLog { run: run.name.clone() })
}

/// How the wheels of a scene turned for a log, and how they came to where it begins.
pub(super) struct Rotations {
    wheels: Vec<Rotation>,
    /// Of each where it begins \[rad\].
    began_at: Vec<f64>,
    /// How long they are brought to their speed before the log begins \[s\].
    run_up: f64,
}

/// Those of a run.
pub(super) fn rotations(scene: &Scene, run: &Run, log: &EncoderLog, counted: &OdometryParameters) -> Rotations {
    let scene = &at_time(scene, run.started);
    let stops = if scene.robot.drivetrain.stop_overrun > 0.0 { log.stops(counted) } else { Vec::new() };
    let held_up = smooth::held_up(&log.time);
    let wheels: Vec<Rotation> =
        scene.robot.wheels.iter().map(|wheel| Rotation::of(scene, wheel, log, &held_up, &stops, counted)).collect();
    let began_moving = wheels.iter().any(|wheel| wheel.initial_speed != 0.0);
    let run_up = if began_moving { RUN_UP[0] + held(&scene.robot.drivetrain) } else { 0.0 };
    let began_at = wheels.iter().map(|wheel| wheel.run_up(-run_up)).collect();
    Rotations { wheels, began_at, run_up }
}

/// A replay under way. A copy goes on as the original does.
#[derive(Clone)]
pub(super) struct Replaying<'l> {
    pub world: World,
    wheels: &'l Rotations,
    rows: &'l [f64],
    place: Place,
    /// Since the log began, of so many.
    step: u64,
    steps: u64,
    keep_every: u64,
}

impl<'l> Replaying<'l> {
    /// Where the log begins: at rest, or after a run-up.
    pub fn begin(
        scene: &Scene,
        run: &Run,
        log: &'l EncoderLog,
        wheels: &'l Rotations,
    ) -> Result<Replaying<'l>, DriveError> {
        let scene = &at_time(scene, run.started);
        let start = run.start.unwrap_or_default();
        let run_up = wheels.run_up;
        let from = if run_up > 0.0 { before(run_up, &wheels.wheels, scene, start) } else { start };
        let world = World::new(scene, from, stream(0, &run.name, "scatter")).map_err(in_world(&run.name))?;
        let steps = ((log.time[log.len() - 1] - log.time[0]) / scene.time_step).ceil() as u64;
        let keep_every = (1.0 / (TRACE_RATE * scene.time_step)).round().max(1.0) as u64;
        let place = Place::default();
        let mut going = Replaying { world, wheels, rows: &log.time, place, step: 0, steps, keep_every };
        for _ in 0..(SETTLE / scene.time_step).round() as u64 {
            going.turn(|wheel| wheel.run_up(-run_up)).map_err(in_world(&run.name))?;
        }
        for step in 0..(run_up / scene.time_step).round() as u64 {
            let time = step as f64 * scene.time_step - run_up + scene.time_step;
            going.turn(|wheel| wheel.run_up(time)).map_err(in_world(&run.name))?;
        }
        Ok(going)
    }

    /// By the log's clock \[s\]. Its last step ends with the log, where the wheels are as the last row has them.
    pub fn time(&self) -> f64 {
        (self.rows[0] + self.step as f64 * self.world.scene().time_step).min(self.rows[self.rows.len() - 1])
    }

    /// Goes on to the next moment that a trace keeps; whether the log had not ended before.
    pub fn go_on(&mut self) -> Result<bool, WorldError> {
        if self.step == self.steps {
            return Ok(false);
        }
        loop {
            self.place = self.place.on_to(self.rows, self.time() + self.world.scene().time_step);
            let place = self.place;
            self.turn(|wheel| wheel.at(place))?;
            self.step += 1;
            if self.step.is_multiple_of(self.keep_every) || self.step == self.steps {
                return Ok(true);
            }
        }
    }

    /// Turns each wheel to an angle in one step.
    fn turn(&mut self, angle: impl Fn(&Rotation) -> f64) -> Result<(), WorldError> {
        for (index, (wheel, began_at)) in self.wheels.wheels.iter().zip(&self.wheels.began_at).enumerate() {
            self.world.follow(index, angle(wheel) - began_at);
        }
        self.world.step()
    }
}

/// A time in a log: so much of the time from the row before it to the row after it, which is so long \[s\].
#[derive(Clone, Copy, Default)]
struct Place {
    after: usize,
    part: f64,
    lasts: f64,
}

impl Place {
    /// At `time`, which is no earlier than this place.
    fn on_to(self, rows: &[f64], time: f64) -> Place {
        let later = rows[self.after..].iter().take_while(|&&row| row <= time).count();
        let after = (self.after + later).clamp(1, rows.len() - 1);
        let (t0, t1) = (rows[after - 1], rows[after]);
        let part = if t1 > t0 { ((time - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { 1.0 };
        Place { after, part, lasts: t1 - t0 }
    }
}

/// Rotation of one wheel over time, as the log has it and the scene's encoder explains it; 0 at its start.
struct Rotation {
    /// At each row of the log \[rad\].
    angle: Vec<f64>,
    /// Speed there \[rad/s\].
    speed: Vec<f64>,
    /// That where the log begins, as it is brought up to it \[rad/s\]; 0 where it begins at rest.
    initial_speed: f64,
    /// How long it is held before that \[s\].
    held: f64,
}

impl Rotation {
    /// `held_up` is how late each row was stamped \[s\], `stops` are those after which wheels coast.
    fn of(
        scene: &Scene,
        wheel: &Wheel,
        log: &EncoderLog,
        held_up: &[f64],
        stops: &[Stop],
        counted: &OdometryParameters,
    ) -> Rotation {
        let own = log.channels.iter().position(|channel| *channel == wheel.name);
        let counts = |row: usize| match own {
            Some(channel) => log.radians(row, channel, counted),
            None => log.sides(row, counted)[usize::from(wheel.side == Side::Right)],
        };
        let drivetrain = &scene.robot.drivetrain;
        let read: Vec<f64> = (0..log.len()).map(|row| (counts(row) - counts(0)) / (1.0 - wheel.count_loss)).collect();
        let encoder = smooth::turned(&log.time, &read, log.tick(counted), held_up);
        let overrun = drivetrain.stop_overrun;
        let coastings = Coasting::all(&log.time, stops, &encoder);
        let mut play = Play::new(drivetrain.backlash);
        let mut angle = vec![0.0];
        let mut coasted = coastings.iter().peekable();
        for row in 1..log.len() {
            // What takes the play up while nobody counts is on no log, and is taken up all the same.
            if let Some(coasting) = coasted.next_if(|coasting| coasting.until < row) {
                play.encoder(coasting.direction * overrun);
            }
            angle.push(angle[row - 1] + play.wheel(encoder[row] - encoder[row - 1]));
        }
        for coasting in &coastings {
            for (angle, &time) in angle.iter_mut().zip(&log.time).skip(coasting.from) {
                *angle += coasting.direction * overrun * coasting.part(time);
            }
        }
        let (speed, initial_speed) = (speeds(&log.time, &angle), initial_speed(&log.time, &angle));
        Rotation { angle, speed, initial_speed, held: held(drivetrain) }
    }

    /// Between rows, by the cubic that has the rows' angles and speeds [Hermite] \[rad\]: a wheel that jumped from one mean speed
    /// to the next would slip by it.
    fn at(&self, Place { after, part, lasts }: Place) -> f64 {
        let [from, to] = [after - 1, after].map(|row| self.angle[row]);
        let [setting_out, arriving] = [after - 1, after].map(|row| self.speed[row] * lasts);
        let way = to - from;
        let (square, cube) = (3.0 * way - 2.0 * setting_out - arriving, setting_out + arriving - 2.0 * way);
        from + part * (setting_out + part * (square + part * cube))
    }

    /// Rotation at `time` < 0 before the log \[rad\]: up to the initial speed, then at it.
    fn run_up(&self, time: f64) -> f64 {
        let (ramp, hold) = (RUN_UP[0], self.held);
        let speed = self.initial_speed;
        let since = (time + ramp + hold).max(0.0);
        let whole = speed * (0.5 * ramp + hold);
        let way = if since < ramp { 0.5 * speed / ramp * since * since } else { speed * (since - 0.5 * ramp) };
        way - whole
    }
}

/// How long wheels are held at the speed that a log begins with \[s\].
fn held(drivetrain: &Drivetrain) -> f64 {
    if drivetrain.wind_up.unwrap_or_default() > 0.0 { WOUND_UP } else { RUN_UP[1] }
}

/// Speeds at each row \[rad/s\]: a parabola's through its neighbours, as far as no angle between rows is beyond those of the rows
/// [Steffen, *Astron. Astrophys.* 239 (1990) 443–450]: a wheel that stands between counts stands. Rows of one stamp have one speed.
fn speeds(time: &[f64], angle: &[f64]) -> Vec<f64> {
    let lasts = |row: usize| time[row] - time[row - 1];
    let mean = |row: usize| (lasts(row), (angle[row] - angle[row - 1]) / lasts(row));
    let takes_time = |row: &usize| lasts(*row) > 0.0;
    let rows = time.len();
    let of_row = |row: usize| {
        let before = (1..=row).rev().find(takes_time).map(mean);
        let after = (row + 1..rows).find(takes_time).map(mean);
        let (Some((before, first)), Some((after, second))) = (before, after) else {
            return before.or(after).map_or(0.0, |(_, speed)| speed);
        };
        let parabola = (first * after + second * before) / (before + after);
        let least = first.abs().min(second.abs()).min(0.5 * parabola.abs());
        if first * second > 0.0 { 2.0 * least.copysign(first) } else { 0.0 }
    };
    (0..rows).map(of_row).collect()
}

/// On a line between rows \[rad\].
fn between(angle: &[f64], Place { after, part, .. }: Place) -> f64 {
    angle[after - 1] + part * (angle[after] - angle[after - 1])
}

/// Speed where a log begins \[rad/s\]; 0 where it begins at rest. Two tenths of a second tell one from a wheel that is only
/// just setting off: their mean speeds on a line, back to the beginning.
fn initial_speed(time: &[f64], angle: &[f64]) -> f64 {
    let at = |since: f64| between(angle, Place::default().on_to(time, time[0] + since));
    let first = (at(0.1) - angle[0]) / 0.1;
    let second = (at(0.2) - at(0.1)) / 0.1;
    let speed = 1.5 * first - 0.5 * second;
    if speed.abs() < 0.05 + 0.3 * second.abs() { 0.0 } else { speed }
}

/// What a wheel does after a stop while nobody counts.
struct Coasting {
    /// Rows of the standstill.
    from: usize,
    until: usize,
    /// Between which times \[s\].
    began: f64,
    lasts: f64,
    /// ±1: that of the way before the stop.
    direction: f64,
}

impl Coasting {
    /// It goes on right after the last count, in the direction of its way; a wheel that had none stands.
    fn all(time: &[f64], stops: &[Stop], encoder: &[f64]) -> Vec<Coasting> {
        let ways = std::iter::once(0).chain(stops.iter().map(|stop| stop.until)).zip(stops);
        ways.map(|(began, stop)| (stop, encoder[stop.from] - encoder[began]))
            .filter(|(_, way)| way.abs() > WAY)
            .map(|(&Stop { from, until }, way)| Coasting {
                from,
                until,
                began: time[from],
                lasts: (time[until] - time[from]).clamp(1e-3, COASTS),
                direction: way.signum(),
            })
            .collect()
    }

    /// How much of it is done at `time` \[s\]: a cosine's rise and fall of the speed.
    fn part(&self, time: f64) -> f64 {
        let part = ((time - self.began) / self.lasts).clamp(0.0, 1.0);
        part - (TAU * part).sin() / TAU
    }
}

/// Where a run-up of so long \[s\] has to begin to arrive at `start`, by dead reckoning.
fn before(run_up: f64, wheels: &[Rotation], scene: &Scene, start: Pose2) -> Pose2 {
    let side = |side: Side, time: f64| {
        let of_side = scene.robot.wheels.iter().zip(wheels).filter(|(wheel, _)| wheel.side == side);
        let angles: Vec<f64> = of_side.map(|(_, rotation)| rotation.run_up(time)).collect();
        angles.iter().sum::<f64>() / angles.len() as f64
    };
    let mut reckoning = DeadReckoning::new(scene.robot.odometry);
    let mut arrived = Pose2::IDENTITY;
    for part in 0..=20 {
        let time = -run_up * (1.0 - f64::from(part) / 20.0);
        arrived = reckoning.update(side(Side::Left, time), side(Side::Right, time));
    }
    start.compose(arrived.inverse())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Between rows a wheel is where its law has it, to the third order where that is smooth; it goes beyond no row, and stands
    /// where it stood.
    #[test]
    fn wheels_turn_smoothly_between_rows() {
        let off = |rate: f64| {
            let time: Vec<f64> = (0..).map(|row| f64::from(row) / rate).take_while(|time| *time <= 2.0).collect();
            let law = |time: f64| 0.5 * time * time + 0.1 * time;
            let angle: Vec<f64> = time.iter().map(|&time| law(time)).collect();
            let speed = speeds(&time, &angle);
            let wheel = Rotation { angle, speed, initial_speed: 0.0, held: 0.0 };
            // The outermost rows have one neighbour only.
            (10..190)
                .map(|k| 0.01 * f64::from(k))
                .map(|at| (wheel.at(Place::default().on_to(&time, at)) - law(at)).abs())
                .fold(0.0, f64::max)
        };
        assert!(off(20.0) < 1e-12 && off(50.0) < 1e-12, "{} {}", off(20.0), off(50.0));
        let time = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let angle = vec![0.0, 0.0, 5.0, 6.0, 6.0, 4.0];
        let speed = speeds(&time, &angle);
        let wheel = Rotation { angle: angle.clone(), speed, initial_speed: 0.0, held: 0.0 };
        for k in 0..500 {
            let at = 0.01 * f64::from(k);
            let (place, row) = (Place::default().on_to(&time, at), at as usize);
            let [low, high] = [angle[row].min(angle[row + 1]), angle[row].max(angle[row + 1])];
            let angle = wheel.at(place);
            assert!((low - 1e-12..=high + 1e-12).contains(&angle), "{angle} at {at}");
        }
    }

    /// Forward, a stop, backward, a stop, a stop again.
    #[test]
    fn wheels_coast_on_as_they_went() {
        let time: Vec<f64> = (0..60).map(|row| 0.1 * f64::from(row)).collect();
        let angle = |time: f64| time.min(1.0) - (time - 2.0).clamp(0.0, 1.0);
        let angles: Vec<f64> = time.iter().map(|&time| angle(time)).collect();
        let stops = [[10, 20], [30, 40], [50, 59]].map(|[from, until]| Stop { from, until });
        let coastings = Coasting::all(&time, &stops, &angles);
        let went: Vec<(f64, f64)> = coastings.iter().map(|coasting| (coasting.began, coasting.direction)).collect();
        assert_eq!(went, [(time[10], 1.0), (time[30], -1.0)]);
        for (row, part) in [(10, 0.0), (11, 0.5), (12, 1.0), (20, 1.0)] {
            assert!((coastings[0].part(time[row]) - part).abs() < 1e-12, "{row}");
        }
    }
}
