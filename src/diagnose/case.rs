//! The runs as a diagnosis sees them: what was read where, and which runs repeat one another.

use super::way::ARM;
use crate::dataset::{Dataset, PoseLog, Protocol, Run};
use crate::geometry::{Pose2, Trace};
use crate::odometry::{DeadReckoning, OdometryParameters};
use crate::scene::{NoiseModel, Scene, Survey};
use std::ops::Range;

/// One run.
#[derive(Debug, Clone)]
pub(super) struct Case {
    /// Index of its campaign: each has a survey and clocks of its own.
    pub campaign: usize,
    pub campaign_name: String,
    pub run: Run,
    /// What the wheels' counts mean.
    pub counted: OdometryParameters,
    /// Whether it has an encoder log to replay.
    pub replayed: bool,
    /// What was read, in order of time; the last is the end.
    pub readings: Vec<Reading>,
    /// Stamp of the reading whose frame the others are stated in \[s\]; `None`: the start, of which no log has a reading.
    pub frame_stamp: Option<f64>,
    /// Hours since the campaign began.
    pub hours: f64,
}

/// One surveyed pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reading {
    /// By the survey's clock \[s\]; `None`: at the end of the run.
    pub stamp: Option<f64>,
    pub x: f64,
    pub y: f64,
    pub heading: Option<f64>,
}

/// Runs that repeat one another: the same protocol, driven alike.
#[derive(Debug, Clone)]
pub(super) struct Cluster {
    /// Index of the run that stands for them.
    pub reference: usize,
    /// Indices of all of them.
    pub runs: Vec<usize>,
    /// Index of the condition that it belongs to.
    pub condition: usize,
    /// Index of the campaign that it belongs to.
    pub campaign: usize,
}

impl Cluster {
    /// Its runs that count; `counts` says how often each run does.
    pub fn active<'a>(&'a self, counts: &'a [f64]) -> impl Iterator<Item = usize> + 'a {
        self.runs.iter().copied().filter(|&run| counts[run] > 0.0)
    }

    /// How many runs it has that count.
    pub fn count(&self, counts: &[f64]) -> f64 {
        self.runs.iter().map(|&run| counts[run]).sum()
    }
}

/// What was driven: runs of one condition share what a model gets wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// What was driven; all paths are one condition.
    pub protocol: Protocol,
    /// Cruising speed \[m/s\].
    pub speed: Option<f64>,
    /// Turn rate on the spot \[rad/s\].
    pub turn_rate: Option<f64>,
}

impl Condition {
    pub(super) fn of(run: &Run) -> Condition {
        Condition { protocol: run.protocol, speed: run.speed, turn_rate: run.turn_rate }
    }

    /// In words: `square 2 m ccw`.
    pub fn label(&self) -> String {
        let shape = match self.protocol {
            Protocol::Square { side, .. } => format!("square {side} m"),
            Protocol::Straight { length, .. } => format!("straight {length} m"),
            Protocol::Spin { turn, .. } => format!("spin {turn:.1} rad"),
            Protocol::Circle { radius, .. } => format!("circle {radius} m"),
            Protocol::Path => "path".to_owned(),
        };
        let mut label = shape;
        if let Some(direction) = self.protocol.direction() {
            label = format!("{label} {direction}");
        }
        if let Some(speed) = self.speed.filter(|_| !matches!(self.protocol, Protocol::Spin { .. })) {
            label = format!("{label}, {speed} m/s");
        }
        if let Some(rate) = self.turn_rate.filter(|_| matches!(self.protocol, Protocol::Spin { .. })) {
            label = format!("{label}, {rate} rad/s");
        }
        label
    }
}

/// Readings of one run that take part: enough to see what happens along the way, few enough to be quick with.
const MOST_READINGS: usize = 40;
/// Readings of all runs together, as far as each keeps its share of at least a fifth.
const READINGS: usize = 2000;

/// Readings of one run that are drawn: no polygon where it was a circle.
const DRAWN: usize = 240;
/// How much of a way may lie between where one run was read and where another was, and what they differ by still be the same noise:
/// what is between readings of one run.
const PLACE: f64 = 1.0 / MOST_READINGS as f64;
/// How far the survey's clock may plausibly be from the encoders' where a stop is sought \[s\].
const CLOCKS: f64 = 0.1;

/// The runs of `datasets` that have anything to say: an end pose or poses, and a way to predict them, in the world of
/// `scene`. Names of those left out come with the reason. Campaigns are numbered from `first` on.
pub(super) fn cases(datasets: &[Dataset], first: usize, scene: &Scene) -> (Vec<Case>, Vec<String>) {
    let fallback = &scene.robot.odometry;
    let mut cases = Vec::new();
    let mut left_out = Vec::new();
    let runs: usize = datasets.iter().map(|dataset| dataset.runs.len()).sum();
    let most = (READINGS / runs.max(1)).clamp(MOST_READINGS / 5, MOST_READINGS);
    for (campaign, dataset) in (first..).zip(datasets) {
        let counted = dataset.campaign.odometry.unwrap_or(*fallback);
        let counted = OdometryParameters {
            ticks_per_revolution: counted
                .ticks_per_revolution
                .or(dataset.campaign.robot.ticks_per_revolution)
                .or(fallback.ticks_per_revolution),
            ..counted
        };
        let (own, zero) = (cases.len(), dataset.clock_zero());
        for run in &dataset.runs {
            let name = format!("{}/{}", dataset.campaign.name, run.name);
            let run = since(run, zero);
            let both_sides = |log: &crate::dataset::EncoderLog| {
                ["left", "right"].iter().all(|side| log.channels.iter().any(|name| name.ends_with(side)))
            };
            let log = run.log();
            if log.is_some_and(|log| !both_sides(log)) {
                left_out.push(format!("{name}: its encoder log has only one side"));
                continue;
            }
            let replayed = log.is_some();
            if !replayed && run.protocol.nominal_end().is_none() {
                left_out.push(format!("{name}: without an encoder log, its way is not known"));
                continue;
            }
            let readings = readings(&run, replayed, &counted, most);
            let apart = apart(&run, replayed, zero);
            if readings.is_empty() && apart.is_none() {
                left_out.push(format!("{name}: no pose was read"));
            }
            left_out.extend(apart.map(|apart| format!("{name}: {apart}")));
            if readings.is_empty() {
                continue;
            }
            let on_the_way = readings.iter().any(|reading| reading.stamp.is_some());
            let frame_stamp =
                run.poses.as_ref().filter(|log| on_the_way && begins_with_frame(log)).map(|log| log.time[0]);
            let hours = run.started.unwrap_or(0.0) / 3600.0;
            let campaign_name = dataset.campaign.name.clone();
            cases.push(Case { campaign, campaign_name, run, counted, replayed, readings, frame_stamp, hours });
        }
        on_their_marks(&mut cases[own..], &NoiseModel::prior(&stated_survey(dataset, scene)));
    }
    (cases, left_out)
}

/// How a campaign was surveyed, as far as it says so.
pub(super) fn stated_survey(dataset: &Dataset, scene: &Scene) -> Survey {
    let stated = &dataset.campaign.survey;
    Survey {
        position_std: stated.position_std.unwrap_or(scene.survey.position_std),
        heading_std: stated.heading_std.unwrap_or(scene.survey.heading_std),
        ..scene.survey
    }
}

/// Draws surveyed starts of one mark to their mean, by as much as survey noise alone makes them differ [James & Stein 1961]:
/// a robot that is put on a mark each time begins nearer to it than one reading says, and a spot on the floor four metres
/// away is come upon a centimetre off for each few milliradians.
fn on_their_marks(cases: &mut [Case], noise: &NoiseModel) {
    let starts: Vec<Option<Pose2>> = cases.iter().map(|case| case.run.start).collect();
    for (case, start) in cases.iter_mut().zip(&starts) {
        let Some(own) = *start else { continue };
        let mark: Vec<Pose2> = starts.iter().flatten().copied().filter(|other| near(own, *other)).collect();
        if mark.len() < 3 {
            continue;
        }
        let drawn = |of: fn(&Pose2) -> f64, std_dev: f64| {
            let count = mark.len() as f64;
            let mean = mark.iter().map(of).sum::<f64>() / count;
            let variance = mark.iter().map(|pose| (of(pose) - mean).powi(2)).sum::<f64>() / (count - 1.0);
            let apart = (variance - std_dev * std_dev).max(0.0);
            mean + (of(&own) - mean) * apart / variance.max(f64::MIN_POSITIVE)
        };
        case.run.start = Some(Pose2 {
            x: drawn(|pose| pose.x, noise.position_std),
            y: drawn(|pose| pose.y, noise.position_std),
            heading: drawn(|pose| pose.heading, noise.heading_std),
        });
    }
}

/// A run whose clocks begin at `zero`: what they go wrong by an hour is counted from there, be it the seconds since 1970.
fn since(run: &Run, zero: f64) -> Run {
    let mut run = run.clone();
    let times = [run.encoders.as_mut().map(|log| &mut log.time), run.poses.as_mut().map(|log| &mut log.time)];
    times.into_iter().flatten().flatten().for_each(|time| *time -= zero);
    run
}

/// That poses were read on the way, and at other times than its encoders.
fn apart(run: &Run, replayed: bool, zero: f64) -> Option<String> {
    let (poses, encoders) = (run.poses.as_ref().filter(|_| replayed)?, run.encoders.as_ref()?);
    let span = |times: &[f64]| Some(format!("{:.1} to {:.1} s", times.first()? + zero, times.last()? + zero));
    let is_apart = poses.time.len() > 2 && on_the_way(run, replayed).is_none();
    let (read, logged) = (span(&poses.time).filter(|_| is_apart)?, span(&encoders.time)?);
    Some(format!(
        "its poses on the way, stamped {read}, hardly overlap with its encoder log, {logged}; clocks have to agree to half a second"
    ))
}

/// Rows of the poses that were read on the way. They need an encoder log, which tells when the robot was where.
fn on_the_way(run: &Run, replayed: bool) -> Option<(&PoseLog, Vec<usize>)> {
    let log = run.poses.as_ref().filter(|log| replayed && log.time.len() > 2)?;
    let encoders = run.encoders.as_ref()?;
    let (first, last) = (encoders.time[0] - 0.5, encoders.time[encoders.len() - 1] + 0.5);
    let rows: Vec<usize> = (usize::from(begins_with_frame(log))..log.time.len())
        .filter(|&row| (first..=last).contains(&log.time[row]))
        .collect();
    (rows.len() > 2).then_some((log, rows))
}

/// Whether the first row is the start pose that all others are seen from, and not one more of them: a tracker that came upon the robot
/// on its way, or read its start apart.
fn begins_with_frame(log: &PoseLog) -> bool {
    const ROUNDED: f64 = 1e-6;
    log.poses
        .first()
        .is_some_and(|first| [first.x, first.y, first.heading.unwrap_or(0.0)].iter().all(|it| it.abs() < ROUNDED))
}

/// At most so many of `rows`, evenly, with the last one.
fn thinned(rows: &[usize], most: usize) -> Vec<usize> {
    let count = rows.len().min(most);
    (1..=count).map(|k| rows[k * rows.len() / count - 1]).collect()
}

/// Moves each of `rows` to the nearest of `others` that the one before did not take; there are no fewer of those. Both rise.
fn move_to_nearest(rows: &mut [usize], others: &[usize]) {
    let (count, mut free) = (rows.len(), 0);
    for (k, row) in rows.iter_mut().enumerate() {
        let after = others.partition_point(|other| other < row).min(others.len() - 1);
        let before = after.saturating_sub(1);
        let nearest = if row.abs_diff(others[before]) < row.abs_diff(others[after]) { before } else { after };
        let place = nearest.clamp(free, others.len() - (count - k));
        *row = others[place];
        free = place + 1;
    }
}

/// What was read at these rows.
fn read(log: &PoseLog, rows: &[usize]) -> Vec<Reading> {
    let of = |&row: &usize| {
        let pose = log.poses[row];
        Reading { stamp: Some(log.time[row]), x: pose.x, y: pose.y, heading: pose.heading }
    };
    rows.iter().map(of).collect()
}

/// The readings that take part. What the robot does within a stop no log tells: it may coast on, at once or late. Readings there
/// give way to the nearest before or after, which tell as well where a leg ends; they stay where there are too few others.
fn readings(run: &Run, replayed: bool, counted: &OdometryParameters, most: usize) -> Vec<Reading> {
    if let (Some((log, rows)), Some(encoders)) = (on_the_way(run, replayed), &run.encoders) {
        let stops: Vec<_> = encoders
            .stops(counted)
            .iter()
            .map(|stop| encoders.time[stop.from] - CLOCKS..=encoders.time[stop.until] + CLOCKS)
            .collect();
        let end = rows[rows.len() - 1];
        let stands = |row: usize| stops.iter().any(|stop| stop.contains(&log.time[row]));
        let moving: Vec<usize> = rows.iter().copied().filter(|&row| row == end || !stands(row)).collect();
        let mut chosen = thinned(&rows, most);
        if moving.len() >= chosen.len() {
            move_to_nearest(&mut chosen, &moving);
        }
        return read(log, &chosen);
    }
    run.end.map(|end| Reading { stamp: None, x: end.x, y: end.y, heading: end.heading }).into_iter().collect()
}

impl Case {
    /// Name of its campaign and its own.
    pub fn name(&self) -> String {
        format!("{}/{}", self.campaign_name, self.run.name)
    }

    /// Whether poses were read on its way.
    pub fn is_timed(&self) -> bool {
        self.readings.iter().any(|reading| reading.stamp.is_some())
    }

    /// Where its end stands among its readings as `linear` lists them: a position, and a heading where one was read.
    pub fn rows_of_end(&self) -> Range<usize> {
        let rows = |reading: &Reading| if reading.heading.is_some() { 3 } else { 2 };
        let all = self.readings.iter().map(rows).sum();
        all - self.readings.last().map_or(0, rows)..all
    }

    /// The same run with so many readings that its way can be drawn.
    pub fn drawn(&self) -> Case {
        let readings = on_the_way(&self.run, self.replayed).map(|(log, rows)| read(log, &thinned(&rows, DRAWN)));
        Case { readings: readings.unwrap_or_else(|| self.readings.clone()), ..self.clone() }
    }

    /// The dead-reckoned way at fractions of the run's time, in `steps` steps.
    pub fn reckoned(&self, steps: usize) -> Vec<Pose2> {
        let Some(log) = self.run.encoders.as_ref().filter(|_| self.replayed) else { return Vec::new() };
        let mut reckoning = DeadReckoning::new(self.counted);
        let poses = (0..log.len()).map(|row| {
            let [left, right] = log.sides(row, &self.counted);
            reckoning.update(left, right)
        });
        let path = Trace { time: log.time.clone(), poses: poses.collect() };
        let (began, lasts) = (log.time[0], self.duration());
        (0..=steps).map(|k| path.at(began + lasts * k as f64 / steps as f64)).collect()
    }

    /// How much of the dead-reckoned way was behind the robot at each reading; none of a run without a log, which is read at its end.
    fn places(&self) -> Vec<f64> {
        const STEPS: usize = 400;
        let path = self.reckoned(STEPS);
        let Some(log) = self.run.encoders.as_ref().filter(|_| !path.is_empty()) else { return Vec::new() };
        let mut behind = vec![0.0];
        for pair in path.windows(2) {
            let step = pair[0].distance(pair[1]) + ARM * (pair[1].heading - pair[0].heading).abs();
            behind.push(behind[behind.len() - 1] + step);
        }
        let whole = behind[STEPS].max(f64::MIN_POSITIVE);
        let place = |stamp: f64| {
            let step = ((stamp - log.time[0]) / self.duration() * STEPS as f64).clamp(0.0, STEPS as f64);
            behind[step.round() as usize] / whole
        };
        self.readings.iter().map(|reading| reading.stamp.map_or(1.0, place)).collect()
    }

    /// How far the robot may be at `time` \[s\], between two rows of its log, from where a smooth curve has it: position \[m\] and
    /// heading \[rad\]. A wheel that speeds up by `a` is `a t²/8` off the middle of a chord of `t`, as the rows about it show; what it
    /// does beyond that none of them shows, and may be as much.
    pub fn between_rows(&self, time: f64) -> [f64; 2] {
        let Some(log) = self.run.encoders.as_ref().filter(|_| self.replayed) else { return [0.0; 2] };
        let after = log.time.partition_point(|&row| row <= time);
        if after == 0 || after == log.len() {
            return [0.0; 2];
        }
        let lasts = log.time[after] - log.time[after - 1];
        // Mean speeds of the way and of the turn between two rows that are about as far apart, beyond either end those of the last.
        let speeds = |from: usize, to: usize| {
            let took = log.time[to] - log.time[from];
            let [from, to] = [from, to].map(|row| log.sides(row, &self.counted));
            let left = self.counted.left_wheel_radius * (to[0] - from[0]);
            let right = self.counted.right_wheel_radius * (to[1] - from[1]);
            [0.5 * (left + right) / took, (right - left) / self.counted.track_width / took]
        };
        let earlier = log.time[..after].partition_point(|&row| row <= log.time[after - 1] - lasts).saturating_sub(1);
        let later =
            (after + log.time[after..].partition_point(|&row| row < log.time[after] + lasts)).min(log.len() - 1);
        let before = if log.time[earlier] < log.time[after - 1] { [earlier, after - 1] } else { [after - 1, after] };
        let beyond = if log.time[later] > log.time[after] { [after, later] } else { [after - 1, after] };
        let [before, beyond] = [before, beyond].map(|[from, to]| speeds(from, to));
        let part = (time - log.time[after - 1]) / lasts;
        // The middles of the rows' neighbours are 2 t apart.
        [0, 1].map(|c| 4.0 * part * (1.0 - part) * lasts / 16.0 * (beyond[c] - before[c]).abs())
    }

    /// Whether the counts of another run differ by more than dead reckoning can make good: centimetres.
    pub fn differs(&self, other: &Case) -> bool {
        const STEPS: usize = 100;
        self.reckoned(STEPS)
            .iter()
            .zip(other.reckoned(STEPS))
            .any(|(a, b)| a.distance(b) > 0.02 || (a.heading - b.heading).abs() > 0.02)
    }

    /// Time of the encoder log from its first to its last row \[s\]; 0 without a log.
    pub fn duration(&self) -> f64 {
        self.run.encoders.as_ref().map_or(0.0, |log| log.time[log.len() - 1] - log.time[0])
    }
}

/// The campaigns with poses on the way, which have clocks.
pub(super) fn with_clocks(cases: &[Case]) -> Vec<usize> {
    let mut campaigns: Vec<usize> = cases.iter().filter(|case| case.is_timed()).map(|case| case.campaign).collect();
    campaigns.dedup();
    campaigns
}

/// Groups runs that repeat one another, and names the conditions. `apart` keeps runs with different start times apart.
pub(super) fn clusters(cases: &[Case], apart: bool) -> (Vec<Cluster>, Vec<Condition>) {
    const STEPS: usize = 40;
    let mut clusters: Vec<(Cluster, Vec<Pose2>, Vec<f64>)> = Vec::new();
    let mut conditions: Vec<Condition> = Vec::new();
    for (index, case) in cases.iter().enumerate() {
        let condition = Condition::of(&case.run);
        let condition = conditions.iter().position(|known| *known == condition).unwrap_or_else(|| {
            conditions.push(condition);
            conditions.len() - 1
        });
        let reckoned = case.reckoned(STEPS);
        let places = case.places();
        let alike = |(cluster, way, read_at): &(Cluster, Vec<Pose2>, Vec<f64>)| {
            let reference = &cases[cluster.reference];
            let length: f64 = way.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
            let turned: f64 = way.windows(2).map(|pair| (pair[1].heading - pair[0].heading).abs()).sum();
            // A short run that speeds up repeats none that goes on as it did, however near both stay.
            let (way_off, turned_off) = (0.02 * length + 0.005, (0.015 * turned + 0.01).min(0.1));
            cluster.campaign == case.campaign
                && cluster.condition == condition
                && reference.replayed == case.replayed
                && reference.readings.len() == case.readings.len()
                && reference.frame_stamp.is_some() == case.frame_stamp.is_some()
                && reference
                    .readings
                    .iter()
                    .zip(&case.readings)
                    .all(|(a, b)| a.heading.is_some() == b.heading.is_some())
                && read_at.iter().zip(&places).all(|(a, b)| (a - b).abs() < PLACE)
                && near(reference.run.start.unwrap_or_default(), case.run.start.unwrap_or_default())
                && (!apart || reference.hours == case.hours)
                && (reference.duration() - case.duration()).abs() <= 0.02 * reference.duration()
                && way
                    .iter()
                    .zip(&reckoned)
                    .all(|(a, b)| a.distance(*b) < way_off && (a.heading - b.heading).abs() < turned_off)
        };
        match clusters.iter_mut().find(|entry| alike(entry)) {
            Some((cluster, ..)) => cluster.runs.push(index),
            None => {
                let campaign = case.campaign;
                clusters.push((Cluster { reference: index, runs: vec![index], condition, campaign }, reckoned, places));
            }
        }
    }
    (clusters.into_iter().map(|(cluster, ..)| cluster).collect(), conditions)
}

/// Whether two starts are the same mark, to what a survey can tell and a floor can matter.
fn near(a: Pose2, b: Pose2) -> bool {
    a.distance(b) < 0.05 && (a.heading - b.heading).abs() < 0.05
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_give_way_to_the_nearest_that_are_free() {
        let moved = |mut rows: Vec<usize>, others: &[usize]| {
            move_to_nearest(&mut rows, others);
            rows
        };
        let moving = [0, 1, 2, 8, 9, 10, 11, 12];
        assert_eq!(moved(vec![1, 9, 12], &moving), [1, 9, 12]);
        assert_eq!(moved(vec![1, 4, 6, 12], &moving), [1, 2, 8, 12]);
        // Where several would take the same, the later ones go on, and leave enough for those after.
        assert_eq!(moved(vec![3, 4, 5, 6, 7], &moving), [2, 8, 9, 10, 11]);
        assert_eq!(moved(vec![9, 10, 11, 12], &[0, 1, 9, 12]), [0, 1, 9, 12]);
        assert_eq!(thinned(&moving, 3), [1, 9, 12]);
    }
}
