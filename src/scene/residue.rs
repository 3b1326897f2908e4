//! What a campaign left of the model that was fitted to it.

use super::Scatter;
use serde::{Deserialize, Serialize};

/// What a campaign left in one condition: readings less the fitted model's, mean over its runs. A diagnosis of a later
/// campaign starts from there. Nothing is simulated by it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Residue {
    /// What was driven, in words: `square 2 m ccw, 0.4 m/s`.
    pub condition: String,
    /// Where the runs started in the room: x, y \[m\], heading \[rad\].
    pub start: [f64; 3],
    /// How many runs it is the mean of.
    pub runs: f64,
    /// Share of the way after which the pose was read whose frame the readings are stated in; absent: the start of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame_at: Option<f64>,
    /// Shares of the way after which readings were taken; empty: one, at the end of the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub at: Vec<f64>,
    /// x of the readings less the model's \[m\].
    pub x: Vec<f64>,
    /// y of the readings less the model's \[m\].
    pub y: Vec<f64>,
    /// Headings less the model's \[rad\]; empty: not read.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub heading: Vec<f64>,
    /// What single runs differed by.
    pub noise: NoiseModel,
}

impl Residue {
    /// Whether its numbers fit together.
    pub fn is_sound(&self) -> bool {
        let readings = self.x.len();
        let noise = &self.noise;
        let sizes = [noise.position_std, noise.heading_std, noise.correlation_time, noise.clock_std];
        let scatter = [noise.scatter.heading_per_corner, noise.scatter.heading_per_sqrt_metre, noise.scatter.distance];
        let numbers = self.x.iter().chain(&self.y).chain(&self.heading).chain(&self.at).chain(&self.start);
        self.y.len() == readings
            && (self.heading.is_empty() || self.heading.len() == readings)
            && readings == self.at.len().max(1)
            && self.runs > 0.0
            && numbers.chain(&sizes).chain(&scatter).chain(&[self.runs]).all(|number| number.is_finite())
    }
}

/// Sizes of the noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseModel {
    /// 1 σ of a surveyed coordinate \[m\].
    pub position_std: f64,
    /// 1 σ of a surveyed heading \[rad\].
    pub heading_std: f64,
    /// Time over which readings on the way remember their noise \[s\].
    pub correlation_time: f64,
    /// σ of the clock offset from run to run \[s\].
    pub clock_std: f64,
    /// What floors do to runs.
    pub scatter: Scatter,
}
