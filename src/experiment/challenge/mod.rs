//! Hidden effects: a robot with something wrong, whose truth nothing but the scorer reads.

mod campaign;
mod judge;
mod oracle;
mod score;

pub use campaign::{CampaignKind, DataKind, planned, planned_as};
pub use score::{Call, Interval, Score, ScoreError, Scored, Scorer, Tally};

use crate::dataset::{Dataset, DatasetError};
use crate::drive::{self, DriveError};
use crate::effect::{Cause, EFFECTS, Effect, Prior};
use crate::geometry::Pose2;
use crate::scene::{Contact, EmpiricalTerm, Feature, Scene, TermPart, Tether};
use campaign::drive_campaign;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::{PI, TAU};
use std::sync::atomic::AtomicBool;

/// What is hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EffectsKind {
    /// Nothing.
    None,
    /// One effect of the catalogue.
    One,
    /// Two.
    Two,
    /// Something that is not in the catalogue.
    Outside,
    /// One effect, or in one draw of five nothing.
    Mixed,
}

/// One draw to be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Challenge {
    /// Of everything that is drawn.
    pub seed: u64,
    /// What the diagnosis gets to see.
    pub data: DataKind,
    /// What is hidden.
    pub effects: EffectsKind,
    /// What is driven.
    pub campaign: CampaignKind,
    /// Whether the world has another tyre law than the diagnosis knows.
    pub mismatch: bool,
    /// With another tyre law: campaigns of the world before anything is hidden, on which the diagnosis first extends its model.
    pub clean_campaigns: usize,
}

/// A draw: the world as it is, and what a lab noted of it.
#[derive(Debug, Clone)]
pub struct Draw {
    /// What was hidden.
    pub causes: Vec<Cause>,
    /// What was hidden and is not in the catalogue, in words.
    pub outside: Option<String>,
    /// The world without what was hidden.
    pub clean: Scene,
    /// The world as it is.
    pub world: Scene,
    /// The campaign that is to be diagnosed.
    pub dataset: Dataset,
    /// With another tyre law: campaigns of the same world before anything was hidden.
    pub clean_datasets: Vec<Dataset>,
}

/// The survey of a challenge: readings on the way remember their noise for half a second.
fn surveyed(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.survey.correlation_time = 0.5;
    scene
}

impl Challenge {
    /// Draws what is hidden in `base` and drives the campaign.
    ///
    /// # Errors
    /// A run that cannot be driven.
    pub fn draw(&self, base: &Scene, stop: &AtomicBool) -> Result<Draw, DriveError> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let mut clean = surveyed(base);
        if self.mismatch {
            clean = another_tyre(&clean, &mut rng);
        }
        let (causes, outside) = self.hide(&clean, &mut rng);
        let mut world = Cause::edit_all(&causes, &clean);
        let outside = outside.then(|| something_else(&mut world, &mut rng));
        let name = format!("challenge-{}", self.seed);
        let dataset = drive_campaign(&world, self.campaign, self.data, self.seed, &name, stop)?;
        let clean_datasets = (1..=if self.mismatch { self.clean_campaigns } else { 0 })
            .map(|number| {
                let which = Draw::clean_name(number);
                let seed = drive::derived_seed(self.seed, &which);
                drive_campaign(&clean, self.campaign, self.data, seed, &format!("{name}-{which}"), stop)
            })
            .collect::<Result<_, _>>()?;
        Ok(Draw { causes, outside, clean, world, dataset, clean_datasets })
    }

    /// What is hidden, and whether it is none of the catalogue.
    fn hide(&self, scene: &Scene, rng: &mut ChaCha8Rng) -> (Vec<Cause>, bool) {
        let count = match self.effects {
            EffectsKind::None => 0,
            EffectsKind::One => 1,
            EffectsKind::Two => 2,
            EffectsKind::Outside => return (Vec::new(), true),
            EffectsKind::Mixed => usize::from(!rng.next_u64().is_multiple_of(5)),
        };
        let applicable: Vec<&'static Effect> = EFFECTS
            .iter()
            .filter(|effect| effect.applies(scene))
            // A clock can be off only where there is one to compare.
            .filter(|effect| effect.id != "survey_time_offset" || self.data == DataKind::Logs)
            .collect();
        let mut causes: Vec<Cause> = Vec::new();
        while causes.len() < count {
            let effect = applicable[(rng.next_u64() % applicable.len() as u64) as usize];
            let cause = draw_cause(effect, scene, self.campaign, rng);
            if causes.iter().all(|known| known.effect != effect) {
                causes.push(cause);
            }
        }
        (causes, false)
    }
}

impl Draw {
    /// What a campaign before anything was hidden is called, from 1 on: `clean`, `clean-2`, …
    fn clean_name(number: usize) -> String {
        if number == 1 { "clean".to_owned() } else { format!("clean-{number}") }
    }

    /// Writes the campaign to `folder` as a dataset, the clean campaigns where there are any to `clean`, `clean-2`, … in it, and
    /// what was hidden to `truth.json`, which nothing but a scorer should read.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, folder: &std::path::Path) -> Result<(), DatasetError> {
        self.dataset.write(folder)?;
        for (number, clean) in (1..).zip(&self.clean_datasets) {
            clean.write(&folder.join(Draw::clean_name(number)))?;
        }
        let causes: Vec<serde_json::Value> = self
            .causes
            .iter()
            .map(|cause| {
                let mut table = serde_json::Map::new();
                table.insert("effect".to_owned(), cause.effect.id.into());
                for (parameter, value) in cause.effect.parameters.iter().zip(&cause.values) {
                    table.insert(parameter.name.to_owned(), (*value).into());
                }
                if let Some(choice) = cause.effect.choice {
                    table.insert(choice.key().to_owned(), cause.choice.clone().into());
                }
                table.into()
            })
            .collect();
        let truth = serde_json::json!({"effects": causes, "outside": self.outside});
        let file = folder.join("truth.json");
        std::fs::write(&file, format!("{truth:#}\n")).map_err(|source| DatasetError::Write { path: file, source })
    }
}

fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// An effect with its numbers drawn from their priors.
fn draw_cause(effect: &'static Effect, scene: &Scene, campaign: CampaignKind, rng: &mut ChaCha8Rng) -> Cause {
    let mut cause = effect.nothing();
    let choices = effect.choices(scene);
    cause.choice.clone_from(&choices[(rng.next_u64() % choices.len() as u64) as usize]);
    let place = on_path(campaign, rng);
    let mut coordinates = [place.x, place.y].into_iter();
    for (value, parameter) in cause.values.iter_mut().zip(effect.parameters) {
        let drawn = match parameter.prior {
            // Offsets of whole campaigns are drawn; a spread over runs is for real data.
            Prior::HalfNormal { .. } if parameter.name == "run_offset_std_s" => 0.0,
            Prior::Normal { mean, std_dev } => mean + std_dev * normal(rng),
            Prior::HalfNormal { std_dev } => (std_dev * normal(rng)).abs(),
            Prior::AnyHeading => TAU * uniform(rng) - PI,
            Prior::OnPath => coordinates.next().unwrap_or(0.0),
            Prior::Known(value) => value,
        };
        *value = drawn.clamp(parameter.bounds[0], parameter.bounds[1]);
    }
    cause
}

/// A place on the nominal path of one of the squares.
fn on_path(campaign: CampaignKind, rng: &mut ChaCha8Rng) -> Pose2 {
    let squares = campaign.squares();
    let (side, direction) = squares[(rng.next_u64() % squares.len() as u64) as usize];
    let along = 4.0 * uniform(rng);
    let mut corner = Pose2::IDENTITY;
    for _ in 0..along as usize {
        corner = corner.compose(Pose2::new(side, 0.0, direction.sign() * 0.5 * PI));
    }
    corner.compose(Pose2::new(along.fract() * side, 0.0, 0.0))
}

/// The same robot on tyres that the diagnosis does not know.
fn another_tyre(scene: &Scene, rng: &mut ChaCha8Rng) -> Scene {
    let mut other = scene.clone();
    let law = rng.next_u64() % 3;
    if law == 0 {
        other.contact = Contact::Rigid;
    }
    let factor = |rng: &mut ChaCha8Rng, spread: f64| (spread * normal(rng)).exp();
    let (stiffness, slip, friction) = (factor(rng, 0.3), factor(rng, 0.3), factor(rng, 0.15));
    for wheel in &mut other.robot.wheels {
        if law < 2 {
            wheel.tyre.vertical_stiffness *= stiffness;
            wheel.tyre.slip_stiffness *= slip;
        }
        if law != 1 {
            wheel.tyre.friction_along *= friction;
            wheel.tyre.friction_across *= friction;
        }
    }
    other
}

/// Puts something into the scene that no effect of the catalogue is.
fn something_else(scene: &mut Scene, rng: &mut ChaCha8Rng) -> String {
    match rng.next_u64() % 3 {
        0 => {
            let bearing = TAU * uniform(rng);
            let anchor = [1.0 + 4.0 * bearing.cos(), 4.0 * bearing.sin(), 1.0];
            let pull = 4.0 + 6.0 * uniform(rng);
            scene.tether = Some(Tether { anchor, pull });
            format!("a tether that pulls with {pull:.1} N to ({:.2}, {:.2}) m", anchor[0], anchor[1])
        }
        1 => {
            let wheel = (rng.next_u64() % scene.robot.wheels.len() as u64) as usize;
            let amplitude = 0.02 + 0.03 * uniform(rng);
            scene.robot.wheels[wheel].out_of_round = [amplitude, TAU * uniform(rng)];
            format!("wheel {} out of round by {:.1} %", scene.robot.wheels[wheel].name, 100.0 * amplitude)
        }
        _ => {
            let part = if rng.next_u64().is_multiple_of(2) { TermPart::Left } else { TermPart::Yaw };
            let feature = [Feature::SpeedCosHeading, Feature::SpeedX, Feature::AbsYawRate, Feature::SpeedTime]
                [(rng.next_u64() % 4) as usize];
            let sign = if rng.next_u64().is_multiple_of(2) { 1.0 } else { -1.0 };
            let coefficient = sign * (0.005 + 0.01 * uniform(rng));
            let term = EmpiricalTerm { part, feature, coefficient };
            scene.empirical.push(term);
            format!("a carpet that carries: {term}")
        }
    }
}
