//! What a cause changes along a way over its coordinates: a curve or lines through what was simulated.

use crate::diagnose::variant::{Axis, Coordinates, RELATIVE, Variant};
use crate::diagnose::way::{ARM, Step, Way, add_times, subtract};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::ops::Range;

/// What causes do to the steps of a cluster.
#[derive(Debug, Clone, Default)]
pub(super) struct Responses {
    pub of_axis: BTreeMap<Axis, Response>,
    /// By variants: of causes the lesser first, of a cause and what is in doubt of tyres the cause.
    pub of_pair: BTreeMap<[usize; 2], Interplay>,
    /// By another cause and what does not go on as it begins.
    pub beside: BTreeMap<(usize, Axis), Beside>,
    /// Of answers that were simulated at once.
    pub of_all: Vec<Whole>,
}

/// What an axis, all along, and another cause do together beyond what each does alone: the more of that cause, the more of it.
#[derive(Debug, Clone)]
pub(super) struct Beside {
    /// What was simulated, by the axis' coordinate.
    simulated: Vec<Together>,
    /// Beyond what each does, where there is as much of the cause as in the first of them.
    response: Response,
}

/// Times as much of a cause beside which something is quite another thing.
const QUITE: f64 = 4.0;

/// What a cause and one axis of another change in all.
#[derive(Debug, Clone)]
pub(super) struct Together {
    /// Coordinates of the cause.
    pub cause: Vec<f64>,
    pub value: f64,
    pub change: Vec<Step>,
    /// Whether it was simulated on both sides of it as well.
    pub is_amid: bool,
}

/// What two variants do together beyond what each does alone, or all along beside the other.
#[derive(Debug, Clone)]
pub(super) struct Interplay {
    /// Coordinates of both where it was simulated.
    pub at: [Vec<f64>; 2],
    /// What both change in all, of tyres beyond what is in the model as it was fitted.
    pub simulated: Vec<Step>,
    pub beyond: Vec<Step>,
}

/// What all that is in an answer does together beyond what each and each two of it do.
#[derive(Debug, Clone)]
pub(super) struct Whole {
    /// Coordinates of each variant where it was simulated.
    pub at: BTreeMap<usize, Vec<f64>>,
    /// What it changes in all.
    pub simulated: Vec<Step>,
    pub beyond: Vec<Step>,
}

/// How much of what `variant` is at `reference` it is at `at`: along that direction.
pub(super) fn share_of(at: &Coordinates, variant: usize, reference: &[f64]) -> f64 {
    let along = at.iter().filter(|(axis, _)| axis.variant == variant);
    let along: f64 = along.map(|(axis, value)| value * reference[axis.coordinate]).sum();
    along / reference.iter().map(|value| value * value).sum::<f64>()
}

impl Beside {
    /// Of nothing that was simulated yet.
    pub fn new() -> Beside {
        Beside { simulated: Vec::new(), response: Response::smooth(Vec::new()) }
    }

    /// Takes what was simulated beside one size of the cause in place of what was before between the first and the last of it, and of
    /// what was beside quite another size. Apportion it then.
    pub fn simulated_at(&mut self, nodes: Vec<Together>) {
        let Some(first) = nodes.first() else { return };
        let product = |one: &[f64], other: &[f64]| -> f64 { one.iter().zip(other).map(|(a, b)| a * b).sum() };
        let share = |known: &Together| product(&known.cause, &first.cause) / product(&first.cause, &first.cause);
        let between = |one: f64| nodes.iter().any(|it| it.value <= one) && nodes.iter().any(|it| it.value >= one);
        self.simulated.retain(|known| !between(known.value) && (1.0 / QUITE..QUITE).contains(&share(known)));
        self.simulated.extend(nodes);
        self.simulated.sort_by(|a, b| a.value.total_cmp(&b.value));
    }

    /// Whether it was simulated, and on both sides, no farther than `by` along the axis from `value`, beside as much of the cause to a
    /// share.
    pub fn is_known(&self, cause: usize, at: &Coordinates, (value, by): (f64, f64), share: f64) -> bool {
        let is_near = |it: &Together| {
            it.is_amid && (it.value - value).abs() <= by && (share_of(at, cause, &it.cause) - 1.0).abs() < share
        };
        self.simulated.iter().any(is_near)
    }

    /// How much of the cause there is at `at`, and where the axis is, or the last place on the way there that was simulated; nothing
    /// where one of them is not at work.
    fn place(&self, (cause, axis): (usize, Axis), at: &Coordinates) -> Option<(f64, f64)> {
        let (_, value) = at.iter().find(|(known, value)| *known == axis && *value != 0.0)?;
        let [first, last] = [self.simulated.first()?, self.simulated.last()?].map(|it| it.value);
        let share = share_of(at, cause, &self.simulated[0].cause);
        Some((share, value.clamp(first.min(0.0), last.max(0.0)))).filter(|(share, _)| *share != 0.0)
    }

    /// Takes what each of them does, as `parts` have it, from what was simulated.
    fn apportion(&mut self, (cause, axis): (usize, Axis), parts: impl Fn(&Coordinates, &mut [Step])) {
        let beyond = |it: &Together| {
            let mut each = vec![[0.0; 3]; it.change.len()];
            let at: Vec<(Axis, f64)> = along(cause, &it.cause).chain([(axis, it.value)]).collect();
            parts(&at, &mut each);
            let mut beyond = vec![[0.0; 3]; it.change.len()];
            let share = share_of(&at, cause, &self.simulated[0].cause);
            add_times(1.0 / share, &it.change, &mut beyond);
            add_times(-1.0 / share, &each, &mut beyond);
            Node::own(it.value, beyond)
        };
        self.response = Response::smooth(self.simulated.iter().map(beyond).collect());
    }
}

impl Interplay {
    /// How much of it there is at `at` between both of `pair`.
    pub fn share(&self, [one, other]: [usize; 2], at: &Coordinates) -> f64 {
        let of_one = share_of(at, one, &self.at[0]);
        if of_one == 0.0 { 0.0 } else { of_one * share_of(at, other, &self.at[1]) }
    }

    fn coordinates(&self, pair: [usize; 2]) -> Vec<(Axis, f64)> {
        pair.iter().zip(&self.at).flat_map(|(variant, values)| along(*variant, values)).collect()
    }
}

impl Whole {
    /// How much of it there is at `at`: all of it where each part is half as large at least as it was simulated.
    fn share(&self, at: &Coordinates) -> f64 {
        let of_part = |(variant, reference): (&usize, &Vec<f64>)| 2.0 * share_of(at, *variant, reference);
        self.at.iter().map(of_part).fold(1.0, f64::min).max(0.0)
    }

    fn coordinates(&self) -> Vec<(Axis, f64)> {
        self.at.iter().flat_map(|(variant, values)| along(*variant, values)).collect()
    }
}

fn along(variant: usize, values: &[f64]) -> impl Iterator<Item = (Axis, f64)> {
    values.iter().enumerate().map(move |(coordinate, value)| (Axis { variant, coordinate }, *value))
}

/// A coordinate, and what the simulator says that it changes.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub at: f64,
    pub change: Vec<Step>,
    /// Whether that was on another way of its kind.
    pub carried: bool,
}

impl Node {
    /// On these ways.
    pub fn own(at: f64, change: Vec<Step>) -> Node {
        Node { at, change, carried: false }
    }
}

/// Change of the steps over one coordinate: through 0 at 0 and through what was simulated at each node.
#[derive(Debug, Clone)]
pub(super) struct Response {
    /// Coordinates and changes that were simulated, by coordinate.
    pub simulated: Vec<Node>,
    between: Between,
    /// Whether all of it was simulated in passing a spot, and not to the end of the way.
    pub in_passing: bool,
}

/// What is taken to happen between nodes.
#[derive(Debug, Clone, Copy)]
enum Between {
    /// Parabolas through three neighbours, blended from one to the next [Overhauser, *Analytic Definition of Curves and
    /// Surfaces by Parabolic Blending*, Ford 1968]: what was simulated far off has no say, so that a kink bends its own
    /// neighbourhood only.
    Smooth,
    /// Straight lines, level beyond the ends: below a grip at which wheels cannot turn the robot, all is otherwise.
    Straight,
}

impl Response {
    /// Of a spot on the floor, simulated while it is passed.
    pub fn in_passing(simulated: Vec<Node>) -> Response {
        Response { in_passing: true, ..Response::through(simulated, Between::Straight) }
    }

    pub fn smooth(simulated: Vec<Node>) -> Response {
        Response::through(simulated, Between::Smooth)
    }

    /// The same of another way, step by step.
    pub fn carried_over(&self, changes: impl Fn(&[Step]) -> Vec<Step>) -> Response {
        let carry = |node: &Node| Node { at: node.at, change: changes(&node.change), carried: true };
        Response { simulated: self.simulated.iter().map(carry).collect(), ..*self }
    }

    fn through(simulated: Vec<Node>, between: Between) -> Response {
        let mut response = Response { simulated: Vec::new(), between, in_passing: false };
        response.simulated_at(simulated);
        response
    }

    /// Goes through these as well from now on.
    pub fn simulated_at(&mut self, nodes: Vec<Node>) {
        self.simulated.extend(nodes);
        self.simulated.sort_by(|a, b| a.at.total_cmp(&b.at));
    }

    /// Whether any of it was simulated on other ways.
    pub fn is_carried(&self) -> bool {
        self.simulated.iter().any(|node| node.carried)
    }

    /// Adds the change at coordinate `x`, so many times, to `steps`.
    pub fn add(&self, x: f64, times: f64, steps: &mut [Step]) {
        match self.between {
            Between::Smooth => self.add_smooth(x, times, steps),
            Between::Straight => self.add_straight(x, times, steps),
        }
    }

    fn add_smooth(&self, x: f64, times: f64, steps: &mut [Step]) {
        // Nothing changes at 0, which is a node as well.
        let zero = self.simulated.partition_point(|node| node.at < 0.0);
        let there = |index: usize| (self.simulated[index].at, Some(&self.simulated[index].change));
        let node = |index: usize| match index.cmp(&zero) {
            Ordering::Less => there(index),
            Ordering::Equal => (0.0, None),
            Ordering::Greater => there(index - 1),
        };
        let last = self.simulated.len();
        let before = (1..last).take_while(|&index| node(index).0 < x).last().unwrap_or(0);
        // Parabolas through the neighbours of the nodes on both sides of `x`, and how much the second one counts.
        let (one, other, part) = match (before > 0, before + 1 < last) {
            (true, true) => {
                let (low, high) = (node(before).0, node(before + 1).0);
                (before - 1..before + 2, before..before + 3, (x - low) / (high - low))
            }
            (true, false) => (before - 1..before + 2, 0..0, 0.0),
            (false, true) => (0..3, 0..0, 0.0),
            (false, false) => (0..2, 0..0, 0.0),
        };
        // How much of a curve through `nodes` is one's own [Lagrange].
        let share = |nodes: &Range<usize>, own: usize| -> f64 {
            let others = nodes.clone().filter(|&other| other != own).map(|other| node(other).0);
            let of_own = || others.map(|other| (x - other) / (node(own).0 - other)).product();
            if nodes.contains(&own) { of_own() } else { 0.0 }
        };
        for own in one.start..one.end.max(other.end) {
            if let (_, Some(change)) = node(own) {
                add_times(times * ((1.0 - part) * share(&one, own) + part * share(&other, own)), change, steps);
            }
        }
    }

    fn add_straight(&self, x: f64, times: f64, steps: &mut [Step]) {
        let mut add = |factor: f64, changes: &[Step]| add_times(times * factor, changes, steps);
        // Nothing changes at 0, which is a node as well.
        let (mut low, mut high): (Option<&Node>, Option<&Node>) = (None, None);
        for node in &self.simulated {
            if node.at <= x {
                low = Some(node);
            } else if high.is_none() {
                high = Some(node);
            }
        }
        match (low.filter(|low| x < 0.0 || low.at > 0.0), high.filter(|high| x >= 0.0 || high.at < 0.0)) {
            (Some(low), Some(high)) => {
                let part = (x - low.at) / (high.at - low.at);
                add(1.0 - part, &low.change);
                add(part, &high.change);
            }
            // Level beyond the last, to 0 before the first.
            (Some(last), None) if x > 0.0 => add(1.0, &last.change),
            (None, Some(last)) if x < 0.0 => add(1.0, &last.change),
            (Some(first), None) | (None, Some(first)) => add(x / first.at, &first.change),
            // Where only less was simulated, more does the opposite, and the other way round.
            (None, None) => {
                if let Some(nearest) = if x >= 0.0 { self.simulated.last() } else { self.simulated.first() } {
                    add(x / nearest.at, &nearest.change);
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
        self.add_parts(at, way, variants, steps);
        if let Some((whole, share)) = self.most_of(at) {
            add_times(share, &whole.beyond, steps);
        }
    }

    /// The same of each cause and each two of them.
    fn add_parts(&self, at: &Coordinates, way: &Way, variants: &[Variant], steps: &mut [Step]) {
        self.add_each(at, way, variants, steps);
        for (pair, interplay) in &self.of_pair {
            add_times(interplay.share(*pair, at), &interplay.beyond, steps);
        }
    }

    /// The same of each cause, alone and all along beside others.
    fn add_each(&self, at: &Coordinates, way: &Way, variants: &[Variant], steps: &mut [Step]) {
        for (axis, value) in at {
            if let Some(response) = self.of_axis.get(axis) {
                response.add(way.along(axis, *value, variants), 1.0, steps);
            }
        }
        for (both, beside) in &self.beside {
            if let Some((share, value)) = beside.place(*both, at) {
                beside.response.add(value, share, steps);
            }
        }
    }

    /// Whether one of two variants was simulated all along beside the other.
    pub fn is_beside(&self, [one, other]: [usize; 2]) -> bool {
        let both = |(cause, axis): &(usize, Axis)| [*cause, axis.variant];
        self.beside.keys().map(both).any(|both| both == [one, other] || both == [other, one])
    }

    /// Of the answers that are part of a hypothesis and were simulated at once the one of which there is most, part by part, and
    /// how much of it there is.
    fn most_of(&self, at: &Coordinates) -> Option<(&Whole, f64)> {
        let part = |whole| Some((whole, Whole::share(whole, at))).filter(|(_, share)| *share > 0.0);
        self.of_all.iter().filter_map(part).max_by(|a, b| {
            let parts = |(whole, share): &(&Whole, f64)| share * whole.at.len() as f64;
            parts(a).total_cmp(&parts(b))
        })
    }

    /// Takes what pairs and answers do beyond their parts anew, where more is known of those.
    pub fn apportion(&mut self, way: &Way, variants: &[Variant]) {
        // Where two are known along both, the second is what the first does not have.
        for (both, mut beside) in std::mem::take(&mut self.beside) {
            beside.apportion(both, |at, steps| self.add_each(at, way, variants, steps));
            self.beside.insert(both, beside);
        }
        let mut pairs = std::mem::take(&mut self.of_pair);
        for (pair, interplay) in &mut pairs {
            let mut parts = vec![[0.0; 3]; interplay.simulated.len()];
            self.add_each(&interplay.coordinates(*pair), way, variants, &mut parts);
            interplay.beyond.clone_from(&interplay.simulated);
            subtract(&mut interplay.beyond, &parts);
        }
        self.of_pair = pairs;
        let mut all = std::mem::take(&mut self.of_all);
        for whole in &mut all {
            let mut parts = vec![[0.0; 3]; whole.simulated.len()];
            self.add_parts(&whole.coordinates(), way, variants, &mut parts);
            whole.beyond.clone_from(&whole.simulated);
            subtract(&mut whole.beyond, &parts);
        }
        self.of_all = all;
    }

    /// Adds what `to` changes beyond `from` of the same axes and more; whether that is anything.
    pub fn add_beyond(
        &self,
        from: &Coordinates,
        to: &Coordinates,
        way: &Way,
        variants: &[Variant],
        steps: &mut [Step],
    ) -> bool {
        let before = |axis: &Axis| from.iter().find(|(known, _)| known == axis).map_or(0.0, |(_, value)| *value);
        let moved: Vec<(Axis, f64)> = to.iter().copied().filter(|(axis, value)| before(axis) != *value).collect();
        let mut is_something = false;
        for (axis, value) in &moved {
            if let Some(response) = self.of_axis.get(axis) {
                response.add(way.along(axis, *value, variants), 1.0, steps);
                response.add(way.along(axis, before(axis), variants), -1.0, steps);
                is_something = true;
            }
        }
        let is_moved = |variant: &usize| moved.iter().any(|(axis, _)| axis.variant == *variant);
        for (both, beside) in &self.beside {
            let [before, now] = [from, to].map(|at| beside.place(*both, at));
            if before != now {
                for (place, times) in [(now, 1.0), (before, -1.0)] {
                    place.into_iter().for_each(|(share, value)| beside.response.add(value, times * share, steps));
                }
                is_something = true;
            }
        }
        for (pair, interplay) in self.of_pair.iter().filter(|(pair, _)| pair.iter().any(is_moved)) {
            let beyond = interplay.share(*pair, to) - interplay.share(*pair, from);
            add_times(beyond, &interplay.beyond, steps);
            is_something |= beyond != 0.0;
        }
        let [before, now] = [from, to].map(|at| self.most_of(at));
        if let (Some((one, before)), Some((other, now))) = (before, now)
            && std::ptr::eq(one, other)
        {
            add_times(now - before, &one.beyond, steps);
            return is_something || now != before;
        }
        for (whole, times) in [(now, 1.0), (before, -1.0)] {
            if let Some((whole, share)) = whole {
                add_times(times * share, &whole.beyond, steps);
                is_something = true;
            }
        }
        is_something
    }
}

pub(super) const NO_ERRORS: [f64; RELATIVE] = [0.0; RELATIVE];

/// What responses are taken to err by in each component, relative.
pub(super) fn errors_of_response(at: &Coordinates, variants: &[Variant]) -> [f64; RELATIVE] {
    let is_error = |axis: &Axis| variants[axis.variant].is_error_of_response(axis.coordinate);
    let mut errors = NO_ERRORS;
    for (axis, value) in at.iter().filter(|(axis, _)| is_error(axis)) {
        errors[axis.coordinate] = *value;
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;
    use crate::scene::{Feature, TermPart};

    /// A response of one step through `change` at `nodes`.
    fn through(change: impl Fn(f64) -> f64, nodes: &[f64]) -> Response {
        Response::smooth(nodes.iter().map(|&at| Node::own(at, vec![[change(at), 0.0, 0.0]])).collect())
    }

    fn at(response: &Response, x: f64) -> f64 {
        let mut steps = [[0.0; 3]];
        response.add(x, 1.0, &mut steps);
        steps[0][0]
    }

    #[test]
    fn it_goes_through_what_was_simulated_and_through_nothing_at_0() {
        let wild = |x: f64| x * (5.0 * x).cos();
        for nodes in [&[0.7][..], &[1.0, 2.0], &[1.0, -1.0], &[-1.0, 1.0, 3.1, 2.9], &[-2.0, -3.0, -0.2, 0.1, 4.0]] {
            let response = through(wild, nodes);
            for &node in nodes.iter().chain(&[0.0]) {
                assert!((at(&response, node) - wild(node)).abs() < 1e-12, "{nodes:?} at {node}");
            }
        }
    }

    #[test]
    fn parabolas_are_returned_everywhere() {
        let parabola = |x: f64| 0.8 * x - 0.3 * x * x;
        for nodes in [&[1.0, 2.0][..], &[1.0, -1.0], &[-1.0, 2.5, 1.0, 1.3], &[-1.0, -2.0, 0.3, 1.0]] {
            let response = through(parabola, nodes);
            for x in [-4.0, -1.5, -0.4, 0.2, 1.1, 1.9, 5.0] {
                assert!((at(&response, x) - parabola(x)).abs() < 1e-12, "{nodes:?} at {x}");
            }
        }
    }

    #[test]
    fn its_slope_has_no_jump_and_a_kink_bends_its_neighbourhood_only() {
        let kinked = |x: f64| x.min(1.25);
        let nodes = [-1.0, 1.0, 2.0, 3.0, 4.0];
        let response = through(kinked, &nodes);
        let slope = |x: f64, by: f64| (at(&response, x + by) - at(&response, x)) / by;
        for node in [-1.0, 0.0, 1.0, 2.0, 3.0] {
            assert!((slope(node, 1e-6) - slope(node, -1e-6)).abs() < 1e-4, "at {node}");
        }
        // Lines on either side of the two nodes about the kink and their neighbours.
        for x in [-2.0, -0.5, 3.5, 5.0] {
            assert!((at(&response, x) - kinked(x)).abs() < 1e-12, "at {x}");
        }
    }

    fn step(x: f64) -> Vec<Step> {
        vec![[x, 0.0, 0.0]]
    }

    fn axis(variant: usize) -> Axis {
        Axis { variant, coordinate: 0 }
    }

    /// Causes of one coordinate each, and a way of one step.
    fn causes(count: usize) -> (Vec<Variant>, Way) {
        let variants = (0..count).map(|_| Variant::empirical(TermPart::Forward, Feature::Speed, 1.0)).collect();
        let start = Pose2::IDENTITY;
        (variants, Way { start, steps: step(0.0), bows: Vec::new(), began: 0.0, lasts: 1.0, hours: 0.0 })
    }

    /// Two causes that do neither a sum nor a product: what was simulated along each of them beside the other comes out, and their
    /// slopes there, also where more is known of one of them since; beyond it what they do together is level.
    #[test]
    fn what_was_simulated_along_two_causes_comes_out_along_both() {
        let (variants, way) = causes(2);
        let together = |a: f64, b: f64| a * a - b + a * b * (b - 3.0 * a).cos();
        let through = |nodes: &[f64], change: &dyn Fn(f64) -> f64| {
            Response::smooth(nodes.iter().map(|&at| Node::own(at, step(change(at)))).collect())
        };
        let mut responses = Responses::default();
        responses.of_axis.insert(axis(0), through(&[1.0, 2.0], &|a| together(a, 0.0)));
        responses.of_axis.insert(axis(1), through(&[1.0, -1.0], &|b| together(0.0, b)));
        let (a, b) = (1.3, -0.7);
        let about = |x: f64| [-0.1, -0.05, 0.0, 0.05, 0.1].map(|by| x + by);
        let node = |cause: f64, value: f64, change: f64| Together {
            cause: vec![cause],
            value,
            change: step(change),
            is_amid: value == b,
        };
        let mut along = |both: (usize, Axis), nodes: Vec<Together>| {
            responses.beside.entry(both).or_insert_with(Beside::new).simulated_at(nodes);
            responses.apportion(&way, &variants);
        };
        // Elsewhere before, and no more of it then.
        along((0, axis(1)), [-0.9, -0.75, -0.65].map(|b| node(0.4, b, together(0.4, b))).to_vec());
        along((0, axis(1)), about(b).map(|b| node(a, b, together(a, b))).to_vec());
        along((1, axis(0)), about(a).map(|a| node(b, a, together(a, b))).to_vec());
        responses.of_axis.insert(axis(0), through(&[1.0, 1.25, 2.0], &|a| together(a, 0.0) + 0.1 * a));
        responses.apportion(&way, &variants);
        let changed = |a: f64, b: f64| {
            let mut steps = step(0.0);
            responses.add_exact(&[(axis(0), a), (axis(1), b)], &way, &variants, &mut steps);
            steps[0][0]
        };
        for (one, other) in about(a).map(|a| (a, b)).into_iter().chain(about(b).map(|b| (a, b))) {
            assert!((changed(one, other) - together(one, other)).abs() < 1e-12, "{one}, {other}");
        }
        // The next term of a parabola through nodes `h` apart, h²/6 of the third derivative, which is less than 60.
        let slope = |of: &dyn Fn(f64) -> f64, x: f64| (of(x + 1e-6) - of(x - 1e-6)) / 2e-6;
        let off = [
            slope(&|x| changed(x, b), a) - slope(&|x| together(x, b), a),
            slope(&|x| changed(a, x), b) - slope(&|x| together(a, x), b),
        ];
        assert!(off.iter().all(|off| off.abs() < 60.0 * 0.05 * 0.05 / 6.0), "{off:?}");
        let beyond = |b: f64| changed(a, b) - changed(0.0, b);
        assert!((beyond(-2.0) - beyond(-0.9)).abs() < 1e-12);
        let knows = |at: [f64; 2], value: f64| {
            let at = [(axis(0), at[0]), (axis(1), at[1])];
            responses.beside[&(0, axis(1))].is_known(0, &at, (value, 0.01), 0.02)
        };
        assert!(knows([a, b], b) && !knows([1.1 * a, b], b) && !knows([a, b], b - 0.1));
    }

    /// Causes whose changes multiply: what was simulated at once comes out where it was simulated and near it, also where more
    /// is known of one of them since, and not where one of them is hardly there; what is less of it then does.
    #[test]
    fn what_was_simulated_at_once_comes_out_where_it_was() {
        let (variants, way) = causes(3);
        let mut responses = Responses::default();
        for variant in 0..3 {
            responses.of_axis.insert(axis(variant), Response::smooth(vec![Node::own(1.0, step(1.0))]));
        }
        let simulated = |responses: &mut Responses, values: &[f64], x: f64| {
            let at = values.iter().enumerate().map(|(variant, value)| (variant, vec![*value])).collect();
            responses.of_all.push(Whole { at, simulated: step(x), beyond: Vec::new() });
            responses.apportion(&way, &variants);
        };
        simulated(&mut responses, &[2.0, 3.0, 5.0], 7.0);
        let changed = |responses: &Responses, values: [f64; 3]| {
            let at: Vec<(Axis, f64)> = (0..3).map(|variant| (axis(variant), values[variant])).collect();
            let mut steps = step(0.0);
            responses.add_exact(&at, &way, &variants, &mut steps);
            steps[0][0]
        };
        assert_eq!(changed(&responses, [2.0, 3.0, 5.0]), 7.0);
        assert_eq!(changed(&responses, [2.1, 3.0, 5.0]), 7.1);
        assert_eq!(changed(&responses, [2.0, 0.0, 5.0]), 7.0);
        assert_eq!(changed(&responses, [2.0, 0.75, 5.0]), 7.75 - 1.5);
        simulated(&mut responses, &[2.0, 3.0], 6.0);
        assert_eq!(changed(&responses, [2.0, 3.0, 5.0]), 7.0);
        assert_eq!(changed(&responses, [2.0, 3.0, 0.01]), 6.01);
        responses.of_axis.insert(axis(0), Response::smooth(vec![Node::own(1.0, step(1.5))]));
        responses.apportion(&way, &variants);
        assert_eq!(changed(&responses, [2.0, 3.0, 5.0]), 7.0);
        assert_eq!(changed(&responses, [2.0, 3.0, 0.0]), 6.0);
    }
}
