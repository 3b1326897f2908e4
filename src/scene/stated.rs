//! Whether a model is one of the robot that a dataset is of, by what both state of it.

use super::error::SceneError;
use super::robot::{Robot, Side};
use crate::dataset::Dataset;
use std::f64::consts::SQRT_2;

/// Right or wrong by the smallest gross factor, 2: the middle in proportion. No two makers measure one wheel so differently.
const FACTOR: f64 = SQRT_2;

impl Robot {
    /// Refuses a dataset of another robot: its wheels or its track are of another size by far, or its encoders count more wheels on
    /// a side.
    ///
    /// # Errors
    /// What the two state, and how they differ.
    pub fn expect_stated(&self, dataset: &Dataset) -> Result<(), SceneError> {
        let facts = &dataset.campaign.robot;
        let other = |what, model: f64, stated: f64| {
            let (file, dataset) = (self.file.clone(), dataset.campaign.name.clone());
            Err(SceneError::OtherRobot { model: file, dataset, what, has: model, stated })
        };
        let apart = |model: f64, stated: &f64| !(1.0 / FACTOR..FACTOR).contains(&(model / stated));
        let radii: f64 = self.wheels.iter().map(|wheel| wheel.tyre.free_radius).sum();
        let diameter = 2.0 * radii / self.wheels.len() as f64;
        if let Some(stated) = facts.nominal_wheel_diameter.filter(|stated| apart(diameter, stated)) {
            return other("robot.nominal_wheel_diameter_m", diameter, stated);
        }
        if let Some(stated) = facts.nominal_track_width.filter(|stated| apart(self.track_width(), stated)) {
            return other("robot.nominal_track_width_m", self.track_width(), stated);
        }
        let channels = dataset.runs.iter().find_map(|run| Some(&run.encoders.as_ref()?.channels));
        for (side, ending, what) in [
            (Side::Left, "left", "left wheels in encoders.csv"),
            (Side::Right, "right", "right wheels in encoders.csv"),
        ] {
            let counted = channels.map_or(0, |channels| channels.iter().filter(|name| name.ends_with(ending)).count());
            let wheels = self.wheels.iter().filter(|wheel| wheel.side == side).count();
            if counted > wheels {
                return other(what, wheels as f64, counted as f64);
            }
        }
        Ok(())
    }
}
