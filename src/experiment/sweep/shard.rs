//! A share of a sweep's points, the same wherever it is worked out.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Share `index` of `of`: the points whose index leaves `index` when divided by `of`. Neighbours cost alike, so that
/// shares cost alike too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Shard {
    index: usize,
    of: usize,
}

/// A share that is none.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("it must read I/N with whole numbers I < N, from 0/N on, as in 0/4")]
pub struct NotAShard;

impl Shard {
    /// All points.
    pub const WHOLE: Shard = Shard { index: 0, of: 1 };
    /// Shares at most.
    const MOST: usize = 100_000;

    /// Share `index` of `of`, where there is one.
    pub fn new(index: usize, of: usize) -> Option<Shard> {
        (index < of && of <= Shard::MOST).then_some(Shard { index, of })
    }

    /// Into how many shares the points are cut.
    pub fn of(self) -> usize {
        self.of
    }

    /// Which share.
    pub fn index(self) -> usize {
        self.index
    }

    /// Its points among `points`.
    pub fn points(self, points: usize) -> impl Iterator<Item = usize> {
        (self.index..points).step_by(self.of)
    }

    /// Its folder under a sweep's; `None` for the whole, which needs none.
    pub fn folder(self) -> Option<String> {
        (self != Shard::WHOLE).then(|| format!("shard-{}-of-{}", self.index, self.of))
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

impl FromStr for Shard {
    type Err = NotAShard;

    fn from_str(text: &str) -> Result<Shard, NotAShard> {
        let (index, of) = text.split_once('/').ok_or(NotAShard)?;
        let number = |text: &str| text.parse().map_err(|_| NotAShard);
        Shard::new(number(index)?, number(of)?).ok_or(NotAShard)
    }
}

impl TryFrom<String> for Shard {
    type Error = NotAShard;

    fn try_from(text: String) -> Result<Shard, NotAShard> {
        text.parse()
    }
}

impl From<Shard> for String {
    fn from(shard: Shard) -> String {
        shard.to_string()
    }
}
