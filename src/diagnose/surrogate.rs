//! A fast stand-in for the simulator: what each cause does to the way of a run, step by step.
//!
//! The way of a run is a chain of small body-frame steps. A cause changes each step by a polynomial in its coordinate
//! through simulations at a few values (exact there); steps are composed again, so that a heading that was changed early
//! carries what comes later without any linearisation. What two causes do together beyond what each does alone is a product
//! of their sizes, once simulated. Survey effects are applied to the composed way as they are.

use super::case::{Case, Cluster, Condition};
use super::forward::{ForwardError, ForwardModel};
use super::spots;
use super::variant::{Axis, Coordinate, RELATIVE, Variant};
use crate::geometry::{Pose2, Trace};
use crate::scene::{EmpiricalTerm, Feature, Motion, Scene, Survey, TwistPart};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Length of a step of the way \[s\]: short against how long the robot takes to speed up or turn.
const STEP: f64 = 0.1;

/// Arm at which a turn counts as way \[m\].
pub(super) const ARM: f64 = 0.3;

/// A change of one step in the body's frame: x, y \[m\], heading \[rad\].
pub(super) type Step = [f64; 3];

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
    /// One a cluster.
    pub responses: Vec<Responses>,
    /// The cluster whose runs turn the robot most, and the run that stands for it.
    pub most_turning: (usize, usize),
    /// Along which causes do much the same on both sides of 0.
    even: BTreeSet<Axis>,
    /// Change of a cluster's steps where what a variant is of the tyres is 1 σ off, and nothing else.
    on_tyres: BTreeMap<(usize, usize), Vec<Step>>,
}

/// The way of one run as the model as given predicts it.
#[derive(Debug, Clone)]
pub(super) struct Way {
    pub start: Pose2,
    pub steps: Vec<Step>,
    /// When it began and how long it lasts, by the encoders' clock \[s\].
    pub began: f64,
    pub lasts: f64,
    /// Share of an hour per unit of hourly coordinates.
    pub hours: f64,
}

/// What causes do to the steps of a cluster.
#[derive(Debug, Clone, Default)]
pub(super) struct Responses {
    pub of_axis: BTreeMap<Axis, Response>,
    /// By variants: of causes the lesser first, of a cause and what is in doubt of tyres the cause.
    of_pair: BTreeMap<[usize; 2], Interplay>,
}

/// What two variants do together beyond what each does alone.
#[derive(Debug, Clone)]
struct Interplay {
    /// Coordinates of both where it was simulated.
    at: [Vec<f64>; 2],
    change: Vec<Step>,
}

/// How much of what `variant` is at `reference` it is at `at`: along that direction.
fn share_of(at: &Coordinates, variant: usize, reference: &[f64]) -> f64 {
    let along = at.iter().filter(|(axis, _)| axis.variant == variant);
    let along: f64 = along.map(|(axis, value)| value * reference[axis.coordinate]).sum();
    along / reference.iter().map(|value| value * value).sum::<f64>()
}

impl Interplay {
    /// How much of it there is at `at` between both of `pair`.
    fn share(&self, [one, other]: [usize; 2], at: &Coordinates) -> f64 {
        share_of(at, one, &self.at[0]) * share_of(at, other, &self.at[1])
    }
}

/// A coordinate, and what the simulator says that it changes.
type Node = (f64, Vec<Step>);

/// Change of the steps over one coordinate: through 0 at 0 and through what was simulated at each node.
#[derive(Debug, Clone)]
pub(super) struct Response {
    /// Coordinate and change of what was simulated.
    simulated: Vec<Node>,
    between: Between,
    /// Whether it was simulated on another way of its kind.
    carried: bool,
}

/// What is taken to happen between nodes.
#[derive(Debug, Clone)]
enum Between {
    /// A polynomial: Newton's divided differences, one a node.
    Smooth(Vec<Vec<Step>>),
    /// Straight lines, level beyond the ends: below a grip at which wheels cannot turn the robot, all is otherwise.
    Straight,
}

impl Response {
    /// Of a variant.
    fn of(variant: &Variant, simulated: Vec<Node>) -> Response {
        if variant.place().is_some() { Response::straight(simulated) } else { Response::smooth(simulated) }
    }

    fn smooth(simulated: Vec<Node>) -> Response {
        // Divided differences of the table (0, 0), (node, change), …
        let at: Vec<f64> = std::iter::once(0.0).chain(simulated.iter().map(|(node, _)| *node)).collect();
        let mut column: Vec<Vec<Step>> = vec![vec![[0.0; 3]; simulated[0].1.len()]];
        column.extend(simulated.iter().map(|(_, change)| change.clone()));
        let mut differences = Vec::new();
        for order in 1..at.len() {
            column = (0..column.len() - 1)
                .map(|i| {
                    let span = at[i + order] - at[i];
                    column[i].iter().zip(&column[i + 1]).map(|(a, b)| each(|c| (b[c] - a[c]) / span)).collect()
                })
                .collect();
            differences.push(column[0].clone());
        }
        Response { simulated, between: Between::Smooth(differences), carried: false }
    }

    fn straight(mut simulated: Vec<Node>) -> Response {
        simulated.sort_by(|a, b| a.0.total_cmp(&b.0));
        Response { simulated, between: Between::Straight, carried: false }
    }

    /// Adds the change at coordinate `x`, so many times, to `steps`.
    fn add(&self, x: f64, times: f64, steps: &mut [Step]) {
        let mut add = |factor: f64, changes: &[Step]| add_times(times * factor, changes, steps);
        match &self.between {
            Between::Smooth(differences) => {
                let mut factor = x;
                for (order, difference) in differences.iter().enumerate() {
                    if order > 0 {
                        factor *= x - self.simulated[order - 1].0;
                    }
                    add(factor, difference);
                }
            }
            Between::Straight => {
                // Nothing changes at 0, which is a node as well.
                let (mut low, mut high): (Option<&Node>, Option<&Node>) = (None, None);
                for node in &self.simulated {
                    if node.0 <= x {
                        low = Some(node);
                    } else if high.is_none() {
                        high = Some(node);
                    }
                }
                match (low.filter(|low| x < 0.0 || low.0 > 0.0), high.filter(|high| x >= 0.0 || high.0 < 0.0)) {
                    (Some(low), Some(high)) => {
                        let part = (x - low.0) / (high.0 - low.0);
                        add(1.0 - part, &low.1);
                        add(part, &high.1);
                    }
                    // Level beyond the last, to 0 before the first.
                    (Some(last), None) if x > 0.0 => add(1.0, &last.1),
                    (None, Some(last)) if x < 0.0 => add(1.0, &last.1),
                    (Some(first), None) | (None, Some(first)) => add(x / first.0, &first.1),
                    // Where only less was simulated, more does the opposite, and the other way round.
                    (None, None) => {
                        if let Some(nearest) = if x >= 0.0 { self.simulated.last() } else { self.simulated.first() } {
                            add(x / nearest.0, &nearest.1);
                        }
                    }
                }
            }
        }
    }
}

impl Responses {
    /// Adds the changes under a hypothesis to the steps of `way`, each component by what responses are taken to err by there.
    pub fn add(&self, at: &Coordinates, way: &Way, variants: &[Variant], steps: &mut [Step]) {
        let errors = errors_of_response(at, variants);
        if errors == NO_ERRORS {
            return self.add_exact(at, way, variants, steps);
        }
        let mut changes = vec![[0.0; 3]; steps.len()];
        self.add_exact(at, way, variants, &mut changes);
        for ((step, change), given) in steps.iter_mut().zip(&changes).zip(&way.steps) {
            let turn = ARM * given[2].abs();
            let turning = turn / (turn + given[0].hypot(given[1])).max(f64::MIN_POSITIVE);
            for c in 0..3 {
                step[c] += change[c] * (1.0 + (1.0 - turning) * errors[c] + turning * errors[3 + c]);
            }
        }
    }

    /// Adds the changes under a hypothesis to the steps of `way` as they were simulated.
    fn add_exact(&self, at: &Coordinates, way: &Way, variants: &[Variant], steps: &mut [Step]) {
        for (axis, value) in at {
            if let Some(response) = self.of_axis.get(axis) {
                response.add(way.along(axis, *value, variants), 1.0, steps);
            }
        }
        for (pair, interplay) in &self.of_pair {
            add_times(interplay.share(*pair, at), &interplay.change, steps);
        }
    }

    /// Adds what `to` changes beyond `from` of the same axes and more; whether that is anything.
    fn add_beyond(
        &self,
        from: &Coordinates,
        to: &Coordinates,
        way: &Way,
        variants: &[Variant],
        steps: &mut [Step],
    ) -> bool {
        let mut moved = false;
        for (axis, value) in to {
            let before = from.iter().find(|(known, _)| known == axis).map_or(0.0, |(_, value)| *value);
            if let Some(response) = self.of_axis.get(axis).filter(|_| before != *value) {
                response.add(way.along(axis, *value, variants), 1.0, steps);
                response.add(way.along(axis, before, variants), -1.0, steps);
                moved = true;
            }
        }
        for (pair, interplay) in &self.of_pair {
            let beyond = interplay.share(*pair, to) - interplay.share(*pair, from);
            add_times(beyond, &interplay.change, steps);
            moved |= beyond != 0.0;
        }
        moved
    }
}

const NO_ERRORS: [f64; RELATIVE] = [0.0; RELATIVE];

/// What responses are taken to err by in each component, relative.
fn errors_of_response(at: &Coordinates, variants: &[Variant]) -> [f64; RELATIVE] {
    let is_error = |axis: &Axis| variants[axis.variant].is_error_of_response(axis.coordinate);
    let mut errors = NO_ERRORS;
    for (axis, value) in at.iter().filter(|(axis, _)| is_error(axis)) {
        errors[axis.coordinate] = *value;
    }
    errors
}

/// Adds `changes`, so many times, to `steps`.
fn add_times(times: f64, changes: &[Step], steps: &mut [Step]) {
    if times == 0.0 {
        return;
    }
    for (step, change) in steps.iter_mut().zip(changes) {
        for c in 0..3 {
            step[c] += times * change[c];
        }
    }
}

/// Length of a step, its turn counted at an arm \[m\].
fn length(step: &Step) -> f64 {
    step[0].hypot(step[1]).hypot(ARM * step[2])
}

fn each(value: impl Fn(usize) -> f64) -> Step {
    std::array::from_fn(value)
}

fn subtract(changes: &mut [Step], others: &[Step]) {
    for (change, other) in changes.iter_mut().zip(others) {
        *change = each(|c| change[c] - other[c]);
    }
}

/// Coordinates of a hypothesis: a value for each axis that it moves along.
pub(super) type Coordinates = [(Axis, f64)];

impl Surrogate {
    /// Simulates every run of `cases` as given, and every cluster under every variant; to `variants` come spots on the floor,
    /// which need ways first: those of the first clusters, so many as are the `campaign`'s.
    pub fn new(
        model: &dyn ForwardModel,
        cases: &[Case],
        clusters: &[Cluster],
        campaign: usize,
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
        let unknown = known.iter().filter(|entry| entry.is_none()).count();
        let first: usize = axes(variants, cases).into_iter().map(|axis| simulations(variants, axis)).sum();
        let total = AtomicUsize::new(jobs.len() + unknown * first);
        let done = AtomicUsize::new(0);
        let tick = || progress(done.fetch_add(1, Relaxed) + 1, total.load(Relaxed));

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
            Candidates::All(Some(library)) if unknown == 0 => library.places.clone(),
            Candidates::All(_) => spots::places(scene, cases, &clusters[..campaign], &ways),
        };
        variants.extend(places.into_iter().map(Variant::spot));
        let most_turning = clusters[..campaign]
            .iter()
            .map(|cluster| cluster.reference)
            .enumerate()
            .max_by(|(_, a), (_, b)| ways[*a].turned().total_cmp(&ways[*b].turned()))
            .expect("a study has runs");
        let responses = vec![Responses::default(); clusters.len()];
        let (even, on_tyres) = (BTreeSet::new(), BTreeMap::new());
        let mut surrogate = Surrogate { survey: scene.survey, responses, ways, most_turning, even, on_tyres };
        let axes = axes(variants, cases);
        let to_simulate: Vec<(usize, Axis)> = (0..clusters.len())
            .filter(|&cluster| known[cluster].is_none())
            .flat_map(|cluster| axes.iter().map(move |&axis| (cluster, axis)))
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
        let responses: Vec<Response> = to_simulate
            .par_iter()
            .map(|&(cluster, axis)| {
                let coordinate = variants[axis.variant].coordinates[axis.coordinate];
                let nodes = nodes(&variants[axis.variant], coordinate).into_iter().map(|at| {
                    let change = surrogate.simulated_change(bench, &clusters[cluster], &[(axis, at)]);
                    tick();
                    change.map(|change| (at, change))
                });
                Ok(Response::of(&variants[axis.variant], nodes.collect::<Result<_, ForwardError>>()?))
            })
            .collect::<Result<_, ForwardError>>()?;
        for ((cluster, axis), response) in to_simulate.into_iter().zip(responses) {
            surrogate.responses[cluster].of_axis.insert(axis, response);
        }
        let campaign = &clusters[..campaign];
        surrogate.even = axes.into_iter().filter(|&axis| surrogate.turns_back(axis, campaign, variants)).collect();
        Ok(surrogate)
    }

    /// Whether a cause does much the same on both sides of 0.
    pub fn is_even(&self, axis: Axis) -> bool {
        self.even.contains(&axis)
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

    /// Simulates one more spot, at its prior's mean and at what it, or a spot beside it, is best at.
    pub fn add_spot(&mut self, bench: Bench<'_>, axis: Axis, at: f64) -> Result<(), ForwardError> {
        let variant = &bench.variants[axis.variant];
        let coordinate = variant.coordinates[axis.coordinate];
        let mut values = nodes(variant, coordinate);
        if values.iter().chain([&0.0]).all(|node| (node - at).abs() > SAME * coordinate.std_dev) {
            values.push(at);
        }
        let concerned: Vec<usize> = (0..bench.clusters.len())
            .filter(|&cluster| self.concerns(bench.model.scene(), &bench.clusters[cluster], variant))
            .collect();
        let simulated = self.simulate(bench, &concerned, axis, &values)?;
        // What was carried over goes, also where the spot is not come upon.
        self.responses.iter_mut().for_each(|responses| drop(responses.of_axis.remove(&axis)));
        for (cluster, simulated) in simulated {
            self.responses[cluster].of_axis.insert(axis, Response::of(variant, simulated));
        }
        Ok(())
    }

    /// Makes the stand-in exact at one value of one axis, in every cluster; a spot, at all that it may be.
    pub fn refine(&mut self, bench: Bench<'_>, axis: Axis, at: f64) -> Result<(), ForwardError> {
        let variant = &bench.variants[axis.variant];
        let is_spot = variant.place().is_some();
        if is_spot && self.is_carried(axis) {
            self.add_spot(bench, axis, at)?;
        }
        let concerned: Vec<usize> =
            (0..bench.clusters.len()).filter(|&cluster| self.responses[cluster].of_axis.contains_key(&axis)).collect();
        let mut values = vec![at];
        if is_spot {
            let coordinate = variant.coordinates[axis.coordinate];
            values.extend(SPOT_GRID.map(|z| coordinate.within(coordinate.mean + z * coordinate.std_dev)));
            values.retain(|&value| self.nearest_node(axis, value, bench.variants) > SAME * coordinate.std_dev);
        }
        for (cluster, added) in self.simulate(bench, &concerned, axis, &values)? {
            let response = self.responses[cluster].of_axis.get_mut(&axis).expect("it is concerned");
            // What a term was taken to do before it was simulated is no simulation.
            let mut simulated = if variant.is_term() { Vec::new() } else { response.simulated.clone() };
            if !is_spot {
                // A polynomial through neighbours that were simulated on other ways would swing between them.
                let apart = CLOSE * variant.coordinates[axis.coordinate].std_dev;
                simulated.retain(|(node, _)| (node - at).abs() > apart);
            }
            simulated.extend(added);
            *response = Response { carried: response.carried, ..Response::of(variant, simulated) };
        }
        Ok(())
    }

    /// What `values` of one axis change in some clusters.
    fn simulate(
        &self,
        bench: Bench<'_>,
        clusters: &[usize],
        axis: Axis,
        values: &[f64],
    ) -> Result<Vec<(usize, Vec<Node>)>, ForwardError> {
        let one = |&cluster: &usize| {
            let simulated = values
                .par_iter()
                .map(|&value| Ok((value, self.simulated_change(bench, &bench.clusters[cluster], &[(axis, value)])?)))
                .collect::<Result<_, ForwardError>>()?;
            Ok((cluster, simulated))
        };
        clusters.par_iter().map(one).collect()
    }

    /// Whether what is known of an axis was simulated on other ways than these.
    fn is_carried(&self, axis: Axis) -> bool {
        self.responses.iter().any(|responses| responses.of_axis.get(&axis).is_some_and(|it| it.carried))
    }

    /// Simulates what pairs of causes of one answer do together, where that is not known nearby; whether anything was.
    pub fn couple(&mut self, bench: Bench<'_>, at: &Coordinates) -> Result<bool, ForwardError> {
        let causes = at_work(bench.variants, at);
        let mut wanted: Vec<(usize, [usize; 2])> = Vec::new();
        for (index, responses) in self.responses.iter().enumerate() {
            let concerned: Vec<usize> = causes
                .iter()
                .filter(|(_, at)| at.iter().any(|(axis, _)| responses.of_axis.contains_key(axis)))
                .map(|(&variant, _)| variant)
                .collect();
            for (position, &one) in concerned.iter().enumerate() {
                for &other in &concerned[position + 1..] {
                    let is_near = |known: &Interplay| (known.share([one, other], at) - 1.0).abs() < NEAR_BY;
                    if !responses.of_pair.get(&[one, other]).is_some_and(is_near) {
                        wanted.push((index, [one, other]));
                    }
                }
            }
        }
        let together = |&(cluster, pair): &(usize, [usize; 2])| {
            let both: Vec<(Axis, f64)> = pair.iter().flat_map(|variant| causes[variant].iter().copied()).collect();
            let at = pair.map(|variant| causes[&variant].iter().map(|(_, value)| *value).collect());
            Ok((cluster, pair, Interplay { at, change: self.beyond_each(bench, cluster, &both)? }))
        };
        let simulated = wanted.par_iter().map(together).collect::<Result<_, ForwardError>>()?;
        Ok(self.keep_together(simulated))
    }

    /// Simulates what causes of an answer do where tyres are 1 σ off in what is in doubt of them, where that is not known
    /// nearby; whether anything was.
    pub fn couple_with_tyres(&mut self, bench: Bench<'_>, at: &Coordinates) -> Result<bool, ForwardError> {
        let in_doubt = bench.variants.iter().enumerate().filter(|(_, variant)| variant.tyre_part().is_some());
        let in_doubt: Vec<(Axis, f64)> =
            in_doubt.map(|(variant, it)| (Axis { variant, coordinate: 0 }, it.coordinates[0].std_dev)).collect();
        let causes = at_work(bench.variants, at);
        let mut wanted: Vec<(usize, usize, (Axis, f64))> = Vec::new();
        for (cluster, responses) in self.responses.iter().enumerate() {
            for (&cause, there) in
                causes.iter().filter(|(_, at)| at.iter().any(|(a, _)| responses.of_axis.contains_key(a)))
            {
                let is_near = |known: &Interplay| (share_of(there, cause, &known.at[0]) - 1.0).abs() < NEAR_BY_ON_TYRES;
                let unknown = in_doubt
                    .iter()
                    .filter(|(tyres, _)| !responses.of_pair.get(&[cause, tyres.variant]).is_some_and(is_near));
                wanted.extend(unknown.map(|&tyres| (cluster, cause, tyres)));
            }
        }
        let mut alone: Vec<(usize, (Axis, f64))> = wanted.iter().map(|&(cluster, _, tyres)| (cluster, tyres)).collect();
        alone.retain(|(cluster, (tyres, _))| !self.on_tyres.contains_key(&(*cluster, tyres.variant)));
        alone.sort_by_key(|(cluster, (tyres, _))| (*cluster, *tyres));
        alone.dedup();
        let simulated: Vec<_> = alone
            .par_iter()
            .map(|&(cluster, tyres)| {
                let change = self.simulated_change(bench, &bench.clusters[cluster], &[tyres])?;
                Ok(((cluster, tyres.0.variant), change))
            })
            .collect::<Result<_, ForwardError>>()?;
        self.on_tyres.extend(simulated);
        let together = |&(cluster, cause, (tyres, value)): &(usize, usize, (Axis, f64))| {
            let there = &causes[&cause];
            let mut change = self.beyond_each(bench, cluster, &[there.as_slice(), &[(tyres, value)]].concat())?;
            // What tyres do alone is in the model as it was fitted.
            subtract(&mut change, &self.on_tyres[&(cluster, tyres.variant)]);
            let at = [there.iter().map(|(_, value)| *value).collect(), vec![value]];
            Ok((cluster, [cause, tyres.variant], Interplay { at, change }))
        };
        let simulated = wanted.par_iter().map(together).collect::<Result<_, ForwardError>>()?;
        Ok(self.keep_together(simulated))
    }

    /// Keeps what pairs do together in clusters; whether there is any.
    fn keep_together(&mut self, simulated: Vec<(usize, [usize; 2], Interplay)>) -> bool {
        let any = !simulated.is_empty();
        for (cluster, pair, interplay) in simulated {
            self.responses[cluster].of_pair.insert(pair, interplay);
        }
        any
    }

    /// What the simulator says that a hypothesis changes in a cluster beyond what is known of each of its axes.
    fn beyond_each(&self, bench: Bench<'_>, cluster: usize, at: &Coordinates) -> Result<Vec<Step>, ForwardError> {
        let mut change = self.simulated_change(bench, &bench.clusters[cluster], at)?;
        for (axis, value) in at {
            if let Some(response) = self.responses[cluster].of_axis.get(axis) {
                let mut alone = vec![[0.0; 3]; change.len()];
                response.add(*value, 1.0, &mut alone);
                subtract(&mut change, &alone);
            }
        }
        Ok(change)
    }

    /// What the simulator says that a hypothesis changes in the steps of a cluster's reference run.
    fn simulated_change(
        &self,
        bench: Bench<'_>,
        cluster: &Cluster,
        at: &Coordinates,
    ) -> Result<Vec<Step>, ForwardError> {
        let Bench { model, cases, variants, .. } = bench;
        let case = &cases[cluster.reference];
        let way = &self.ways[cluster.reference];
        let scene = edited(model.scene(), variants, at);
        let mut run = case.run.clone();
        if at.iter().any(|(axis, _)| variants[axis.variant].coordinates[axis.coordinate].hourly) {
            // Stated an hour: what it does after one.
            run.started = Some(run.started.unwrap_or(0.0) + 3600.0);
        }
        let trace = model.trace(&scene, &run, &case.counted)?;
        let edited = Way::of(&trace, way.steps.len(), case.replayed, 0.0);
        Ok(edited.steps.iter().zip(&way.steps).map(|(a, b)| each(|c| a[c] - b[c])).collect())
    }

    /// Adds what terms of the body's twist do: exactly their formula, along the way of each cluster's reference.
    pub fn add_terms(&mut self, clusters: &[Cluster], variants: &[Variant]) {
        for (index, variant) in variants.iter().enumerate() {
            let Some(term) = variant.term() else { continue };
            let axis = Axis { variant: index, coordinate: 0 };
            for (responses, cluster) in self.responses.iter_mut().zip(clusters) {
                let change = self.ways[cluster.reference].empirical(&term);
                responses.of_axis.insert(axis, Response::smooth(vec![(1.0, change)]));
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

    /// Root mean squares over all ways of each feature, and of the forward speed.
    pub fn sizes(&self, clusters: &[Cluster]) -> (Vec<(Feature, f64)>, f64) {
        let mean_square = |part: TwistPart, feature: Feature| {
            let (mut sum, mut count) = (0.0, 0.0);
            for cluster in clusters {
                let way = &self.ways[cluster.reference];
                let dt = way.lasts / way.steps.len() as f64;
                let c = TwistPart::ALL.iter().position(|it| *it == part).expect("one of them");
                for step in way.empirical(&EmpiricalTerm { part, feature, coefficient: 1.0 }) {
                    sum += (step[c] / dt).powi(2);
                    count += 1.0;
                }
            }
            (sum / f64::max(count, 1.0)).sqrt()
        };
        let features = Feature::ALL.map(|feature| (feature, mean_square(TwistPart::Forward, feature)));
        (features.to_vec(), mean_square(TwistPart::Forward, Feature::Speed))
    }

    /// How far `at` is from the nearest value of `axis` that was simulated. A spot that was come upon on other ways is none:
    /// what it does changes over a decimetre.
    pub fn nearest_node(&self, axis: Axis, at: f64, variants: &[Variant]) -> f64 {
        if variants[axis.variant].place().is_some() && self.is_carried(axis) {
            return f64::INFINITY;
        }
        let nodes = self.responses.iter().filter_map(|responses| responses.of_axis.get(&axis));
        nodes
            .flat_map(|response| response.simulated.iter().map(|(node, _)| *node).chain([0.0]))
            .map(|node| (node - at).abs())
            .fold(f64::INFINITY, f64::min)
    }

    /// The way of a run under a hypothesis: its steps' ends in the room, the start first.
    pub fn path(&self, cluster: usize, run: usize, at: &Coordinates, variants: &[Variant]) -> Vec<Pose2> {
        compose(self.ways[run].start, &self.steps(cluster, run, at, variants))
    }

    /// Its steps.
    pub fn steps(&self, cluster: usize, run: usize, at: &Coordinates, variants: &[Variant]) -> Vec<Step> {
        let way = &self.ways[run];
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
                let steps = path.len() - 1;
                let place = ((survey.time_of(stamp) - way.began) / way.lasts).clamp(0.0, 1.0) * steps as f64;
                let before = (place as usize).min(steps - 1);
                within(path, before, place - before as f64)
            }
        };
        let frame = case.frame_stamp.map_or(path[0], |stamp| at(Some(stamp)));
        case.readings.iter().map(|reading| survey.reading(frame, at(reading.stamp))).collect()
    }

    /// The survey under a hypothesis. That the robot turns about another point than the model's is no matter of the survey,
    /// but the same path seen from the robot: as if another point were tracked.
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

/// Responses of a robot in conditions that were simulated before: what causes do to one run they do to the next of its
/// kind, place by place along the way.
#[derive(Debug, Clone, Default)]
pub struct Library {
    /// Of the spots on the floor, in the order of their variants.
    places: Vec<[f64; 2]>,
    entries: Vec<Entry>,
}

#[derive(Debug, Clone)]
struct Entry {
    condition: Condition,
    /// Time that its log takes \[s\]; `None` without a log. A log with other stops in it is another manoeuvre.
    duration: Option<f64>,
    /// Progress at the end of each step.
    progress: Vec<f64>,
    responses: Responses,
}

impl Library {
    /// What a surrogate simulated.
    pub(super) fn of_surrogate(
        surrogate: &Surrogate,
        variants: &[Variant],
        cases: &[Case],
        clusters: &[Cluster],
    ) -> Library {
        let entry = |(cluster, responses): (&Cluster, &Responses)| Entry {
            condition: Condition::of(&cases[cluster.reference].run),
            duration: duration(&cases[cluster.reference]),
            progress: surrogate.ways[cluster.reference].progress(),
            responses: responses.clone(),
        };
        let places = variants.iter().filter_map(Variant::place).collect();
        Library { places, entries: clusters.iter().zip(&surrogate.responses).map(entry).collect() }
    }

    fn of(&self, case: &Case) -> Option<&Entry> {
        let condition = Condition::of(&case.run);
        let alike = |known: Option<f64>| match (known, duration(case)) {
            (Some(known), Some(own)) => (known - own).abs() < 0.02 * own,
            (known, own) => known.is_none() && own.is_none(),
        };
        self.entries.iter().find(|entry| entry.condition == condition && alike(entry.duration))
    }
}

fn duration(case: &Case) -> Option<f64> {
    case.replayed.then(|| case.duration())
}

impl Entry {
    /// The responses, carried over to the steps of another way by its progress.
    fn along(&self, way: &Way) -> Responses {
        let wanted = way.progress();
        let carry = |changes: &[Step]| -> Vec<Step> {
            let sum_at = |place: f64, sums: &[Step]| -> Step {
                let after = self.progress.partition_point(|&p| p < place).min(self.progress.len() - 1);
                let (p0, s0) = if after == 0 { (0.0, [0.0; 3]) } else { (self.progress[after - 1], sums[after - 1]) };
                let (p1, s1) = (self.progress[after], sums[after]);
                let part = if p1 > p0 { ((place - p0) / (p1 - p0)).clamp(0.0, 1.0) } else { 1.0 };
                each(|c| s0[c] + part * (s1[c] - s0[c]))
            };
            let mut sums = Vec::with_capacity(changes.len());
            let mut sum = [0.0; 3];
            for change in changes {
                sum = each(|c| sum[c] + change[c]);
                sums.push(sum);
            }
            let mut before = [0.0; 3];
            let last = wanted.len() - 1;
            wanted
                .iter()
                .enumerate()
                .map(|(k, &place)| {
                    let now = if k == last { sum } else { sum_at(place, &sums) };
                    let change = each(|c| now[c] - before[c]);
                    before = now;
                    change
                })
                .collect()
        };
        let of_axis = self.responses.of_axis.iter().map(|(axis, response)| {
            let simulated = response.simulated.iter().map(|(node, changes)| (*node, carry(changes))).collect();
            let along = match response.between {
                Between::Smooth(_) => Response::smooth(simulated),
                Between::Straight => Response::straight(simulated),
            };
            (*axis, Response { carried: true, ..along })
        });
        Responses { of_axis: of_axis.collect(), of_pair: BTreeMap::new() }
    }
}

/// Values of a coordinate that are simulated first. Of spots on the floor there are many: what is plausible, and one below
/// the grip at which a robot no longer turns as it is told, have to do until a spot is a leading answer.
fn nodes(variant: &Variant, coordinate: Coordinate) -> Vec<f64> {
    if variant.place().is_some() {
        [0.0, -1.0].map(|z| coordinate.within(coordinate.mean + z * coordinate.std_dev)).to_vec()
    } else if coordinate.one_sided {
        vec![coordinate.std_dev, 2.0 * coordinate.std_dev]
    } else {
        vec![-coordinate.std_dev, coordinate.std_dev]
    }
}

/// Products of two causes' sizes that are nearer than this to what was simulated need no other, relative.
const NEAR_BY: f64 = 0.15;
/// The same of a cause on tyres that are in doubt: how much of it hangs on them changes little with its size.
const NEAR_BY_ON_TYRES: f64 = 0.5;
/// Nodes of a polynomial that are nearer than this to a new one make room for it \[σ\].
const CLOSE: f64 = 0.5;
/// Values nearer than this to one another need not both be simulated \[σ\].
const SAME: f64 = 0.1;
/// Values at which a leading spot is simulated besides, in σ about its mean.
const SPOT_GRID: [f64; 8] = [1.0, 0.5, -0.25, -0.5, -0.75, -1.5, -2.0, -2.5];

/// Simulations of a cluster that a coordinate takes at first.
fn simulations(variants: &[Variant], axis: Axis) -> usize {
    let variant = &variants[axis.variant];
    nodes(variant, variant.coordinates[axis.coordinate]).len()
}

/// The coordinates that have to be simulated: not those of the survey, and not what a replay cannot show.
fn axes(variants: &[Variant], cases: &[Case]) -> Vec<Axis> {
    let all_replayed = cases.iter().all(|case| case.replayed);
    variants
        .iter()
        .enumerate()
        .filter(|(_, variant)| !variant.effect.is_survey() && !variant.is_term())
        // Logged stamps are not late: a replay does not depend on when the controller got its counts.
        .filter(|(_, variant)| !(all_replayed && variant.effect.id == "encoder_latency"))
        .flat_map(|(index, variant)| {
            (0..variant.coordinates.len()).map(move |coordinate| Axis { variant: index, coordinate })
        })
        .collect()
}

/// Coordinates of the physical causes of a hypothesis that do something, by variant.
fn at_work(variants: &[Variant], at: &Coordinates) -> BTreeMap<usize, Vec<(Axis, f64)>> {
    let mut causes: BTreeMap<usize, Vec<(Axis, f64)>> = BTreeMap::new();
    for &(axis, value) in at {
        let variant = &variants[axis.variant];
        if variant.is_physical() && !variant.coordinates[axis.coordinate].hourly {
            causes.entry(axis.variant).or_default().push((axis, value));
        }
    }
    let is_something =
        |(axis, value): &(Axis, f64)| value.abs() > SAME * variants[axis.variant].coordinates[axis.coordinate].std_dev;
    causes.retain(|_, at| at.iter().any(is_something));
    causes
}

/// The causes at a hypothesis' coordinates, in the order of their variants.
pub(super) fn causes(variants: &[Variant], at: &Coordinates) -> Vec<crate::effect::Cause> {
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
    let mut edited = crate::effect::Cause::edit_all(&causes(variants, at), scene);
    edited.empirical.extend(terms(variants, at));
    for (axis, value) in at {
        if let Some(part) = variants[axis.variant].tyre_part() {
            part.edit(&mut edited, *value);
        }
    }
    edited
}

/// The pose a `part` of step `k` after its beginning: a cubic through its ends with the speeds of its neighbours, exact
/// while the robot speeds up or slows down steadily.
fn within(path: &[Pose2], k: usize, part: f64) -> Pose2 {
    let step = |k: usize| path[k].relative(path[k + 1]);
    let (here, before) = (step(k), step(k.saturating_sub(1)));
    let after = step((k + 1).min(path.len() - 2));
    let between = |before: f64, here: f64, after: f64| {
        let (first, last) = (0.5 * (before + here), 0.5 * (here + after));
        let (p, p2, p3) = (part, part * part, part * part * part);
        here * (3.0 * p2 - 2.0 * p3) + first * (p3 - 2.0 * p2 + p) + last * (p3 - p2)
    };
    path[k].compose(Pose2::new(
        between(before.x, here.x, after.x),
        between(before.y, here.y, after.y),
        between(before.heading, here.heading, after.heading),
    ))
}

/// Ends of the steps, the start first.
pub(super) fn compose(start: Pose2, steps: &[Step]) -> Vec<Pose2> {
    let mut path = Vec::with_capacity(steps.len() + 1);
    let mut pose = start;
    path.push(pose);
    let (mut sin, mut cos) = start.heading.sin_cos();
    for &[dx, dy, turn] in steps {
        pose = Pose2::new(pose.x + cos * dx - sin * dy, pose.y + sin * dx + cos * dy, pose.heading + turn);
        path.push(pose);
        // A step turns little: the direction is turned on, by series that are exact to 1e-12 below 0.15 rad.
        (sin, cos) = if turn.abs() < 0.15 {
            let t2 = turn * turn;
            let s = turn * (1.0 - t2 / 6.0 * (1.0 - t2 / 20.0 * (1.0 - t2 / 42.0)));
            let c = 1.0 - t2 / 2.0 * (1.0 - t2 / 12.0 * (1.0 - t2 / 30.0 * (1.0 - t2 / 56.0)));
            (sin * c + cos * s, cos * c - sin * s)
        } else {
            pose.heading.sin_cos()
        };
    }
    path
}

fn lasts(trace: &Trace) -> f64 {
    trace.time[trace.time.len() - 1] - trace.time[0]
}

/// Steps that a way of this duration \[s\] is cut into.
fn count_of(duration: f64) -> usize {
    ((duration / STEP).ceil() as usize).max(4)
}

/// Steps that the way of a trace is cut into.
pub(super) fn steps_of(trace: &Trace) -> usize {
    count_of(lasts(trace))
}

impl Way {
    /// Where a run of this way is along an axis: what grows by the hour, as far as it had grown.
    fn along(&self, axis: &Axis, value: f64, variants: &[Variant]) -> f64 {
        if variants[axis.variant].coordinates[axis.coordinate].hourly { value * self.hours } else { value }
    }

    /// A trace cut into `count` steps: of equal time for a replay, whose times are the log's; else of equal progress, so
    /// that a robot that stands longer somewhere is still compared where it is.
    pub fn of(trace: &Trace, count: usize, replayed: bool, hours: f64) -> Way {
        let (began, lasts) = (trace.time[0], lasts(trace));
        let poses: Vec<Pose2> = if replayed {
            (0..=count).map(|k| trace.at(began + lasts * k as f64 / count as f64)).collect()
        } else {
            by_progress(trace, count)
        };
        let steps = poses
            .windows(2)
            .map(|pair| {
                let step = pair[0].relative(pair[1]);
                [step.x, step.y, step.heading]
            })
            .collect();
        Way { start: poses[0], steps, began, lasts, hours }
    }

    /// The way of a run whose counts hardly differ from those of `reference`, whose way this is: the difference of their
    /// dead reckoning is added step by step, turned as much as the reference turned for its own.
    fn beside(&self, reference: &Case, case: &Case) -> Way {
        let count = self.steps.len();
        let (own, other) = (reference.reckoned(count), case.reckoned(count));
        let turned = self.turned();
        let reckoned: f64 = own.windows(2).map(|pair| (pair[1].heading - pair[0].heading).abs()).sum();
        let share = if reckoned > 0.1 { turned / reckoned } else { 1.0 };
        let steps = self
            .steps
            .iter()
            .zip(own.windows(2).zip(other.windows(2)))
            .map(|(step, (own, other))| {
                let (own, other) = (own[0].relative(own[1]), other[0].relative(other[1]));
                [step[0] + other.x - own.x, step[1] + other.y - own.y, step[2] + share * (other.heading - own.heading)]
            })
            .collect();
        let began = case.run.encoders.as_ref().map_or(self.began, |log| log.time[0]);
        let start = case.run.start.unwrap_or_default();
        Way { start, steps, began, lasts: case.duration(), hours: case.hours }
    }

    /// All that it turns, either way round \[rad\].
    pub fn turned(&self) -> f64 {
        self.steps.iter().map(|step| step[2].abs()).sum()
    }

    /// Progress at the end of each step, 1 at the end of the way.
    fn progress(&self) -> Vec<f64> {
        let mut sum = 0.0;
        let mut progress: Vec<f64> = self
            .steps
            .iter()
            .map(|step| {
                sum += step[0].hypot(step[1]) + ARM * step[2].abs();
                sum
            })
            .collect();
        progress.iter_mut().for_each(|p| *p /= sum.max(1e-9));
        progress
    }

    /// Shares of the way that are behind the robot at `times` of the encoders' clock \[s\].
    pub fn shares_at(&self, times: impl Iterator<Item = f64>) -> Vec<f64> {
        let progress = self.progress();
        let share = |time: f64| {
            let place = ((time - self.began) / self.lasts).clamp(0.0, 1.0) * progress.len() as f64;
            let step = (place as usize).min(progress.len() - 1);
            let before = if step == 0 { 0.0 } else { progress[step - 1] };
            before + (place - step as f64) * (progress[step] - before)
        };
        times.map(share).collect()
    }

    /// When so much of the way was first behind the robot, by the encoders' clock \[s\].
    pub fn times_of(&self, shares: impl Iterator<Item = f64>) -> Vec<f64> {
        let progress = self.progress();
        let time = |share: f64| {
            let step = progress.partition_point(|&behind| behind < share).min(progress.len() - 1);
            let before = if step == 0 { 0.0 } else { progress[step - 1] };
            let gone = progress[step] - before;
            let part = if gone > 0.0 { ((share - before) / gone).clamp(0.0, 1.0) } else { 0.0 };
            self.began + self.lasts * (step as f64 + part) / progress.len() as f64
        };
        shares.map(time).collect()
    }

    /// What a term of the body's twist adds to each step, for a coefficient of 1.
    pub fn empirical(&self, term: &EmpiricalTerm) -> Vec<Step> {
        let dt = self.lasts / self.steps.len() as f64;
        let mut pose = self.start;
        let mut speed_before = 0.0;
        self.steps
            .iter()
            .enumerate()
            .map(|(k, step)| {
                let twist =
                    crate::geometry::Twist2 { forward: step[0] / dt, left: step[1] / dt, yaw_rate: step[2] / dt };
                let acceleration = (twist.forward - speed_before) / dt;
                speed_before = twist.forward;
                let motion = Motion { twist, pose, time: (k as f64 + 0.5) * dt, acceleration };
                pose = pose.compose(Pose2::new(step[0], step[1], step[2]));
                let added = EmpiricalTerm::twist(&[EmpiricalTerm { coefficient: 1.0, ..*term }], &motion);
                [added.forward * dt, added.left * dt, added.yaw_rate * dt]
            })
            .collect()
    }
}

/// Poses at equal progress: way, and turn at an arm of 0.3 m.
fn by_progress(trace: &Trace, count: usize) -> Vec<Pose2> {
    let mut progress = vec![0.0];
    for pair in trace.poses.windows(2) {
        let more = pair[0].distance(pair[1]) + ARM * (pair[1].heading - pair[0].heading).abs();
        progress.push(progress[progress.len() - 1] + more);
    }
    let total = progress[progress.len() - 1];
    (0..=count)
        .map(|k| {
            let wanted = total * k as f64 / count as f64;
            let after = progress.partition_point(|&p| p < wanted).clamp(1, progress.len() - 1);
            let (p0, p1) = (progress[after - 1], progress[after]);
            let part = if p1 > p0 { ((wanted - p0) / (p1 - p0)).clamp(0.0, 1.0) } else { 1.0 };
            let step = trace.poses[after - 1].relative(trace.poses[after]);
            trace.poses[after - 1].compose(Pose2::new(step.x * part, step.y * part, step.heading * part))
        })
        .collect()
}
