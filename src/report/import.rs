//! What became of recordings, for the terminal.

use super::text::{Style, table};
use crate::dataset::{Dataset, Protocol};

/// The runs of `dataset`: what each is taken for beside what its odometry says was `driven`, how long, how often read.
pub fn import(dataset: &Dataset, driven: &[Option<Protocol>]) -> String {
    let mut table = table(Style::Terminal, &["run", "protocol", "by odometry", "lasts [s]", "readings", "poses"]);
    for (run, driven) in dataset.runs.iter().zip(driven) {
        let lasts = run.encoders.as_ref().and_then(|log| Some(log.time.last()? - log.time.first()?));
        table.add_row([
            run.name.clone(),
            words(&run.protocol, |size| size.to_string()),
            driven.map_or("–".to_owned(), |driven| words(&driven, |size| format!("{size:.4}"))),
            lasts.map_or("–".to_owned(), |lasts| format!("{lasts:.2}")),
            run.encoders.as_ref().map_or(0, |log| log.len()).to_string(),
            run.poses.as_ref().map_or(0, |log| log.time.len()).to_string(),
        ]);
    }
    format!("{table}\n")
}

/// `square ccw 0.75 m`.
fn words(protocol: &Protocol, number: impl Fn(f64) -> String) -> String {
    let mut words = vec![protocol.kind().to_owned()];
    words.extend(protocol.direction().map(str::to_owned));
    words.extend(protocol.size().map(|size| format!("{} m", number(size))));
    if let Protocol::Spin { turn, .. } = protocol {
        words.push(format!("{turn:.4} rad"));
    }
    words.join(" ")
}
