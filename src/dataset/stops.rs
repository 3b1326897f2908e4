//! Stops: where an encoder log says that the robot stood.

use super::EncoderLog;
use crate::odometry::OdometryParameters;

/// How far a wheel turns at most in what may be a standstill \[rad\].
const STILL: f64 = 3e-3;
/// How long a standstill is at least \[s\], and at the end of a log, which may have been cut off.
const STOP: f64 = 0.08;
const LAST_STOP: f64 = 0.03;

/// A stop in a log: its first and last row without a count on either side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stop {
    /// First row.
    pub from: usize,
    /// Last row.
    pub until: usize,
}

impl EncoderLog {
    /// The stops of the robot: after each way that ends in a standstill of both sides. `odometry` turns ticks into radians.
    pub fn stops(&self, odometry: &OdometryParameters) -> Vec<Stop> {
        let sides: Vec<[f64; 2]> = (0..self.len()).map(|row| self.sides(row, odometry)).collect();
        Stop::all(&self.time, &sides)
    }
}

impl Stop {
    /// After each way that ends in a standstill of both sides; `sides` are their angles by row \[rad\].
    fn all(time: &[f64], sides: &[[f64; 2]]) -> Vec<Stop> {
        let apart = |a: usize, b: usize| (0..2).map(|i| (sides[a][i] - sides[b][i]).abs()).fold(0.0, f64::max);
        let mut found: Vec<Stop> = Vec::new();
        let rows = time.len();
        let (mut from, mut way_began) = (0, 0);
        while from < rows {
            let last = (from..rows).take_while(|&row| apart(row, from) < STILL).last().unwrap_or(from);
            let next = last + 1;
            let long = time[last] - time[from] >= if next == rows { LAST_STOP } else { STOP };
            // The last rows of the way, and the first of the next one, are within STILL too. A log whose counts never rest has
            // nothing to tell them by.
            let rest = |row: &usize| apart(*row, row - 1) == 0.0;
            let rests = (from + 1..next).rev().find(rest);
            let until = rests.unwrap_or(last);
            // A controller that creeps up on its goal makes one stop look like two.
            let still_there = apart(from, way_began) <= 3.0 * STILL;
            if long && !(still_there && found.is_empty()) {
                if still_there {
                    found.pop();
                }
                let stands = |row: &usize| rests.is_none() || apart(*row, until) == 0.0;
                found.push(Stop { from: (from..until).rev().take_while(stands).last().unwrap_or(until), until });
                way_began = until;
            }
            from = next;
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Angle of a wheel at `time`, which follows a straight of `way` \[rad\], pauses, and turns on the spot: the left one backwards.
    fn wheel(time: f64, way: f64, pause: f64, sign: f64) -> f64 {
        let (rate, acceleration) = (2.4, 4.8);
        let ramp = rate / acceleration;
        let on = |time: f64| {
            let (total, time) = (way / rate + ramp, time.max(0.0));
            let rest = (total - time).max(0.0);
            let (up, down) = (0.5 * acceleration * time * time, way - 0.5 * acceleration * rest * rest);
            if time < ramp {
                up
            } else if rest < ramp {
                down
            } else {
                rate * (time - 0.5 * ramp)
            }
        };
        on(time) + sign * on(time - way / rate - ramp - pause)
    }

    #[test]
    fn stops_are_found_where_counts_end_however_short_they_are() {
        let (way, tick) = (12.0, TAU / 2796.8);
        let arrives = way / 2.4 + 0.5;
        for pause in [0.08, 0.4, 2.0] {
            for rate in [20.0, 50.0] {
                let end = 2.0 * arrives + pause + 0.5;
                let time: Vec<f64> = (0..(end * rate) as usize).map(|row| row as f64 / rate).collect();
                let counted = |angle: f64| (angle / tick).floor() * tick;
                let sides = |&time: &f64| [-1.0, 1.0].map(|sign| counted(wheel(time, way, pause, sign)));
                let sides: Vec<[f64; 2]> = time.iter().map(sides).collect();
                let stops = Stop::all(&time, &sides);
                let began: Vec<f64> = stops.iter().map(|stop| time[stop.from]).collect();
                assert_eq!(stops.len(), 2, "{pause} s at {rate} Hz: {began:?}");
                // To a row, and to the time that the last tick takes.
                let known_to = 1.0 / rate + (2.0 * tick / 4.8).sqrt() + 1e-9;
                for (began, expected) in began.iter().zip([arrives, 2.0 * arrives + pause]) {
                    assert!((began - expected).abs() < known_to, "{pause} s at {rate} Hz: {began} for {expected}");
                }
                // A log that ends on the way ends in no stop.
                let cut = time.partition_point(|&time| time < arrives + pause + 0.6 * arrives);
                assert_eq!(Stop::all(&time[..cut], &sides[..cut]), stops[..1], "{pause} s at {rate} Hz");
                // Where counts never rest, a stop is as long as they hardly move.
                let restless = |(row, sides): (usize, &[f64; 2])| sides.map(|side| side + 1e-5 * (row % 7) as f64);
                let restless: Vec<[f64; 2]> = sides.iter().enumerate().map(restless).collect();
                let restless = Stop::all(&time, &restless);
                assert_eq!(restless.len(), 2, "{pause} s at {rate} Hz");
                for (stop, known) in restless.iter().zip(&stops) {
                    let [longer, long] = [stop, known].map(|stop| time[stop.until] - time[stop.from]);
                    assert!(longer >= long, "{pause} s at {rate} Hz: {longer} s for {long} s");
                }
            }
        }
    }
}
