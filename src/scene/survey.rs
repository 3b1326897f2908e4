//! How poses are measured, and what differs from run to run.

/// Noise of one surveyed pose, 1 σ; the start of a run is a reading like its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Survey {
    /// Of each coordinate \[m\].
    pub position_std: f64,
    /// \[rad\]
    pub heading_std: f64,
}

impl Survey {
    /// Readings without noise.
    pub const PERFECT: Survey = Survey { position_std: 0.0, heading_std: 0.0 };
}

impl Default for Survey {
    /// A tape measure and a straight edge: 2 mm, 3 mrad.
    fn default() -> Self {
        Survey { position_std: 2e-3, heading_std: 3e-3 }
    }
}

/// What an uneven floor does to real runs that encoders cannot see, 1 σ, drawn run by run.
///
/// A bump under one wheel lengthens its way; the body ends up turned or short against what the wheels rolled. The
/// simulation imposes that twist as a motion of the floor under the tyres, in proportion to the body's own motion, so
/// that the tyres work as they do and only the outcome scatters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// Heading a quarter turn on the spot \[rad\].
    pub heading_per_corner: f64,
    /// Heading over the square root of distance \[rad/√m\].
    pub heading_per_sqrt_metre: f64,
    /// Distance, relative \[–\].
    pub distance: f64,
}

impl Scatter {
    /// An even floor.
    pub const NONE: Scatter = Scatter { heading_per_corner: 0.0, heading_per_sqrt_metre: 0.0, distance: 0.0 };
}

impl Default for Scatter {
    fn default() -> Self {
        Scatter { heading_per_corner: 2.5e-3, heading_per_sqrt_metre: 1e-3, distance: 1e-3 }
    }
}
