//! What of the stand-in is simulated: responses where an answer is, and what causes do together.

use super::response::{Interplay, Node, Response, Responses, Whole, share_of};
use super::{Bench, Elsewhere, Surrogate};
use crate::diagnose::case::{Case, Cluster};
use crate::diagnose::forward::ForwardError;
use crate::diagnose::spots;
use crate::diagnose::variant::{Axis, Coordinate, Coordinates, Variant, edited};
use crate::diagnose::way::{Step, each, length, steps_along, subtract};
use crate::geometry::Trace;
use crate::scene::{Contact, SpottedFloor};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Values of a coordinate that are simulated first, the one that shows most at the head. What a spot on the floor does turns
/// about where its grip is what takes a wheel aside, and is level below where a robot no longer turns as it is told.
pub(in crate::diagnose) fn nodes(variant: &Variant, coordinate: Coordinate) -> Vec<f64> {
    if variant.place().is_some() {
        SPOT_NODES.map(|z| coordinate.within(coordinate.mean + z * coordinate.std_dev)).to_vec()
    } else if coordinate.one_sided {
        vec![coordinate.std_dev, 2.0 * coordinate.std_dev]
    } else {
        vec![-coordinate.std_dev, coordinate.std_dev]
    }
}

/// Products of two causes' sizes that are nearer than this to what was simulated need no other, relative.
const NEAR_BY: f64 = 0.15;
/// The same of each, where one does not go on as it begins.
pub(super) const NEAR_BY_IN_WAVES: f64 = 0.02;
/// The same of a cause on tyres that are in doubt: how much of it hangs on them changes little with its size.
const NEAR_BY_ON_TYRES: f64 = 0.5;
/// Parts of an answer up to which what each two of them do together is simulated. Of more there are too many, and what all do
/// at once has to do.
const IN_PAIRS: usize = 6;
/// Parts of an answer from which on it is more than pairs.
const MORE_THAN_PAIRS: usize = 3;
/// Nodes that were simulated on other ways make room for a new one that is nearer than this \[σ\].
const CLOSE: f64 = 0.5;
/// Share that what was taken to happen far from what was simulated may be off by before it is simulated halfway there as well.
const ASTRAY: f64 = 0.1;
/// Values nearer than this to one another need not both be simulated \[σ\], and those of what does not go on as it begins.
pub(super) const SAME: f64 = 0.1;
pub(super) const SAME_IN_WAVES: f64 = 0.03;
/// Values at which a spot is simulated, and at which a leading one is besides, in σ about its mean.
const SPOT_NODES: [f64; 3] = [-0.75, 0.0, 0.75];
const SPOT_GRID: [f64; 8] = [1.25, 0.25, -0.25, -0.5, -1.0, -1.5, -2.0, -2.5];

/// Simulations of a cluster that a coordinate takes at first.
pub(super) fn simulations(variants: &[Variant], axis: Axis) -> usize {
    let variant = &variants[axis.variant];
    nodes(variant, variant.coordinates[axis.coordinate]).len()
}

/// The coordinates that have to be simulated: not those of the survey, and not what a replay cannot show.
pub(super) fn axes(variants: &[Variant], cases: &[Case]) -> Vec<Axis> {
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

/// Coordinates of the physical causes and of the terms of a hypothesis that do something, by variant.
pub(super) fn at_work(variants: &[Variant], at: &Coordinates) -> BTreeMap<usize, Vec<(Axis, f64)>> {
    let mut causes: BTreeMap<usize, Vec<(Axis, f64)>> = BTreeMap::new();
    for &(axis, value) in at {
        let variant = &variants[axis.variant];
        let is_simulated = variant.is_physical() || variant.is_term();
        if is_simulated && !variant.coordinates[axis.coordinate].hourly {
            causes.entry(axis.variant).or_default().push((axis, value));
        }
    }
    let is_something =
        |(axis, value): &(Axis, f64)| value.abs() > SAME * variants[axis.variant].coordinates[axis.coordinate].std_dev;
    causes.retain(|_, at| at.iter().any(is_something));
    causes
}

impl Surrogate {
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
        let simulated = self.in_passing(bench, &concerned, axis, &values)?;
        // What was carried over goes, also where the spot is not come upon.
        self.responses.iter_mut().for_each(|responses| drop(responses.of_axis.remove(&axis)));
        for (cluster, simulated) in simulated {
            self.responses[cluster].of_axis.insert(axis, Response::in_passing(simulated));
        }
        self.apportion(bench);
        Ok(())
    }

    /// Makes the stand-in exact at one value of one axis, in every cluster; a spot in passing at all that it may be besides.
    pub fn refine(&mut self, bench: Bench<'_>, axis: Axis, at: f64) -> Result<(), ForwardError> {
        let variant = &bench.variants[axis.variant];
        let is_spot = variant.place().is_some();
        if is_spot && self.is_carried(axis) {
            self.add_spot(bench, axis, at)?;
        }
        let concerned: Vec<usize> =
            (0..bench.clusters.len()).filter(|&cluster| self.responses[cluster].of_axis.contains_key(&axis)).collect();
        let nearest = self.nearest(axis, at);
        let mut simulated = self.simulate(bench, &concerned, axis, &[at])?;
        if is_spot {
            let coordinate = variant.coordinates[axis.coordinate];
            let mut values = SPOT_GRID.map(|z| coordinate.within(coordinate.mean + z * coordinate.std_dev)).to_vec();
            let is_near = |value: f64, node: f64| (value - node).abs() < SAME * coordinate.std_dev;
            values.retain(|&value| !is_near(value, at) && !is_near(value, self.nearest(axis, value)));
            let in_passing = self.in_passing(bench, &concerned, axis, &values)?;
            simulated.iter_mut().zip(in_passing).for_each(|((_, nodes), (_, more))| nodes.extend(more));
        }
        let is_far = (at - nearest).abs() > variant.coordinates[axis.coordinate].std_dev;
        if is_far && !is_spot && simulated.iter().any(|(cluster, nodes)| self.is_astray(*cluster, axis, &nodes[0])) {
            let between = self.simulate(bench, &concerned, axis, &[0.5 * (at + nearest)])?;
            simulated.iter_mut().zip(between).for_each(|((_, nodes), (_, between))| nodes.extend(between));
        }
        let mut gone: Vec<(usize, Node)> = Vec::new();
        for (cluster, added) in simulated {
            let response = self.responses[cluster].of_axis.get_mut(&axis).expect("it is concerned");
            // What a term was taken to do before it was simulated is no simulation.
            if variant.is_term() {
                response.simulated.clear();
            }
            if !is_spot {
                // A curve through neighbours that were simulated on other ways would swing between them.
                let apart = CLOSE * variant.coordinates[axis.coordinate].std_dev;
                let is_other = |node: &mut Node| node.carried && (node.at - at).abs() <= apart;
                gone.extend(response.simulated.extract_if(.., is_other).map(|node| (cluster, node)));
            }
            response.simulated_at(added);
            response.in_passing = false;
        }
        // Apportioned in any case: the curve has changed.
        let anew = self.simulate_anew(bench, &concerned, axis, gone);
        self.apportion(bench);
        anew
    }

    /// Simulates on these ways what was simulated on others and made room, where the curve is another without it.
    fn simulate_anew(
        &mut self,
        bench: Bench<'_>,
        concerned: &[usize],
        axis: Axis,
        mut gone: Vec<(usize, Node)>,
    ) -> Result<(), ForwardError> {
        gone.retain(|(cluster, node)| self.is_astray(*cluster, axis, node));
        let mut missed: Vec<f64> = gone.iter().map(|(_, node)| node.at).collect();
        missed.sort_by(f64::total_cmp);
        missed.dedup();
        for (cluster, added) in self.simulate(bench, concerned, axis, &missed)? {
            let response = self.responses[cluster].of_axis.get_mut(&axis).expect("it is concerned");
            response.simulated_at(added);
        }
        Ok(())
    }

    /// Whether what an axis was taken to do at a node is wrong by more than a share of it.
    fn is_astray(&self, cluster: usize, axis: Axis, node: &Node) -> bool {
        let mut off = vec![[0.0; 3]; node.change.len()];
        self.responses[cluster].of_axis[&axis].add(node.at, 1.0, &mut off);
        subtract(&mut off, &node.change);
        let size = |changes: &[Step]| changes.iter().map(length).sum::<f64>();
        size(&off) > ASTRAY * size(&node.change)
    }

    /// What `values` of one axis change in some clusters.
    pub(super) fn simulate(
        &self,
        bench: Bench<'_>,
        clusters: &[usize],
        axis: Axis,
        values: &[f64],
    ) -> Result<Vec<(usize, Vec<Node>)>, ForwardError> {
        let one = |&cluster: &usize| {
            let simulated = values
                .par_iter()
                .map(|&value| {
                    let change = self.simulated_change(bench, &bench.clusters[cluster], &[(axis, value)])?;
                    Ok(Node::own(value, change))
                })
                .collect::<Result<_, ForwardError>>()?;
            Ok((cluster, simulated))
        };
        clusters.par_iter().map(one).collect()
    }

    /// What values of a spot change in some clusters, simulated while their runs pass it.
    fn in_passing(
        &self,
        bench: Bench<'_>,
        clusters: &[usize],
        axis: Axis,
        values: &[f64],
    ) -> Result<Vec<(usize, Vec<Node>)>, ForwardError> {
        let spots: Vec<(Axis, f64)> = values.iter().map(|&value| (axis, value)).collect();
        let one = |&cluster: &usize| {
            let changes = self.changes_in_passing(bench, &bench.clusters[cluster], &spots)?;
            Ok((cluster, values.iter().zip(changes).map(|(at, change)| Node::own(*at, change)).collect()))
        };
        clusters.par_iter().map(one).collect()
    }

    /// What spots on the floor, each for itself, change in the steps of a cluster's reference run while that passes them.
    pub(super) fn changes_in_passing(
        &self,
        bench: Bench<'_>,
        cluster: &Cluster,
        spots: &Coordinates,
    ) -> Result<Vec<Vec<Step>>, ForwardError> {
        let Bench { model, cases, variants, .. } = bench;
        let case = &cases[cluster.reference];
        let floors: Vec<SpottedFloor> = spots
            .iter()
            .filter_map(|spot| {
                let place = variants[spot.0.variant].place()?;
                Some(spots::spotted(&edited(model.scene(), variants, &[*spot]), place))
            })
            .collect();
        let traces = model.traces_on(model.scene(), &case.run, &case.counted, &floors)?;
        Ok(traces.iter().map(|trace| self.changed(cluster, case, trace)).collect())
    }

    /// Simulates what a spot does where runs come upon it elsewhere, if that is not known nearby; whether it was.
    pub fn look_elsewhere(&mut self, bench: Bench<'_>, spot: Axis, at: f64) -> Result<bool, ForwardError> {
        let variant = &bench.variants[spot.variant];
        let near = SAME * variant.coordinates[spot.coordinate].std_dev;
        let is_known = self.elsewhere.iter().any(|((_, known), it)| *known == spot && (it.at - at).abs() < near);
        let Some(place) = variant.place().filter(|_| !is_known) else { return Ok(false) };
        let first = bench.variants.len();
        let about = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        let displaced = about.map(|by| Variant::spot([0, 1].map(|k| place[k] + by[k] * spots::STRAY)));
        let variants = [bench.variants, &displaced].concat();
        let there: Vec<(Axis, f64)> = (first..variants.len()).map(|variant| (Axis { variant, ..spot }, at)).collect();
        let bench = Bench { variants: &variants, ..bench };
        let concerned = (0..bench.clusters.len()).filter(|&it| self.responses[it].of_axis.contains_key(&spot));
        let simulated = concerned
            .collect::<Vec<usize>>()
            .into_par_iter()
            .map(|cluster| {
                let changes = self.changes_in_passing(bench, &bench.clusters[cluster], &there)?;
                let half = |up: &[Step], down: &[Step]| -> Vec<Step> {
                    up.iter().zip(down).map(|(up, down)| each(|c| 0.5 * (up[c] - down[c]))).collect()
                };
                let changes = [half(&changes[0], &changes[1]), half(&changes[2], &changes[3])];
                Ok(((cluster, spot), Elsewhere { at, changes }))
            })
            .collect::<Result<Vec<_>, ForwardError>>()?;
        self.elsewhere.extend(simulated);
        Ok(true)
    }

    /// Simulates what causes and terms of one answer do together, each two of them and all at once, where that is not known
    /// nearby; whether anything was.
    pub fn couple(&mut self, bench: Bench<'_>, at: &Coordinates) -> Result<bool, ForwardError> {
        let in_pairs = self.couple_pairs(bench, at)?;
        Ok(self.couple_all(bench, at)? || in_pairs)
    }

    /// Whether there is more to an answer than what each two of its parts do together.
    pub fn is_more_than_pairs(&self, variants: &[Variant], at: &Coordinates) -> bool {
        at_work(variants, at).len() >= MORE_THAN_PAIRS
    }

    /// Whether what all that is in an answer does at once is known nearby.
    pub fn knows_all(&self, variants: &[Variant], at: &Coordinates) -> bool {
        let causes = at_work(variants, at);
        let is_known =
            |responses: &Responses| responses.of_all.iter().any(|whole| self.is_near(variants, whole, &causes));
        causes.len() < MORE_THAN_PAIRS || self.responses.iter().all(is_known)
    }

    /// Whether that is known anywhere.
    pub fn knows_of_all(&self, variants: &[Variant], at: &Coordinates) -> bool {
        let causes = at_work(variants, at);
        let is_of_it = |whole: &Whole| whole.at.keys().eq(causes.keys());
        causes.len() < MORE_THAN_PAIRS || self.responses.iter().all(|it| it.of_all.iter().any(is_of_it))
    }

    /// Whether an answer was simulated at once near where its causes are.
    fn is_near(&self, variants: &[Variant], whole: &Whole, causes: &BTreeMap<usize, Vec<(Axis, f64)>>) -> bool {
        let is_near = |(axis, value): &(Axis, f64)| {
            let same = if self.is_wavy(*axis) { SAME_IN_WAVES } else { SAME };
            let near = same * variants[axis.variant].coordinates[axis.coordinate].std_dev;
            (whole.at[&axis.variant][axis.coordinate] - value).abs() < near
        };
        whole.at.keys().eq(causes.keys()) && causes.values().flatten().all(is_near)
    }

    /// Whether a cause does not go on as it begins, along any of its coordinates.
    fn has_waves(&self, variant: usize) -> bool {
        self.wavy.iter().any(|axis| axis.variant == variant)
    }

    fn couple_pairs(&mut self, bench: Bench<'_>, at: &Coordinates) -> Result<bool, ForwardError> {
        let causes = at_work(bench.variants, at);
        if causes.len() > IN_PAIRS {
            return Ok(false);
        }
        let along = self.couple_along(bench, at)?;
        let mut wanted: Vec<(usize, [usize; 2])> = Vec::new();
        for (index, responses) in self.responses.iter().enumerate() {
            let concerned: Vec<usize> = causes
                .iter()
                .filter(|(_, at)| at.iter().any(|(axis, _)| responses.of_axis.contains_key(axis)))
                .map(|(&variant, _)| variant)
                .collect();
            for (position, &one) in concerned.iter().enumerate() {
                for &other in &concerned[position + 1..] {
                    let pair = [one, other];
                    let is_near = |known: &Interplay| {
                        if pair.iter().any(|&variant| self.has_waves(variant)) {
                            let is_same = |part: usize| {
                                (share_of(at, pair[part], &known.at[part]) - 1.0).abs() < NEAR_BY_IN_WAVES
                            };
                            is_same(0) && is_same(1)
                        } else {
                            (known.share(pair, at) - 1.0).abs() < NEAR_BY
                        }
                    };
                    if !responses.of_pair.get(&pair).is_some_and(is_near) {
                        wanted.push((index, pair));
                    }
                }
            }
        }
        let together = |&(cluster, pair): &(usize, [usize; 2])| {
            let both: Vec<(Axis, f64)> = pair.iter().flat_map(|variant| causes[variant].iter().copied()).collect();
            let at = pair.map(|variant| causes[&variant].iter().map(|(_, value)| *value).collect());
            let simulated = self.simulated_change(bench, &bench.clusters[cluster], &both)?;
            Ok((cluster, pair, Interplay { at, simulated, beyond: Vec::new() }))
        };
        let simulated = wanted.par_iter().map(together).collect::<Result<_, ForwardError>>()?;
        Ok(self.keep_together(bench, simulated) || along)
    }

    /// Simulates all that is in an answer of more than pairs at once, where that is not known nearby; whether it was.
    pub fn couple_all(&mut self, bench: Bench<'_>, at: &Coordinates) -> Result<bool, ForwardError> {
        if self.knows_all(bench.variants, at) {
            return Ok(false);
        }
        let causes = at_work(bench.variants, at);
        let all: Vec<(Axis, f64)> = causes.values().flatten().copied().collect();
        let simulated: Vec<Vec<Step>> = bench
            .clusters
            .par_iter()
            .map(|cluster| self.simulated_change(bench, cluster, &all))
            .collect::<Result<_, ForwardError>>()?;
        let values = |at: &Vec<(Axis, f64)>| at.iter().map(|(_, value)| *value).collect();
        let at: BTreeMap<usize, Vec<f64>> = causes.iter().map(|(variant, at)| (*variant, values(at))).collect();
        for (responses, simulated) in self.responses.iter_mut().zip(simulated) {
            responses.of_all.retain(|whole| !whole.at.keys().eq(at.keys()));
            responses.of_all.push(Whole { at: at.clone(), simulated, beyond: Vec::new() });
        }
        self.apportion(bench);
        Ok(true)
    }

    /// Takes what pairs and answers do beyond their parts anew, where more is known of those.
    pub(super) fn apportion(&mut self, bench: Bench<'_>) {
        let Surrogate { responses, ways, .. } = self;
        for (responses, cluster) in responses.iter_mut().zip(bench.clusters) {
            responses.apportion(&ways[cluster.reference], bench.variants);
        }
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
                let near = if self.has_waves(cause) { NEAR_BY_IN_WAVES } else { NEAR_BY_ON_TYRES };
                let is_near = |known: &Interplay| (share_of(there, cause, &known.at[0]) - 1.0).abs() < near;
                let unknown = in_doubt
                    .iter()
                    .filter(|(tyres, _)| !responses.of_pair.get(&[cause, tyres.variant]).is_some_and(is_near));
                wanted.extend(unknown.map(|&tyres| (cluster, cause, tyres)));
            }
        }
        let mut alone: Vec<(usize, (Axis, f64))> = wanted.iter().map(|&(cluster, _, tyres)| (cluster, tyres)).collect();
        alone.retain(|(cluster, (tyres, _))| {
            let is_known = self.on_tyres.contains_key(&(*cluster, tyres.variant));
            !is_known && !self.responses[*cluster].of_axis.contains_key(tyres)
        });
        alone.sort_by_key(|(cluster, (tyres, _))| (*cluster, *tyres));
        alone.dedup();
        let simulated: Vec<_> = alone
            .par_iter()
            .map(|&(cluster, tyres)| {
                let change = self.simulated_change(bench, &bench.clusters[cluster], &[tyres])?;
                Ok(((cluster, tyres.0.variant), change))
            })
            .collect::<Result<_, ForwardError>>()?;
        // However much cylinders grip, all alike, a robot that is as the model has it turns as it does: what friction does to a replay
        // is of counts that fight, and for causes to make up for. Of tyres, what it does is in the model as it was fitted.
        let is_rigid = bench.model.scene().contact == Contact::Rigid;
        if is_rigid {
            for ((cluster, tyres), change) in simulated {
                let axis = Axis { variant: tyres, coordinate: 0 };
                let there = bench.variants[tyres].coordinates[0].std_dev;
                self.responses[cluster].of_axis.insert(axis, Response::smooth(vec![Node::own(there, change)]));
            }
        } else {
            self.on_tyres.extend(simulated);
        }
        let together = |&(cluster, cause, (tyres, value)): &(usize, usize, (Axis, f64))| {
            let there = &causes[&cause];
            let both = [there.as_slice(), &[(tyres, value)]].concat();
            let mut simulated = self.simulated_change(bench, &bench.clusters[cluster], &both)?;
            if let Some(alone) = self.on_tyres.get(&(cluster, tyres.variant)) {
                subtract(&mut simulated, alone);
            }
            let at = [there.iter().map(|(_, value)| *value).collect(), vec![value]];
            Ok((cluster, [cause, tyres.variant], Interplay { at, simulated, beyond: Vec::new() }))
        };
        let simulated = wanted.par_iter().map(together).collect::<Result<_, ForwardError>>()?;
        Ok(self.keep_together(bench, simulated))
    }

    /// Keeps what pairs do together in clusters; whether there is any.
    fn keep_together(&mut self, bench: Bench<'_>, simulated: Vec<(usize, [usize; 2], Interplay)>) -> bool {
        let any = !simulated.is_empty();
        for (cluster, pair, interplay) in simulated {
            self.responses[cluster].of_pair.insert(pair, interplay);
        }
        if any {
            self.apportion(bench);
        }
        any
    }

    /// What the simulator says that a hypothesis changes in the steps of a cluster's reference run.
    pub(super) fn simulated_change(
        &self,
        bench: Bench<'_>,
        cluster: &Cluster,
        at: &Coordinates,
    ) -> Result<Vec<Step>, ForwardError> {
        let Bench { model, cases, variants, .. } = bench;
        let case = &cases[cluster.reference];
        let mut given = model.scene().clone();
        let mut run = case.run.clone();
        if at.iter().any(|(axis, _)| variants[axis.variant].coordinates[axis.coordinate].hourly) {
            // Stated an hour: what it does within one, to tyres that are what they are as the run begins.
            given.robot = given.robot.at(run.started.unwrap_or(0.0));
            given.robot.tyre_growth = 0.0;
            run.started = Some(3600.0);
        }
        let trace = model.trace(&edited(&given, variants, at), &run, &case.counted)?;
        Ok(self.changed(cluster, case, &trace))
    }

    /// By how much the steps of a trace of a cluster's reference run are not those of the model as given.
    fn changed(&self, cluster: &Cluster, case: &Case, trace: &Trace) -> Vec<Step> {
        let way = &self.ways[cluster.reference];
        let edited = steps_along(trace, way.steps.len(), case.replayed);
        edited.iter().zip(&way.steps).map(|(a, b)| each(|c| a[c] - b[c])).collect()
    }
}
