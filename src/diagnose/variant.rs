//! The candidates: effects as coordinates that a search can move along.

use crate::effect::{Cause, EFFECTS, Effect, Family, NO_CAUSE, Prior};
use crate::scene::{Contact, EmpiricalTerm, Feature, Scene, TermPart};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_1_SQRT_2;

/// The effect that needs a place.
const SPOT: &str = "floor_grip_patch";
/// The effect of which each campaign has its own.
pub(super) const CLOCKS: &str = "survey_time_offset";

/// Components of a step that a response errs in, straight and turning.
pub(super) const RELATIVE: usize = 6;

/// What a variant is to a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Role {
    /// A candidate of the catalogue.
    Cause,
    /// One that the model cannot be driven with, as a load that tips the robot: it explains nothing.
    Refused,
    /// A term of a formula in place of a cause, for a coefficient of 1.
    Term(EmpiricalTerm),
    /// In doubt: what a calibration finds.
    Calibration,
    /// In doubt: what causes do.
    Responses,
    /// In doubt: what causes do, as far as it hangs on the tyres.
    Tyres(TyrePart),
}

/// What of tyres a model knows only roughly; its coordinate is ln of the ratio to the model's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TyrePart {
    Friction,
    VerticalStiffness,
    SlipStiffness,
}

impl TyrePart {
    /// Those that a scene's model is in doubt of, and 1 σ of each: a rigid cylinder has no patch.
    pub fn in_doubt(scene: &Scene) -> Vec<(TyrePart, f64)> {
        let doubt = scene.robot.doubt;
        let stiffness = if scene.contact == Contact::Patch { doubt.stiffness } else { 0.0 };
        let mut parts = vec![
            (TyrePart::Friction, doubt.friction),
            (TyrePart::VerticalStiffness, stiffness),
            (TyrePart::SlipStiffness, stiffness),
        ];
        parts.retain(|(_, std_dev)| *std_dev > 0.0);
        parts
    }

    /// Changes it on every wheel.
    pub fn edit(self, scene: &mut Scene, log_ratio: f64) {
        let ratio = log_ratio.exp();
        for tyre in scene.robot.wheels.iter_mut().map(|wheel| &mut wheel.tyre) {
            match self {
                TyrePart::Friction => {
                    tyre.friction_along *= ratio;
                    tyre.friction_across *= ratio;
                }
                TyrePart::VerticalStiffness => tyre.vertical_stiffness *= ratio,
                TyrePart::SlipStiffness => tyre.slip_stiffness *= ratio,
            }
        }
    }
}

/// An effect with its choice made; what is left are coordinates.
#[derive(Debug, Clone)]
pub(super) struct Variant {
    pub effect: &'static Effect,
    /// Wheel or side; empty where nothing is to be chosen.
    pub choice: String,
    /// What it is to a search.
    pub role: Role,
    /// Parameters that are held: a place on the floor.
    pub held: Vec<(usize, f64)>,
    pub coordinates: Vec<Coordinate>,
}

/// One direction of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Coordinate {
    /// The parameter where the coordinate is 0 and nothing changes.
    pub neutral: f64,
    /// Prior: normal with this mean and σ, cut off below 0 where it is one-sided.
    pub mean: f64,
    pub std_dev: f64,
    /// How far a linear look sees: about the range in which responses are simulated.
    pub reach: f64,
    pub one_sided: bool,
    /// Where it may be: what its parameter allows.
    pub bounds: [f64; 2],
    /// Grows with the time since the campaign began, and is stated an hour.
    pub hourly: bool,
    /// The campaign whose clocks alone it moves, where there are several.
    pub clocks_of: Option<usize>,
}

impl Coordinate {
    const ANYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    /// Prior σ that a linear look sees.
    const SEEN: f64 = 4.0;

    /// Of what nobody expects to be there.
    fn about_nothing(std_dev: f64, bounds: [f64; 2]) -> Coordinate {
        let reach = Coordinate::SEEN * std_dev;
        let (one_sided, hourly) = (false, false);
        Coordinate { neutral: 0.0, mean: 0.0, std_dev, reach, one_sided, bounds, hourly, clocks_of: None }
    }

    /// The nearest value that it may have.
    pub fn within(&self, value: f64) -> f64 {
        value.clamp(self.bounds[0], self.bounds[1])
    }
}

/// A coordinate of one variant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Axis {
    pub variant: usize,
    pub coordinate: usize,
}

impl Variant {
    /// All candidates in `scene`, but for spots on the floor, which need places first.
    ///
    /// On two axles friction moves nothing but the effective track, whose name stands for it. Each of `campaigns` has clocks
    /// of its own.
    pub fn all(scene: &Scene, campaigns: &[usize]) -> Vec<Variant> {
        EFFECTS
            .iter()
            .filter(|effect| effect.applies(scene) && effect.id != SPOT)
            .filter(|effect| effect.id != "tyre_grip_anisotropy" || scene.robot.wheelbase() == 0.0)
            .flat_map(|effect| effect.choices(scene).into_iter().map(|choice| Variant::new(effect, choice)))
            .map(|variant| variant.telling_clocks_apart(campaigns))
            .collect()
    }

    fn new(effect: &'static Effect, choice: String) -> Variant {
        let mut coordinates: Vec<Coordinate> = Vec::new();
        let mut held = Vec::new();
        for (index, parameter) in effect.parameters.iter().enumerate() {
            let hourly = parameter.name == "per_hour";
            let neutral = effect.neutral(parameter);
            let coordinate = |mean: f64, std_dev, one_sided| {
                let mean = mean - neutral;
                let bounds = parameter.bounds.map(|bound| bound - neutral);
                let reach = Coordinate::SEEN * std_dev;
                Coordinate { neutral, mean, std_dev, reach, one_sided, bounds, hourly, clocks_of: None }
            };
            match parameter.prior {
                Prior::Normal { mean, std_dev } => coordinates.push(coordinate(mean, std_dev, false)),
                // A spread over runs is no coordinate: it is noise.
                Prior::HalfNormal { .. } if parameter.name == "run_offset_std_s" => held.push((index, 0.0)),
                Prior::HalfNormal { std_dev } => coordinates.push(coordinate(0.0, std_dev, true)),
                // A size and an angle are two components of a vector.
                Prior::AnyHeading => {
                    let size = coordinates.pop().expect("a heading follows a size").std_dev * FRAC_1_SQRT_2;
                    let bounds = Coordinate::ANYWHERE;
                    coordinates.extend([Coordinate { bounds, ..coordinate(0.0, size, false) }; 2]);
                }
                Prior::OnPath | Prior::Known(_) => {}
            }
        }
        Variant { effect, choice, role: Role::Cause, held, coordinates }
    }

    /// Lets each of several campaigns have clocks of its own: the offset moves those of the first, and as many coordinates more,
    /// after all others, those of the rest. What is stated as one number is their mean.
    fn telling_clocks_apart(mut self, campaigns: &[usize]) -> Variant {
        if let ([first, others @ ..], CLOCKS) = (campaigns, self.effect.id)
            && !others.is_empty()
        {
            let offset = Coordinate { clocks_of: Some(*first), ..self.coordinates[0] };
            self.coordinates[0] = offset;
            self.coordinates.extend(others.iter().map(|&campaign| Coordinate { clocks_of: Some(campaign), ..offset }));
        }
        self
    }

    /// Coordinates of the clocks of several campaigns; none where they are the same.
    pub fn clocks(&self) -> Vec<usize> {
        (0..self.coordinates.len()).filter(|&index| self.coordinates[index].clocks_of.is_some()).collect()
    }

    /// Coordinates that have a parameter of their own.
    pub fn own_parameters(&self) -> usize {
        self.coordinates.len() - self.clocks().len().saturating_sub(1)
    }

    /// A spot on the floor at a place in the room \[m\].
    pub fn spot(place: [f64; 2]) -> Variant {
        let effect = Effect::named(SPOT).expect("it is in the catalogue");
        Variant { held: vec![(0, place[0]), (1, place[1])], ..Variant::new(effect, String::new()) }
    }

    /// The place of a spot on the floor.
    pub fn place(&self) -> Option<[f64; 2]> {
        (self.effect.id == SPOT).then(|| [self.held[0].1, self.held[1].1])
    }

    /// Whether it is a slope of the floor, whose pull along x and y are its coordinates.
    pub fn is_slope(&self) -> bool {
        self.is_cause() && self.names("floor_slope")
    }

    /// A term of a formula without a cause; `std_dev` is what is plausible of its coefficient.
    pub fn empirical(part: TermPart, feature: Feature, std_dev: f64) -> Variant {
        Variant {
            effect: &NO_CAUSE,
            choice: String::new(),
            role: Role::Term(EmpiricalTerm { part, feature, coefficient: 1.0 }),
            held: Vec::new(),
            // What it does to each step is in proportion to it, however large it is.
            coordinates: vec![Coordinate {
                reach: f64::INFINITY,
                ..Coordinate::about_nothing(std_dev, Coordinate::ANYWHERE)
            }],
        }
    }

    /// The same as something that is in doubt by 1 σ, and no candidate.
    pub fn doubted(&self, std_dev: f64) -> Variant {
        let coordinate = Coordinate { mean: 0.0, std_dev, ..self.coordinates[0] };
        Variant { role: Role::Calibration, coordinates: vec![coordinate], ..self.clone() }
    }

    /// What responses of a model may err by, and no candidate: forward, sideways and in heading, driving straight and turning,
    /// relative; then how far causes move the centre of rotation besides, forward and to the left, over what they move the
    /// robot by in all.
    pub fn response_error(std_dev: f64) -> Variant {
        // A response may be hardly there, but is never turned round.
        let relative = Coordinate::about_nothing(std_dev, [-0.95, f64::INFINITY]);
        let centre = Coordinate::about_nothing(std_dev, Coordinate::ANYWHERE);
        Variant {
            effect: &NO_CAUSE,
            choice: String::new(),
            role: Role::Responses,
            held: Vec::new(),
            coordinates: [vec![relative; RELATIVE], vec![centre; 2]].concat(),
        }
    }

    /// What a model knows only roughly of its tyres, and no candidate.
    pub fn tyre_error(part: TyrePart, std_dev: f64) -> Variant {
        Variant {
            effect: &NO_CAUSE,
            choice: String::new(),
            role: Role::Tyres(part),
            held: Vec::new(),
            coordinates: vec![Coordinate::about_nothing(std_dev, Coordinate::ANYWHERE)],
        }
    }

    /// What of the tyres it is.
    pub fn tyre_part(&self) -> Option<TyrePart> {
        if let Role::Tyres(part) = self.role { Some(part) } else { None }
    }

    /// Whether a coordinate of it is what responses err by, relative.
    pub fn is_error_of_response(&self, coordinate: usize) -> bool {
        self.role == Role::Responses && coordinate < RELATIVE
    }

    /// The part of a shift of the centre of rotation that a coordinate of it is: 0 forward, 1 to the left.
    pub fn part_of_centre(&self, coordinate: usize) -> Option<usize> {
        (self.role == Role::Responses).then(|| coordinate.checked_sub(RELATIVE)).flatten()
    }

    /// Whether it is what responses err by.
    pub fn is_response_error(&self) -> bool {
        self.role == Role::Responses
    }

    /// Whether it is a cause that the robot feels.
    pub fn is_physical(&self) -> bool {
        self.is_cause() && !self.effect.is_survey()
    }

    /// Takes it from the candidates.
    pub fn refuse(&mut self) {
        self.role = Role::Refused;
    }

    /// Whether it is a cause that can be named.
    pub fn is_cause(&self) -> bool {
        self.role == Role::Cause
    }

    /// The term of a formula that it is, for a coefficient of 1.
    pub fn term(&self) -> Option<EmpiricalTerm> {
        if let Role::Term(term) = self.role { Some(term) } else { None }
    }

    /// Whether it is a term of a formula.
    pub fn is_term(&self) -> bool {
        self.term().is_some()
    }

    /// Whether it is no candidate, but something in doubt of the model, which moves a little under every answer.
    pub fn is_doubted(&self) -> bool {
        matches!(self.role, Role::Calibration | Role::Responses | Role::Tyres(_))
    }

    /// Whether it is the cause of this name.
    pub fn names(&self, id: &str) -> bool {
        self.is_cause() && self.effect.id == id
    }

    /// The cause at these coordinates.
    pub fn cause(&self, at: &[f64]) -> Cause {
        let mut cause = self.effect.nothing();
        cause.choice.clone_from(&self.choice);
        if self.is_vector() {
            cause.values = vec![at[0].hypot(at[1]), at[1].atan2(at[0])];
            return cause;
        }
        for &(index, value) in &self.held {
            cause.values[index] = value;
        }
        let clocks = self.clocks();
        let mut free = at.iter();
        for (index, parameter) in self.effect.parameters.iter().enumerate() {
            let is_free = matches!(parameter.prior, Prior::Normal { .. } | Prior::HalfNormal { .. })
                && !self.held.iter().any(|(held, _)| *held == index);
            if is_free {
                let coordinate = self.coordinates[at.len() - free.len()];
                let own = *free.next().expect("one a free parameter");
                let mean = || clocks.iter().map(|&clock| at[clock]).sum::<f64>() / clocks.len() as f64;
                let value = coordinate.neutral + if coordinate.clocks_of.is_some() { mean() } else { own };
                let [least, greatest] = parameter.bounds;
                cause.values[index] = value.clamp(least, greatest);
            }
        }
        cause
    }

    /// σ of each parameter from the covariance of the coordinates, in the order of the effect's parameters; `None` for one
    /// that was not sought.
    pub fn std_devs(&self, at: &[f64], covariance: &nalgebra::DMatrix<f64>) -> Vec<Option<f64>> {
        if self.is_vector() {
            let size = at[0].hypot(at[1]).max(1e-12);
            let (c, s) = (at[0] / size, at[1] / size);
            let along = c * c * covariance[(0, 0)] + 2.0 * c * s * covariance[(0, 1)] + s * s * covariance[(1, 1)];
            let across = s * s * covariance[(0, 0)] - 2.0 * c * s * covariance[(0, 1)] + c * c * covariance[(1, 1)];
            return vec![Some(along.sqrt()), Some(across.sqrt() / size)];
        }
        let clocks = self.clocks();
        let of_mean = || {
            let all = clocks.iter().flat_map(|&i| clocks.iter().map(move |&j| covariance[(i, j)])).sum::<f64>();
            all.sqrt() / clocks.len() as f64
        };
        let std_dev = |k: usize| if clocks.contains(&k) { of_mean() } else { covariance[(k, k)].sqrt() };
        let mut free = 0..at.len();
        self.effect
            .parameters
            .iter()
            .enumerate()
            .map(|(index, parameter)| {
                let is_free = matches!(parameter.prior, Prior::Normal { .. } | Prior::HalfNormal { .. })
                    && !self.held.iter().any(|(held, _)| *held == index);
                is_free.then(|| free.next().map(std_dev)).flatten()
            })
            .collect()
    }

    /// Whether it is a cause that a calibration finds.
    pub fn is_of_calibration(&self) -> bool {
        super::CALIBRATED.iter().any(|id| self.names(id))
    }

    /// Whether it may be much larger than expected: a calibration finds it, it hangs on what the robot carries, or it is of no
    /// known cause.
    pub fn may_be_large(&self) -> bool {
        self.is_of_calibration() || self.is_term() || self.is_cause() && self.effect.family == Family::Mass
    }

    /// Whether its coordinates are the two components of a vector.
    fn is_vector(&self) -> bool {
        self.effect.parameters.iter().any(|parameter| parameter.prior == Prior::AnyHeading)
    }

    /// The effect by its id; a term as it is written.
    pub fn id(&self) -> String {
        match self.role {
            Role::Term(term) => format!("{} ~ {}", term.part.symbol(), term.feature.symbol()),
            _ => self.effect.id.to_owned(),
        }
    }

    /// A name for tables: the effect, and the choice.
    pub fn label(&self) -> String {
        match self.place() {
            Some([x, y]) => format!("{} ({x:.2}, {y:.2})", self.id()),
            None if self.choice.is_empty() => self.id(),
            None => format!("{} ({})", self.id(), self.choice),
        }
    }
}

/// Coordinates of a hypothesis: a value for each axis that it moves along.
pub(super) type Coordinates = [(Axis, f64)];

/// A hypothesis moved `by` so much along an axis, be it a new one.
pub(super) fn moved_along(at: &Coordinates, axis: Axis, by: f64) -> Vec<(Axis, f64)> {
    let mut moved = at.to_vec();
    match moved.iter_mut().find(|(known, _)| *known == axis) {
        Some((_, value)) => *value += by,
        None => moved.push((axis, by)),
    }
    moved
}

/// A hypothesis moved to a value of an axis, which it moves along.
pub(super) fn moved_to(at: &Coordinates, axis: Axis, value: f64) -> Vec<(Axis, f64)> {
    at.iter().map(|&(own, there)| (own, if own == axis { value } else { there })).collect()
}

/// The causes at a hypothesis' coordinates, in the order of their variants.
pub(super) fn causes(variants: &[Variant], at: &Coordinates) -> Vec<Cause> {
    let mut of_variant: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for (axis, value) in at {
        let values =
            of_variant.entry(axis.variant).or_insert_with(|| vec![0.0; variants[axis.variant].coordinates.len()]);
        values[axis.coordinate] = *value;
    }
    of_variant.retain(|variant, _| variants[*variant].is_cause());
    of_variant.into_iter().map(|(variant, values)| variants[variant].cause(&values)).collect()
}

/// The terms of a formula at a hypothesis' coordinates.
pub(super) fn terms(variants: &[Variant], at: &Coordinates) -> Vec<EmpiricalTerm> {
    let term = |(axis, value): &(Axis, f64)| {
        variants[axis.variant].term().map(|term| EmpiricalTerm { coefficient: *value, ..term })
    };
    at.iter().filter_map(term).collect()
}

/// A scene with a hypothesis' causes and terms in it.
pub(super) fn edited(scene: &Scene, variants: &[Variant], at: &Coordinates) -> Scene {
    let mut edited = Cause::edit_all(&causes(variants, at), scene);
    edited.empirical.extend(terms(variants, at));
    for (axis, value) in at {
        if let Some(part) = variants[axis.variant].tyre_part() {
            part.edit(&mut edited, *value);
        }
    }
    edited
}
