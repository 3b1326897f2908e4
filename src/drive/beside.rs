//! A run on floors that are its own but for a spot: simulated only while the robot is there.
//!
//! A robot that closes its loop on ticks drives on after a spot as it would have driven without, from where it then is: so
//! only what happens while it turns within a spot's reach is simulated, from a copy of the run that gets there. What this leaves out is what
//! hangs on where in the room the robot is (a slope, another spot, the same spot a second time), in proportion to how far the
//! first pass moved it.

use super::error::DriveError;
use super::replay::{Replaying, log_of, rotations};
use super::run::{Task, Underway, in_world};
use crate::dataset::Run;
use crate::geometry::{Pose2, Trace};
use crate::odometry::OdometryParameters;
use crate::scene::{GripRegion, Scene, SpottedFloor};
use crate::world::{World, WorldError};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// How long wheels, tyres and speed loops take to come to rest after a spot \[s\].
const RELAX: f64 = 0.5;
/// Rate from which on a robot turns, so that its wheels slip aside and a spot has something to do \[rad/s\].
const TURNS: f64 = 0.02;

/// Where the base is when `task` is driven without noise on each of `floors`, each the scene's but for a spot.
///
/// # Errors
/// As for [`super::run`].
pub fn run_beside(
    scene: &Scene,
    task: &Task,
    floors: &[SpottedFloor],
    stop: &AtomicBool,
) -> Result<Vec<Trace>, DriveError> {
    let going = Underway::begin(scene, task, 0)?;
    let settled = going.world.pose();
    let going = Driven { going, is_over: false, mark: task.start.compose(settled.inverse()) };
    beside(going, &task.name, floors, stop)
}

/// Where the base is when the log of `run` is replayed on each of `floors`, each the scene's but for a spot.
///
/// # Errors
/// As for [`super::replay`].
pub fn replay_beside(
    scene: &Scene,
    run: &Run,
    counted: &OdometryParameters,
    floors: &[SpottedFloor],
    stop: &AtomicBool,
) -> Result<Vec<Trace>, DriveError> {
    let log = log_of(run)?;
    let wheels = rotations(scene, run, log, counted);
    beside(Replaying::begin(scene, run, log, &wheels)?, &run.name, floors, stop)
}

/// A simulation under way, of which a copy goes on as the original does.
trait Going: Clone + Send {
    fn world(&mut self) -> &mut World;
    fn time(&self) -> f64;
    /// Where the base is.
    fn pose(&self) -> Pose2;
    /// Goes on to the next moment that a trace keeps; whether there is one.
    fn go_on(&mut self) -> Result<bool, WorldError>;
}

/// A protocol, as it is driven.
#[derive(Clone)]
struct Driven {
    going: Underway,
    is_over: bool,
    /// From where the robot came to rest to where it was put.
    mark: Pose2,
}

impl Going for Driven {
    fn world(&mut self) -> &mut World {
        &mut self.going.world
    }

    fn time(&self) -> f64 {
        self.going.time()
    }

    fn pose(&self) -> Pose2 {
        self.mark.compose(self.going.world.pose())
    }

    fn go_on(&mut self) -> Result<bool, WorldError> {
        if self.is_over {
            return Ok(false);
        }
        // The driver has yet to decide on the moment where it is.
        loop {
            self.is_over = self.going.decide();
            if self.is_over {
                return Ok(!self.going.is_kept());
            }
            self.going.advance()?;
            if self.going.is_kept() {
                return Ok(true);
            }
        }
    }
}

impl Going for Replaying<'_> {
    fn world(&mut self) -> &mut World {
        &mut self.world
    }

    fn time(&self) -> f64 {
        Replaying::time(self)
    }

    fn pose(&self) -> Pose2 {
        self.world.pose()
    }

    fn go_on(&mut self) -> Result<bool, WorldError> {
        Replaying::go_on(self)
    }
}

/// One pass of a spot, from the moment `from` of the run as it is.
struct Pass<G> {
    floor: usize,
    from: usize,
    /// The moment at which it is over; `None`: the run ends in it.
    until: Option<usize>,
    last_within: f64,
    going: G,
}

fn beside<G: Going>(
    mut going: G,
    run: &str,
    floors: &[SpottedFloor],
    stop: &AtomicBool,
) -> Result<Vec<Trace>, DriveError> {
    let mut given = Trace::default();
    let mut passes: Vec<Pass<G>> = Vec::new();
    let mut under_way: Vec<Option<usize>> = vec![None; floors.len()];
    loop {
        let (time, pose) = (going.time(), going.pose());
        let turns = going.world().twist().yaw_rate.abs() > TURNS;
        let moment = given.time.len();
        for (floor, (spotted, pass)) in floors.iter().zip(&mut under_way).enumerate() {
            match (turns && spotted.is_within(pose), *pass) {
                (true, Some(pass)) => passes[pass].last_within = time,
                (true, None) => {
                    *pass = Some(passes.len());
                    let going = going.clone();
                    passes.push(Pass { floor, from: moment, until: None, last_within: time, going });
                }
                (false, Some(under_way)) if time > passes[under_way].last_within + RELAX => {
                    passes[under_way].until = Some(moment);
                    *pass = None;
                }
                (false, _) => {}
            }
        }
        given.time.push(time);
        given.poses.push(pose);
        if stop.load(Ordering::Relaxed) {
            return Err(DriveError::Interrupted { run: run.to_owned() });
        }
        if !going.go_on().map_err(in_world(run))? {
            break;
        }
    }
    let passed: Vec<(usize, usize, Option<usize>, Trace)> = passes
        .into_par_iter()
        .map(|pass| {
            let Pass { floor, from, until, mut going, .. } = pass;
            let trace = through(&mut going, &floors[floor].regions, until.map(|until| until - from));
            Ok((floor, from, until, trace.map_err(in_world(run))?))
        })
        .collect::<Result<_, DriveError>>()?;
    Ok((0..floors.len())
        .map(|floor| {
            let own = passed.iter().filter(|(of, ..)| *of == floor);
            spliced(&given, own.map(|(_, from, until, trace)| (*from, *until, trace)))
        })
        .collect())
}

/// Goes on for so many moments, or to the end, on a floor with these regions.
fn through<G: Going>(going: &mut G, regions: &[GripRegion], moments: Option<usize>) -> Result<Trace, WorldError> {
    going.world().set_regions(regions);
    let mut trace = Trace::default();
    while moments.is_none_or(|moments| trace.time.len() < moments) && going.go_on()? {
        trace.time.push(going.time());
        trace.poses.push(going.pose());
    }
    Ok(trace)
}

/// The run as it is but for its passes of a spot, each in the place of the moments after `from` up to `until`.
fn spliced<'t>(given: &Trace, passes: impl Iterator<Item = (usize, Option<usize>, &'t Trace)>) -> Trace {
    let mut whole = Trace::default();
    // From where the robot is without the spot to where it is with it.
    let mut moved = Pose2::IDENTITY;
    let mut add = |moved: Pose2, time: &[f64], poses: &[Pose2]| {
        whole.time.extend_from_slice(time);
        whole.poses.extend(poses.iter().map(|pose| moved.compose(*pose)));
    };
    let mut next = 0;
    for (from, until, pass) in passes {
        add(moved, &given.time[next..=from], &given.poses[next..=from]);
        add(moved, &pass.time, &pass.poses);
        let Some(until) = until else { return whole };
        next = until + 1;
        let end = pass.poses.last().copied().unwrap_or(given.poses[until]);
        moved = moved.compose(end).compose(given.poses[until].inverse());
    }
    add(moved, &given.time[next..], &given.poses[next..]);
    whole
}
