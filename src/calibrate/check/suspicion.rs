//! What can look wrong with a campaign, in plain words.

use crate::dataset::runs_in_words;
use std::fmt;

/// One thing about a campaign that is hardly what was meant.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspicion {
    /// What it looks like.
    pub kind: SuspicionKind,
    /// The runs that show it, in file order; empty where it is about `dataset.toml` alone.
    pub runs: Vec<String>,
    /// The number that gave it away; each kind says which.
    pub seen: f64,
    /// What that number should be, or the bound that it should keep.
    pub expected: f64,
}

/// What a campaign can look like. `seen` and `expected` are the evidence beside it in a [`Suspicion`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum SuspicionKind {
    /// `cw` and `ccw` (or `forward` and `reverse`) of a run the wrong way round: turn or way seen, and by the label.
    DirectionLabel,
    /// The left and right encoder columns are swapped: turn by the logs and by label and survey \[rad\].
    EncoderSidesSwapped,
    /// Logs turn one way, and label or survey the other, and nothing says which is right \[rad\].
    TurnDisagrees,
    /// One encoder counts down where its wheel goes forward: its way and the expected way \[m\].
    CountSignLeft,
    /// As [`SuspicionKind::CountSignLeft`], on the right.
    CountSignRight,
    /// Both encoders count down where the robot goes forward \[m\].
    CountSignBoth,
    /// y and heading are positive to the right: end heading seen and expected \[rad\]; or y alone is: share of the
    /// pattern explained as noted and with the axis turned round.
    YAxisFlipped,
    /// x is positive backwards: way along x seen and expected \[m\], or shares of the pattern as for y.
    XAxisFlipped,
    /// One of the axes is flipped, and without headings nothing says which: shares of the pattern.
    OneAxisFlipped,
    /// Headings alone are positive to the right \[rad\].
    HeadingSign,
    /// Headings in degrees: the number noted and the turn in radians.
    HeadingDegrees,
    /// Headings wrapped to one turn \[rad\].
    HeadingWrapped,
    /// Positions in millimetres or centimetres: distance noted and the largest that is possible \[m\].
    PositionUnit,
    /// A wheel radius against the nominal diameter, or against distances \[m\].
    WheelRadius,
    /// The track width against its nominal value, or against turns \[m\].
    TrackWidth,
    /// Ticks a revolution against distances: those stated, and those that would fit.
    TicksPerRevolution,
    /// The side of a run against what its logs or survey say \[m\]: stated, and what would fit.
    SideLength,
    /// A run far from its own kind: its distance from their median in standard deviations, and the bound.
    Outlier,
    /// End poses in the frame of the room: mean misfit as noted and taken from the start pose \[m\].
    RoomFrame,
    /// Start and end are swapped: end heading seen and expected \[rad\].
    StartEndSwapped,
    /// The `x_m` and `y_m` columns are swapped: shares of the pattern, or the way along x of a straight.
    ColumnsSwapped,
    /// Runs with the same end to the last digit: how many, and how many such pairs chance makes.
    CopiedRun,
    /// Squares driven one way round only: runs in the direction driven (+ counter-clockwise, − clockwise), 0.
    OneDirection,
    /// Counts of each row alone: way by their difference from first to last, and by their sum \[m\].
    CountSteps,
    /// Counters that begin anew: the jump, and their range, in the log's unit.
    CountsWrapped,
    /// Encoder stamps in another unit: mean speed of the wheels \[m/s\] and duration as stamped \[s\].
    LogTime,
    /// Encoder rows missing while wheels turned: the longest interval and the usual one \[s\].
    LogGap,
    /// Poses at other times than counts: last stamp of each \[s\].
    ClocksApart,
    /// Poses that set off at another time than the wheels: by how much later, and what clocks may disagree by \[s\].
    ClockOffset,
    /// Headings on the way in degrees: the last one noted, and the turn in radians.
    WayDegrees,
    /// Headings on the way wrapped to one turn: the last one, and as it would count on \[rad\].
    WayWrapped,
    /// Positions on the way in millimetres or centimetres: farthest from the first, and as the protocol has it \[m\].
    WayUnit,
    /// Poses on the way in the frame of the room: how far the last is from the end, as noted and seen from the first \[m\].
    WayRoomFrame,
    /// Poses on the way that begin elsewhere than the run: distance of the first from the start, and 0, or how far from the
    /// start the robot was by its wheels, where a log begins later than the run \[m\].
    WayStart,
    /// Poses on the way that leap from row to row: the largest step, and one that hardly any exceeds \[m\].
    WayJump,
    /// Poses on the way that stay the same while wheels turn: for how long \[s\], and how far the wheels go at least \[m\].
    WayFrozen,
    /// The robot goes across its headings on the way: mean cosine between the two, and 1.
    WayAcross,
}

impl SuspicionKind {
    /// A name for programs: `direction_label`, `position_unit`, …
    pub fn as_str(self) -> &'static str {
        use SuspicionKind::*;
        match self {
            DirectionLabel => "direction_label",
            EncoderSidesSwapped => "encoder_sides_swapped",
            TurnDisagrees => "turn_disagrees",
            CountSignLeft => "count_sign_left",
            CountSignRight => "count_sign_right",
            CountSignBoth => "count_sign_both",
            YAxisFlipped => "y_axis_flipped",
            XAxisFlipped => "x_axis_flipped",
            OneAxisFlipped => "one_axis_flipped",
            HeadingSign => "heading_sign",
            HeadingDegrees => "heading_degrees",
            HeadingWrapped => "heading_wrapped",
            PositionUnit => "position_unit",
            WheelRadius => "wheel_radius",
            TrackWidth => "track_width",
            TicksPerRevolution => "ticks_per_revolution",
            SideLength => "side_length",
            Outlier => "outlier",
            RoomFrame => "room_frame",
            StartEndSwapped => "start_end_swapped",
            ColumnsSwapped => "columns_swapped",
            CopiedRun => "copied_run",
            OneDirection => "one_direction",
            CountSteps => "count_steps",
            CountsWrapped => "counts_wrapped",
            LogTime => "log_time",
            LogGap => "log_gap",
            ClocksApart => "clocks_apart",
            ClockOffset => "clock_offset",
            WayDegrees => "way_degrees",
            WayWrapped => "way_wrapped",
            WayUnit => "way_unit",
            WayRoomFrame => "way_room_frame",
            WayStart => "way_start",
            WayJump => "way_jump",
            WayFrozen => "way_frozen",
            WayAcross => "way_across",
        }
    }
}

impl fmt::Display for Suspicion {
    /// What was seen, why it is suspicious, what to do.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use SuspicionKind::*;
        let Suspicion { kind, runs, seen, expected } = self;
        let (who, one) = (runs_in_words(runs), runs.len() == 1);
        let s = if one { "s" } else { "" };
        match kind {
            DirectionLabel => write!(
                f,
                "{who}: the column `direction` says one way and the measurement the other ({seen:.3} where the label \
                 calls for {expected:.3}). The labels look swapped. Correct `direction`; where there are no logs, headings \
                 and y noted positive to the right would look the same, so look at the notes first."
            ),
            EncoderSidesSwapped => write!(
                f,
                "{who}: the encoders say that the robot turned {seen:+.2} rad, its label and its survey {expected:+.2} rad. \
                 The left and right encoder columns look swapped. Swap their names in the header of encoders.csv."
            ),
            TurnDisagrees => write!(
                f,
                "{who}: the encoders say that the robot turned {seen:+.2} rad, and the rest of the data {expected:+.2} rad. \
                 Either the left and right encoder columns are swapped, or the direction is, or headings and y are \
                 positive to the right; the data do not tell which. Turn the robot to the left by hand and look which \
                 encoder counts up and what you write down."
            ),
            CountSignLeft | CountSignRight => write!(
                f,
                "{who}: the {} wheel goes {seen:+.2} m by its encoder where the drive calls for about {expected:+.2} m. \
                 It looks as if that encoder counts down when the wheel rolls forward. Change the sign of its column in \
                 encoders.csv.",
                if *kind == CountSignLeft { "left" } else { "right" }
            ),
            CountSignBoth => write!(
                f,
                "{who}: by the encoders the robot went {seen:+.2} m where the drive calls for about {expected:+.2} m. \
                 Both encoders seem to count down when the robot goes forward. Change the sign of both in encoders.csv."
            ),
            YAxisFlipped if expected.abs() <= 1.0 => write!(
                f,
                "{who}: the end points form a pattern that driving cannot make ({:.0} % of it explained), and turned \
                 into one that it does make ({:.0} %) by changing the sign of y. y looks positive to the right. It is \
                 positive to the left of the start heading: change the sign of `y_m`.",
                100.0 * seen,
                100.0 * expected
            ),
            YAxisFlipped => write!(
                f,
                "{who}: end{s} at heading {seen:+.3} rad where {expected:+.3} rad was driven. y and headings look \
                 positive to the right. Both are positive to the left (counter-clockwise): change the signs of `y_m` \
                 and `heading_rad`; if start and end were swapped in the notes instead, swap them back, and if directions were \
                 told from the encoders, as `import` does, look whether their columns are."
            ),
            XAxisFlipped if runs.is_empty() || (0.0..=1.0).contains(expected) && (0.0..=1.0).contains(seen) => write!(
                f,
                "{who}: the end points form a pattern that driving cannot make ({:.0} % of it explained), and turned \
                 into one that it does make ({:.0} %) by changing the sign of x. x looks positive backwards. It is \
                 positive along the start heading: change the sign of `x_m`.",
                100.0 * seen,
                100.0 * expected
            ),
            XAxisFlipped => write!(
                f,
                "{who}: x ends at {seen:+.3} m where about {expected:+.3} m was driven. x looks positive backwards, or \
                 start and end are swapped. x is positive along the start heading: change the sign of `x_m`, or correct \
                 `direction` if the run was driven the other way."
            ),
            OneAxisFlipped => write!(
                f,
                "{who}: the end points form a pattern that driving cannot make ({:.0} % of it explained), and would \
                 make one that it can ({:.0} %) with the sign of x or of y changed. x is positive along the start \
                 heading and y to its left: look which of them was noted the other way.",
                100.0 * seen,
                100.0 * expected
            ),
            HeadingSign => write!(
                f,
                "{who}: end{s} at heading {seen:+.3} rad where {expected:+.3} rad was driven, while x and y look right. \
                 Headings look positive clockwise. They are positive counter-clockwise: change the sign of `heading_rad`."
            ),
            HeadingDegrees if runs.is_empty() => write!(
                f,
                "{who}: survey.heading_std_rad is {seen}, more than {expected} rad; nothing that is worth noting is measured \
                 that badly. It looks like degrees: multiply by 0.0174533."
            ),
            HeadingDegrees => write!(
                f,
                "{who}: end{s} at a heading of {seen:.1} where the run turns by {expected:.3} rad. That looks like degrees. \
                 Multiply `heading_rad` by 0.0174533."
            ),
            HeadingWrapped => write!(
                f,
                "{who}: end{s} at heading {seen:+.3} rad where the robot turned by about {expected:+.3} rad. The heading \
                 looks wrapped to a single turn. Headings count on: add or take off whole turns of 6.283185 rad, so that a \
                 clockwise square ends near -6.283."
            ),
            PositionUnit if runs.is_empty() => write!(
                f,
                "{who}: survey.position_std_m is {seen}, more than the {expected} m of half a side; nothing could be told \
                 from such a survey. It looks like millimetres or centimetres: write metres."
            ),
            PositionUnit => write!(
                f,
                "{who}: end{s} {seen:.2} m away where no more than {expected:.3} m is possible. The positions look like \
                 millimetres or centimetres. Write metres in `x_m` and `y_m`."
            ),
            WheelRadius => write!(
                f,
                "{who}: the wheel radius in [odometry] is {seen} m, and about {expected:.4} m would fit the rest. \
                 Look whether a diameter was entered as a radius, or a decimal point slipped, there or in \
                 robot.nominal_wheel_diameter_m."
            ),
            TrackWidth => write!(
                f,
                "{who}: odometry.track_width_m is {seen} m, and about {expected:.4} m would fit the rest; even a \
                 skid-steer robot believes in no more than about two and a half times its own width. Look for a slipped \
                 decimal point or half a track, there or in robot.nominal_track_width_m."
            ),
            TicksPerRevolution => write!(
                f,
                "{who}: with {seen} ticks a revolution the logs do not go the way that the robot went; about {expected:.1} \
                 would fit. Look for quadrature (times 4 or 2) and for the gear ratio; if the ticks are right, \
                 the wheel radius is wrong."
            ),
            SideLength => write!(
                f,
                "{who}: `side_m` (or `radius_m`) says {seen} m, and the run itself looks like {expected:.3} m. The length \
                 looks mistyped. Correct it."
            ),
            Outlier => write!(
                f,
                "{who}: end{s} {seen:.1} standard deviations away from the other runs of the same kind, and scatter stays \
                 within {expected:.1}. A wheel may have slipped, the robot may have been nudged, a digit may be wrong. \
                 Look at the notes, and repeat the run or leave it out."
            ),
            RoomFrame => write!(
                f,
                "{who}: as noted the ends are {seen:.3} m from where they should be, and {expected:.3} m if they are seen \
                 from the start poses. They look like poses in the room. `x_m`, `y_m` and `heading_rad` are in the frame \
                 of the run's start: x along the start heading, y to its left."
            ),
            StartEndSwapped => write!(
                f,
                "{who}: end{s} at heading {seen:+.3} rad where {expected:+.3} rad was driven, and the position fits a start \
                 as seen from the end. Start and end look swapped. Write down the end as seen from the start."
            ),
            ColumnsSwapped => write!(
                f,
                "{who}: the end points make sense with `x_m` and `y_m` swapped and not as they are ({seen:.2} where \
                 {expected:.2} is expected). x is along the start heading, y to its left: swap the two columns."
            ),
            CopiedRun => write!(
                f,
                "{who}: the end is the same to the last digit in {seen:.0} runs; by chance {expected:.1e} such pairs are \
                 expected. A row looks copied. Look at the notes, and measure again if need be."
            ),
            OneDirection => write!(
                f,
                "{who}: {:.0} square{} {} and none the other way round. What turns the robot too little and what bends its \
                 straights look the same from one direction. Drive as many squares the other way.",
                seen.abs(),
                if seen.abs() > 1.5 { "s" } else { "" },
                if *seen > 0.0 { "counter-clockwise" } else { "clockwise" }
            ),
            CountSteps => write!(
                f,
                "{who}: from the first row of encoders.csv to the last the robot went {seen:.3} m, and {expected:.2} m if all \
                 rows are added up. They look like counts since the row before. Counts go on: add them up."
            ),
            CountsWrapped => write!(
                f,
                "{who}: in encoders.csv a count jumps by {seen:.1} from one row to the next. It looks like a counter of a range \
                 of {expected:.4} that begins anew. Counts go on: add the range, or take it off, from there on."
            ),
            LogTime => write!(
                f,
                "{who}: by the stamps of encoders.csv the wheels go {seen:.2e} m/s on average, for {expected:.0} s. `t_s` looks \
                 like milliseconds, or like another unit than seconds."
            ),
            LogGap => write!(
                f,
                "{who}: in encoders.csv {seen:.2} s are between two rows, and {expected:.3} s otherwise, while wheels turned. \
                 Rows look lost, and how the robot went meanwhile cannot be known: leave the run out, or log it again."
            ),
            ClocksApart => write!(
                f,
                "{who}: poses.csv ends at {seen:.1} s and encoders.csv at {expected:.1} s, and they hardly overlap. Both count \
                 seconds of the same run, from clocks that agree to half a second: look at the units of `t_s`, and where each \
                 clock begins."
            ),
            ClockOffset => write!(
                f,
                "{who}: in poses.csv the robot sets off {:.1} s {} its wheels do in encoders.csv, where {expected:.1} s is much \
                 for two clocks. {} each `t_s` of poses.csv, or import both anew with one clock.",
                seen.abs(),
                if *seen > 0.0 { "after" } else { "before" },
                if *seen > 0.0 { "Take that off" } else { "Add that to" },
            ),
            WayDegrees => write!(
                f,
                "{who}: in poses.csv the last heading is {seen:.1} where the run turns by {expected:.3} rad. That looks like \
                 degrees. Multiply its `heading_rad` by 0.0174533."
            ),
            WayWrapped => write!(
                f,
                "{who}: in poses.csv the last heading is {seen:+.3} rad where the robot turned by about {expected:+.3} rad. \
                 Headings look wrapped to a single turn. They count on: wherever one jumps by about 6.283185 rad from row to \
                 row, take the jump off all that follow."
            ),
            WayUnit => write!(
                f,
                "{who}: in poses.csv the robot gets {seen:.1} m from its first row where about {expected:.3} m are driven. The \
                 positions look like millimetres or centimetres. Write metres in its `x_m` and `y_m`."
            ),
            WayRoomFrame => write!(
                f,
                "{who}: in poses.csv the last row is {seen:.3} m from where the run ended (headings count by the side's \
                 length), and {expected:.3} m if it is seen from the first row. The poses look as noted in the room, or of a \
                 tracker with another origin. They are in the frame of the run's start: x along the start heading, y to its \
                 left, all 0 as the run begins."
            ),
            WayStart if *expected > 0.0 => write!(
                f,
                "{who}: poses.csv begins when the robot was {expected:.2} m from its start by its wheels already, and its first \
                 row is {seen:.3} m from the start. Poses are of one point in the frame of where that point was as the run \
                 began: a tracker that missed that is no survey of this run, unless encoders.csv begins as late."
            ),
            WayStart => write!(
                f,
                "{who}: in poses.csv the first row is {seen:.3} m from the start. Poses are of one point in the frame of \
                 where that point was as the run began: take the position of the first row off all, or look whether the log \
                 begins with the run."
            ),
            WayJump => write!(
                f,
                "{who}: in poses.csv the point leaps by {seen:.3} m from one row to the next, where hardly a step is longer than \
                 {expected:.4} m. The tracker may have taken something else for the robot: delete such rows."
            ),
            WayFrozen => write!(
                f,
                "{who}: in poses.csv the pose stays the same to the last digit for {seen:.1} s, while the wheels go {expected:.2} m \
                 or more. The tracker seems to have lost the robot and repeated itself: delete such rows."
            ),
            WayAcross => write!(
                f,
                "{who}: in poses.csv the robot does not go where its headings point (mean cosine {seen:.2} where \
                 {expected:.0} is driven). y or the headings look positive to the right, `x_m` and `y_m` swapped, or \
                 headings counted from another axis. x is along the start heading, y to its left, headings \
                 counter-clockwise from x."
            ),
        }
    }
}
