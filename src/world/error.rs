//! What can go wrong in a running world.

/// A world that cannot be built, or that has left what it can simulate.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum WorldError {
    /// A rate that is no whole number of steps.
    #[error(
        "{what} is {rate} Hz, a period of {period_steps:.4} simulation steps of {time_step} s; it must be a whole number of steps (1 or more)"
    )]
    Rate {
        /// Which rate.
        what: &'static str,
        /// \[Hz\]
        rate: f64,
        /// \[s\]
        time_step: f64,
        /// Its period in steps.
        period_steps: f64,
    },
    /// A wheel that has nothing beneath it at the start.
    #[error(
        "wheel `{wheel}` has no ground beneath it at the start, at x = {x:.3} m, y = {y:.3} m; give the world a [plane] or put an obstacle's top there"
    )]
    NoGround {
        /// The wheel.
        wheel: String,
        /// \[m\]
        x: f64,
        /// \[m\]
        y: f64,
    },
    /// The robot and an obstacle share space at the start.
    #[error(
        "the robot starts inside obstacle {obstacle} of the world (counted from 1): its {part} and the obstacle share space"
    )]
    StartsInside {
        /// Number of the obstacle in the world file, from 1.
        obstacle: usize,
        /// Chassis or wheel.
        part: String,
    },
    /// The chassis leans too far.
    #[error(
        "the robot tipped over {time:.2} s into the run, at x = {x:.2} m, y = {y:.2} m (its chassis leans by more than 60 degrees)"
    )]
    TippedOver {
        /// \[s\]
        time: f64,
        /// \[m\]
        x: f64,
        /// \[m\]
        y: f64,
    },
    /// The robot fell off the ground.
    #[error("the robot fell off the ground {time:.2} s into the run, at x = {x:.2} m, y = {y:.2} m")]
    Fell {
        /// \[s\]
        time: f64,
        /// \[m\]
        x: f64,
        /// \[m\]
        y: f64,
    },
    /// Numbers that are no longer finite.
    #[error(
        "the simulation diverged {time:.3} s into the run: the step of {time_step} s is too long for this robot's stiffest part; a shorter --time-step or softer tyres would do"
    )]
    Diverged {
        /// \[s\]
        time: f64,
        /// \[s\]
        time_step: f64,
    },
}
