//! Ways: a run's path as a chain of small body-frame steps, and what is done with such chains.

use super::case::Case;
use super::variant::{Axis, Variant};
use crate::geometry::{Pose2, Trace, Twist2};
use crate::scene::{EmpiricalTerm, Motion};
use std::ops::Range;

/// Length of a step of the way \[s\]: short against how long the robot takes to speed up or turn.
const STEP: f64 = 0.1;

/// Parts of a step between which it is known where the model as given takes the robot: it starts and stops within one.
const FINE: usize = 5;

/// Arm at which a turn counts as way \[m\].
pub(super) const ARM: f64 = 0.3;

/// A change of one step in the body's frame: x, y \[m\], heading \[rad\].
pub(super) type Step = [f64; 3];

/// The way of one run as the model as given predicts it.
#[derive(Debug, Clone)]
pub(super) struct Way {
    pub start: Pose2,
    pub steps: Vec<Step>,
    /// How far the robot is, between the ends of each step, off the smooth curve through those, in the body's frame where the step
    /// begins; none of a way whose times are no log's.
    pub bows: Vec<[Step; FINE - 1]>,
    /// When it began and how long it lasts, by the encoders' clock \[s\].
    pub began: f64,
    pub lasts: f64,
    /// Share of an hour per unit of hourly coordinates.
    pub hours: f64,
}

impl Way {
    /// Where a run of this way is along an axis: what grows by the hour, as far as it had grown.
    pub(super) fn along(&self, axis: &Axis, value: f64, variants: &[Variant]) -> f64 {
        if variants[axis.variant].coordinates[axis.coordinate].hourly { value * self.hours } else { value }
    }

    /// A trace cut into `count` steps: of equal time for a replay, whose times are the log's; else of equal progress, so
    /// that a robot that stands longer somewhere is still compared where it is.
    pub fn of(trace: &Trace, count: usize, replayed: bool, hours: f64) -> Way {
        let bows = if replayed { bows(&evenly(trace, count * FINE)) } else { Vec::new() };
        let steps = steps_along(trace, count, replayed);
        Way { start: trace.poses[0], steps, bows, began: trace.time[0], lasts: lasts(trace), hours }
    }

    /// The way of a run whose counts hardly differ from those of `reference`, whose way this is: the difference of their
    /// dead reckoning is added step by step, turned as much as the reference turned for its own.
    pub(super) fn beside(&self, reference: &Case, case: &Case) -> Way {
        let count = self.steps.len();
        let [own, other] = [reference, case].map(|case| case.reckoned(count * FINE));
        let turned = self.turned();
        let (of_own, of_other) = (bows(&own), bows(&other));
        let [own, other] = [own, other].map(|path| path.into_iter().step_by(FINE).collect::<Vec<_>>());
        let reckoned: f64 = own.windows(2).map(|pair| (pair[1].heading - pair[0].heading).abs()).sum();
        let share = if reckoned > 0.1 { turned / reckoned } else { 1.0 };
        let steps = self
            .steps
            .iter()
            .zip(own.windows(2).zip(other.windows(2)))
            .map(|(step, (own, other))| {
                let (own, other) = (own[0].relative(own[1]), other[0].relative(other[1]));
                [step[0] + other.x - own.x, step[1] + other.y - own.y, step[2] + share * (other.heading - own.heading)]
            })
            .collect();
        let more = |(k, bow): (usize, &[Step; FINE - 1])| {
            std::array::from_fn(|part| {
                let [x, y, turn] = each(|c| of_other[k][part][c] - of_own[k][part][c]);
                [bow[part][0] + x, bow[part][1] + y, bow[part][2] + share * turn]
            })
        };
        let bows = self.bows.iter().enumerate().map(more).collect();
        let began = case.run.encoders.as_ref().map_or(self.began, |log| log.time[0]);
        let start = case.run.start.unwrap_or_default();
        Way { start, steps, bows, began, lasts: case.duration(), hours: case.hours }
    }

    /// The pose so many steps on a `path` that this way, or one that a cause made of it, takes. A run whose log ends in motion goes
    /// on as it went, and one that begins in motion came so: clocks that disagree have poses read there.
    pub fn pose_at(&self, path: &[Pose2], place: f64) -> Pose2 {
        let last = path.len() - 1;
        let step = |k: usize| step_to(path[k], path[k + 1]);
        if place < 0.0 {
            return path[0].compose(scaled(going_on(step(0), step(1)), -place).inverse());
        }
        if place > last as f64 {
            return path[last].compose(scaled(going_on(step(last - 1), step(last - 2)), place - last as f64));
        }
        let k = (place as usize).min(last - 1);
        let part = place - k as f64;
        let smooth = within(path, k, part);
        if self.bows.is_empty() {
            return smooth;
        }
        let bow = |node: usize| match (node / FINE, node % FINE) {
            (_, 0) => Step::default(),
            (k, part) => self.bows[k][part - 1],
        };
        let node = (k * FINE + (part * FINE as f64) as usize).min(last * FINE - 1);
        let part = place * FINE as f64 - node as f64;
        let (one, next) = (bow(node), bow(node + 1));
        let (before, beyond) = (bow(node.saturating_sub(1)), bow((node + 2).min(last * FINE)));
        let between = |from: Step, to: Step, share: f64| each(|c| share * (to[c] - from[c]));
        let more = bent(between(one, next, 1.0), [between(before, next, 0.5), between(one, beyond, 0.5)], part);
        let [x, y, turn] = each(|c| one[c] + more[c]);
        let (sin, cos) = path[k].heading.sin_cos();
        Pose2::new(smooth.x + cos * x - sin * y, smooth.y + sin * x + cos * y, smooth.heading + turn)
    }

    /// All that it turns, either way round \[rad\].
    pub fn turned(&self) -> f64 {
        self.steps.iter().map(|step| step[2].abs()).sum()
    }

    /// Progress at the end of each step, 1 at the end of the way.
    pub(super) fn progress(&self) -> Vec<f64> {
        let mut sum = 0.0;
        let mut progress: Vec<f64> = self
            .steps
            .iter()
            .map(|step| {
                sum += step[0].hypot(step[1]) + ARM * step[2].abs();
                sum
            })
            .collect();
        progress.iter_mut().for_each(|p| *p /= sum.max(1e-9));
        progress
    }

    /// Shares of the way that are behind the robot at `times` of the encoders' clock \[s\].
    pub fn shares_at(&self, times: impl Iterator<Item = f64>) -> Vec<f64> {
        let progress = self.progress();
        let share = |time: f64| {
            let place = ((time - self.began) / self.lasts).clamp(0.0, 1.0) * progress.len() as f64;
            let step = (place as usize).min(progress.len() - 1);
            let before = if step == 0 { 0.0 } else { progress[step - 1] };
            before + (place - step as f64) * (progress[step] - before)
        };
        times.map(share).collect()
    }

    /// How far the robot may be at `time` \[s\] from where it would be had it gone on as its log ends, or come as it begins:
    /// position \[m\] and heading \[rad\], of one whose steps differ by so much from one to the next. One that stands stays.
    pub fn unlogged(&self, time: f64, unsteadiness: [f64; 2]) -> [f64; 2] {
        let place = (time - self.began) / self.lasts * self.steps.len() as f64;
        let last = self.steps.len() - 1;
        let (beyond, step) = if place < 0.0 {
            (-place, going_on(self.steps[0], self.steps[1]))
        } else {
            (place - self.steps.len() as f64, going_on(self.steps[last], self.steps[last - 1]))
        };
        if beyond <= 0.0 {
            return [0.0; 2];
        }
        let typical = self.steps.iter().map(length).sum::<f64>() / self.steps.len() as f64;
        let moves = (length(&step) / typical.max(f64::MIN_POSITIVE)).min(1.0);
        // A speed that wanders off as it did before takes the robot with it, as the time to the power of 3/2.
        unsteadiness.map(|of_step| of_step * beyond.powf(1.5) * moves)
    }

    /// When so much of the way was first behind the robot, by the encoders' clock \[s\].
    pub fn times_of(&self, shares: impl Iterator<Item = f64>) -> Vec<f64> {
        let progress = self.progress();
        let time = |share: f64| {
            let step = progress.partition_point(|&behind| behind < share).min(progress.len() - 1);
            let before = if step == 0 { 0.0 } else { progress[step - 1] };
            let gone = progress[step] - before;
            let part = if gone > 0.0 { ((share - before) / gone).clamp(0.0, 1.0) } else { 0.0 };
            self.began + self.lasts * (step as f64 + part) / progress.len() as f64
        };
        shares.map(time).collect()
    }

    /// How the robot moves in each step.
    pub fn motions(&self) -> Vec<Motion> {
        let dt = self.lasts / self.steps.len() as f64;
        let mut pose = self.start;
        // A run may begin in motion: its first step speeds up as its second does.
        let speed = |k: usize| self.steps[k.min(self.steps.len() - 1)][0] / dt;
        let mut speed_before = 2.0 * speed(0) - speed(1);
        self.steps
            .iter()
            .enumerate()
            .map(|(k, step)| {
                let twist = Twist2 { forward: step[0] / dt, left: step[1] / dt, yaw_rate: step[2] / dt };
                let acceleration = (twist.forward - speed_before) / dt;
                speed_before = twist.forward;
                let motion = Motion { twist, pose, time: (k as f64 + 0.5) * dt, acceleration };
                pose = pose.compose(Pose2::new(step[0], step[1], step[2]));
                motion
            })
            .collect()
    }

    /// What a term of the body's twist adds to each step, for a coefficient of 1.
    pub fn empirical(&self, term: &EmpiricalTerm) -> Vec<Step> {
        let dt = self.lasts / self.steps.len() as f64;
        let term = [EmpiricalTerm { coefficient: 1.0, ..*term }];
        let added = |motion: &Motion| {
            let added = EmpiricalTerm::twist(&term, motion);
            [added.forward * dt, added.left * dt, added.yaw_rate * dt]
        };
        self.motions().iter().map(added).collect()
    }
}

/// Root mean squares over ways of how much steps differ from one to the next: position \[m\], heading \[rad\].
pub(super) fn unsteadiness<'a>(ways: impl Iterator<Item = &'a Way>) -> [f64; 2] {
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for pair in ways.flat_map(|way| way.steps.windows(2)) {
        sum[0] += (pair[1][0] - pair[0][0]).powi(2) + (pair[1][1] - pair[0][1]).powi(2);
        sum[1] += (pair[1][2] - pair[0][2]).powi(2);
        count += 1.0;
    }
    sum.map(|sum| (sum / f64::max(count, 1.0)).sqrt())
}

/// How far a path, which has so many poses a step, is off the curve through the ends of its steps.
fn bows(fine: &[Pose2]) -> Vec<[Step; FINE - 1]> {
    let path: Vec<Pose2> = fine.iter().copied().step_by(FINE).collect();
    let of_step = |k: usize| {
        std::array::from_fn(|part| {
            let smooth = within(&path, k, (part + 1) as f64 / FINE as f64);
            let pose = fine[k * FINE + part + 1];
            let (sin, cos) = path[k].heading.sin_cos();
            let (x, y) = (pose.x - smooth.x, pose.y - smooth.y);
            [cos * x + sin * y, cos * y - sin * x, pose.heading - smooth.heading]
        })
    };
    (0..path.len() - 1).map(of_step).collect()
}

/// The step beyond the `outermost` of a way: at the speed that it has at its end, as it and the `next` one show; none of a robot that
/// is only just setting off, or has come to rest.
fn going_on(outermost: Step, next: Step) -> Step {
    const SETS_OFF: f64 = 0.3;
    let at_end = each(|c| 1.5 * outermost[c] - 0.5 * next[c]);
    let turns_round = at_end[0] * outermost[0] + at_end[1] * outermost[1] + ARM * ARM * at_end[2] * outermost[2] <= 0.0;
    if turns_round || length(&at_end) < SETS_OFF * length(&next) { Step::default() } else { at_end }
}

/// So much of a step, on the arc that it is.
fn scaled([x, y, turn]: Step, by: f64) -> Pose2 {
    let direction = 0.5 * (by - 1.0) * turn;
    let (sin, cos) = direction.sin_cos();
    Pose2::new(by * (cos * x - sin * y), by * (sin * x + cos * y), by * turn)
}

/// The pose a `part` of step `k` after its beginning: a cubic through its ends with the speeds of its neighbours, exact
/// while the robot speeds up or slows down steadily.
fn within(path: &[Pose2], k: usize, part: f64) -> Pose2 {
    let step = |of: usize| {
        let (from, to) = (path[of], path[of + 1]);
        [to.x - from.x, to.y - from.y, to.heading - from.heading]
    };
    let [before, here, after] = [k.saturating_sub(1), k, (k + 1).min(path.len() - 2)].map(step);
    let speeds = [before, after].map(|other| each(|c| 0.5 * (other[c] + here[c])));
    let [x, y, turn] = bent(here, speeds, part);
    Pose2::new(path[k].x + x, path[k].y + y, path[k].heading + turn)
}

/// A part of a way, on the cubic that sets out and arrives at these speeds \[Hermite\].
fn bent(way: Step, [first, last]: [Step; 2], part: f64) -> Step {
    let (p, p2, p3) = (part, part * part, part * part * part);
    let (of_way, of_first, of_last) = (3.0 * p2 - 2.0 * p3, p3 - 2.0 * p2 + p, p3 - p2);
    each(|c| way[c] * of_way + first[c] * of_first + last[c] * of_last)
}

/// Ends of the steps, the start first.
pub(super) fn compose(start: Pose2, steps: &[Step]) -> Vec<Pose2> {
    let mut path = Vec::with_capacity(steps.len() + 1);
    let mut pose = start;
    path.push(pose);
    let (mut sin, mut cos) = start.heading.sin_cos();
    for &[dx, dy, turn] in steps {
        pose = Pose2::new(pose.x + cos * dx - sin * dy, pose.y + sin * dx + cos * dy, pose.heading + turn);
        path.push(pose);
        (sin, cos) = turned((sin, cos), turn);
    }
    path
}

/// Moves a path as changes of the steps of a part of it do, to first order: what follows a step is shifted by its own, and turned
/// about its end. `directions` are sines and cosines of the path's headings.
pub(super) fn bend(path: &mut [Pose2], directions: &[(f64, f64)], part: Range<usize>, change: impl Fn(usize) -> Step) {
    // A pose at (x, y) is moved by `shift` and `turn` times (−y, x).
    let (mut shift, mut turn) = ([0.0; 2], 0.0);
    for (k, pose) in path.iter_mut().enumerate().skip(part.start + 1) {
        if k <= part.end {
            let ([dx, dy, turned], (sin, cos)) = (change(k - 1), directions[k - 1]);
            shift[0] += cos * dx - sin * dy + turned * pose.y;
            shift[1] += sin * dx + cos * dy - turned * pose.x;
            turn += turned;
        }
        let (x, y) = (pose.x, pose.y);
        *pose = Pose2::new(x + shift[0] - turn * y, y + shift[1] + turn * x, pose.heading + turn);
    }
}

/// A direction's sine and cosine turned on by a step's turn, which is little: by series that are exact to 1e-12 below 0.15 rad.
fn turned((sin, cos): (f64, f64), turn: f64) -> (f64, f64) {
    let (s, c) = if turn.abs() < 0.15 {
        let t2 = turn * turn;
        let s = turn * (1.0 - t2 / 6.0 * (1.0 - t2 / 20.0 * (1.0 - t2 / 42.0)));
        let c = 1.0 - t2 / 2.0 * (1.0 - t2 / 12.0 * (1.0 - t2 / 30.0 * (1.0 - t2 / 56.0)));
        (s, c)
    } else {
        turn.sin_cos()
    };
    (sin * c + cos * s, cos * c - sin * s)
}

/// How long a trace lasts \[s\].
pub(super) fn lasts(trace: &Trace) -> f64 {
    trace.time[trace.time.len() - 1] - trace.time[0]
}

/// Steps that a way of this duration \[s\] is cut into.
pub(super) fn count_of(duration: f64) -> usize {
    ((duration / STEP).ceil() as usize).max(4)
}

/// Steps that the way of a trace is cut into.
pub(super) fn steps_of(trace: &Trace) -> usize {
    count_of(lasts(trace))
}

/// The steps that a trace is cut into, as a way is.
pub(super) fn steps_along(trace: &Trace, count: usize, replayed: bool) -> Vec<Step> {
    let path = if replayed { evenly(trace, count) } else { by_progress(trace, count) };
    path.windows(2).map(|pair| step_to(pair[0], pair[1])).collect()
}

/// Poses at equal times.
fn evenly(trace: &Trace, count: usize) -> Vec<Pose2> {
    let (began, lasts) = (trace.time[0], lasts(trace));
    (0..=count).map(|k| trace.at(began + lasts * k as f64 / count as f64)).collect()
}

/// The step from one pose to another.
fn step_to(from: Pose2, to: Pose2) -> Step {
    let step = from.relative(to);
    [step.x, step.y, step.heading]
}

/// Poses at equal progress: way, and turn at an arm of 0.3 m.
fn by_progress(trace: &Trace, count: usize) -> Vec<Pose2> {
    let mut progress = vec![0.0];
    for pair in trace.poses.windows(2) {
        let more = pair[0].distance(pair[1]) + ARM * (pair[1].heading - pair[0].heading).abs();
        progress.push(progress[progress.len() - 1] + more);
    }
    let total = progress[progress.len() - 1];
    (0..=count)
        .map(|k| {
            let wanted = total * k as f64 / count as f64;
            let after = progress.partition_point(|&p| p < wanted).clamp(1, progress.len() - 1);
            let (p0, p1) = (progress[after - 1], progress[after]);
            let part = if p1 > p0 { ((wanted - p0) / (p1 - p0)).clamp(0.0, 1.0) } else { 1.0 };
            let step = trace.poses[after - 1].relative(trace.poses[after]);
            trace.poses[after - 1].compose(Pose2::new(step.x * part, step.y * part, step.heading * part))
        })
        .collect()
}

/// Adds `changes`, so many times, to `steps`.
pub(super) fn add_times(times: f64, changes: &[Step], steps: &mut [Step]) {
    if times == 0.0 {
        return;
    }
    for (step, change) in steps.iter_mut().zip(changes) {
        for c in 0..3 {
            step[c] += times * change[c];
        }
    }
}

/// Length of a step, its turn counted at an arm \[m\].
pub(super) fn length(step: &Step) -> f64 {
    step[0].hypot(step[1]).hypot(ARM * step[2])
}

pub(super) fn each(value: impl Fn(usize) -> f64) -> Step {
    std::array::from_fn(value)
}

pub(super) fn subtract(changes: &mut [Step], others: &[Step]) {
    for (change, other) in changes.iter_mut().zip(others) {
        *change = each(|c| change[c] - other[c]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Feature, TermPart};

    /// On a steady arc a pose beyond either end is where the arc goes on; a robot that stands stays, and is sure to.
    #[test]
    fn a_way_goes_on_beyond_its_ends_as_it_went() {
        let arc = |turn: f64| Pose2::new(turn.sin(), 1.0 - turn.cos(), turn);
        let path: Vec<Pose2> = (0..=4).map(|k| arc(0.1 * f64::from(k))).collect();
        let way = |steps: Vec<Step>| {
            let lasts = 0.1 * steps.len() as f64;
            Way { start: Pose2::IDENTITY, steps, bows: Vec::new(), began: 0.0, lasts, hours: 0.0 }
        };
        let whole = way(vec![[0.1, 0.0, 0.1]; 4]);
        for place in [-1.7, -0.4, 0.0, 4.0, 4.3, 6.0] {
            let (found, expected) = (whole.pose_at(&path, place), arc(0.1 * place));
            // The chord of a step is a 24th of the cube of its turn short of the arc, and is scaled as it is.
            let beyond: f64 = f64::max(-place, place - 4.0);
            let short = (beyond.powi(3) - beyond).abs() * 0.1f64.powi(3) / 24.0;
            assert!((found.distance(expected) - short).abs() < 1e-6, "{place}: {found:?}");
            assert!((found.heading - expected.heading).abs() < 1e-12);
        }
        let stands = [Pose2::IDENTITY; 3];
        assert_eq!([-3.0, 5.0].map(|place| whole.pose_at(&stands, place)), [Pose2::IDENTITY; 2]);
        let ends = |last: f64| way(vec![[0.04, 0.0, 0.0], [0.04, 0.0, 0.0], [last, 0.0, 0.0]]);
        assert_eq!(ends(0.0).unlogged(0.5, [0.01, 0.02]), [0.0; 2]);
        assert_eq!(ends(0.04).unlogged(0.3, [0.01, 0.02]), [0.0; 2]);
        let [position, heading] = ends(0.04).unlogged(0.7, [0.01, 0.02]);
        assert!((position - 0.08).abs() < 1e-12 && (heading - 0.16).abs() < 1e-12, "{position} {heading}");
    }

    /// A robot that sets off, turns and stops as motors have it, read at moments that no step ends at: as near as the trace itself
    /// is, where the curve through the steps' ends alone is 0.3 mm and 0.7 mrad off.
    #[test]
    fn a_reading_is_where_the_robot_was() {
        // Way and turn at 1 m/s² and 2 rad/s².
        let ramp = |time: f64, began: f64, lasts: f64| {
            let since = (time - began).clamp(0.0, lasts + 0.4);
            let [up, down] = [since.min(0.4), (since - lasts).max(0.0)];
            0.5 * up * up + 0.4 * (since - up) - 0.5 * down * down
        };
        let pose = |time: f64| {
            let (gone, turned) = (ramp(time, 0.13, 1.1), 2.0 * ramp(time, 1.95, 0.9));
            Pose2::new(gone, 0.0, turned)
        };
        let time: Vec<f64> = (0..=176).map(|k| (0.02 * f64::from(k)).min(3.513)).collect();
        let trace = Trace { poses: time.iter().map(|&time| pose(time)).collect(), time };
        let way = Way::of(&trace, count_of(lasts(&trace)), true, 0.0);
        let path = compose(way.start, &way.steps);
        let off = |way: &Way| {
            let read = |time: f64| way.pose_at(&path, time / way.lasts * (path.len() - 1) as f64);
            let of = |time: f64| (read(time).distance(pose(time)), (read(time).heading - pose(time).heading).abs());
            let all = (0..1000).map(|k| of(3.513e-3 * f64::from(k)));
            all.fold((0.0, 0.0), |most: (f64, f64), one| (most.0.max(one.0), most.1.max(one.1)))
        };
        // Of a chord of 20 ms, twice: a t²/8 each.
        let (way_off, turn_off) = off(&way);
        assert!(way_off < 1e-4 && turn_off < 2e-4, "{way_off:e} m, {turn_off:e} rad");
        let (way_off, turn_off) = off(&Way { bows: Vec::new(), ..way.clone() });
        assert!(way_off > 2e-4 && turn_off > 5e-4, "{way_off:e} m, {turn_off:e} rad");
        // Before it set off it stood, and after it stopped it stands, though its outermost steps move.
        let sets_off = [0.0, 1.0, 4.0, 9.0].map(|x| Pose2::new(1e-3 * x, 0.0, 0.0));
        let stops = [0.0, 5.0, 8.0, 9.0].map(|x| Pose2::new(1e-3 * x, 0.0, 0.0));
        assert_eq!(way.pose_at(&sets_off, -30.0), sets_off[0]);
        assert_eq!(way.pose_at(&stops, 33.0), stops[3]);
    }

    #[test]
    fn a_bent_path_is_that_of_changed_steps_to_first_order() {
        let steps: Vec<Step> = (0..40).map(|k| [0.04, 0.001 * f64::from(k % 3), 0.05 * f64::from(k % 7 - 2)]).collect();
        let change = |k: usize| [1e-5 * (k as f64).sin(), -1e-5 * (k as f64).cos(), 1e-5 * (k % 5) as f64];
        let start = Pose2::new(0.3, -0.2, 0.7);
        let given = compose(start, &steps);
        let directions: Vec<_> = given.iter().map(|pose| pose.heading.sin_cos()).collect();
        for part in [0..40, 0..9, 13..29, 35..40, 7..7] {
            let mut changed = steps.clone();
            part.clone().for_each(|k| add_times(1.0, &[change(k)], &mut changed[k..=k]));
            let mut bent = given.clone();
            bend(&mut bent, &directions, part.clone(), change);
            let off = compose(start, &changed).iter().zip(&bent).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            // Turns add up to 1e-3 at most, over 1.6 m: half their square of it, and as much of the shift, is second order.
            assert!(off < 1e-6, "{part:?}: {off:e}");
        }
    }

    #[test]
    fn a_way_that_begins_in_motion_speeds_up_no_more_for_that() {
        let accelerated = EmpiricalTerm { part: TermPart::Forward, feature: Feature::Acceleration, coefficient: 1.0 };
        let added = |speeds: &[f64]| -> Vec<f64> {
            let steps: Vec<Step> = speeds.iter().map(|speed| [0.1 * speed, 0.0, 0.0]).collect();
            let lasts = 0.1 * steps.len() as f64;
            let way = Way { start: Pose2::IDENTITY, steps, bows: Vec::new(), began: 0.0, lasts, hours: 0.0 };
            way.empirical(&accelerated).iter().map(|step| step[0]).collect()
        };
        // A term a adds what the speed grows by: nothing at 0.4 m/s, 0.02 m a step where that grows by 0.02 m/s, at rest or not.
        assert!(added(&[0.4; 5]).iter().all(|it| it.abs() < 1e-12));
        assert!(added(&[0.4]).iter().all(|it| it.abs() < 1e-12));
        for first in [0.01, 0.41] {
            let speeds = [0, 1, 2, 3].map(|k| first + 0.02 * f64::from(k));
            assert!(added(&speeds).iter().all(|it| (it - 0.02).abs() < 1e-12));
        }
    }
}
