//! `treadmark effects`: every cause that a diagnosis can name.

use crate::effect::EFFECTS;
use crate::report::{json, text};
use clap::Args;

/// Arguments of `treadmark effects`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Print JSON on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    if arguments.json {
        let effects: Vec<json::EffectJson> = EFFECTS.iter().map(json::EffectJson::new).collect();
        sayln!("{}", serde_json::to_string_pretty(&effects)?)?;
    } else {
        say!("{}", text::effects())?;
    }
    Ok(())
}
