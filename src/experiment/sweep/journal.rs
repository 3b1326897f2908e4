//! The journal: one record a point that is done, kept as it comes, so that a sweep ended at any moment goes on from there.
//!
//! A record is a line of its own, `CRC-32 of the rest`, a space, the point's index and its cells, set apart by tabs.
//! A line that was being written when the process ended is not whole or fails its sum, and is the last one: it is dropped,
//! and its point done again. Numbers are written with as many digits as bring the same bits back.

use super::error::SweepError;
use super::shard::Shard;
use crate::table::Cell;
use serde::{Deserialize, Serialize};
use std::fs::{File, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const PLAN: &str = "plan.toml";
const JOURNAL: &str = "journal.tsv";
/// What a sweep may leave in its folder when it is ended between two steps.
const OWN: [&str; 3] = [PLAN, JOURNAL, "plan.toml.part"];
/// Records that may wait for the disk, and how long. Losing them costs time, and no result.
const BATCH: (usize, Duration) = (64, Duration::from_secs(1));

/// The first line: what the records are of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Header {
    format: String,
    pub version: String,
    pub shard: Shard,
    pub points: usize,
    /// Sum over the robot and world as loaded: their files may change where the plan does not.
    pub inputs: String,
}

/// A point that is done.
pub(super) type Record = (usize, Vec<Cell>);

/// A folder's plan and records.
#[derive(Debug)]
pub(super) struct Kept {
    pub folder: PathBuf,
    pub plan: String,
    pub header: Header,
    pub records: Vec<Record>,
}

/// A journal that records are added to. Its file is locked while it is open.
#[derive(Debug)]
pub(super) struct Journal {
    file: File,
    path: PathBuf,
    waiting: usize,
    synced: Instant,
}

impl Header {
    pub(super) fn new(shard: Shard, points: usize, inputs: String) -> Header {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Header { format: "treadmark-sweep-journal/1".to_owned(), version, shard, points, inputs }
    }

    /// Whether records under `self`, found in `folder`, belong with those under `own`.
    pub(super) fn belongs(&self, own: &Header, folder: &Path) -> Result<(), SweepError> {
        let folder = folder.to_owned();
        if self.version != own.version || self.format != own.format {
            let found = self.version.clone();
            return Err(SweepError::OtherVersion { folder, found, own: env!("CARGO_PKG_VERSION") });
        }
        if self.inputs != own.inputs || self.points != own.points {
            return Err(SweepError::OtherInputs { folder });
        }
        Ok(())
    }
}

impl Journal {
    /// Opens the journal in `folder`, which is made where it is not there; with it, the records that it holds.
    pub(super) fn open(
        folder: &Path,
        plan: &Path,
        text: &str,
        own: &Header,
    ) -> Result<(Journal, Vec<Record>), SweepError> {
        let in_folder = |source| SweepError::Io { file: folder.to_owned(), source };
        std::fs::create_dir_all(folder).map_err(in_folder)?;
        let mut foreign = false;
        for entry in std::fs::read_dir(folder).map_err(in_folder)? {
            let name = entry.map_err(in_folder)?.file_name();
            foreign |= !OWN.iter().any(|own| name == *own);
        }
        let kept = folder.join(PLAN);
        if foreign && !kept.is_file() {
            return Err(SweepError::NotASweep { folder: folder.to_owned() });
        }
        let path = folder.join(JOURNAL);
        let failed = |source| SweepError::Io { file: path.clone(), source };
        let mut file =
            File::options().read(true).write(true).create(true).truncate(false).open(&path).map_err(failed)?;
        // Some shared file systems have no locks; there, two on one folder is the user's to avoid.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(SweepError::Busy { folder: folder.to_owned() });
        }
        match std::fs::read_to_string(&kept) {
            Ok(there) if there == text => {}
            Ok(_) => return Err(SweepError::OtherPlan { folder: folder.to_owned(), other: plan.to_owned() }),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => keep_plan(folder, text)?,
            Err(source) => return Err(SweepError::Io { file: kept, source }),
        }

        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let (header, records, whole) = parse(&path, &bytes)?;
        if let Some(header) = &header {
            header.belongs(own, folder)?;
            if header.shard != own.shard {
                let (found, asked) = (header.shard.to_string(), own.shard.to_string());
                return Err(SweepError::OtherShard { folder: folder.to_owned(), found, asked });
            }
        }
        file.set_len(whole as u64).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        let mut journal = Journal { file, path, waiting: 0, synced: Instant::now() };
        if header.is_none() {
            let mut line = serde_json::to_string(own).expect("strings and numbers are JSON");
            line.push('\n');
            journal.write(line.as_bytes())?;
            journal.sync()?;
            // The names in the folder go to the disk too.
            if let Ok(open) = File::open(folder) {
                open.sync_all().map_err(|source| SweepError::Io { file: folder.to_owned(), source })?;
            }
        }
        Ok((journal, records))
    }

    /// Adds a record. It is on the disk after the batch, or after [`Journal::sync`].
    pub(super) fn add(&mut self, index: usize, cells: &[Cell]) -> Result<(), SweepError> {
        self.write(line(index, cells).as_bytes())?;
        self.waiting += 1;
        if self.waiting >= BATCH.0 || self.synced.elapsed() >= BATCH.1 { self.sync() } else { Ok(()) }
    }

    /// Puts what was added on the disk.
    pub(super) fn sync(&mut self) -> Result<(), SweepError> {
        self.file.sync_data().map_err(|source| SweepError::Io { file: self.path.clone(), source })?;
        self.waiting = 0;
        self.synced = Instant::now();
        Ok(())
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), SweepError> {
        self.file.write_all(bytes).map_err(|source| SweepError::Io { file: self.path.clone(), source })
    }
}

/// What `folder` keeps; `None` where it is no sweep's.
pub(super) fn kept(folder: &Path) -> Result<Option<Kept>, SweepError> {
    let read = |name: &str| match std::fs::read(folder.join(name)) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(SweepError::Io { file: folder.join(name), source }),
    };
    let (Some(plan), Some(journal)) = (read(PLAN)?, read(JOURNAL)?) else { return Ok(None) };
    let (Some(header), records, _) = parse(&folder.join(JOURNAL), &journal)? else { return Ok(None) };
    let plan = String::from_utf8_lossy(&plan).into_owned();
    Ok(Some(Kept { folder: folder.to_owned(), plan, header, records }))
}

/// The plan's own text, whole or not there at all.
fn keep_plan(folder: &Path, text: &str) -> Result<(), SweepError> {
    let part = folder.join("plan.toml.part");
    let write = || {
        let mut file = File::create(&part)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        std::fs::rename(&part, folder.join(PLAN))
    };
    write().map_err(|source| SweepError::Io { file: folder.join(PLAN), source })
}

/// Header, records, and the length of what is whole [bytes].
fn parse(file: &Path, bytes: &[u8]) -> Result<(Option<Header>, Vec<Record>, usize), SweepError> {
    let mut records: Vec<Record> = Vec::new();
    let mut header = None;
    let mut whole = 0;
    for (number, line) in bytes.split_inclusive(|&byte| byte == b'\n').enumerate() {
        let last = whole + line.len() == bytes.len();
        let text = line.strip_suffix(b"\n").and_then(|line| std::str::from_utf8(line).ok());
        let understood = match text {
            Some(text) if number == 0 => {
                header = serde_json::from_str(text).ok();
                header.is_some()
            }
            Some(text) => parse_line(text).is_some_and(|record| {
                records.push(record);
                true
            }),
            None => false,
        };
        match understood {
            true => whole += line.len(),
            false if last => break,
            false => return Err(SweepError::Damaged { file: file.to_owned(), line: number + 1 }),
        }
    }
    Ok((header, records, whole))
}

fn line(index: usize, cells: &[Cell]) -> String {
    let mut rest = index.to_string();
    for cell in cells {
        rest.push('\t');
        match cell {
            // Rust writes the shortest digits that read back as the same bits.
            Cell::Number(value) => rest.push_str(&format!("n{value:?}")),
            Cell::Whole(value) => rest.push_str(&format!("w{value}")),
            // JSON has no bare tabs or ends of lines.
            Cell::Text(text) => rest.push_str(&format!("t{}", serde_json::Value::from(text.as_str()))),
            Cell::Absent => rest.push('-'),
        }
    }
    format!("{:08x} {rest}\n", crc32fast::hash(rest.as_bytes()))
}

fn parse_line(line: &str) -> Option<Record> {
    let (sum, rest) = line.split_once(' ')?;
    if u32::from_str_radix(sum, 16).ok()? != crc32fast::hash(rest.as_bytes()) {
        return None;
    }
    let mut parts = rest.split('\t');
    let index = parts.next()?.parse().ok()?;
    let cell = |part: &str| {
        if part == "-" {
            return Some(Cell::Absent);
        }
        let (kind, value) = part.split_at_checked(1)?;
        match kind {
            "n" => Some(Cell::Number(value.parse().ok()?)),
            "w" => Some(Cell::Whole(value.parse().ok()?)),
            "t" => Some(Cell::Text(serde_json::from_str(value).ok()?)),
            _ => None,
        }
    };
    Some((index, parts.map(cell).collect::<Option<_>>()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_comes_back_bit_by_bit() {
        let cells = vec![
            Cell::Number(0.1 + 0.2),
            Cell::Number(-0.0),
            Cell::Number(f64::MIN_POSITIVE / 3.0),
            Cell::Whole(u64::MAX),
            Cell::Text("a\tb\n\"c\" δ".to_owned()),
            Cell::Absent,
        ];
        let text = line(7, &cells);
        let (index, back) = parse_line(text.strip_suffix('\n').expect("it ends")).expect("it parses");
        assert_eq!(index, 7);
        assert_eq!(format!("{cells:?}"), format!("{back:?}"));
        for end in 0..text.len() - 1 {
            let torn = text.get(..end).unwrap_or("");
            assert!(parse_line(torn).is_none(), "{torn:?} is taken for whole");
        }
    }
}
