//! Tables with a header: encoders, poses, or both in one row. A column's unit is in its name or in `--map`; it is never
//! guessed.

use super::error::{ImportError, TableProblem};
use super::log::{FromAbove, Planar, Row, Wheels};
use super::stamp::{self, Nanoseconds};
use crate::dataset::EncoderUnit;
use crate::geometry::Pose2;
use std::path::Path;

/// What a table holds.
pub(super) struct Table {
    pub(super) wheels: Option<Wheels>,
    pub(super) poses: Option<Vec<Row<Pose2>>>,
    /// Poses that were not measured.
    pub(super) dropouts: usize,
}

/// What a column is, and what its numbers are multiplied by to be SI.
#[derive(Debug, Clone, PartialEq)]
enum Target {
    /// The power of ten that makes nanoseconds of it.
    Time(i32),
    Wheel {
        channel: String,
        unit: EncoderUnit,
        factor: f64,
    },
    /// x, y, heading.
    Plan(usize, f64),
    Quaternion(usize),
}

impl Target {
    fn parse(name: &str) -> Option<Target> {
        if let Some(part) = ["qx", "qy", "qz", "qw"].iter().position(|part| *part == name) {
            return Some(Target::Quaternion(part));
        }
        let (quantity, unit) = name.rsplit_once('_')?;
        let length = || [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)].into_iter().find(|(name, _)| *name == unit);
        match quantity {
            "t" => {
                let powers = [("s", 9), ("ms", 6), ("us", 3), ("ns", 0)];
                powers.into_iter().find(|(name, _)| *name == unit).map(|(_, power)| Target::Time(power))
            }
            "x" => length().map(|(_, factor)| Target::Plan(0, factor)),
            "y" => length().map(|(_, factor)| Target::Plan(1, factor)),
            "heading" => match unit {
                "rad" => Some(Target::Plan(2, 1.0)),
                "deg" => Some(Target::Plan(2, 1f64.to_radians())),
                _ => None,
            },
            _ if quantity.ends_with("left") || quantity.ends_with("right") => {
                let (unit, factor) = match unit {
                    "ticks" => (EncoderUnit::Ticks, 1.0),
                    "rad" => (EncoderUnit::Radians, 1.0),
                    "deg" => (EncoderUnit::Radians, 1f64.to_radians()),
                    _ => return None,
                };
                Some(Target::Wheel { channel: quantity.to_owned(), unit, factor })
            }
            _ => None,
        }
    }
}

/// A column that is read.
struct Column {
    place: usize,
    /// Its name in the file.
    name: String,
    target_name: String,
    target: Target,
}

/// Reads the table in `text`; `map` pairs targets with columns, and columns that are named like targets need none.
pub(super) fn read(path: &Path, text: &str, map: &[(String, String)]) -> Result<Table, ImportError> {
    let fails = |line, problem| ImportError::Table { path: path.to_owned(), line, problem };
    let text = text.trim_start_matches('\u{feff}');
    let first = text.lines().next().unwrap_or("");
    let delimiter =
        [b',', b';', b'\t'].into_iter().max_by_key(|byte| (first.bytes().filter(|b| b == byte).count(), *byte == b','));
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter.unwrap_or(b','))
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(text.as_bytes());
    let unreadable = |error: csv::Error| ImportError::Read { path: path.to_owned(), source: error.into() };
    let header: Vec<String> = reader.headers().map_err(unreadable)?.iter().map(str::to_owned).collect();
    let columns = columns(&header, map).map_err(|problem| fails(1, problem))?;

    let mut wheels = wheels(&columns);
    let planned: Vec<&Column> = [0, 1, 2]
        .into_iter()
        .filter_map(|part| columns.iter().find(|column| matches!(column.target, Target::Plan(p, _) if p == part)))
        .collect();
    let turned: Vec<&Column> = columns.iter().filter(|column| matches!(column.target, Target::Quaternion(_))).collect();
    let mut poses = (!planned.is_empty()).then(Vec::new);
    let mut above = FromAbove::default();

    let mut last: Option<Nanoseconds> = None;
    let mut line = 1;
    for record in reader.records() {
        let record = record.map_err(unreadable)?;
        line = record.position().map_or(line + 1, csv::Position::line);
        if record.iter().all(str::is_empty) {
            continue;
        }
        if record.len() != header.len() {
            return Err(fails(line, TableProblem::Ragged { found: record.len(), expected: header.len() }));
        }
        let value = |column: &Column, allowed| {
            let (column, value) = (column.name.clone(), record[column.place].to_owned());
            fails(line, TableProblem::Value { column, value, allowed })
        };
        let number = |column: &Column| {
            record[column.place].parse::<f64>().map_err(|_| value(column, "a number with a decimal point"))
        };
        let mut stamp = 0;
        for column in &columns {
            if let Target::Time(power) = column.target {
                let text = &record[column.place];
                stamp = stamp::scaled(text, power).ok_or_else(|| value(column, "a time with a decimal point"))?;
            }
        }
        if let Some(before) = last.filter(|before| *before > stamp) {
            let (before, after) = (stamp::seconds(before), stamp::seconds(stamp));
            return Err(fails(line, TableProblem::TimeGoesBack { before, after }));
        }
        last = Some(stamp);
        let arrival = stamp;
        if let Some(wheels) = &mut wheels {
            let mut counts = Vec::with_capacity(wheels.channels.len());
            for column in &columns {
                if let Target::Wheel { factor, .. } = column.target {
                    let count = number(column)?;
                    if !count.is_finite() {
                        return Err(value(column, "a finite number"));
                    }
                    counts.push(count * factor);
                }
            }
            wheels.rows.push(Row { stamp, arrival, value: counts });
        }
        if let Some(poses) = &mut poses {
            // A survey is often slower than the encoders that it shares a table with.
            if planned.iter().all(|column| record[column.place].is_empty()) {
                continue;
            }
            let mut plan = [0.0; 3];
            for column in &planned {
                if let Target::Plan(part, factor) = column.target {
                    plan[part] = number(column)? * factor;
                }
            }
            let mut quaternion = [0.0, 0.0, 0.0, 1.0];
            for column in &turned {
                if let Target::Quaternion(part) = column.target {
                    quaternion[part] = number(column)?;
                }
            }
            let seen = above.see([plan[0], plan[1], plan[2]], quaternion);
            if let Planar::Pose(seen) = seen.map_err(|problem| fails(line, TableProblem::Pose(problem)))? {
                let heading = if turned.is_empty() { plan[2] } else { seen.heading };
                poses.push(Row { stamp, arrival, value: Pose2::new(seen.x, seen.y, heading) });
            }
        }
    }
    if last.is_none() {
        return Err(fails(1, TableProblem::Empty));
    }
    above.check().map_err(|problem| fails(line, TableProblem::Pose(problem)))?;
    Ok(Table { wheels, poses, dropouts: above.dropouts })
}

/// The columns that are read: those that `map` names, and those whose own name says what they are.
fn columns(header: &[String], map: &[(String, String)]) -> Result<Vec<Column>, TableProblem> {
    let mut columns: Vec<Column> = Vec::new();
    let mut problem = None;
    for (target_name, name) in map {
        let target =
            Target::parse(target_name).ok_or_else(|| TableProblem::NoTarget { target: target_name.clone() })?;
        match header.iter().position(|column| column == name) {
            Some(place) => {
                columns.push(Column { place, name: name.clone(), target_name: target_name.clone(), target });
            }
            // One map serves several files, of encoders and of poses.
            None => {
                problem.get_or_insert(TableProblem::NoColumn {
                    target: target_name.clone(),
                    column: name.clone(),
                    there: header.to_vec(),
                });
            }
        }
    }
    for (place, name) in header.iter().enumerate() {
        let mapped = columns.iter().any(|column| column.place == place || column.target_name == *name);
        if let Some(target) = Target::parse(name).filter(|_| !mapped) {
            columns.push(Column { place, name: name.clone(), target_name: name.clone(), target });
        }
    }
    columns.sort_by_key(|column| column.place);
    let has = |wanted: &dyn Fn(&Target) -> bool| columns.iter().find(|column| wanted(&column.target));
    let time = has(&|target| matches!(target, Target::Time(_)));
    let left = has(&|target| matches!(target, Target::Wheel { channel, .. } if channel.ends_with("left")));
    let right = has(&|target| matches!(target, Target::Wheel { channel, .. } if channel.ends_with("right")));
    let plan = |part: usize| has(&move |target| matches!(target, Target::Plan(p, _) if *p == part));
    let turns = columns.iter().filter(|column| matches!(column.target, Target::Quaternion(_))).count();
    let incomplete = |there: &Column, lacks| {
        Err(problem.clone().unwrap_or(TableProblem::Incomplete { there: there.target_name.clone(), lacks }))
    };
    match (left, right) {
        (Some(there), None) => return incomplete(there, "the right wheels"),
        (None, Some(there)) => return incomplete(there, "the left wheels"),
        _ => {}
    }
    match (plan(0), plan(1)) {
        (Some(there), None) => return incomplete(there, "y"),
        (None, Some(there)) => return incomplete(there, "x"),
        (Some(there), Some(_)) if plan(2).is_none() && turns < 4 => {
            return incomplete(there, "the heading (heading_rad, heading_deg, or qx, qy, qz and qw)");
        }
        _ => {}
    }
    match (time, left.or(plan(0))) {
        (Some(_), Some(_)) => Ok(columns),
        (None, Some(there)) => incomplete(there, "the time (t_s, t_ms, t_us or t_ns)"),
        (_, None) => Err(problem.unwrap_or(TableProblem::Untold { there: header.to_vec() })),
    }
    .and_then(|columns| match unit_clash(&columns) {
        Some((first, second)) => Err(TableProblem::MixedUnits { first, second }),
        None => Ok(columns),
    })
}

fn unit_clash(columns: &[Column]) -> Option<(String, String)> {
    let mut wheels = columns.iter().filter_map(|column| match &column.target {
        Target::Wheel { unit, .. } => Some((*unit, &column.target_name)),
        _ => None,
    });
    let (unit, first) = wheels.next()?;
    wheels.find(|(other, _)| *other != unit).map(|(_, second)| (first.clone(), second.clone()))
}

fn wheels(columns: &[Column]) -> Option<Wheels> {
    let mut found: Option<Wheels> = None;
    for column in columns {
        if let Target::Wheel { channel, unit, .. } = &column.target {
            let wheels = found.get_or_insert_with(|| Wheels { unit: *unit, channels: Vec::new(), rows: Vec::new() });
            wheels.channels.push(channel.clone());
        }
    }
    found
}
