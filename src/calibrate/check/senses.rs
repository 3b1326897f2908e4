//! Which way a run turned and went, by its three witnesses: label, survey and encoders.

use super::SuspicionKind::{
    ColumnsSwapped, CountSignBoth, DirectionLabel, EncoderSidesSwapped, HeadingSign, StartEndSwapped, TurnDisagrees,
    XAxisFlipped, YAxisFlipped,
};
use super::logs::heading_on_ways;
use super::way::along_wheels;
use super::{SuspicionKind, Work, inverse, label, share, stated_turn, vector};
use crate::dataset::{EncoderLog, Protocol, Rotation, SurveyedPose, Travel};
use crate::geometry::Pose2;
use std::f64::consts::FRAC_PI_2;

/// Which way round.
pub(super) fn turns(work: &mut Work) {
    let (mut by_label, mut by_encoders, mut by_survey) = (Vec::new(), Vec::new(), Vec::new());
    let (mut survey_or_label, mut encoders_or_label, mut encoders_agree) = (Vec::new(), Vec::new(), false);
    for (index, run) in work.data.runs.iter().enumerate() {
        let Some(direction) = label(&run.protocol) else { continue };
        let at_least = stated_turn(&run.protocol).map_or(FRAC_PI_2, |turn| 0.5 * turn);
        let sense = |turn: f64, least: f64| (turn.abs() > least).then_some(turn * direction > 0.0);
        // True: as the label says.
        let surveyed = run.end.and_then(|end| end.heading).and_then(|heading| sense(heading, at_least));
        let logged = work.logged_turn(run).and_then(|turn| sense(turn, 0.3));
        encoders_agree |= logged == Some(true);
        match (surveyed, logged) {
            (Some(false), Some(false)) => by_label.push(index),
            (Some(true), Some(false)) => by_encoders.push(index),
            (Some(false), Some(true)) => by_survey.push(index),
            (Some(false), None) => survey_or_label.push(index),
            (None, Some(false)) => encoders_or_label.push(index),
            _ => {}
        }
    }
    // Columns are swapped for a whole file: without a heading a single run against the rest is its label.
    if !by_encoders.is_empty() {
        by_encoders.append(&mut encoders_or_label);
        by_encoders.sort_unstable();
    } else if encoders_agree {
        by_label.append(&mut encoders_or_label);
        by_label.sort_unstable();
    }
    if !encoders_or_label.is_empty() {
        let (seen, expected) = turn_and_label(work, encoders_or_label[0]);
        work.suspect(TurnDisagrees, &encoders_or_label, seen, expected);
        work.logs_exact = false;
    }
    if let Some(&first) = by_encoders.first() {
        let (seen, expected) = turn_and_label(work, first);
        work.suspect(EncoderSidesSwapped, &by_encoders, seen, expected);
        for index in by_encoders {
            work.data.runs[index].encoders.iter_mut().for_each(swap_sides);
        }
    }
    // Survey against a label that the encoders confirm: which of three ways to a wrong sign is told by the position.
    if !by_survey.is_empty() {
        let kind = wrong_survey(work, &by_survey).unwrap_or(YAxisFlipped);
        mend_survey(work, kind, by_survey);
    }
    survey_against_label(work, survey_or_label, &mut by_label);
    if let Some(&first) = by_label.first() {
        let expected = label(&work.data.runs[first].protocol).unwrap_or(1.0)
            * stated_turn(&work.data.runs[first].protocol).unwrap_or(0.0);
        let run = &work.data.runs[first];
        let seen = run.end.and_then(|end| end.heading).or_else(|| work.logged_turn(run)).unwrap_or(0.0);
        work.suspect(DirectionLabel, &by_label, seen, expected);
        for index in by_label {
            turn_round(&mut work.data.runs[index].protocol);
        }
    }
    paths(work);
}

/// Logged turn of a run and the turn by its label \[rad\].
fn turn_and_label(work: &Work, index: usize) -> (f64, f64) {
    let run = &work.data.runs[index];
    let turn = stated_turn(&run.protocol).or(run.end.and_then(|end| end.heading).map(f64::abs)).unwrap_or(0.0);
    (work.logged_turn(run).unwrap_or(0.0), label(&run.protocol).unwrap_or(1.0) * turn)
}

/// How a noted end is set right.
type Mend = fn(SurveyedPose) -> SurveyedPose;

/// What a survey with a wrong heading sign may have been.
const WAYS: [(SuspicionKind, Mend); 3] = [
    (YAxisFlipped, |end| SurveyedPose { x: end.x, y: -end.y, heading: end.heading.map(|heading| -heading) }),
    (StartEndSwapped, inverse),
    (HeadingSign, |end| SurveyedPose { x: end.x, y: end.y, heading: end.heading.map(|heading| -heading) }),
];

/// Which of the ways makes the pattern that driving makes, by a clear margin: the right one explains nearly all of it,
/// a wrong one a ninth (see [`share`]).
fn wrong_survey(work: &Work, runs: &[usize]) -> Option<SuspicionKind> {
    let mut fits: Vec<(f64, SuspicionKind)> = WAYS
        .into_iter()
        .map(|(kind, mend)| {
            let vectors: Vec<_> = runs
                .iter()
                .filter_map(|&index| {
                    let run = &work.data.runs[index];
                    let (Protocol::Square { side, direction }, Some(end)) = (run.protocol, run.end) else {
                        return None;
                    };
                    let nominal = run.protocol.nominal_end()?;
                    let end = mend(end);
                    let error = SurveyedPose { heading: end.heading.map(|heading| heading - nominal.heading), ..end };
                    Some((vector(error, side), direction.sign()))
                })
                .collect();
            (share(&vectors), kind)
        })
        .collect();
    fits.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    (fits[0].0 > 0.7 && fits[1].0 < 0.5).then_some(fits[0].1)
}

/// Notes the suspicion and mends the ends.
fn mend_survey(work: &mut Work, kind: SuspicionKind, runs: Vec<usize>) {
    let Some((_, mend)) = WAYS.into_iter().find(|(way, _)| *way == kind) else { return };
    let Some(&first) = runs.first() else { return };
    let seen = work.data.runs[first].end.and_then(|end| end.heading).unwrap_or(0.0);
    let (_, expected) = turn_and_label(work, first);
    work.suspect(kind, &runs, seen, expected);
    for index in runs {
        let run = &mut work.data.runs[index];
        run.end.iter_mut().for_each(|end| *end = mend(*end));
        // A way that turns as the end did is written in the same way; a start seen from the end is of ends alone.
        let Some(log) = run.poses.as_mut().filter(|_| kind != StartEndSwapped) else { continue };
        let turned = |pose: Option<&SurveyedPose>| pose.and_then(|pose| pose.heading).unwrap_or(0.0);
        if turned(log.poses.last()) * turned(run.end.as_ref()) < 0.0 {
            log.poses.iter_mut().for_each(|pose| *pose = mend(*pose));
        }
    }
}

/// Survey against label without encoders. A label that is wrong looks like its mirror image, so that only the other
/// runs can tell: the end is near those of the other direction, or mirrored near those of its own.
fn survey_against_label(work: &mut Work, runs: Vec<usize>, by_label: &mut Vec<usize>) {
    if runs.is_empty() {
        return;
    }
    let mean = |work: &Work, side: f64, direction: Rotation| {
        let ends: Vec<SurveyedPose> = work
            .data
            .runs
            .iter()
            .enumerate()
            .filter(|(index, run)| run.protocol == Protocol::Square { side, direction } && !runs.contains(index))
            .filter_map(|(_, run)| run.end)
            .collect();
        let n = ends.len() as f64;
        let sum = |value: fn(&SurveyedPose) -> f64| ends.iter().map(value).sum::<f64>() / n;
        (n > 0.0).then(|| Pose2::new(sum(|end| end.x), sum(|end| end.y), 0.0))
    };
    let mut of: Vec<(SuspicionKind, Vec<usize>)> = Vec::new();
    for &index in &runs {
        let run = &work.data.runs[index];
        let mut kind = DirectionLabel;
        if let (Protocol::Square { side, direction }, Some(end)) = (run.protocol, run.end) {
            let other = match direction {
                Rotation::Clockwise => Rotation::CounterClockwise,
                Rotation::CounterClockwise => Rotation::Clockwise,
            };
            let at = |end: SurveyedPose| Pose2::new(end.x, end.y, 0.0);
            if let (Some(own), Some(other)) = (mean(work, side, direction), mean(work, side, other)) {
                let mut near: Vec<(f64, SuspicionKind)> =
                    WAYS.into_iter().map(|(way, mend)| (at(mend(end)).distance(own), way)).collect();
                near.push((at(end).distance(other), DirectionLabel));
                near.sort_by(|(one, _), (other, _)| one.total_cmp(other));
                // Three times nearer than the next, or it is the plainest of mistakes: a label.
                if near[0].0 < near[1].0 / 3.0 {
                    kind = near[0].1;
                }
            }
        }
        match of.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, list)) => list.push(index),
            None => of.push((kind, vec![index])),
        }
    }
    // Every square of the campaign at once: start and end swapped is the one mistake that is no mirror image.
    let squares = work.indices(|run| matches!(run.protocol, Protocol::Square { .. }) && run.end.is_some());
    if squares.iter().all(|index| runs.contains(index)) && wrong_survey(work, &runs) == Some(StartEndSwapped) {
        of = vec![(StartEndSwapped, runs.clone())];
    }
    for (kind, runs) in of {
        if kind == DirectionLabel {
            by_label.extend(runs);
            by_label.sort_unstable();
        } else {
            mend_survey(work, kind, runs);
        }
    }
}

/// Paths have no label: encoders stand against survey, over all paths together, and nothing tells which is right.
fn paths(work: &mut Work) {
    let Some((runs, [left, right])) = heading_on_ways(work) else { return };
    if left > 0.0 && right < 0.0 {
        let indices: Vec<usize> = runs.iter().map(|(index, ..)| *index).collect();
        let widest = runs.iter().max_by(|(_, _, one), (_, _, other)| one.abs().total_cmp(&other.abs()));
        let (seen, expected) = widest.map_or((0.0, 0.0), |(index, _, heading)| {
            (work.logged_turn(&work.data.runs[*index]).unwrap_or(0.0), *heading)
        });
        let columns = work.found.iter().any(|found| found.kind == EncoderSidesSwapped);
        // Swapped columns leave the way as it is; wheels that both count down turn it round as well.
        if !columns && along_wheels(work, &indices).is_some_and(|[along, way]| along < -0.5 * way) {
            let way = work.logged_way(&work.data.runs[indices[0]]).unwrap_or(0.0);
            work.suspect(CountSignBoth, &indices, way, -way);
            work.logs_exact = false;
            return;
        }
        work.suspect(if columns { EncoderSidesSwapped } else { TurnDisagrees }, &indices, seen, expected);
    }
}

/// Which way along.
pub(super) fn travel(work: &mut Work) {
    let (mut by_label, mut by_encoders, mut by_survey, mut swapped) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut right = false;
    for (index, run) in work.data.runs.iter().enumerate() {
        let Protocol::Straight { length, direction } = run.protocol else { continue };
        // A third of the length is far from nothing and farther from the other sign.
        let sense = |way: f64| (way.abs() > length / 3.0).then(|| way * direction.sign() > 0.0);
        let logged = work.logged_way(run).and_then(sense);
        // Across instead of along; an inch of side slip is not two thirds of the length.
        if run.end.is_some_and(|end| end.y.abs() > 2.0 / 3.0 * length && end.x.abs() < length / 3.0) {
            swapped.push(index);
            continue;
        }
        let surveyed = run.end.and_then(|end| sense(end.x));
        right |= surveyed == Some(true);
        match (surveyed, logged) {
            (Some(false), Some(false)) => by_label.push(index),
            (Some(true) | None, Some(false)) => by_encoders.push(index),
            (Some(false), _) => by_survey.push(index),
            _ => {}
        }
    }
    if let Some(&first) = swapped.first() {
        let (seen, expected) = way_and_label(work, first);
        // The columns of a file, so all of its runs; where some straights are right, those rows alone.
        let runs = if right { swapped } else { work.indices(|run| run.end.is_some()) };
        work.suspect(ColumnsSwapped, &runs, seen, expected);
        for index in runs {
            if let Some(end) = &mut work.data.runs[index].end {
                (end.x, end.y) = (end.y, end.x);
            }
        }
    }
    if let Some(&first) = by_survey.first() {
        let (seen, expected) = way_and_label(work, first);
        if let Some(slot) = work.found.iter().position(|found| found.kind == StartEndSwapped) {
            // The same hand that swapped them on the squares.
            let names: Vec<String> = by_survey.iter().map(|&index| work.data.runs[index].name.clone()).collect();
            work.found[slot].runs.extend(names);
            for index in by_survey {
                if let Some(end) = &mut work.data.runs[index].end {
                    *end = inverse(*end);
                }
            }
        } else {
            let runs = if right { by_survey } else { work.indices(|run| run.end.is_some()) };
            work.suspect(XAxisFlipped, &runs, seen, expected);
            for index in runs {
                if let Some(end) = &mut work.data.runs[index].end {
                    end.x = -end.x;
                }
            }
        }
    }
    if let Some(&first) = by_label.first() {
        let (seen, expected) = way_and_label(work, first);
        work.suspect(DirectionLabel, &by_label, seen, expected);
        for index in by_label {
            if let Protocol::Straight { direction, .. } = &mut work.data.runs[index].protocol {
                *direction = match direction {
                    Travel::Forward => Travel::Reverse,
                    Travel::Reverse => Travel::Forward,
                };
            }
        }
    }
    if let Some(&first) = by_encoders.first() {
        let seen = work.logged_way(&work.data.runs[first]).unwrap_or(0.0);
        let (_, expected) = way_and_label(work, first);
        work.suspect(CountSignBoth, &by_encoders, seen, expected);
        work.logs_exact = false;
    }
}

/// Surveyed way of a straight along x and the way by its label \[m\].
fn way_and_label(work: &Work, index: usize) -> (f64, f64) {
    let run = &work.data.runs[index];
    (run.end.map_or(0.0, |end| end.x), run.protocol.nominal_end().map_or(0.0, |end| end.x))
}

fn swap_sides(log: &mut EncoderLog) {
    for channel in &mut log.channels {
        *channel = match (channel.strip_suffix("left"), channel.strip_suffix("right")) {
            (Some(stem), _) => format!("{stem}right"),
            (_, Some(stem)) => format!("{stem}left"),
            _ => continue,
        };
    }
}

fn turn_round(protocol: &mut Protocol) {
    if let Protocol::Square { direction, .. } | Protocol::Spin { direction, .. } | Protocol::Circle { direction, .. } =
        protocol
    {
        *direction = match direction {
            Rotation::Clockwise => Rotation::CounterClockwise,
            Rotation::CounterClockwise => Rotation::Clockwise,
        };
    }
}
