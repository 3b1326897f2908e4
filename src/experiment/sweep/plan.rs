//! The plan: what a point is, what is varied and over what.
//!
//! ```toml
//! format = "treadmark-sweep/1"
//! point = "run"                        # run, campaign or challenge
//! seed = 1                             # point k has seed + k
//! repeats = 3                          # of every combination, with fresh noise
//! robot = "jnpf_4wd"                   # a shipped robot, or a model file beside this plan
//! world = "lab_floor"
//!
//! [protocol]
//! kind = "square"
//! side_m = 2.0
//!
//! [set]                                # the same at every point
//! "floor_slope.gradient" = 0.01
//!
//! [[grid]]                             # every combination with every other
//! parameter = "tyre.friction_across"
//! values = [0.6, 0.8, 1.0]
//!
//! [[grid]]
//! parameter = "floor_slope.downhill_heading_rad"
//! from = -3.0
//! to = 3.0
//! count = 7
//! ```
//!
//! Instead of a grid or with it, `[list]` (`parameters`, and `points` with one value each) and `[sample]` (`method`
//! random or sobol, `count`, and `[[sample.over]]` with `parameter`, `from`, `to`, `scale`). All of them are combined:
//! the list varies slowest, then the sample, then grids in their order, then repeats.

use super::error::SweepError;
use super::key::{Allowed, Key, Target, Value};
use crate::strict;
use crate::table::Column;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Points of a plan at most: their rows are put together in memory.
pub const MOST_POINTS: usize = 10_000_000;
/// Samples of one scrambled Sobol sequence at most, and its dimensions [the `sobol_burley` crate].
const SOBOL: (u32, usize) = (1 << 16, 256);

/// What is done at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PointKind {
    /// One protocol is driven.
    Run,
    /// Squares both ways round, a calibration, and squares again.
    Campaign,
    /// One hidden-effect draw, diagnosed and scored.
    Challenge,
}

/// What a run drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProtocolKind {
    /// Four straights and four turns.
    Square,
    /// One straight.
    Straight,
    /// A turn on the spot.
    Spin,
    /// A circle or part of one.
    Circle,
}

/// How wheels meet the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum TyreLaw {
    Patch,
    Rigid,
}

/// A sweep as it was asked for.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The file's own text: what tells one sweep from another.
    pub text: String,
    /// The file.
    pub file: PathBuf,
    /// What is done at a point.
    pub kind: PointKind,
    /// What a run drives.
    pub protocol: ProtocolKind,
    /// Of point 0; point k has `seed` + k.
    pub seed: u64,
    /// Points with the same values and fresh noise.
    pub repeats: usize,
    pub(super) tyre_law: TyreLaw,
    pub(super) survey_noise: bool,
    pub(super) scatter: bool,
    pub(super) mismatch: bool,
    set: Vec<(Key, Value)>,
    factors: Vec<Factor>,
}

/// Keys that vary together, and the values that they take.
#[derive(Debug, Clone)]
struct Factor {
    keys: Vec<Key>,
    rows: Vec<Vec<Value>>,
}

/// One point of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// From 0, in the table's order.
    pub index: usize,
    /// Which repeat, from 1.
    pub repeat: usize,
    /// Of its noise.
    pub seed: u64,
    /// One a varied key.
    pub values: Vec<Value>,
}

#[derive(Deserialize)]
enum Format {
    #[serde(rename = "treadmark-sweep/1")]
    V1,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(rename = "format")]
    _format: Format,
    #[serde(rename = "description", default)]
    _description: String,
    point: PointKind,
    #[serde(default = "one")]
    seed: u32,
    #[serde(default = "one")]
    repeats: u32,
    robot: Option<Spanned<Value>>,
    world: Option<Spanned<Value>>,
    time_step_s: Option<Spanned<Value>>,
    #[serde(default = "yes")]
    survey_noise: bool,
    #[serde(default = "yes")]
    scatter: bool,
    #[serde(default = "patch")]
    tyre_law: TyreLaw,
    protocol: Option<Spanned<ProtocolTable>>,
    campaign: Option<Spanned<CampaignTable>>,
    challenge: Option<Spanned<ChallengeTable>>,
    #[serde(default)]
    set: BTreeMap<Spanned<KeyName>, Spanned<Value>>,
    #[serde(default)]
    grid: Vec<GridTable>,
    list: Option<ListTable>,
    sample: Option<SampleTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ProtocolTable {
    kind: ProtocolKind,
    side_m: Option<Spanned<Value>>,
    length_m: Option<Spanned<Value>>,
    radius_m: Option<Spanned<Value>>,
    turn_rad: Option<Spanned<Value>>,
    direction: Option<Spanned<Value>>,
    speed_m_s: Option<Spanned<Value>>,
    turn_rate_rad_s: Option<Spanned<Value>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CampaignTable {
    side_m: Option<Spanned<Value>>,
    runs: Option<Spanned<Value>>,
    method: Option<Spanned<Value>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ChallengeTable {
    data: Option<Spanned<Value>>,
    effects: Option<Spanned<Value>>,
    campaign: Option<Spanned<Value>>,
    #[serde(default)]
    mismatch: bool,
}

/// A key in the place of a table's key, in whose order the table is kept.
#[derive(Deserialize)]
#[serde(transparent)]
struct KeyName(Key);

impl PartialEq for KeyName {
    fn eq(&self, other: &KeyName) -> bool {
        self.0.name() == other.0.name()
    }
}

impl Eq for KeyName {}

impl PartialOrd for KeyName {
    fn partial_cmp(&self, other: &KeyName) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for KeyName {
    fn cmp(&self, other: &KeyName) -> std::cmp::Ordering {
        self.0.name().cmp(other.0.name())
    }
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Scale {
    #[default]
    Linear,
    Log,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GridTable {
    parameter: Spanned<Key>,
    values: Option<Vec<Spanned<Value>>>,
    from: Option<Spanned<Value>>,
    to: Option<Spanned<Value>>,
    count: Option<u32>,
    #[serde(default)]
    scale: Scale,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ListTable {
    parameters: Vec<Spanned<Key>>,
    points: Vec<Spanned<Vec<Spanned<Value>>>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum SampleMethod {
    Random,
    Sobol,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SampleTable {
    method: SampleMethod,
    count: Spanned<u32>,
    over: Vec<SampleOver>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SampleOver {
    parameter: Spanned<Key>,
    from: Spanned<Value>,
    to: Spanned<Value>,
    #[serde(default)]
    scale: Scale,
}

fn one() -> u32 {
    1
}

fn yes() -> bool {
    true
}

fn patch() -> TyreLaw {
    TyreLaw::Patch
}

impl ProtocolKind {
    fn as_str(self) -> &'static str {
        match self {
            ProtocolKind::Square => "square",
            ProtocolKind::Straight => "straight",
            ProtocolKind::Spin => "spin",
            ProtocolKind::Circle => "circle",
        }
    }
}

impl Scale {
    /// The value at `share` (0 to 1) of the way from `from` to `to`.
    fn at(self, from: f64, to: f64, share: f64) -> f64 {
        match self {
            _ if share == 0.0 => from,
            _ if share == 1.0 => to,
            Scale::Linear => from + share * (to - from),
            Scale::Log => (from.ln() + share * (to.ln() - from.ln())).exp(),
        }
    }
}

impl Plan {
    /// Reads a plan.
    ///
    /// # Errors
    /// It cannot be read, or what is wrong where, and what is allowed.
    pub fn read(file: &Path) -> Result<Plan, SweepError> {
        let text = std::fs::read_to_string(file).map_err(|source| SweepError::Io { file: file.to_owned(), source })?;
        Plan::parse(file, text)
    }

    /// The plan in `text`; `file` is what messages call it, and where robot and world files are looked for.
    ///
    /// # Errors
    /// What is wrong where, and what is allowed.
    pub fn parse(file: &Path, text: String) -> Result<Plan, SweepError> {
        let parsed: File = strict::parse(&text).map_err(|source| SweepError::Toml { file: file.to_owned(), source })?;
        let mut reader = Reader {
            file,
            text: &text,
            kind: parsed.point,
            protocol: parsed.protocol.as_ref().map_or(ProtocolKind::Square, |table| table.get_ref().kind),
            varied: Vec::new(),
        };
        let set = reader.set(&parsed)?;
        let mut factors = Vec::new();
        if let Some(list) = &parsed.list {
            factors.push(reader.list(list)?);
        }
        if let Some(sample) = &parsed.sample {
            factors.push(reader.sample(sample, parsed.seed)?);
        }
        for grid in &parsed.grid {
            factors.push(reader.grid(grid)?);
        }
        let points =
            factors.iter().map(|factor| factor.rows.len() as u128).product::<u128>() * u128::from(parsed.repeats);
        if points == 0 || points > MOST_POINTS as u128 {
            return Err(SweepError::TooMany { file: file.to_owned(), points, most: MOST_POINTS });
        }
        let protocol = reader.protocol;
        Ok(Plan {
            file: file.to_owned(),
            kind: parsed.point,
            protocol,
            seed: u64::from(parsed.seed),
            repeats: parsed.repeats as usize,
            tyre_law: parsed.tyre_law,
            survey_noise: parsed.survey_noise,
            scatter: parsed.scatter,
            mismatch: parsed.challenge.is_some_and(|table| table.get_ref().mismatch),
            set,
            factors,
            text,
        })
    }

    /// How many points it has.
    pub fn len(&self) -> usize {
        self.factors.iter().map(|factor| factor.rows.len()).product::<usize>() * self.repeats
    }

    /// Never: a plan has a point at least.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Point `index` of [`Plan::len`].
    pub fn point(&self, index: usize) -> Point {
        let mut rest = index / self.repeats;
        let mut rows: Vec<&[Value]> = Vec::with_capacity(self.factors.len());
        for factor in self.factors.iter().rev() {
            rows.push(&factor.rows[rest % factor.rows.len()]);
            rest /= factor.rows.len();
        }
        Point {
            index,
            repeat: index % self.repeats + 1,
            seed: self.seed + index as u64,
            values: rows.into_iter().rev().flatten().cloned().collect(),
        }
    }

    /// The keys that vary, in the order of [`Point::values`].
    pub fn keys(&self) -> impl Iterator<Item = &Key> {
        self.factors.iter().flat_map(|factor| &factor.keys)
    }

    /// What holds at `point`: what is the same everywhere, then what varies.
    pub(super) fn settings<'a>(&'a self, point: &'a Point) -> impl Iterator<Item = (&'a Key, &'a Value)> + Clone {
        let same = self.set.iter().map(|(key, value)| (key, value));
        same.chain(self.factors.iter().flat_map(|factor| &factor.keys).zip(&point.values))
    }

    /// Every word that `key` takes anywhere in the plan, or `default`.
    pub(super) fn words(&self, key: &str, default: &str) -> Vec<String> {
        let mut words: Vec<String> = Vec::new();
        let mut keep = |value: &Value| {
            if let Value::Text(text) = value
                && !words.contains(text)
            {
                words.push(text.clone());
            }
        };
        for factor in &self.factors {
            if let Some(column) = factor.keys.iter().position(|known| known.name() == key) {
                factor.rows.iter().for_each(|row| keep(&row[column]));
            }
        }
        if words.is_empty() {
            let same = self.set.iter().find(|(known, _)| known.name() == key);
            return vec![same.map_or(default.to_owned(), |(_, value)| match value {
                Value::Text(text) => text.clone(),
                Value::Number(value) => value.to_string(),
            })];
        }
        words
    }

    /// The columns that say which point a row is.
    pub fn columns(&self) -> Vec<Column> {
        let mut columns = vec![Column::whole("point"), Column::whole("repeat"), Column::whole("seed")];
        columns.extend(self.keys().map(|key| {
            // Dots would have to be quoted in most query languages.
            let name = key.name().replace('.', "_");
            if key.takes_text() { Column::text(name) } else { Column::number(name) }
        }));
        columns
    }
}

/// Checks what a plan says, and says where it is wrong.
struct Reader<'a> {
    file: &'a Path,
    text: &'a str,
    kind: PointKind,
    protocol: ProtocolKind,
    varied: Vec<String>,
}

impl Reader<'_> {
    /// The values that hold at every point.
    fn set(&self, file: &File) -> Result<Vec<(Key, Value)>, SweepError> {
        let mut set = Vec::new();
        let mut keep = |name: &str, value: &Option<Spanned<Value>>| -> Result<(), SweepError> {
            if let (Some(value), Some(key)) = (value, Key::named(name)) {
                self.here(&key, value.span().start)?;
                set.push((key.clone(), self.value(&key, value)?));
            }
            Ok(())
        };
        keep("robot", &file.robot)?;
        keep("world", &file.world)?;
        keep("time_step_s", &file.time_step_s)?;
        if let Some(table) = &file.protocol {
            self.table_here("protocol", PointKind::Run, table.span().start)?;
            let table = table.get_ref();
            keep("protocol.side_m", &table.side_m)?;
            keep("protocol.length_m", &table.length_m)?;
            keep("protocol.radius_m", &table.radius_m)?;
            keep("protocol.turn_rad", &table.turn_rad)?;
            keep("protocol.direction", &table.direction)?;
            keep("protocol.speed_m_s", &table.speed_m_s)?;
            keep("protocol.turn_rate_rad_s", &table.turn_rate_rad_s)?;
        }
        if let Some(table) = &file.campaign {
            self.table_here("campaign", PointKind::Campaign, table.span().start)?;
            let table = table.get_ref();
            keep("campaign.side_m", &table.side_m)?;
            keep("campaign.runs", &table.runs)?;
            keep("campaign.method", &table.method)?;
        }
        if let Some(table) = &file.challenge {
            self.table_here("challenge", PointKind::Challenge, table.span().start)?;
            let table = table.get_ref();
            keep("challenge.data", &table.data)?;
            keep("challenge.effects", &table.effects)?;
            keep("challenge.campaign", &table.campaign)?;
        }
        for (key, value) in &file.set {
            let at = key.span().start;
            let key = &key.get_ref().0;
            self.here(key, at)?;
            set.push((key.clone(), self.value(key, value)?));
        }
        Ok(set)
    }

    fn list(&mut self, table: &ListTable) -> Result<Factor, SweepError> {
        let keys = table.parameters.iter().map(|key| self.vary(key)).collect::<Result<Vec<Key>, _>>()?;
        let rows = table.points.iter().map(|point| {
            let values = point.get_ref();
            if values.len() != keys.len() {
                let (line, column) = self.place(point.span().start);
                let (found, expected) = (values.len(), keys.len());
                return Err(SweepError::ListPoint { file: self.file.to_owned(), line, column, found, expected });
            }
            keys.iter().zip(values).map(|(key, value)| self.value(key, value)).collect::<Result<Vec<_>, _>>()
        });
        let rows = rows.collect::<Result<_, _>>()?;
        Ok(Factor { keys, rows })
    }

    fn grid(&mut self, table: &GridTable) -> Result<Factor, SweepError> {
        let key = self.vary(&table.parameter)?;
        let rows = match (&table.values, &table.from, &table.to, table.count) {
            (Some(values), None, None, None) if table.scale == Scale::Linear => {
                values.iter().map(|value| Ok(vec![self.value(&key, value)?])).collect::<Result<Vec<_>, SweepError>>()?
            }
            (None, Some(from), Some(to), Some(count)) if count >= 2 => {
                let [from, to] = self.range(&table.parameter, from, to, table.scale)?;
                let share = |step: u32| f64::from(step) / f64::from(count - 1);
                (0..count).map(|step| vec![Value::Number(table.scale.at(from, to, share(step)))]).collect()
            }
            _ => return Err(self.bad_range(&table.parameter)),
        };
        Ok(Factor { keys: vec![key], rows })
    }

    fn sample(&mut self, table: &SampleTable, seed: u32) -> Result<Factor, SweepError> {
        let keys = table.over.iter().map(|over| self.vary(&over.parameter)).collect::<Result<Vec<Key>, _>>()?;
        let ranges = table
            .over
            .iter()
            .map(|over| self.range(&over.parameter, &over.from, &over.to, over.scale))
            .collect::<Result<Vec<_>, _>>()?;
        let count = *table.count.get_ref();
        let (most, dimensions) =
            if table.method == SampleMethod::Sobol { SOBOL } else { (MOST_POINTS as u32, usize::MAX) };
        if count == 0 || count > most || keys.len() > dimensions {
            let allowed = Allowed::Whole(1, most);
            return Err(self.not_allowed(
                "sample.count",
                &Value::Number(f64::from(count)),
                &allowed,
                table.count.span().start,
            ));
        }
        // A stream of its own, so that no run's noise has the numbers of the sample.
        let mut rng = ChaCha8Rng::seed_from_u64(u64::from(seed));
        rng.set_stream(u64::from_le_bytes(*b"sampling"));
        let rows = (0..count).map(|row| {
            let cell = |(dimension, (over, [from, to])): (usize, (&SampleOver, &[f64; 2]))| {
                let share = match table.method {
                    SampleMethod::Random => (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64,
                    // Owen-scrambled [Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020].
                    SampleMethod::Sobol => f64::from(sobol_burley::sample(row, dimension as u32, seed)),
                };
                Value::Number(over.scale.at(*from, *to, share))
            };
            table.over.iter().zip(&ranges).enumerate().map(cell).collect()
        });
        let rows = rows.collect();
        Ok(Factor { keys, rows })
    }

    /// A key that varies: once, and only where it has a meaning.
    fn vary(&mut self, key: &Spanned<Key>) -> Result<Key, SweepError> {
        let at = key.span().start;
        let key = key.get_ref();
        self.here(key, at)?;
        if self.varied.iter().any(|known| known == key.name()) {
            let (line, column) = self.place(at);
            return Err(SweepError::Twice { file: self.file.to_owned(), line, column, key: key.name().to_owned() });
        }
        self.varied.push(key.name().to_owned());
        Ok(key.clone())
    }

    /// Both ends of a range.
    fn range(
        &self,
        key: &Spanned<Key>,
        from: &Spanned<Value>,
        to: &Spanned<Value>,
        scale: Scale,
    ) -> Result<[f64; 2], SweepError> {
        let ends = (self.value(key.get_ref(), from)?, self.value(key.get_ref(), to)?);
        let whole = matches!(key.get_ref().allowed(), Allowed::Whole(..));
        match ends {
            (Value::Number(low), Value::Number(high))
                if low < high && !whole && (scale == Scale::Linear || low > 0.0) =>
            {
                Ok([low, high])
            }
            _ => Err(self.bad_range(key)),
        }
    }

    fn bad_range(&self, key: &Spanned<Key>) -> SweepError {
        let (line, column) = self.place(key.span().start);
        SweepError::Range { file: self.file.to_owned(), line, column, key: key.get_ref().name().to_owned() }
    }

    /// A value that its key allows.
    fn value(&self, key: &Key, value: &Spanned<Value>) -> Result<Value, SweepError> {
        let mut allowed = key.allowed();
        if key.name() == "protocol.direction" {
            let straight = self.protocol == ProtocolKind::Straight;
            allowed = Allowed::OneOf(if straight { vec!["forward", "reverse"] } else { vec!["cw", "ccw"] });
        }
        if allowed.holds(value.get_ref()) {
            Ok(value.get_ref().clone())
        } else {
            Err(self.not_allowed(key.name(), value.get_ref(), &allowed, value.span().start))
        }
    }

    fn not_allowed(&self, key: &str, value: &Value, allowed: &Allowed, at: usize) -> SweepError {
        let (line, column) = self.place(at);
        let (key, value, allowed) = (key.to_owned(), value.to_string(), allowed.to_string());
        SweepError::Value { file: self.file.to_owned(), line, column, key, value, allowed }
    }

    /// Whether this kind of point, and its protocol, has the key.
    fn here(&self, key: &Key, at: usize) -> Result<(), SweepError> {
        let Target::Plan(word) = key.target else { return Ok(()) };
        let (table, _) = word.key.split_once('.').unwrap_or((word.key, ""));
        let of = match table {
            "protocol" => PointKind::Run,
            "campaign" => PointKind::Campaign,
            "challenge" => PointKind::Challenge,
            _ => return Ok(()),
        };
        self.table_here(key.name(), of, at)?;
        if !word.protocols.is_empty() && !word.protocols.contains(&self.protocol.as_str()) {
            return Err(self.not_here(key.name(), self.protocol.as_str(), at));
        }
        Ok(())
    }

    fn table_here(&self, key: &str, of: PointKind, at: usize) -> Result<(), SweepError> {
        let what = match self.kind {
            PointKind::Run => "run",
            PointKind::Campaign => "campaign",
            PointKind::Challenge => "challenge",
        };
        if self.kind == of { Ok(()) } else { Err(self.not_here(key, what, at)) }
    }

    fn not_here(&self, key: &str, what: &'static str, at: usize) -> SweepError {
        let (line, column) = self.place(at);
        SweepError::NotHere { file: self.file.to_owned(), line, column, key: key.to_owned(), what }
    }

    fn place(&self, offset: usize) -> (usize, usize) {
        strict::place(self.text, offset)
    }
}
