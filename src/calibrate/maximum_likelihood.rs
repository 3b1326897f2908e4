//! Ours: maximum likelihood over all runs, iterated to the end, with full covariance.
//!
//! Every run's surveyed end is compared with dead reckoning of its wheels' rotation, exactly, for corrections
//! (E_d, E_b/E_s, E_s) and one turn of the survey's frame against the robot a dataset. The noise of an end has three parts:
//!
//! - the survey's own, at start and end (the start is a reading too: its heading swings the end);
//! - what an uneven floor does on the way: a random walk of heading with distance and with corners and a random scale,
//!   in the proportions of [`PROCESS`], by a factor;
//! - what makes headings disagree with positions beyond that: a heading noise of its own.
//!
//! Factor and heading noise are told by the runs themselves, by restricted maximum likelihood \[Patterson & Thompson,
//! *Biometrika* 58 (1971) 545–554\], so that readings that fit nothing else weigh little.
//!
//! What the runs could not tell even with the robot's own belief as truth has an infinite σ, and is named: squares close
//! whatever the scale. The scale is then a nuisance under a prior of 1 %, so that it does not spoil the rest.

use super::Method;
use super::error::CalibrateError;
use super::estimate::{Estimate, Parameter, SCALE_NOT_FIXED};
use super::training::{Observation, Training};
use crate::geometry::Pose2;
use crate::odometry::OdometryCorrection;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn, Matrix3, Vector3};

pub(super) const METHOD: Method = Method {
    name: "maximum_likelihood",
    source: "ours: all runs, exact dead reckoning, survey frame and floor scatter unknown, full covariance",
    needs: "surveyed runs of any protocol; headings and logs are used where there are any",
    blind_to: "what is no wheel radius, track or survey frame: see `diagnose`",
    estimate,
};

/// Standard deviations of an uneven floor: heading a quarter turn on the spot \[rad\], heading a square-root metre
/// \[rad/√m\], distance \[–\]. Only their proportions matter.
const PROCESS: [f64; 3] = [2.5e-3, 1e-3, 1e-3];

/// Prior σ of the survey frame's turn \[rad\].
const FRAME_STD: f64 = 0.01;

/// σ of a logarithm beyond which the data do not fix it: wheels and tape measures are known better than to 1 %.
const NOT_FIXED: f64 = 0.01;

/// Least noise of an end, where the dataset states none: a tenth of a millimetre and of a milliradian.
const LEAST_STD: f64 = 1e-4;

/// Rounds of fit and noise levels.
const ROUNDS: usize = 3;

/// Unknowns: ln E_d, ln(E_b/E_s), ln E_s, then a frame turn a dataset.
const CORRECTIONS: usize = 3;

/// One run's residual (surveyed − predicted) and its noise, split in survey and process at factor 1.
struct Noise {
    survey: Matrix3<f64>,
    process: Matrix3<f64>,
}

/// Which of the unknowns are fitted.
#[derive(Debug, Clone)]
struct Fitted {
    unknowns: Vec<usize>,
    /// Whether ln E_s is fitted under its prior alone, because the data do not fix it.
    scale_is_nuisance: bool,
}

#[derive(Clone)]
struct Problem<'a> {
    training: &'a Training,
    /// Whitening of each run: inverse of the Cholesky factor of its noise; rows of blank headings are zero.
    whiten: &'a [Matrix3<f64>],
    fitted: &'a Fitted,
    datasets: usize,
    /// All unknowns.
    unknowns: DVector<f64>,
}

impl Problem<'_> {
    fn correction(unknowns: &DVector<f64>) -> OdometryCorrection {
        OdometryCorrection {
            diameter_ratio: unknowns[0].exp(),
            track_ratio: (unknowns[1] + unknowns[2]).exp(),
            distance_scale: unknowns[2].exp(),
        }
    }

    /// Surveyed − predicted of one run; the frame's turn swings the predicted position.
    fn residual(&self, run: &Observation, unknowns: &DVector<f64>) -> Vector3<f64> {
        let predicted = run.path.end(&self.training.odometry.corrected(&Self::correction(unknowns)));
        let (sin, cos) = (-unknowns[CORRECTIONS + run.dataset]).sin_cos();
        Vector3::new(
            run.surveyed.x - (cos * predicted.x - sin * predicted.y),
            run.surveyed.y - (sin * predicted.x + cos * predicted.y),
            run.surveyed.heading.map_or(0.0, |heading| heading - predicted.heading),
        )
    }

    /// Whitened residuals of all runs, then the priors of frames and scale.
    fn whitened(&self, unknowns: &DVector<f64>) -> DVector<f64> {
        let runs = self.training.runs.len();
        let mut out = DVector::zeros(3 * runs + self.datasets + 1);
        for (index, (run, whiten)) in self.training.runs.iter().zip(self.whiten).enumerate() {
            out.fixed_rows_mut::<3>(3 * index).copy_from(&(whiten * self.residual(run, unknowns)));
        }
        for dataset in 0..self.datasets {
            out[3 * runs + dataset] = unknowns[CORRECTIONS + dataset] / FRAME_STD;
        }
        if self.fitted.scale_is_nuisance {
            out[3 * runs + self.datasets] = unknowns[2] / NOT_FIXED;
        }
        out
    }

    /// Change of the whitened residuals with each fitted unknown.
    fn jacobian_at(&self, unknowns: &DVector<f64>) -> DMatrix<f64> {
        let runs = self.training.runs.len();
        let fitted = &self.fitted.unknowns;
        let parameters = self.training.odometry.corrected(&Self::correction(unknowns));
        let of_corrections = self.change_of_parameters(unknowns);
        let mut jacobian = DMatrix::zeros(3 * runs + self.datasets + 1, fitted.len());
        for (index, (run, whiten)) in self.training.runs.iter().zip(self.whiten).enumerate() {
            let (end, change) = run.path.end_and_change(&parameters);
            let turn = -unknowns[CORRECTIONS + run.dataset];
            let (sin, cos) = turn.sin_cos();
            let into_survey = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
            // Residuals are surveyed less predicted, and of a blank heading none.
            let seen = Vector3::new(1.0, 1.0, f64::from(u8::from(run.surveyed.heading.is_some())));
            let of_corrections = -(whiten * Matrix3::from_diagonal(&seen) * into_survey * change * of_corrections);
            let of_frame = whiten * Vector3::new(-sin * end.x - cos * end.y, cos * end.x - sin * end.y, 0.0);
            for (column, &unknown) in fitted.iter().enumerate() {
                let mut rows = jacobian.fixed_view_mut::<3, 1>(3 * index, column);
                if unknown < CORRECTIONS {
                    rows.copy_from(&of_corrections.column(unknown));
                } else if unknown == CORRECTIONS + run.dataset {
                    rows.copy_from(&of_frame);
                }
            }
        }
        for (column, &unknown) in fitted.iter().enumerate() {
            if let Some(dataset) = unknown.checked_sub(CORRECTIONS) {
                jacobian[(3 * runs + dataset, column)] = 1.0 / FRAME_STD;
            } else if unknown == 2 && self.fitted.scale_is_nuisance {
                jacobian[(3 * runs + self.datasets, column)] = 1.0 / NOT_FIXED;
            }
        }
        jacobian
    }

    /// How left radius, right radius and track change with the three corrections: no path is followed for it, so that central
    /// differences are cheap, and exact to nine digits.
    fn change_of_parameters(&self, unknowns: &DVector<f64>) -> Matrix3<f64> {
        const STEP: f64 = 1e-5;
        let columns = std::array::from_fn::<_, 3, _>(|unknown| {
            let at = |step: f64| {
                let mut moved = unknowns.clone();
                moved[unknown] += step;
                let parameters = self.training.odometry.corrected(&Self::correction(&moved));
                Vector3::new(parameters.left_wheel_radius, parameters.right_wheel_radius, parameters.track_width)
            };
            (at(STEP) - at(-STEP)) / (2.0 * STEP)
        });
        Matrix3::from_columns(&columns)
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        for (value, &unknown) in x.iter().zip(&self.fitted.unknowns) {
            self.unknowns[unknown] = *value;
        }
    }

    fn params(&self) -> DVector<f64> {
        let fitted = &self.fitted.unknowns;
        DVector::from_iterator(fitted.len(), fitted.iter().map(|&unknown| self.unknowns[unknown]))
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.whitened(&self.unknowns)).filter(|residuals| residuals.iter().all(|value| value.is_finite()))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        Some(self.jacobian_at(&self.unknowns))
    }
}

fn estimate(training: &Training) -> Result<Estimate, CalibrateError> {
    let datasets = training.runs.iter().map(|run| run.dataset + 1).max().unwrap_or(0);
    let found: usize = training.runs.iter().map(|run| if run.surveyed.heading.is_some() { 3 } else { 2 }).sum();
    let noise: Vec<Noise> = training.runs.iter().map(|run| Noise::of(run, training)).collect();
    let singular = || CalibrateError::Singular { dataset: training.name.clone() };

    let whiten = whitening(training, &noise, Levels { process: 1.0, heading: 0.0 }).ok_or_else(singular)?;
    let all = Fitted { unknowns: (0..CORRECTIONS + datasets).collect(), scale_is_nuisance: false };
    let start = DVector::zeros(all.unknowns.len());
    let belief = Problem { training, whiten: &whiten, fitted: &all, datasets, unknowns: start.clone() };
    let fitted = fixed_at_belief(&belief, &start);
    let nuisances = usize::from(fitted.scale_is_nuisance);
    let corrections = fitted.unknowns.iter().filter(|&&unknown| unknown < CORRECTIONS).count() - nuisances;
    if found < corrections.max(1) || corrections == 0 {
        return Err(CalibrateError::TooFew { dataset: training.name.clone(), found, needed: corrections.max(1) });
    }

    // Noise levels and fit depend on each other weakly: a few rounds settle both.
    let mut unknowns = start;
    let mut whiten = whiten;
    for round in 0..ROUNDS {
        let problem = Problem { training, whiten: &whiten, fitted: &fitted, datasets, unknowns: unknowns.clone() };
        let (solved, report) = LevenbergMarquardt::new().minimize(problem);
        if !report.termination.was_successful() && !report.objective_function.is_finite() {
            return Err(singular());
        }
        unknowns = solved.unknowns;
        if round + 1 < ROUNDS {
            let levels = Linear::at(training, &fitted, datasets, &unknowns).levels(training, &noise);
            whiten = whitening(training, &noise, levels).ok_or_else(singular)?;
        }
    }
    let problem = Problem { training, whiten: &whiten, fitted: &fitted, datasets, unknowns: unknowns.clone() };
    let jacobian = problem.jacobian_at(&unknowns);
    let covariance = (jacobian.transpose() * &jacobian).try_inverse().ok_or_else(singular)?;
    Ok(report(&unknowns, &fitted, &covariance))
}

/// Turns logarithms into ratios, and names what was not fixed.
fn report(unknowns: &DVector<f64>, fitted: &Fitted, covariance: &DMatrix<f64>) -> Estimate {
    let mut stated = unknowns.clone();
    if fitted.scale_is_nuisance {
        stated[2] = 0.0;
    }
    let correction = Problem::correction(&stated);
    let values = [correction.diameter_ratio, correction.track_ratio, correction.distance_scale];
    // d(E_d, E_b, E_s) over d(ln E_d, ln E_b/E_s, ln E_s).
    let mut chain = DMatrix::zeros(3, fitted.unknowns.len());
    for (column, &unknown) in fitted.unknowns.iter().enumerate() {
        match unknown {
            0 => chain[(0, column)] = values[0],
            1 => chain[(1, column)] = values[1],
            2 if !fitted.scale_is_nuisance => {
                chain[(1, column)] = values[1];
                chain[(2, column)] = values[2];
            }
            _ => {}
        }
    }
    let full = &chain * covariance * chain.transpose();
    let has = |unknown: usize| fitted.unknowns.contains(&unknown);
    let (diameters, ratio, scale) = (has(0), has(1), has(2) && !fitted.scale_is_nuisance);
    let fixed = [diameters, ratio && scale, scale];
    let parameter = |index: usize| Parameter {
        value: values[index],
        std_dev: if fixed[index] { full[(index, index)].sqrt() } else { f64::INFINITY },
    };
    let not_fixed = match (diameters, ratio, scale) {
        (true, true, true) => None,
        (true, true, false) => Some(SCALE_NOT_FIXED),
        (_, false, true) => Some("E_b: no run turns enough; a square or a spin fixes it"),
        (false, true, _) => Some("E_d: no run is straight enough; a square or a straight fixes it"),
        _ => Some("more than one of E_d, E_b, E_s: drive squares both ways round and a straight"),
    };
    Estimate {
        diameter_ratio: parameter(0),
        track_ratio: parameter(1),
        distance_scale: parameter(2),
        covariance: Some(std::array::from_fn(|i| {
            std::array::from_fn(|j| if fixed[i] && fixed[j] { full[(i, j)] } else { f64::INFINITY })
        })),
        not_fixed,
    }
}

/// The unknowns that these runs fix where the robot's belief is true: there, a closed run really is closed, and tells
/// nothing of scale. (Far from it a closed run's error grows with the scale, but to read a scale off it would be to
/// trust the model to second order.)
fn fixed_at_belief(problem: &Problem<'_>, belief: &DVector<f64>) -> Fitted {
    // Residuals play no part in the sensitivities, so that the wheels' path alone decides.
    let jacobian = problem.jacobian_at(belief);
    let mut fixed: Vec<usize> = problem.fitted.unknowns.clone();
    // Take away the worst until what is left is fixed: scale first where it ties with the track.
    for candidate in [2, 1, 0] {
        let columns: Vec<_> = fixed.iter().map(|&unknown| jacobian.column(unknown).into_owned()).collect();
        let j = DMatrix::from_columns(&columns);
        let information = j.transpose() * &j + DMatrix::identity(j.ncols(), j.ncols()) * 1e-9;
        let position = fixed.iter().position(|&unknown| unknown == candidate);
        let std_dev = information.try_inverse().zip(position).map(|(inverse, at)| inverse[(at, at)].sqrt());
        if std_dev.is_none_or(|std_dev| std_dev > NOT_FIXED) {
            fixed.retain(|&unknown| unknown != candidate);
        }
    }
    let scale_is_nuisance = !fixed.contains(&2);
    if scale_is_nuisance {
        fixed.push(2);
    }
    Fitted { unknowns: fixed, scale_is_nuisance }
}

impl Noise {
    fn of(run: &Observation, training: &Training) -> Noise {
        let [position, heading] = run.survey_std.map(|std| std.max(LEAST_STD));
        let odometry = &run.odometry;
        let poses: Vec<(Pose2, [f64; 2])> = run.path.poses(odometry).collect();
        let end = poses.last().map_or(Pose2::IDENTITY, |(pose, _)| *pose);
        // A heading lost at a pose swings the rest of the way about it.
        let swing = |at: Pose2| Vector3::new(-(end.y - at.y), end.x - at.x, 1.0);

        let mut survey = Matrix3::from_diagonal(&Vector3::new(position, position, heading).map(|std| std * std));
        let at_start = swing(Pose2::IDENTITY);
        survey += Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0)) * position * position
            + at_start * at_start.transpose() * heading * heading;

        let [corner, walk, scale] = PROCESS;
        let half_track = 0.5 * training.odometry.track_width;
        let mut process = Matrix3::zeros();
        for (pose, [left, right]) in &poses {
            let (left, right) = (left * odometry.left_wheel_radius, right * odometry.right_wheel_radius);
            let way = 0.5 * (left + right).abs();
            let on_the_spot = ((right - left).abs() / odometry.track_width - way / half_track).max(0.0);
            let variance = walk * walk * way + corner * corner * on_the_spot / std::f64::consts::FRAC_PI_2;
            process += swing(*pose) * swing(*pose).transpose() * variance;
        }
        let stretch = Vector3::new(end.x, end.y, 0.0) * scale;
        process += stretch * stretch.transpose();
        Noise { survey, process }
    }

    fn covariance(&self, levels: Levels) -> Matrix3<f64> {
        let mut covariance = self.survey + self.process * levels.process;
        covariance[(2, 2)] += levels.heading * levels.heading;
        covariance
    }
}

/// How strong the noises are that the runs themselves tell.
#[derive(Debug, Clone, Copy)]
struct Levels {
    /// Factor on the variance of the process noise.
    process: f64,
    /// σ of a heading noise of its own \[rad\].
    heading: f64,
}

/// Inverse Cholesky factors of every run's noise; without a heading, of its position alone.
fn whitening(training: &Training, noise: &[Noise], levels: Levels) -> Option<Vec<Matrix3<f64>>> {
    training
        .runs
        .iter()
        .zip(noise)
        .map(|(run, noise)| {
            let mut covariance = noise.covariance(levels);
            if run.surveyed.heading.is_none() {
                for k in 0..2 {
                    covariance[(2, k)] = 0.0;
                    covariance[(k, 2)] = 0.0;
                }
                covariance[(2, 2)] = 1.0;
            }
            let mut whiten = covariance.cholesky()?.l().try_inverse()?;
            if run.surveyed.heading.is_none() {
                whiten.row_mut(2).fill(0.0);
            }
            Some(whiten)
        })
        .collect()
}

/// The problem about a fit, linear: residuals and sensitivities before any whitening.
struct Linear {
    residuals: DVector<f64>,
    jacobian: DMatrix<f64>,
}

impl Linear {
    fn at(training: &Training, fitted: &Fitted, datasets: usize, unknowns: &DVector<f64>) -> Linear {
        let bare = vec![Matrix3::identity(); training.runs.len()];
        let problem = Problem { training, whiten: &bare, fitted, datasets, unknowns: unknowns.clone() };
        Linear { residuals: problem.whitened(unknowns), jacobian: problem.jacobian_at(unknowns) }
    }

    /// The noise levels of greatest restricted likelihood, which allows for what the fit has taken out of the residuals:
    /// golden sections over the root of the factor and over the heading's σ in turn.
    fn levels(&self, training: &Training, noise: &[Noise]) -> Levels {
        let mut levels = Levels { process: 1.0, heading: 0.0 };
        for _ in 0..2 {
            let root = least(10.0, |root| self.minus_log(training, noise, Levels { process: root * root, ..levels }));
            levels.process = root * root;
            levels.heading = least(0.2, |heading| self.minus_log(training, noise, Levels { heading, ..levels }));
        }
        levels
    }

    /// −2 ln of the restricted likelihood, but for a constant.
    fn minus_log(&self, training: &Training, noise: &[Noise], levels: Levels) -> f64 {
        let Some(whiten) = whitening(training, noise, levels) else { return f64::INFINITY };
        let (mut residuals, mut jacobian) = (self.residuals.clone(), self.jacobian.clone());
        let mut log_noise = 0.0;
        for (index, (run, whiten)) in training.runs.iter().zip(&whiten).enumerate() {
            let white = whiten * residuals.fixed_rows::<3>(3 * index);
            residuals.fixed_rows_mut::<3>(3 * index).copy_from(&white);
            let white = whiten * jacobian.fixed_rows::<3>(3 * index);
            jacobian.fixed_rows_mut::<3>(3 * index).copy_from(&white);
            let rows = if run.surveyed.heading.is_some() { 3 } else { 2 };
            log_noise -= 2.0 * (0..rows).map(|k| whiten[(k, k)].ln()).sum::<f64>();
        }
        let information = jacobian.transpose() * &jacobian;
        let determinant = information.determinant();
        // The best small step from here, so that the likelihood is that of the fit under this noise.
        let Some(inverse) = information.try_inverse() else { return f64::INFINITY };
        let gradient = jacobian.transpose() * &residuals;
        residuals.norm_squared() - gradient.dot(&(&inverse * &gradient)) + log_noise + determinant.ln()
    }
}

/// Where `cost` is least between 0 and `high`, both included.
fn least(high: f64, cost: impl Fn(f64) -> f64) -> f64 {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (end, mut low, mut high) = (high, 0.0, high);
    for _ in 0..24 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if cost(a) <= cost(b) { high = b } else { low = a }
    }
    let inner = 0.5 * (low + high);
    [0.0, inner, end].into_iter().min_by(|one, other| cost(*one).total_cmp(&cost(*other))).unwrap_or(inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Campaign, Dataset, Protocol, Rotation, Run, SurveyedPose, Travel};
    use crate::odometry::OdometryParameters;

    /// Squares that did not close, a straight and a spin, of two campaigns; one end without a heading.
    #[test]
    fn sensitivities_are_those_of_the_residuals() {
        let believed = OdometryParameters {
            left_wheel_radius: 0.1,
            right_wheel_radius: 0.101,
            track_width: 0.4,
            ticks_per_revolution: None,
        };
        let run = |protocol, x: f64, heading: Option<f64>| Run {
            name: "1".to_owned(),
            protocol,
            speed: None,
            turn_rate: None,
            started: None,
            start: None,
            end: Some(SurveyedPose { x, y: 0.3, heading }),
            odometry_end: Some(SurveyedPose { x: 0.02, y: -0.01, heading: Some(6.25) }),
            encoders: None,
            poses: None,
        };
        let square = Protocol::Square { side: 2.0, direction: Rotation::CounterClockwise };
        let mut campaign = Campaign { odometry: Some(believed), ..Campaign::default() };
        let mut datasets = Vec::new();
        for name in ["one", "other"] {
            campaign.name = name.to_owned();
            let straight = Run {
                odometry_end: None,
                ..run(Protocol::Straight { length: 3.0, direction: Travel::Forward }, 2.9, Some(0.01))
            };
            let runs = vec![run(square, 0.1, Some(6.2)), run(square, 0.2, None), straight];
            datasets.push(Dataset { campaign: campaign.clone(), runs });
        }
        let training = Training::new(&datasets).expect("it is one");
        let whiten = vec![Matrix3::new(3.0, 0.0, 0.0, 1.0, 2.0, 0.0, 0.5, -1.0, 4.0); training.runs.len()];
        let fitted = Fitted { unknowns: vec![0, 1, 2, 3, 4], scale_is_nuisance: true };
        let unknowns = DVector::from_vec(vec![0.01, -0.04, 0.02, 0.03, -0.02]);
        let problem =
            Problem { training: &training, whiten: &whiten, fitted: &fitted, datasets: 2, unknowns: unknowns.clone() };
        let jacobian = problem.jacobian_at(&unknowns);
        const STEP: f64 = 1e-6;
        for column in 0..5 {
            let at = |step: f64| {
                let mut moved = unknowns.clone();
                moved[column] += step;
                problem.whitened(&moved)
            };
            let expected = (at(STEP) - at(-STEP)) / (2.0 * STEP);
            // Central differences lose half of the digits: 1e-16 of a residual of 10 over 1e-6, and a step squared.
            let off = (jacobian.column(column) - &expected).amax();
            assert!(off < 1e-7, "{column}: {off} of {}", expected.amax());
        }
    }
}
