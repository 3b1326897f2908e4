//! A fast stand-in for the simulator: what each cause does to the way of a run, step by step.
//!
//! The way of a run is a chain of small body-frame steps (`way`). A cause changes each step by a curve over its coordinate
//! through simulations at a few values (exact there; `response`); steps are composed again, so that a heading that was changed
//! early carries what comes later without any linearisation. What two causes do together beyond what each does alone is a
//! product of their sizes, once simulated (`exact`), and what is beyond pairs in an answer of many is added where that answer
//! is. Survey effects are applied to the composed way as they are.

mod exact;
mod library;
mod response;
mod waves;

pub use library::Library;

use super::case::{Case, Cluster};
use super::forward::{ForwardError, ForwardModel};
use super::spots;
use super::variant::{Axis, Coordinates, Variant, causes};
use super::way::{self, ARM, Step, Way, compose, count_of, each, lasts, length};
use crate::geometry::{Pose2, Trace};
use crate::scene::{Contact, EmpiricalTerm, Feature, Motion, Scene, Survey, TermPart};
pub(super) use exact::nodes;
use exact::{axes, simulations};
use library::Entry;
use rayon::prelude::*;
use response::{NO_ERRORS, Node, Response, Responses, errors_of_response};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Spots on the floor that one simulation passes.
const AT_ONCE: usize = 32;

/// What is simulated, by whom, and what causes could be at work.
#[derive(Clone, Copy)]
pub(super) struct Bench<'a> {
    pub model: &'a dyn ForwardModel,
    pub cases: &'a [Case],
    pub clusters: &'a [Cluster],
    pub variants: &'a [Variant],
}

/// What a study looks for.
#[derive(Clone, Copy)]
pub(super) enum Candidates<'l> {
    /// A few, which are quickly simulated.
    Few(&'l [Variant]),
    /// All; responses that are known are not simulated again.
    All(Option<&'l Library>),
}

/// The stand-in for a set of runs.
pub(super) struct Surrogate {
    pub survey: Survey,
    pub ways: Vec<Way>,
    /// How much steps of the first clusters' ways differ from one to the next: position \[m\], heading \[rad\].
    pub unsteadiness: [f64; 2],
    /// One a cluster.
    responses: Vec<Responses>,
    /// The cluster whose runs turn the robot most, and the run that stands for it.
    pub most_turning: (usize, usize),
    /// Along which causes do much the same on both sides of 0.
    even: BTreeSet<Axis>,
    /// Along which causes do not go on as they begin.
    wavy: BTreeSet<Axis>,
    /// Change of a cluster's steps where what a variant is of the tyres is 1 σ off, and nothing else.
    on_tyres: BTreeMap<(usize, usize), Vec<Step>>,
    /// What spots do where they are come upon elsewhere.
    elsewhere: BTreeMap<(usize, Axis), Elsewhere>,
    /// Causes that the model cannot be driven with, each with the reason, in plain words.
    pub refused: Vec<String>,
}

/// Root mean square over `motions` of what a term is for a coefficient of 1: a part of the twist, or a force.
pub(super) fn size(part: TermPart, feature: Feature, motions: &[Motion]) -> f64 {
    let unit = EmpiricalTerm { part, feature, coefficient: 1.0 };
    let square = |motion: &Motion| match part {
        TermPart::Potential => EmpiricalTerm::force(&[unit], motion.pose).map(|it| it * it).iter().sum::<f64>(),
        TermPart::Forward | TermPart::Left | TermPart::Yaw => feature.value(motion).powi(2),
    };
    (motions.iter().map(square).sum::<f64>() / f64::max(motions.len() as f64, 1.0)).sqrt()
}

/// Change of a cluster's steps beyond what a spot of one size does, where a run comes upon it [`spots::STRAY`] farther west, and
/// farther south: as if the spot were so much farther east, and farther north.
struct Elsewhere {
    at: f64,
    changes: [Vec<Step>; 2],
}

impl Surrogate {
    /// Simulates every run of `cases` as given, and every cluster under every variant; to `variants` come spots on the floor,
    /// which need ways first: those of the first clusters, so many as are `used`. From its causes go those that the model cannot
    /// be driven with.
    pub fn new(
        model: &dyn ForwardModel,
        cases: &[Case],
        clusters: &[Cluster],
        used: usize,
        variants: &mut Vec<Variant>,
        candidates: Candidates<'_>,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Surrogate, ForwardError> {
        let scene = model.scene();
        let library = if let Candidates::All(library) = candidates { library } else { None };
        // Without a log all runs of a cluster are one simulation.
        let jobs: Vec<(usize, usize)> = clusters
            .iter()
            .enumerate()
            .flat_map(|(index, cluster)| {
                let reference = &cases[cluster.reference];
                let apart = |run: &&usize| **run == cluster.reference || reference.differs(&cases[**run]);
                let runs: Vec<usize> = if reference.replayed {
                    cluster.runs.iter().filter(apart).copied().collect()
                } else {
                    vec![cluster.reference]
                };
                runs.into_iter().map(move |run| (index, run))
            })
            .collect();
        let known: Vec<Option<&Entry>> =
            clusters.iter().map(|cluster| library.and_then(|library| library.of(&cases[cluster.reference]))).collect();
        let unknown: Vec<usize> = (0..clusters.len()).filter(|&cluster| known[cluster].is_none()).collect();
        let first: usize = axes(variants, cases).into_iter().map(|axis| simulations(variants, axis)).sum();
        let total = AtomicUsize::new(jobs.len() + unknown.len() * first);
        let done = AtomicUsize::new(0);
        let tell = |more: usize, did: usize| {
            let total = total.fetch_add(more, Relaxed) + more;
            progress(done.fetch_add(did, Relaxed) + did, total);
        };
        let tick = || tell(0, 1);

        let traces: Vec<((usize, usize), Trace)> = jobs
            .par_iter()
            .map(|&(cluster, run)| {
                let trace = model.trace(scene, &cases[run].run, &cases[run].counted)?;
                tick();
                Ok(((cluster, run), trace))
            })
            .collect::<Result<_, ForwardError>>()?;
        let mut ways: Vec<Option<Way>> = vec![None; cases.len()];
        for ((cluster, run), trace) in &traces {
            let reference = &cases[clusters[*cluster].reference];
            let count = count_of(if reference.replayed { reference.duration() } else { lasts(trace) });
            let way = Way::of(trace, count, reference.replayed, cases[*run].hours);
            if reference.replayed {
                ways[*run] = Some(way.clone());
                if *run == clusters[*cluster].reference {
                    for &member in clusters[*cluster].runs.iter().filter(|&&it| !reference.differs(&cases[it])) {
                        ways[member] = Some(way.beside(reference, &cases[member]));
                    }
                }
            } else {
                for &member in &clusters[*cluster].runs {
                    ways[member] = Some(Way { hours: cases[member].hours, ..way.clone() });
                }
            }
        }
        let ways: Vec<Way> = ways.into_iter().map(|way| way.expect("every run is in a cluster")).collect();
        let places = match candidates {
            Candidates::Few(_) => Vec::new(),
            Candidates::All(Some(library)) if unknown.is_empty() => library.places.clone(),
            Candidates::All(_) => spots::places(scene, cases, &clusters[..used], &ways),
        };
        variants.extend(places.into_iter().map(Variant::spot));
        let most_turning = clusters[..used]
            .iter()
            .map(|cluster| cluster.reference)
            .enumerate()
            .max_by(|(_, a), (_, b)| ways[*a].turned().total_cmp(&ways[*b].turned()))
            .expect("a study has runs");
        let responses = vec![Responses::default(); clusters.len()];
        let (even, wavy) = (BTreeSet::new(), BTreeSet::new());
        let (on_tyres, elsewhere) = (BTreeMap::new(), BTreeMap::new());
        let unsteadiness = way::unsteadiness(clusters[..used].iter().map(|cluster| &ways[cluster.reference]));
        let survey = scene.survey;
        let mut surrogate = Surrogate {
            survey,
            responses,
            ways,
            unsteadiness,
            most_turning,
            even,
            wavy,
            on_tyres,
            elsewhere,
            refused: Vec::new(),
        };
        let axes = axes(variants, cases);
        let to_simulate: Vec<(usize, Axis)> = unknown
            .iter()
            .flat_map(|&cluster| axes.iter().map(move |&axis| (cluster, axis)))
            .filter(|&(cluster, axis)| surrogate.concerns(scene, &clusters[cluster], &variants[axis.variant]))
            .collect();
        total.store(
            jobs.len() + to_simulate.iter().map(|&(_, axis)| simulations(variants, axis)).sum::<usize>(),
            Relaxed,
        );

        for (cluster, entry) in known.iter().enumerate() {
            if let Some(entry) = entry {
                surrogate.responses[cluster] = entry.along(&surrogate.ways[clusters[cluster].reference]);
            }
        }
        let bench = Bench { model, cases, clusters, variants };
        let is_spot = |(_, axis): &(usize, Axis)| variants[axis.variant].place().is_some();
        let (spots, causes): (Vec<_>, Vec<_>) = to_simulate.into_iter().partition(is_spot);
        let of_clusters = spots.chunk_by(|(one, _), (other, _)| one == other);
        let chunks: Vec<&[(usize, Axis)]> = of_clusters.flat_map(|spots| spots.chunks(AT_ONCE)).collect();
        let values = |axis: Axis| {
            let variant = &variants[axis.variant];
            nodes(variant, variant.coordinates[axis.coordinate])
        };
        let in_passing: Vec<Response> = chunks
            .par_iter()
            .map(|chunk| {
                let cluster = &clusters[chunk[0].0];
                let spots = |&(_, axis): &(usize, Axis)| values(axis).into_iter().map(move |value| (axis, value));
                let all: Vec<(Axis, f64)> = chunk.iter().flat_map(spots).collect();
                let mut changes = surrogate.changes_in_passing(bench, cluster, &all)?.into_iter();
                all.iter().for_each(|_| tick());
                let each = all.chunk_by(|(one, _), (other, _)| one == other);
                let of_spot = each.map(|spot| {
                    let nodes = spot.iter().zip(&mut changes).map(|((_, at), change)| Node::own(*at, change));
                    Response::in_passing(nodes.collect())
                });
                Ok(of_spot.collect())
            })
            .collect::<Result<Vec<Vec<Response>>, ForwardError>>()?
            .concat();
        let whole: Vec<Result<Response, ForwardError>> = causes
            .par_iter()
            .map(|&(cluster, axis)| {
                let nodes = values(axis).into_iter().map(|at| {
                    let change = surrogate.simulated_change(bench, &clusters[cluster], &[(axis, at)]);
                    tick();
                    change.map(|change| Node::own(at, change))
                });
                Ok(Response::smooth(nodes.collect::<Result<_, ForwardError>>()?))
            })
            .collect();
        for ((cluster, axis), response) in spots.into_iter().zip(in_passing) {
            surrogate.responses[cluster].of_axis.insert(axis, response);
        }
        let mut refused: BTreeMap<usize, ForwardError> = BTreeMap::new();
        for ((cluster, axis), response) in causes.into_iter().zip(whole) {
            let response = match response {
                Ok(response) => response,
                Err(error) if variants[axis.variant].is_cause() => {
                    refused.entry(axis.variant).or_insert(error);
                    let nothing = vec![Step::default(); surrogate.ways[clusters[cluster].reference].steps.len()];
                    let nodes = values(axis).into_iter().map(|at| Node::own(at, nothing.clone()));
                    Response::smooth(nodes.collect())
                }
                Err(error) => return Err(error),
            };
            surrogate.responses[cluster].of_axis.insert(axis, response);
        }
        if !refused.is_empty() {
            // Whoever interrupts a diagnosis stops the model as given, too.
            let case = &cases[clusters[0].reference];
            model.trace(scene, &case.run, &case.counted)?;
        }
        for (variant, error) in refused {
            variants[variant].refuse();
            surrogate.refused.push(format!("the cause {}: with it, {error}", variants[variant].label()));
        }
        let bench = Bench { model, cases, clusters, variants };
        // A glance takes causes as they begin.
        let give = scene.contact == Contact::Rigid && matches!(candidates, Candidates::All(_));
        surrogate.look_farther(bench, &unknown, used, give, &tell);
        let turns_back = |&axis: &Axis| surrogate.turns_back(axis, &clusters[..used], variants);
        surrogate.even = axes.iter().copied().filter(turns_back).collect();
        surrogate.wavy = axes.into_iter().filter(|&axis| surrogate.is_known_farther(axis, variants)).collect();
        Ok(surrogate)
    }

    /// What a spot does beyond what it does where it is to steps of a cluster's runs that stray east and north, if that was
    /// simulated; and by which part of it one of size `at` does so: a weak one does little wherever it is come upon.
    pub fn elsewhere(&self, cluster: usize, spot: Axis, at: f64) -> Option<(f64, &[Vec<Step>; 2])> {
        let known = self.elsewhere.get(&(cluster, spot))?;
        Some(((at / known.at).abs().min(1.0), &known.changes))
    }

    /// Whether it was simulated of a spot in any cluster.
    pub fn knows_elsewhere(&self, spot: Axis) -> bool {
        self.elsewhere.keys().any(|(_, known)| *known == spot)
    }

    /// Whether a cause does much the same on both sides of 0.
    pub fn is_even(&self, axis: Axis) -> bool {
        self.even.contains(&axis)
    }

    /// Whether a cause does not go on as it begins.
    pub fn is_wavy(&self, axis: Axis) -> bool {
        self.wavy.contains(&axis)
    }

    /// Where a cause that does not go on as it begins was simulated; nowhere of others.
    pub fn waves(&self, axis: Axis) -> Vec<f64> {
        if !self.is_wavy(axis) {
            return Vec::new();
        }
        let mut all: Vec<f64> = self.nodes_along(axis).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// The values of an axis that were simulated in any cluster.
    fn nodes_along(&self, axis: Axis) -> impl Iterator<Item = f64> {
        let of_axis = self.responses.iter().filter_map(move |responses| responses.of_axis.get(&axis));
        of_axis.flat_map(|response| response.simulated.iter().map(|node| node.at))
    }

    /// Whether what a cause moves the robot by, `a x + b x²`, turns back within 1 σ of 0: whether `b σ` is half of `a` or more,
    /// over all that the reference runs pass.
    fn turns_back(&self, axis: Axis, clusters: &[Cluster], variants: &[Variant]) -> bool {
        let variant = &variants[axis.variant];
        let coordinate = variant.coordinates[axis.coordinate];
        if coordinate.one_sided || variant.place().is_some() {
            return false;
        }
        let (mut odd, mut even) = (0.0, 0.0);
        for (index, cluster) in clusters.iter().enumerate() {
            let at = |z: f64| self.path(index, cluster.reference, &[(axis, z * coordinate.std_dev)], variants);
            for ((up, here), down) in at(1.0).iter().zip(&at(0.0)).zip(&at(-1.0)) {
                let moved = |to: &Pose2| [to.x - here.x, to.y - here.y, ARM * (to.heading - here.heading)];
                for (up, down) in moved(up).into_iter().zip(moved(down)) {
                    odd += (up - down).powi(2);
                    even += (up + down).powi(2);
                }
            }
        }
        even > 0.25 * odd
    }

    /// Whether a variant may do anything to a cluster.
    fn concerns(&self, scene: &Scene, cluster: &Cluster, variant: &Variant) -> bool {
        variant.place().is_none_or(|place| spots::touches(scene, &self.ways[cluster.reference], place))
    }

    /// Adds what terms of a formula do along the way of each cluster's reference: those of the body's twist exactly that, a potential
    /// what a robot of such a `weight` \[N\] does on a slope, as steep as it pulls.
    pub fn add_terms(&mut self, clusters: &[Cluster], variants: &[Variant], weight: f64) {
        let slope = variants.iter().position(Variant::is_slope);
        for (cluster, of) in clusters.iter().enumerate() {
            let way = &self.ways[of.reference];
            // What 1 N along x, and along y, adds to each step.
            let pulled = [0, 1].map(|along| {
                let mut change = vec![[0.0; 3]; way.steps.len()];
                if let Some(variant) = slope {
                    let downhill = (Axis { variant, coordinate: along }, 1.0 / weight);
                    self.responses[cluster].add(&[downhill], way, variants, &mut change);
                }
                change
            });
            let motions = way.motions();
            let of_term = |term: EmpiricalTerm| -> Vec<Step> {
                if term.part != TermPart::Potential {
                    return way.empirical(&term);
                }
                let forces = motions.iter().map(|motion| EmpiricalTerm::force(&[term], motion.pose));
                let [x, y] = &pulled;
                forces.zip(x).zip(y).map(|(([fx, fy], x), y)| each(|c| fx * x[c] + fy * y[c])).collect()
            };
            let terms = variants.iter().enumerate().filter_map(|(index, variant)| Some((index, variant.term()?)));
            let changes: Vec<(usize, Vec<Step>)> = terms.map(|(index, term)| (index, of_term(term))).collect();
            for (variant, change) in changes {
                let response = Response::smooth(vec![Node::own(1.0, change)]);
                self.responses[cluster].of_axis.insert(Axis { variant, coordinate: 0 }, response);
            }
        }
    }

    /// Lets what is in doubt of the model do what its effect does.
    pub fn add_doubted(&mut self, variants: &[Variant]) {
        for (index, variant) in variants.iter().enumerate().filter(|(_, variant)| variant.is_doubted()) {
            let alike = |it: &Variant| it.is_cause() && it.effect == variant.effect && it.choice == variant.choice;
            let Some(original) = variants.iter().position(alike) else { continue };
            for responses in &mut self.responses {
                if let Some(response) = responses.of_axis.get(&Axis { variant: original, coordinate: 0 }).cloned() {
                    responses.of_axis.insert(Axis { variant: index, coordinate: 0 }, response);
                }
            }
        }
    }

    /// How the clusters' reference runs move, step by step.
    pub fn motions(&self, clusters: &[Cluster]) -> Vec<Motion> {
        clusters.iter().flat_map(|cluster| self.ways[cluster.reference].motions()).collect()
    }

    /// Whether what is known of an axis was simulated on other ways than these.
    fn is_carried(&self, axis: Axis) -> bool {
        self.responses.iter().any(|responses| responses.of_axis.get(&axis).is_some_and(Response::is_carried))
    }

    /// How far `at` is from the nearest value of `axis` that was simulated. A spot that was come upon on other ways is none,
    /// for what it does changes over a few centimetres, nor one that was come upon in passing.
    pub fn nearest_node(&self, axis: Axis, at: f64, variants: &[Variant]) -> f64 {
        let is_none = |it: &Response| it.is_carried() || it.in_passing;
        let of_axis = |responses: &Responses| responses.of_axis.get(&axis).is_some_and(is_none);
        if variants[axis.variant].place().is_some() && self.responses.iter().any(of_axis) {
            return f64::INFINITY;
        }
        (self.nearest(axis, at) - at).abs()
    }

    /// The value of `axis` nearest to `at` that was simulated, or 0, where nothing changes.
    fn nearest(&self, axis: Axis, at: f64) -> f64 {
        self.nodes_along(axis)
            .fold(0.0, |nearest, node| if (node - at).abs() < (nearest - at).abs() { node } else { nearest })
    }

    /// The way of a run under a hypothesis: its steps' ends in the room, the start first.
    pub fn path(&self, cluster: usize, run: usize, at: &Coordinates, variants: &[Variant]) -> Vec<Pose2> {
        compose(self.ways[run].start, &self.steps(cluster, run, at, variants))
    }

    /// Its steps.
    pub fn steps(&self, cluster: usize, run: usize, at: &Coordinates, variants: &[Variant]) -> Vec<Step> {
        self.steps_along(cluster, &self.ways[run], at, variants)
    }

    /// What a hypothesis changes of the steps of a cluster's run, where that is the same for all of its runs.
    pub fn common_change(
        &self,
        (cluster, run): (usize, usize),
        at: &Coordinates,
        variants: &[Variant],
    ) -> Option<Vec<Step>> {
        let hourly = |(axis, _): &(Axis, f64)| variants[axis.variant].coordinates[axis.coordinate].hourly;
        if at.iter().any(hourly) || errors_of_response(at, variants) != NO_ERRORS {
            return None;
        }
        let way = &self.ways[run];
        let mut change = vec![[0.0; 3]; way.steps.len()];
        self.responses[cluster].add(at, way, variants, &mut change);
        Some(change)
    }

    /// Those of another way of the cluster's kind.
    pub fn steps_along(&self, cluster: usize, way: &Way, at: &Coordinates, variants: &[Variant]) -> Vec<Step> {
        let mut steps = way.steps.clone();
        self.responses[cluster].add(at, way, variants, &mut steps);
        steps
    }

    /// The path of a run under `to`, which moves from `from` along a few axes, where the run's `steps` are known; `None` where it
    /// is the same.
    pub fn path_beyond(
        &self,
        (cluster, run): (usize, usize),
        (from, steps): (&Coordinates, &[Step]),
        to: &Coordinates,
        variants: &[Variant],
    ) -> Option<Vec<Pose2>> {
        let way = &self.ways[run];
        if [from, to].iter().any(|at| errors_of_response(at, variants) != NO_ERRORS) {
            return Some(self.path(cluster, run, to, variants));
        }
        let mut steps = steps.to_vec();
        let moves = self.responses[cluster].add_beyond(from, to, way, variants, &mut steps);
        moves.then(|| compose(way.start, &steps))
    }

    /// Readings of a path, as `survey` reads them.
    pub fn readings(&self, case: &Case, way: &Way, path: &[Pose2], survey: &Survey) -> Vec<Pose2> {
        let at = |stamp: Option<f64>| match stamp {
            None => path[path.len() - 1],
            Some(stamp) => {
                let share = (survey.time_of(stamp) - way.began) / way.lasts;
                way.pose_at(path, share * (path.len() - 1) as f64)
            }
        };
        let frame = case.frame_stamp.map_or(path[0], |stamp| at(Some(stamp)));
        let read = survey.readings_from(frame);
        case.readings.iter().map(|reading| read(at(reading.stamp))).collect()
    }

    /// The survey of a campaign under a hypothesis.
    pub fn survey_in(&self, campaign: usize, scene: &Scene, at: &Coordinates, variants: &[Variant]) -> Survey {
        self.by_clocks_of(campaign, self.survey_of(scene, at, variants), at, variants)
    }

    /// The survey under a hypothesis, by the mean of clocks that are told apart. That the robot turns about another point than the
    /// model's is no matter of the survey, but the same path seen from the robot: as if another point were tracked.
    pub fn survey_of(&self, scene: &Scene, at: &Coordinates, variants: &[Variant]) -> Survey {
        let mut survey = self.survey;
        if at.iter().any(|(axis, _)| variants[axis.variant].effect.is_survey()) {
            let causes: Vec<_> = causes(variants, at).into_iter().filter(|cause| cause.effect.is_survey()).collect();
            let mut light = scene.clone();
            light.survey = self.survey;
            survey = crate::effect::Cause::edit_all(&causes, &light).survey;
        }
        let mut centre = [0.0; 2];
        for (axis, value) in at {
            if let Some(part) = variants[axis.variant].part_of_centre(axis.coordinate) {
                centre[part] = *value;
            }
        }
        if centre != [0.0; 2] {
            let swing = self.swing(at, variants);
            survey.base_from_tracked.x += centre[0] * swing;
            survey.base_from_tracked.y += centre[1] * swing;
        }
        survey
    }

    /// A survey under a hypothesis, by the clocks of one campaign.
    pub fn by_clocks_of(&self, campaign: usize, survey: Survey, at: &Coordinates, variants: &[Variant]) -> Survey {
        let is_own = |axis: &Axis| variants[axis.variant].coordinates[axis.coordinate].clocks_of == Some(campaign);
        let own = at.iter().find(|(axis, _)| is_own(axis));
        own.map_or(survey, |(_, offset)| Survey { time_offset: self.survey.time_offset + offset, ..survey })
    }

    /// All that physical causes move the robot by over all that it turns, beside what a calibration takes back, in the kind of
    /// run that turns most \[m/rad\].
    fn swing(&self, at: &Coordinates, variants: &[Variant]) -> f64 {
        if !at.iter().any(|(axis, _)| variants[axis.variant].is_physical()) {
            return 0.0;
        }
        let (cluster, reference) = self.most_turning;
        let way = &self.ways[reference];
        let steps = self.steps(cluster, reference, at, variants);
        let moved = |(step, given): (&Step, &Step)| length(&each(|c| step[c] - given[c]));
        steps.iter().zip(&way.steps).map(moved).sum::<f64>() / way.turned().max(f64::MIN_POSITIVE)
    }
}
