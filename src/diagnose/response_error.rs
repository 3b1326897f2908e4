//! What responses may err by: a tyre is not the model's tyre, and a run is not the run that stands for it.

use super::case::Cluster;
use super::linear::Problem;
use super::low_rank::LowRank;
use super::variant::{Axis, Coordinates, Variant};
use super::way::{Step, Way, bend, compose};
use crate::geometry::Pose2;
use crate::scene::Survey;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Error that responses are allowed as a whole, and in each part of the way, relative.
pub(super) const RESPONSE_ERROR: [f64; 2] = [0.02, 0.03];
/// Error that a response may have from run to run, relative: runs are not the run that stands for them.
const RUN_ERROR: f64 = 0.005;
/// The same of a spot on the floor, in each component of the steps: a run that strays by a centimetre comes upon it
/// otherwise, and what a spot does changes over a decimetre. Of those that lead it is simulated, for where the response is
/// steep it changes by more.
const SPOT_ERROR: f64 = 0.1;
/// Parts of a way whose responses may err independently.
pub(super) const PARTS: usize = 8;

impl Problem<'_> {
    /// Components of the steps that a response errs in together: each for itself where the model was moved far.
    pub(super) fn components(&self) -> &'static [&'static [usize]] {
        if self.variants.iter().any(Variant::is_response_error) { &[&[0], &[1], &[2]] } else { &[&[0, 1, 2]] }
    }

    /// Whitened change of a cluster's readings that the response of `at` makes as a whole and in each part of its way:
    /// columns of the response's own error.
    pub(super) fn response_errors(&self, cluster: usize, at: &Coordinates) -> DMatrix<f64> {
        let response = Changed::by(self, cluster, at);
        let (given, count) = (&response.way.steps, response.steps.len());
        let parts = (0..PARTS).map(|part| part * count / PARTS..(part + 1) * count / PARTS);
        let mut columns = Vec::with_capacity(PARTS + 1);
        for (range, error) in parts.clone().map(|part| (part, 1)).chain([(0..count, 0)]) {
            let less = |components| response.less(given, range.clone(), components) * self.response_error[error];
            columns.extend(self.components().iter().copied().map(less));
        }
        // What a spot does hangs on where exactly it is come upon, run for run and for all of them.
        if let Some(without) = self.without_spots(cluster, at) {
            columns.extend(parts.map(|part| response.less(&without, part, &[0, 1, 2]) * SPOT_ERROR));
            columns.extend(self.come_upon_elsewhere(&response, cluster, at));
        }
        self.whitened(cluster, &columns)
    }

    /// Whitened change of a cluster's readings that each run's response makes on its own: columns of what runs differ by.
    pub(super) fn run_error_columns(&self, cluster: usize, at: &Coordinates) -> DMatrix<f64> {
        self.whitened(cluster, &self.of_runs(cluster, at))
    }

    /// Covariance of what a cluster's runs differ by on their account, where they come upon spots elsewhere than the run that
    /// stands for them and what that does is known.
    pub(super) fn runs_apart(&self, cluster: usize, at: &Coordinates) -> Option<DMatrix<f64>> {
        at.iter().any(|&(axis, value)| self.surrogate.elsewhere(cluster, axis, value).is_some()).then(|| {
            let columns = DMatrix::from_columns(&self.of_runs(cluster, at));
            &columns * columns.transpose()
        })
    }

    /// Change of a cluster's readings that each run's response makes on its own.
    fn of_runs(&self, cluster: usize, at: &Coordinates) -> Vec<DVector<f64>> {
        let response = Changed::by(self, cluster, at);
        let all = 0..response.steps.len();
        let mut columns = vec![response.less(&response.way.steps, all.clone(), &[0, 1, 2]) * RUN_ERROR];
        if let Some(without) = self.without_spots(cluster, at) {
            columns.extend((0..3).map(|c| response.less(&without, all.clone(), &[c]) * SPOT_ERROR));
            columns.extend(self.come_upon_elsewhere(&response, cluster, at));
        }
        columns
    }

    /// Change of a cluster's readings where spots are come upon elsewhere, as far as that is known: farther east, and north.
    fn come_upon_elsewhere(&self, response: &Changed<'_>, cluster: usize, at: &Coordinates) -> [DVector<f64>; 2] {
        [0, 1].map(|part| {
            let known = at.iter().filter_map(|&(axis, value)| self.surrogate.elsewhere(cluster, axis, value));
            let nothing = DVector::zeros(response.readings.len());
            known.fold(nothing, |sum, (share, changes)| sum + response.more(&changes[part]) * share)
        })
    }

    /// What whitens a cluster's whitened readings of what its runs' responses differ by.
    pub(super) fn run_errors(&self, cluster: usize, at: &Coordinates) -> LowRank {
        LowRank::of(&self.run_error_columns(cluster, at))
    }

    /// Steps of a cluster's reference run without what spots on the floor do, where there are any.
    fn without_spots(&self, cluster: usize, at: &Coordinates) -> Option<Vec<Step>> {
        let on_level_floor: Vec<(Axis, f64)> = at.iter().copied().filter(|(axis, _)| !self.is_spot(axis)).collect();
        let reference = self.clusters[cluster].reference;
        (on_level_floor.len() < at.len())
            .then(|| self.surrogate.steps(cluster, reference, &on_level_floor, self.variants))
    }

    pub(super) fn is_spot(&self, axis: &Axis) -> bool {
        self.variants[axis.variant].place().is_some()
    }
}

/// The way of a cluster's reference run as a hypothesis changes it.
struct Changed<'p> {
    problem: &'p Problem<'p>,
    run: usize,
    way: &'p Way,
    survey: Survey,
    steps: Vec<Step>,
    path: Vec<Pose2>,
    /// Sines and cosines of its headings.
    directions: Vec<(f64, f64)>,
    readings: DVector<f64>,
}

/// So much of a further change is looked at and scaled back up: a survey may read a path in a frame that turns with it.
const SHARE: f64 = 0.1;

impl<'p> Changed<'p> {
    fn by(problem: &'p Problem<'p>, cluster: usize, at: &Coordinates) -> Changed<'p> {
        let surrogate = problem.surrogate;
        let &Cluster { reference, campaign, .. } = &problem.clusters[cluster];
        let way = &surrogate.ways[reference];
        let survey = surrogate.survey_in(campaign, problem.scene, at, problem.variants);
        let steps = surrogate.steps(cluster, reference, at, problem.variants);
        let path = compose(way.start, &steps);
        let directions = path.iter().map(|pose| pose.heading.sin_cos()).collect();
        let readings = DVector::zeros(0);
        let mut changed = Changed { problem, run: reference, way, survey, steps, path, directions, readings };
        changed.readings = changed.read(&changed.path);
        changed
    }

    fn read(&self, path: &[Pose2]) -> DVector<f64> {
        self.problem.read(self.run, path, &self.survey)
    }

    /// What a further change of the steps makes of the readings.
    fn more(&self, change: &[Step]) -> DVector<f64> {
        self.change_of_readings(0..change.len(), |k| change[k])
    }

    /// What it changes of the readings beyond `without`, by these components of the steps of a part of the way.
    fn less(&self, without: &[Step], part: Range<usize>, components: &[usize]) -> DVector<f64> {
        self.change_of_readings(part, |k| {
            let mut change = [0.0; 3];
            for &c in components {
                change[c] = self.steps[k][c] - without[k][c];
            }
            change
        })
    }

    /// Change of the readings by small changes of the steps of a part of the way.
    fn change_of_readings(&self, part: Range<usize>, change: impl Fn(usize) -> Step) -> DVector<f64> {
        let mut path = self.path.clone();
        bend(&mut path, &self.directions, part, |k| change(k).map(|change| SHARE * change));
        (self.read(&path) - &self.readings) / SHARE
    }
}
