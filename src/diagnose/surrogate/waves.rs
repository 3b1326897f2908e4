//! Where a cause does not go on as it began.
//!
//! A controller makes of counts that are later than a tenth of a second what no curve through lesser delays goes on to: it turns
//! the robot by more, less, more and less again. Axles of rigid wheels that fight do next to nothing until one of them gives, and
//! nearly the same from then on, however much they differ. A fit that comes from 0 stops at the first of these waves, or before the
//! step, and other causes are called for to make good what it leaves. So causes of one sign, which are those of the drivetrain and of
//! the encoders, and all causes on rigid wheels, which grip or give, are simulated as far as is plausible; where one does something
//! else there than was foretold, the way there is simulated ever more closely, until it does what is foretold, and fits begin at each
//! place (`search`). Which wheel gives hangs on what else moves the robot, too: axles that differ turn it one way alone and the other
//! way beside unequal wheels. So what does not go on as it begins is simulated all along beside each cause that leads alone
//! (`refine`), and beside each that is in an answer with it about where it is there: a fit needs to know how what they do together
//! goes on as well as what it is, or it stops beside the best, and sure of it.

use super::response::{Beside, Node, Response, Together};
use super::{Bench, Surrogate, exact};
use crate::diagnose::forward::ForwardError;
use crate::diagnose::variant::{Axis, Coordinates, Variant};
use crate::diagnose::way::{Step, add_times, compose, length};
use crate::geometry::Pose2;
use rayon::prelude::*;

/// How far a cause is plausible \[σ\].
const FAR: f64 = 3.0;
/// Places nearer to one another than this are not told apart \[σ\].
const APART: f64 = 0.2;
/// Share of what a cause does to a run's end that a curve may be off by there, and what it may be off by in any case, which hardly
/// any survey reads \[m\].
const ASTRAY: f64 = 0.1;
const UNREAD: f64 = 0.001;
/// Where a cause is simulated about a place, so that how it goes on from there is known as well as where it is \[σ\].
const ABOUT: [f64; 5] = [-0.3, -0.1, 0.0, 0.1, 0.3];

impl Surrogate {
    /// Simulates what causes do as far as is plausible, those of one sign and, on wheels that grip or `give`, all, in `clusters` of
    /// which it is known what they do nearer by. Where that is to be is asked of the first clusters only, so many as are `used`: runs
    /// that are held out have no say in it. `progress` is told how many more simulations there are, and how many more are done.
    pub(super) fn look_farther(
        &mut self,
        bench: Bench<'_>,
        clusters: &[usize],
        used: usize,
        give: bool,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) {
        if clusters.is_empty() {
            return;
        }
        // Whether there are waves is seen in the run that turns most for its time.
        let turns = |cluster: usize| {
            let way = &self.ways[bench.clusters[cluster].reference];
            way.turned() / way.lasts
        };
        let is_known = |cluster: usize| !clusters.contains(&cluster);
        let most = |one: &usize, other: &usize| {
            is_known(*one).cmp(&is_known(*other)).then(turns(*one).total_cmp(&turns(*other)))
        };
        let Some(shows) = (0..used).max_by(most) else { return };
        let is_simulated = |axis: &Axis| self.responses[shows].of_axis.contains_key(axis);
        let mut axes = exact::axes(bench.variants, bench.cases);
        axes.retain(|axis| {
            let variant = &bench.variants[axis.variant];
            let is_asked = give || variant.coordinates[axis.coordinate].one_sided;
            is_asked && variant.place().is_none() && is_simulated(axis)
        });
        let farther: Vec<Vec<Node>> = if is_known(shows) {
            axes.iter().map(|&axis| self.known_farther(shows, axis, bench.variants)).collect()
        } else {
            axes.par_iter().map(|&axis| self.astray_along(bench, shows, axis, progress)).collect()
        };
        let others: Vec<usize> = clusters.iter().copied().filter(|&cluster| cluster != shows).collect();
        progress(others.len() * farther.iter().map(Vec::len).sum::<usize>(), 0);
        for (axis, nodes) in axes.into_iter().zip(farther).filter(|(_, nodes)| !nodes.is_empty()) {
            let values: Vec<f64> = nodes.iter().map(|node| node.at).collect();
            let simulated = self.simulate(bench, &others, axis, &values);
            progress(0, others.len() * values.len());
            let Ok(mut simulated) = simulated else { continue };
            if clusters.contains(&shows) {
                simulated.push((shows, nodes));
            }
            for (cluster, nodes) in simulated {
                if let Some(response) = self.responses[cluster].of_axis.get_mut(&axis) {
                    response.simulated_at(nodes);
                }
            }
        }
    }

    /// Simulates what causes that do not go on as they begin do, all along, beside each cause of an answer. Whether anything was.
    pub fn couple_all_along(&mut self, bench: Bench<'_>, answer: &Coordinates) -> bool {
        let causes = exact::at_work(bench.variants, answer);
        let mut wanted: Vec<(usize, usize, Axis)> = Vec::new();
        for (cluster, responses) in self.responses.iter().enumerate() {
            let is_concerned = |axis: &Axis| responses.of_axis.contains_key(axis);
            for (&cause, _) in causes.iter().filter(|(_, at)| at.iter().all(|(axis, _)| is_concerned(axis))) {
                // What two such causes do together is known along one of them; what changes by the hour each run has more or less of.
                let is_new = |axis: &Axis| axis.variant != cause && !responses.is_beside([cause, axis.variant]);
                let is_steady = |axis: &Axis| !bench.variants[axis.variant].coordinates[axis.coordinate].hourly;
                let others = self.wavy.iter().filter(|axis| is_concerned(axis) && is_new(axis) && is_steady(axis));
                wanted.extend(others.map(|&axis| (cluster, cause, axis)));
            }
        }
        let all_along = |&(cluster, cause, axis): &(usize, usize, Axis)| {
            // Where the robot cannot be driven, nothing is known.
            let there = |value: f64| self.together(bench, cluster, &causes[&cause], (axis, value)).ok();
            let nodes = self.waves(axis).into_par_iter().filter_map(there);
            (cluster, (cause, axis), nodes.map(|node| Together { is_amid: true, ..node }).collect())
        };
        let simulated: Vec<_> = wanted.par_iter().map(all_along).collect();
        self.keep_along(bench, simulated)
    }

    /// Simulates what does not go on as it begins beside another cause of an answer, about where it is, if that is not known nearby;
    /// whether anything was. Along both of two such causes, if both are.
    pub(super) fn couple_along(&mut self, bench: Bench<'_>, answer: &Coordinates) -> Result<bool, ForwardError> {
        let causes = exact::at_work(bench.variants, answer);
        let std_dev = |axis: Axis| bench.variants[axis.variant].coordinates[axis.coordinate].std_dev;
        let mut wanted: Vec<(usize, usize, (Axis, f64))> = Vec::new();
        for (cluster, responses) in self.responses.iter().enumerate() {
            let is_concerned = |at: &[(Axis, f64)]| at.iter().any(|(axis, _)| responses.of_axis.contains_key(axis));
            for (&cause, _) in causes.iter().filter(|(_, at)| is_concerned(at)) {
                let others = causes.iter().filter(|(other, _)| **other != cause).flat_map(|(_, at)| at);
                let is_known = |&(axis, value): &(Axis, f64)| {
                    let near = (value, exact::SAME_IN_WAVES * std_dev(axis));
                    let beside = responses.beside.get(&(cause, axis));
                    beside.is_some_and(|it| it.is_known(cause, answer, near, exact::NEAR_BY_IN_WAVES))
                };
                let in_waves = others.filter(|(axis, value)| {
                    let is_something = value.abs() > exact::SAME * std_dev(*axis);
                    is_something && self.is_wavy(*axis) && responses.of_axis.contains_key(axis)
                });
                wanted.extend(in_waves.filter(|it| !is_known(it)).map(|&it| (cluster, cause, it)));
            }
        }
        let about = |&(cluster, cause, (axis, place)): &(usize, usize, (Axis, f64))| {
            let coordinate = bench.variants[axis.variant].coordinates[axis.coordinate];
            let is_there = |it: &f64| *it * place > 0.0 && coordinate.within(*it) == *it;
            let about = ABOUT.map(|z| place + z * coordinate.std_dev).into_iter();
            let values: Vec<f64> = about.filter(|it| *it == place || is_there(it)).collect();
            let there = |value: f64| match self.together(bench, cluster, &causes[&cause], (axis, value)) {
                Ok(there) => Some(Ok(Together { is_amid: value == place, ..there })),
                // No farther than the robot can be driven.
                Err(error) => (value == place).then_some(Err(error)),
            };
            let nodes = values.into_par_iter().filter_map(there).collect::<Result<_, ForwardError>>()?;
            Ok((cluster, (cause, axis), nodes))
        };
        let simulated = wanted.par_iter().map(about).collect::<Result<_, ForwardError>>()?;
        Ok(self.keep_along(bench, simulated))
    }

    /// What a cause and a value of one axis of another change in a cluster.
    fn together(
        &self,
        bench: Bench<'_>,
        cluster: usize,
        cause: &Coordinates,
        (axis, value): (Axis, f64),
    ) -> Result<Together, ForwardError> {
        let both = [cause, &[(axis, value)]].concat();
        let change = self.simulated_change(bench, &bench.clusters[cluster], &both)?;
        Ok(Together { cause: cause.iter().map(|(_, value)| *value).collect(), value, change, is_amid: false })
    }

    /// Keeps what axes do beside causes in clusters; whether there is any.
    fn keep_along(&mut self, bench: Bench<'_>, simulated: Vec<(usize, (usize, Axis), Vec<Together>)>) -> bool {
        let any = simulated.iter().any(|(_, _, nodes)| !nodes.is_empty());
        for (cluster, both, nodes) in simulated {
            self.responses[cluster].beside.entry(both).or_insert_with(Beside::new).simulated_at(nodes);
        }
        if any {
            self.apportion(bench);
        }
        any
    }

    /// What was simulated of an axis in a cluster besides what comes first.
    fn known_farther(&self, cluster: usize, axis: Axis, variants: &[Variant]) -> Vec<Node> {
        let variant = &variants[axis.variant];
        let first = exact::nodes(variant, variant.coordinates[axis.coordinate]);
        let nodes = self.responses[cluster].of_axis[&axis].simulated.iter();
        nodes.filter(|node| !first.contains(&node.at)).cloned().collect()
    }

    /// Whether more was simulated of a cause than what comes first, since it does not go on as it begins.
    pub(super) fn is_known_farther(&self, axis: Axis, variants: &[Variant]) -> bool {
        let is_known = |cluster: usize| {
            let responses = &self.responses[cluster];
            responses.of_axis.contains_key(&axis) && !self.known_farther(cluster, axis, variants).is_empty()
        };
        variants[axis.variant].place().is_none() && (0..self.responses.len()).any(is_known)
    }

    /// What an axis does in a cluster where that is not what was foretold, and about there.
    fn astray_along(
        &self,
        bench: Bench<'_>,
        cluster: usize,
        axis: Axis,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Vec<Node> {
        let coordinate = bench.variants[axis.variant].coordinates[axis.coordinate];
        let way = &self.ways[bench.clusters[cluster].reference];
        let mut response = self.responses[cluster].of_axis[&axis].clone();
        let simulated = |value: f64| -> Result<Node, ForwardError> {
            let change = self.simulated_change(bench, &bench.clusters[cluster], &[(axis, value)]);
            progress(1, 1);
            Ok(Node::own(value, change?))
        };
        let end = |change: &[Step]| -> Pose2 {
            let mut steps = way.steps.clone();
            add_times(1.0, change, &mut steps);
            *compose(way.start, &steps).last().expect("it begins somewhere")
        };
        let given = end(&[]);

        let is_foretold = |response: &Response, node: &Node| {
            let mut foretold = vec![[0.0; 3]; way.steps.len()];
            response.add(node.at, 1.0, &mut foretold);
            let there = end(&node.change);
            apart(there, end(&foretold)) < UNREAD.max(ASTRAY * apart(there, given))
        };
        let sides = if coordinate.one_sided { &[FAR][..] } else { &[FAR, -FAR] };
        // Where the robot cannot be driven, there is nothing to look for.
        let far = sides.iter().filter_map(|z| simulated(coordinate.within(z * coordinate.std_dev)).ok());
        let far: Vec<Node> = far.filter(|far| !is_foretold(&response, far)).collect();
        if far.is_empty() {
            return far;
        }
        let places = response.simulated.iter().chain(&far).map(|node| node.at);
        let mut known: Vec<f64> = places.chain([0.0]).collect();
        known.sort_by(f64::total_cmp);
        let mut gaps: Vec<[f64; 2]> = known.windows(2).map(|gap| [gap[0], gap[1]]).collect();
        let mut found = far.clone();
        response.simulated_at(far);
        while let Some([near, far]) = gaps.pop() {
            if far - near < 2.0 * APART * coordinate.std_dev {
                continue;
            }
            let Ok(middle) = simulated(0.5 * (near + far)) else { continue };
            if !is_foretold(&response, &middle) {
                gaps.extend([[near, middle.at], [middle.at, far]]);
            }
            found.push(middle.clone());
            response.simulated_at(vec![middle]);
        }
        found
    }
}

fn apart(one: Pose2, other: Pose2) -> f64 {
    length(&[one.x - other.x, one.y - other.y, one.heading - other.heading])
}
