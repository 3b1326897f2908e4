//! Shards put together: the table that one machine would have written.

use super::error::SweepError;
use super::journal::{self, Kept};
use super::plan::Plan;
use super::shard::Shard;
use super::{TABLE, table};
use std::path::{Path, PathBuf};

/// What shards came to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Merged {
    /// How many.
    pub shards: usize,
    /// Rows of the table.
    pub points: usize,
    /// How many of them could not be done.
    pub failures: usize,
    /// The table.
    pub table: PathBuf,
}

/// Puts the shards in `folders`, or in folders inside them, into one table in `into`.
///
/// # Errors
/// Shards of different plans, versions, inputs or cuts; shards that are missing, twice there or not run to their end.
pub fn merge(folders: &[PathBuf], into: &Path) -> Result<Merged, SweepError> {
    let mut shards = Vec::new();
    for folder in folders {
        shards.extend(found(folder)?);
    }
    shards.sort_by_key(|kept| kept.header.shard);
    let [first, rest @ ..] = shards.as_slice() else {
        return Err(SweepError::NoShards { folder: folders.first().cloned().unwrap_or_default() });
    };
    let own = journal::Header::new(first.header.shard, first.header.points, first.header.inputs.clone());
    first.header.belongs(&own, &first.folder)?;
    for other in rest {
        if other.plan != first.plan {
            return Err(SweepError::OtherPlan { folder: other.folder.clone(), other: first.folder.clone() });
        }
        other.header.belongs(&first.header, &other.folder)?;
        if other.header.shard.of() != first.header.shard.of() {
            return Err(SweepError::OtherCut {
                folder: other.folder.clone(),
                found: other.header.shard.to_string(),
                other: first.folder.clone(),
                other_shard: first.header.shard.to_string(),
            });
        }
    }
    for pair in shards.windows(2) {
        if pair[0].header.shard == pair[1].header.shard {
            return Err(SweepError::SameShard {
                folder: pair[0].folder.clone(),
                other: pair[1].folder.clone(),
                shard: pair[0].header.shard.to_string(),
            });
        }
    }
    let of = first.header.shard.of();
    let missing: Vec<String> = (0..of)
        .filter(|&index| !shards.iter().any(|kept| kept.header.shard.index() == index))
        .filter_map(|index| Some(Shard::new(index, of)?.to_string()))
        .collect();
    if !missing.is_empty() {
        return Err(SweepError::MissingShards { missing });
    }
    let plan = Plan::parse(&first.folder.join("plan.toml"), first.plan.clone())?;
    let unfinished: Vec<(PathBuf, String, usize)> = shards
        .iter()
        .filter_map(|kept| {
            let left = left(kept, plan.len());
            (left > 0).then(|| (kept.folder.clone(), kept.header.shard.to_string(), left))
        })
        .collect();
    if !unfinished.is_empty() {
        return Err(SweepError::Unfinished { unfinished });
    }
    let header = first.header.clone();
    let count = shards.len();
    let mut records: Vec<_> = shards.into_iter().flat_map(|kept| kept.records).collect();
    records.sort_by_key(|(index, _)| *index);
    records.dedup_by_key(|(index, _)| *index);
    let points = records.len();
    let failures = super::failures(&records).len();
    std::fs::create_dir_all(into).map_err(|source| SweepError::Io { file: into.to_owned(), source })?;
    let file = into.join(TABLE);
    table(&plan, &header, records).write(&file)?;
    Ok(Merged { shards: count, points, failures, table: file })
}

/// The shard in `folder`, or those in the folders inside it.
fn found(folder: &Path) -> Result<Vec<Kept>, SweepError> {
    if let Some(kept) = journal::kept(folder)? {
        return Ok(vec![kept]);
    }
    let failed = |source| SweepError::Io { file: folder.to_owned(), source };
    let mut shards = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.is_dir() {
            shards.extend(journal::kept(&path)?);
        }
    }
    if shards.is_empty() { Err(SweepError::NoShards { folder: folder.to_owned() }) } else { Ok(shards) }
}

/// How many of a shard's points are not done.
fn left(kept: &Kept, points: usize) -> usize {
    let mut is_left = vec![false; points];
    kept.header.shard.points(points).for_each(|index| is_left[index] = true);
    kept.records.iter().filter(|(index, _)| *index < points).for_each(|(index, _)| is_left[*index] = false);
    is_left.iter().filter(|left| **left).count()
}
