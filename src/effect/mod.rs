//! Effects: every cause that a diagnosis can name, each defined once, each an edit of a [`Scene`].
//!
//! An edit is a pure function of the effect's parameters, an increment on the scene as given, and the identity where they
//! are zero. The simulator knows the scene and no effects. From [`EFFECTS`] derive `--set`, `treadmark effects`, the
//! extended model files, the diagnosis' candidates and the hidden-effect tests.

mod catalogue;
mod error;
mod model;

pub use catalogue::{EFFECTS, NO_CAUSE};
pub use error::EffectError;
pub use model::{ExtendedModel, load_scene};

use crate::geometry::wrap_angle;
use crate::scene::{Contact, Scene};

/// A physical or measurement cause that a model may leave out.
#[derive(Debug)]
pub struct Effect {
    /// As the command line, files and JSON spell it.
    pub id: &'static str,
    /// Where it sits.
    pub family: Family,
    /// The cause in a sentence.
    pub cause: &'static str,
    /// What data can show it.
    pub shown_by: &'static str,
    /// Where it is described.
    pub source: &'static str,
    /// Its numbers.
    pub parameters: &'static [Parameter],
    /// What else has to be said: which wheel, which side.
    pub choice: Option<Choice>,
    needs: Needs,
    edit: fn(&mut Scene, &[f64], &str),
}

/// What a scene must have for an effect to do anything in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Needs {
    Nothing,
    TwoAxles,
    Caster,
    /// Rigid cylinders grip alike in all directions.
    Patches,
    /// What makes the track of two axles is friction, of one axle where its wheels stand.
    PatchesOrOneAxle,
    FlatFloor,
    /// Most drivetrains are as good as rigid: a model says where one may not be.
    WindUp,
}

impl Needs {
    fn met_by(self, scene: &Scene) -> bool {
        let (on_patches, two_axles) = (scene.contact == Contact::Patch, scene.robot.wheelbase() > 0.0);
        match self {
            Needs::Nothing => true,
            Needs::TwoAxles => two_axles,
            Needs::Caster => !scene.robot.casters.is_empty(),
            Needs::Patches => on_patches,
            Needs::PatchesOrOneAxle => on_patches || !two_axles,
            Needs::FlatFloor => scene.floor.plane.is_some(),
            Needs::WindUp => scene.robot.drivetrain.wind_up.is_some(),
        }
    }

    /// For messages.
    fn label(self) -> &'static str {
        match self {
            Needs::Nothing => "nothing",
            Needs::TwoAxles => "a second axle",
            Needs::Caster => "a caster",
            Needs::Patches => "tyres on contact patches",
            Needs::PatchesOrOneAxle => "tyres on contact patches, or wheels on one axle",
            Needs::FlatFloor => "a flat floor",
            Needs::WindUp => "a drivetrain whose model states `wind_up_rad_nm`, be it as 0",
        }
    }
}

/// Where a cause sits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Wheels and tyres.
    Tyres,
    /// Mass.
    Mass,
    /// A name for several causes that act alike.
    Class,
    /// Floor, in the room frame.
    Floor,
    /// Drivetrain and encoders.
    Drivetrain,
    /// Survey: the robot does what it does, and is read wrongly.
    Survey,
}

/// One number of an effect.
#[derive(Debug, PartialEq)]
pub struct Parameter {
    /// With its unit, as files and JSON spell it: `angle_rad`.
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Least and greatest value allowed.
    pub bounds: [f64; 2],
    /// What is plausible before any data.
    pub prior: Prior,
}

impl Parameter {
    /// `one` less `other`; of directions the short way round.
    pub fn difference(&self, one: f64, other: f64) -> f64 {
        if matches!(self.prior, Prior::AnyHeading) { wrap_angle(one - other) } else { one - other }
    }
}

/// What is plausible of a parameter before any data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prior {
    /// Normal.
    Normal {
        /// Its mean.
        mean: f64,
        /// Its σ.
        std_dev: f64,
    },
    /// The size of a normal number of mean 0.
    HalfNormal {
        /// The normal number's σ.
        std_dev: f64,
    },
    /// Any angle.
    AnyHeading,
    /// A coordinate of a place on the path that was driven.
    OnPath,
    /// Known.
    Known(f64),
}

/// What an effect has to be told beside numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// `wheel`: one of the model file's.
    Wheel,
    /// `side`: `left` or `right`.
    Side,
}

/// An effect with its numbers: a cause, as a file states it or a diagnosis finds it.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// Which effect.
    pub effect: &'static Effect,
    /// Wheel or side, where the effect has to be told; else empty.
    pub choice: String,
    /// One value a parameter, in their order.
    pub values: Vec<f64>,
}

impl PartialEq for Effect {
    fn eq(&self, other: &Effect) -> bool {
        self.id == other.id
    }
}

impl Family {
    /// As tables spell it.
    pub fn as_str(self) -> &'static str {
        match self {
            Family::Tyres => "wheels and tyres",
            Family::Mass => "mass",
            Family::Class => "class",
            Family::Floor => "floor",
            Family::Drivetrain => "drivetrain and encoders",
            Family::Survey => "survey",
        }
    }
}

impl Choice {
    /// The key: `wheel` or `side`.
    pub fn key(self) -> &'static str {
        match self {
            Choice::Wheel => "wheel",
            Choice::Side => "side",
        }
    }

    /// What can be chosen in `scene`.
    pub fn among(self, scene: &Scene) -> Vec<String> {
        match self {
            Choice::Wheel => scene.robot.wheels.iter().map(|wheel| wheel.name.clone()).collect(),
            Choice::Side => vec!["left".to_owned(), "right".to_owned()],
        }
    }
}

impl Effect {
    /// The effect of this id.
    pub fn named(id: &str) -> Option<&'static Effect> {
        EFFECTS.iter().find(|effect| effect.id == id)
    }

    /// Whether `scene` has what it is about.
    pub fn applies(&self, scene: &Scene) -> bool {
        self.needs.met_by(scene)
    }

    /// What can be chosen in `scene`: wheels or sides, or one empty word where nothing has to be.
    pub fn choices(&self, scene: &Scene) -> Vec<String> {
        self.choice.map_or_else(|| vec![String::new()], |choice| choice.among(scene))
    }

    /// Whether it changes what is read and nothing that happens.
    pub fn is_survey(&self) -> bool {
        self.family == Family::Survey
    }
}

impl Cause {
    /// `scene` with this cause in it.
    pub fn edit(&self, scene: &Scene) -> Scene {
        let mut edited = scene.clone();
        (self.effect.edit)(&mut edited, &self.values, &self.choice);
        edited
    }

    /// `scene` with all of `causes` in it, in their order.
    pub fn edit_all(causes: &[Cause], scene: &Scene) -> Scene {
        causes.iter().fold(scene.clone(), |scene, cause| cause.edit(&scene))
    }

    /// Whether its values lie in their bounds and `scene` has its part.
    ///
    /// # Errors
    /// What is wrong, and what is allowed.
    pub fn check(&self, scene: &Scene) -> Result<(), EffectError> {
        let effect = self.effect;
        if !effect.applies(scene) {
            let robot = scene.robot.name.clone();
            return Err(EffectError::DoesNotApply { effect: effect.id, robot, needs: effect.needs.label() });
        }
        for (parameter, &value) in effect.parameters.iter().zip(&self.values) {
            let [least, greatest] = parameter.bounds;
            if !(least..=greatest).contains(&value) {
                return Err(EffectError::OutOfBounds {
                    effect: effect.id,
                    parameter: parameter.name,
                    value,
                    least,
                    greatest,
                });
            }
        }
        if let Some(choice) = effect.choice {
            let among = choice.among(scene);
            if !among.contains(&self.choice) {
                let given = self.choice.clone();
                return Err(EffectError::Choice { effect: effect.id, key: choice.key(), given, among });
            }
        }
        Ok(())
    }

    /// Causes from settings `EFFECT.PARAMETER=VALUE`; settings of one effect belong together unless a key comes twice.
    /// Parameters that are not set are zero, or their known value.
    ///
    /// # Errors
    /// An unknown effect or parameter, a value that is no number or out of bounds, with what is allowed.
    pub fn from_settings(settings: &[String], scene: &Scene) -> Result<Vec<Cause>, EffectError> {
        let mut causes: Vec<(Cause, Vec<String>)> = Vec::new();
        for setting in settings {
            let malformed = || EffectError::Malformed { setting: setting.clone() };
            let (name, value) = setting.split_once('=').ok_or_else(malformed)?;
            let (id, key) = name.split_once('.').ok_or_else(malformed)?;
            let effect = Effect::named(id).ok_or_else(|| EffectError::unknown(id))?;
            let open =
                causes.iter().rposition(|(cause, set)| cause.effect == effect && !set.iter().any(|it| it == key));
            let index = open.unwrap_or_else(|| {
                causes.push((effect.nothing(), Vec::new()));
                causes.len() - 1
            });
            let (cause, set) = &mut causes[index];
            set.push(key.to_owned());
            cause.set(key, value)?;
        }
        let causes: Vec<Cause> = causes.into_iter().map(|(cause, _)| cause).collect();
        causes.iter().try_for_each(|cause| cause.check(scene))?;
        Ok(causes)
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), EffectError> {
        let effect = self.effect;
        if effect.choice.is_some_and(|choice| choice.key() == key) {
            self.choice = value.to_owned();
            return Ok(());
        }
        let Some(index) = effect.parameters.iter().position(|parameter| parameter.name == key) else {
            return Err(EffectError::UnknownParameter {
                effect: effect.id,
                parameter: key.to_owned(),
                known: effect.keys(),
            });
        };
        self.values[index] =
            value.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| EffectError::NotANumber {
                effect: effect.id,
                parameter: effect.parameters[index].name,
                value: value.to_owned(),
            })?;
        Ok(())
    }

    /// The cause in a line: `floor_slope: gradient 0.0100, downhill_heading_rad 1.57`.
    pub fn line(&self) -> String {
        let mut parts: Vec<String> = self
            .effect
            .parameters
            .iter()
            .zip(&self.values)
            .map(|(parameter, value)| format!("{} {value:.4}", parameter.name))
            .collect();
        if let Some(choice) = self.effect.choice {
            parts.push(format!("{} {}", choice.key(), self.choice));
        }
        format!("{}: {}", self.effect.id, parts.join(", "))
    }
}

impl Effect {
    /// The cause that does nothing.
    pub fn nothing(&'static self) -> Cause {
        let values = self
            .parameters
            .iter()
            .map(|parameter| match parameter.prior {
                Prior::Known(value) => value,
                _ => self.neutral(parameter),
            })
            .collect();
        Cause { effect: self, choice: String::new(), values }
    }

    /// The value of a parameter at which nothing changes.
    pub(crate) fn neutral(&self, parameter: &Parameter) -> f64 {
        if parameter.name == "ratio" { 1.0 } else { 0.0 }
    }

    fn keys(&self) -> Vec<&'static str> {
        self.parameters.iter().map(|parameter| parameter.name).chain(self.choice.map(Choice::key)).collect()
    }
}
