//! What a cause changes along a way over its coordinates: a polynomial or lines through what was simulated.

use crate::diagnose::variant::{Axis, Coordinates, RELATIVE, Variant};
use crate::diagnose::way::{ARM, Step, Way, add_times, each};
use std::collections::BTreeMap;

/// What causes do to the steps of a cluster.
#[derive(Debug, Clone, Default)]
pub(super) struct Responses {
    pub of_axis: BTreeMap<Axis, Response>,
    /// By variants: of causes the lesser first, of a cause and what is in doubt of tyres the cause.
    pub of_pair: BTreeMap<[usize; 2], Interplay>,
}

/// What two variants do together beyond what each does alone.
#[derive(Debug, Clone)]
pub(super) struct Interplay {
    /// Coordinates of both where it was simulated.
    pub at: [Vec<f64>; 2],
    pub change: Vec<Step>,
}

/// How much of what `variant` is at `reference` it is at `at`: along that direction.
pub(super) fn share_of(at: &Coordinates, variant: usize, reference: &[f64]) -> f64 {
    let along = at.iter().filter(|(axis, _)| axis.variant == variant);
    let along: f64 = along.map(|(axis, value)| value * reference[axis.coordinate]).sum();
    along / reference.iter().map(|value| value * value).sum::<f64>()
}

impl Interplay {
    /// How much of it there is at `at` between both of `pair`.
    pub fn share(&self, [one, other]: [usize; 2], at: &Coordinates) -> f64 {
        share_of(at, one, &self.at[0]) * share_of(at, other, &self.at[1])
    }
}

/// A coordinate, and what the simulator says that it changes.
pub(super) type Node = (f64, Vec<Step>);

/// Change of the steps over one coordinate: through 0 at 0 and through what was simulated at each node.
#[derive(Debug, Clone)]
pub(super) struct Response {
    /// Coordinate and change of what was simulated.
    pub simulated: Vec<Node>,
    pub between: Between,
    /// Whether it was simulated on another way of its kind.
    pub carried: bool,
}

/// What is taken to happen between nodes.
#[derive(Debug, Clone)]
pub(super) enum Between {
    /// A polynomial: Newton's divided differences, one a node.
    Smooth(Vec<Vec<Step>>),
    /// Straight lines, level beyond the ends: below a grip at which wheels cannot turn the robot, all is otherwise.
    Straight,
}

impl Response {
    /// Of a variant.
    pub fn of(variant: &Variant, simulated: Vec<Node>) -> Response {
        if variant.place().is_some() { Response::straight(simulated) } else { Response::smooth(simulated) }
    }

    pub fn smooth(simulated: Vec<Node>) -> Response {
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

    pub fn straight(mut simulated: Vec<Node>) -> Response {
        simulated.sort_by(|a, b| a.0.total_cmp(&b.0));
        Response { simulated, between: Between::Straight, carried: false }
    }

    /// Adds the change at coordinate `x`, so many times, to `steps`.
    pub fn add(&self, x: f64, times: f64, steps: &mut [Step]) {
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
    pub fn add_beyond(
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
