//! How the error of a spin depends on friction across the tyre: a sweep from a plan in the code, and its rows.
//!
//! ```sh
//! cargo run --release --example sweep
//! ```

use std::error::Error;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use treadmark::experiment::sweep::{Plan, Shard, Sweep};

const PLAN: &str = r#"
format = "treadmark-sweep/1"
point = "run"
scatter = false
survey_noise = false

[protocol]
kind = "spin"

[[grid]]
parameter = "protocol.direction"
values = ["cw", "ccw"]

[[grid]]
parameter = "tyre.friction_across"
from = 0.6
to = 1.0
count = 3
"#;

/// Sweeps, twice: the second time there is nothing left to do.
pub fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::temp_dir().join(format!("treadmark-example-sweep-{}", std::process::id()));
    let sweep = Sweep::prepare(Plan::parse(Path::new("plan in the code"), PLAN.to_owned())?)?;
    for start in ["first", "second"] {
        let swept = sweep.run(&folder, Shard::WHOLE, &|_| {}, &AtomicBool::new(false))?;
        println!("{start} start: {} of {} points were there", swept.progress.before, swept.progress.points);
    }
    println!("{} bytes of Parquet", std::fs::read(folder.join("sweep.parquet"))?.len());
    Ok(std::fs::remove_dir_all(folder)?)
}
