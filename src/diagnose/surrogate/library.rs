//! Responses that were simulated before, carried over to other runs of their kind.

use super::Surrogate;
use super::response::Responses;
use crate::diagnose::case::{Case, Cluster, Condition};
use crate::diagnose::variant::Variant;
use crate::diagnose::way::{Step, Way, each};

/// Responses of a robot in conditions that were simulated before: what causes do to one run they do to the next of its
/// kind, place by place along the way.
#[derive(Debug, Clone, Default)]
pub struct Library {
    /// Of the spots on the floor, in the order of their variants.
    pub(super) places: Vec<[f64; 2]>,
    entries: Vec<Entry>,
}

#[derive(Debug, Clone)]
pub(super) struct Entry {
    condition: Condition,
    /// Time that its log takes \[s\]; `None` without a log. A log with other stops in it is another manoeuvre.
    duration: Option<f64>,
    /// Progress at the end of each step.
    progress: Vec<f64>,
    responses: Responses,
}

impl Library {
    /// What a surrogate simulated.
    pub(in crate::diagnose) fn of_surrogate(
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

    pub(super) fn of(&self, case: &Case) -> Option<&Entry> {
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
    pub(super) fn along(&self, way: &Way) -> Responses {
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
        let of_axis = self.responses.of_axis.iter().map(|(axis, response)| (*axis, response.carried_over(carry)));
        Responses { of_axis: of_axis.collect(), ..Responses::default() }
    }
}
