//! Extended model files: a robot model, and the causes that a diagnosis found on top of it.
//!
//! ```toml
//! format = "treadmark-extended-robot/1"
//! base = "jnpf_4wd"                    # a shipped robot or a model file, extended or not
//! contact = "rigid"                    # how wheels meet the ground; not said: as in the base
//!
//! [[effects]]
//! effect = "floor_slope"
//! gradient = 0.008
//! downhill_heading_rad = 1.2
//!
//! [[empirical]]                        # δω = 0.003 v
//! part = "yaw"
//! feature = "speed"
//! coefficient = 0.003
//! ```
//!
//! A formula has terms of the body's twist and of a potential, `part = "potential"` with the feature `x_squared`, `x_y` or `y_squared`,
//! which pulls the robot downhill.
//!
//! A table `[doubt]` says how far the robot is known to differ from the model all the same: `motion`, relative to each part of
//! a way, on runs that it was not fitted to; `transient`, of what is made good by a run's end; `response`, of what causes do to it;
//! `diameter_scale`, `diameter_ratio` and `effective_track`, 1 σ of what a calibration would find; `friction` and `stiffness`,
//! 1 σ of what its tyres are taken for. A diagnosis blames no cause for so much. Tables `[[residue]]` say what the campaign
//! that the model was fitted to leaves ([`Residue`]): a diagnosis of the next one starts from there.
//!
//! Every command takes one as `--robot`. It may hold edits of floor and survey, since that is where causes can lie.

use super::{Cause, Effect, EffectError};
use crate::scene::{Contact, Doubt, EmpiricalTerm, Residue, Scene};
use crate::strict;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A robot model and causes on top of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtendedModel {
    /// Robot model file or shipped name.
    pub base: String,
    /// Where the causes come from, in a sentence; empty: not said.
    pub description: String,
    /// How wheels meet the ground, where that is not as in the base.
    pub contact: Option<Contact>,
    /// In the order in which they are applied.
    pub causes: Vec<Cause>,
    /// Terms without a physical cause.
    pub empirical: Vec<EmpiricalTerm>,
    /// How far the robot is known to differ from the model.
    pub doubt: Doubt,
    /// What the campaign that it was fitted to leaves, one a condition.
    pub residues: Vec<Residue>,
}

const FORMAT: &str = "treadmark-extended-robot/1";
/// Models that may extend one another.
const DEEPEST: usize = 16;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    description: String,
    base: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    contact: Option<Contact>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    effects: Vec<BTreeMap<String, toml::Value>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    empirical: Vec<EmpiricalTerm>,
    #[serde(default, skip_serializing_if = "no_doubt")]
    doubt: Doubt,
    #[serde(default, rename = "residue", skip_serializing_if = "Vec::is_empty")]
    residues: Vec<Residue>,
}

/// Reads a robot, extended or not, and a world, each a file or the name of a shipped one.
///
/// # Errors
/// What is wrong with which file, where, and what is allowed.
pub fn load_scene(robot: &str, world: &str) -> Result<Scene, EffectError> {
    let mut extensions = Vec::new();
    let mut given = robot.to_owned();
    while let Some(model) = ExtendedModel::read(Path::new(&given))? {
        if extensions.len() == DEEPEST {
            return Err(EffectError::TooDeep { file: PathBuf::from(robot), limit: DEEPEST });
        }
        let file = PathBuf::from(&given);
        given.clone_from(&model.base);
        extensions.push((file, model));
    }
    let mut scene = Scene::load(&given, world)?;
    for (file, model) in extensions.into_iter().rev() {
        scene.contact = model.contact.unwrap_or(scene.contact);
        for cause in &model.causes {
            cause
                .check(&scene)
                .map_err(|source| EffectError::InFile { file: file.clone(), source: Box::new(source) })?;
            scene = cause.edit(&scene);
        }
        scene.empirical.extend(&model.empirical);
        scene.robot.doubt = scene.robot.doubt.widest(model.doubt);
        // What an earlier extension left is relative to a model that is no longer.
        scene.robot.residues = model.residues;
        scene.robot.file = file;
    }
    Ok(scene)
}

impl ExtendedModel {
    /// The extended model in `file`; `None` where there is no such file, or it is a plain robot model.
    ///
    /// # Errors
    /// It cannot be read, does not parse, or holds an unknown effect or a value that is not allowed.
    pub fn read(file: &Path) -> Result<Option<ExtendedModel>, EffectError> {
        if !file.is_file() {
            return Ok(None);
        }
        let text = std::fs::read_to_string(file).map_err(|source| EffectError::Io { file: file.to_owned(), source })?;
        let declares = |line: &str| line.trim_start().starts_with("format") && line.contains(FORMAT);
        if !text.lines().any(declares) {
            return Ok(None);
        }
        let parsed: File =
            strict::parse(&text).map_err(|source| EffectError::Toml { file: file.to_owned(), source })?;
        let in_file = |source| EffectError::InFile { file: file.to_owned(), source: Box::new(source) };
        let causes = parsed.effects.into_iter().map(cause_of).collect::<Result<_, _>>().map_err(in_file)?;
        if let Some(odd) = parsed.residues.iter().find(|residue| !residue.is_sound()) {
            return Err(in_file(EffectError::Residue {
                condition: odd.condition.clone(),
                counts: [odd.x.len(), odd.y.len(), odd.heading.len(), odd.at.len()],
            }));
        }
        if let Some(&term) = parsed.empirical.iter().find(|term| !term.is_sound()) {
            return Err(in_file(EffectError::Term { term }));
        }
        // A base that is a file stands where this file says, seen from here.
        let beside = file.parent().unwrap_or(Path::new("")).join(&parsed.base);
        let base = if beside.is_file() { beside.to_string_lossy().into_owned() } else { parsed.base };
        Ok(Some(ExtendedModel {
            base,
            description: parsed.description,
            contact: parsed.contact,
            causes,
            empirical: parsed.empirical,
            doubt: parsed.doubt,
            residues: parsed.residues,
        }))
    }

    /// The file's text.
    pub fn to_toml(&self) -> String {
        let effects = self
            .causes
            .iter()
            .map(|cause| {
                let mut table = BTreeMap::from([("effect".to_owned(), toml::Value::from(cause.effect.id))]);
                for (parameter, value) in cause.effect.parameters.iter().zip(&cause.values) {
                    table.insert(parameter.name.to_owned(), toml::Value::from(*value));
                }
                if let Some(choice) = cause.effect.choice {
                    table.insert(choice.key().to_owned(), toml::Value::from(cause.choice.as_str()));
                }
                table
            })
            .collect();
        let file = File {
            format: FORMAT.to_owned(),
            description: self.description.clone(),
            base: self.base.clone(),
            contact: self.contact,
            effects,
            empirical: self.empirical.clone(),
            doubt: self.doubt,
            residues: self.residues.clone(),
        };
        toml::to_string(&file).expect("strings, numbers and tables are TOML")
    }
}

fn no_doubt(doubt: &Doubt) -> bool {
    *doubt == Doubt::default()
}

/// A cause from a table of its effect, parameters and choice.
fn cause_of(mut table: BTreeMap<String, toml::Value>) -> Result<Cause, EffectError> {
    let id = table.remove("effect").map(text).unwrap_or_default();
    let effect = Effect::named(&id).ok_or_else(|| EffectError::unknown(&id))?;
    let mut cause = effect.nothing();
    for (key, value) in table {
        cause.set(&key, &text(value))?;
    }
    Ok(cause)
}

fn text(value: toml::Value) -> String {
    match value {
        toml::Value::String(text) => text,
        other => other.to_string(),
    }
}
