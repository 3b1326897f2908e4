//! What was found in a recording that its owner should know, in plain words.

use crate::dataset::runs_in_words;

/// Something that was found on the way; none of it keeps the recording from being imported, and only what says so was
/// mended. Times are seconds since the recording began, by the clock of the readings.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Finding {
    /// What was read of a bag.
    #[error("{log}: {wheels}; {poses}")]
    Took {
        /// The recording.
        log: String,
        /// Where the encoders come from.
        wheels: String,
        /// Where the poses come from.
        poses: String,
    },
    /// Poses that are none.
    #[error("{log}: {count} poses hold no number (NaN: a survey that lost its markers) and are left out")]
    Dropouts {
        /// The recording.
        log: String,
        /// How many.
        count: usize,
    },
    /// Single readings that came late.
    #[error("{log}: {count} readings of the {stream} came one place late by their stamps, and are put in order")]
    Late {
        /// The recording.
        log: String,
        /// `encoders` or `poses`.
        stream: &'static str,
        /// How many.
        count: usize,
    },
    /// A clock that was set.
    #[error(
        "{log}: the clock of the {stream} jumps by {by:+.3} s at {at:.3} s; nothing is mended, the recording is cut there"
    )]
    ClockJump {
        /// The recording.
        log: String,
        /// `encoders` or `poses`.
        stream: &'static str,
        /// \[s\]
        at: f64,
        /// \[s\]
        by: f64,
    },
    /// Two clocks far apart.
    #[error(
        "{log}: by their stamps the poses move {:.1} s {} the wheels do: two clocks; their stamps are moved by that, and a \
         diagnosis finds what is left of it",
        by.abs(), if *by > 0.0 { "after" } else { "before" }
    )]
    ClocksApart {
        /// The recording.
        log: String,
        /// \[s\]
        by: f64,
    },
    /// Wheels that turned while nobody looked.
    #[error(
        "{log}: from {from:.3} to {until:.3} s the wheels turned by {turned:.2} rad {when} the poses of that run; it is cut \
         there, in motion"
    )]
    Unseen {
        /// The recording.
        log: String,
        /// \[s\]
        from: f64,
        /// \[s\]
        until: f64,
        /// The most that any wheel turned \[rad\].
        turned: f64,
        /// `before` or `after`.
        when: &'static str,
    },
    /// Times without readings.
    #[error("{log}: {count} gap(s) in the {stream}, the longest of {longest:.3} s at {at:.3} s, where {usual:.3} s is usual; {}",
        if *stream == "encoders" { "counts go on after it, but the way between is taken as one arc" } else { "nothing is filled in" })]
    Gaps {
        /// The recording.
        log: String,
        /// `encoders` or `poses`.
        stream: &'static str,
        /// How many.
        count: usize,
        /// \[s\]
        longest: f64,
        /// When the longest began \[s\].
        at: f64,
        /// \[s\]
        usual: f64,
    },
    /// A counter that ran over, mended.
    #[error("{log}: counter `{channel}` ran over {count} time(s), first at {at:.3} s: {range}; mended")]
    Wrapped {
        /// The recording.
        log: String,
        /// The encoder's column.
        channel: String,
        /// How often.
        count: usize,
        /// \[s\]
        at: f64,
        /// What it counts in: `a 16-bit counter`, …
        range: &'static str,
    },
    /// A counter that began anew.
    #[error(
        "{log}: counter `{channel}` jumps from {from} to {to} at {at:.3} s, which neither a turning wheel nor a counter that surely ran over once explains (an encoder that was restarted?); nothing is mended, the recording is cut there"
    )]
    Reset {
        /// The recording.
        log: String,
        /// The encoder's column.
        channel: String,
        /// \[s\]
        at: f64,
        /// Before.
        from: f64,
        /// After.
        to: f64,
    },
    /// A stretch that is no run.
    #[error(
        "{log}: at {at:.3} s the wheels turned by no more than {most:.3} rad between two standstills; that is left out"
    )]
    Nudge {
        /// The recording.
        log: String,
        /// \[s\]
        at: f64,
        /// \[rad\]
        most: f64,
    },
    /// Runs that start or end while they roll.
    #[error("{} in motion: a surveyed {end} pose is only as good as the two clocks agree then", of_runs(runs, *when))]
    InMotion {
        /// The runs.
        runs: Vec<String>,
        /// What one does, and what several do.
        when: [&'static str; 2],
        /// `start` or `end`.
        end: &'static str,
    },
    /// Wheels and poses that turn the opposite ways round.
    #[error(
        "in {disagree} of {turned} runs that turn the wheels turn the robot the other way round than the poses: the left and \
         right wheels are mixed up, or they count down as they roll forward, or the survey is mirrored"
    )]
    TurnsDisagree {
        /// Runs in which they do.
        disagree: usize,
        /// Runs that turn.
        turned: usize,
    },
    /// Runs without a survey.
    #[error("{} no poses; note the end pose in runs.csv", of_runs(runs, ["has", "have"]))]
    NotSurveyed {
        /// The runs.
        runs: Vec<String>,
    },
    /// Shapes that cannot be told.
    #[error(
        "what was driven is told from the wheels with --odometry or --robot, or stated with --runs; without, every run is a path"
    )]
    ShapesUntold,
    /// Noise of the survey that nobody stated.
    #[error("{missing} not stated, so it stays blank in dataset.toml; it is 1 σ of one reading")]
    NoNoise {
        /// The options.
        missing: &'static str,
    },
}

/// `run 03 begins`, `runs 01, 02, 03, 04 and 8 more begin`.
fn of_runs(runs: &[String], [one_does, several_do]: [&str; 2]) -> String {
    format!("{} {}", runs_in_words(runs), if runs.len() == 1 { one_does } else { several_do })
}

#[cfg(test)]
mod tests {
    use super::of_runs;

    #[test]
    fn verbs_agree_with_their_runs() {
        let runs: Vec<String> = (1..=12).map(|run| format!("{run:02}")).collect();
        let does = ["begins", "begin"];
        for (count, words) in
            [(1, "run 01 begins"), (3, "runs 01, 02 and 03 begin"), (12, "runs 01, 02, 03, 04 and 8 more begin")]
        {
            assert_eq!(of_runs(&runs[..count], does), words);
        }
    }
}
