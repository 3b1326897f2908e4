//! `treadmark challenge`: hidden effects, drawn for others or scored.

use super::options::{SceneOptions, set_threads};
use super::output;
use super::progress::{progress_bar, simulations};
use super::watch::stop_on_ctrl_c;
use crate::diagnose::Options;
use crate::experiment::{CampaignKind, Challenge, DataKind, EffectsKind, Scored, Scorer, Simulator};
use crate::report::challenge as report;
use clap::{Args, ValueEnum};

/// Arguments of `treadmark challenge`.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneOptions,
    /// What the diagnosis gets to see
    #[arg(long, value_enum, default_value_t = Data::Logs)]
    data: Data,
    /// What is hidden; mixed is one effect, or in one draw of five nothing
    #[arg(long, value_enum, default_value_t = Effects::Mixed)]
    effects: Effects,
    /// What is driven: 2 m and 4 m squares, or a straight, spins, circles and slow squares besides
    #[arg(long, value_enum, default_value_t = Campaign::Squares)]
    campaign: Campaign,
    /// Draw the world with another tyre law than the model's: other stiffness, other friction, or rigid cylinders
    #[arg(long)]
    mismatch: bool,
    /// With --mismatch: campaigns of that world before anything is hidden, on which the model is extended first
    #[arg(long, value_name = "N", requires = "mismatch", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=100))]
    clean: u16,
    /// Let the diagnosis keep to the model's law of tyres, also where another serves better
    #[arg(long)]
    hold_tyres: bool,
    /// Draw, diagnose and score a range of seeds
    #[arg(long)]
    score: bool,
    /// Seeds to score: the first, and the one after the last
    #[arg(long, value_name = "A..B", default_value = "1..201", value_parser = range)]
    seeds: (u64, u64),
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Data {
    Logs,
    Endpoints,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Effects {
    None,
    One,
    Two,
    Outside,
    Mixed,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Campaign {
    Squares,
    Full,
}

fn range(text: &str) -> Result<(u64, u64), String> {
    let parsed = text.split_once("..").and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    match parsed {
        Some((a, b)) if a < b => Ok((a, b)),
        _ => Err("it must read A..B with whole numbers A < B, as in 1..201".to_owned()),
    }
}

/// Draws a campaign, or scores a range of seeds.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    set_threads(arguments.scene.threads)?;
    let mut scene = arguments.scene.scene()?;
    // The step that the diagnosis simulates with: another one would be a mismatch of its own.
    scene.time_step = scene.time_step.max(Simulator::TIME_STEP);
    let stop = stop_on_ctrl_c();
    let challenge = Challenge {
        seed: arguments.scene.seed,
        data: match arguments.data {
            Data::Logs => DataKind::Logs,
            Data::Endpoints => DataKind::EndPoints,
        },
        effects: match arguments.effects {
            Effects::None => EffectsKind::None,
            Effects::One => EffectsKind::One,
            Effects::Two => EffectsKind::Two,
            Effects::Outside => EffectsKind::Outside,
            Effects::Mixed => EffectsKind::Mixed,
        },
        campaign: match arguments.campaign {
            Campaign::Squares => CampaignKind::Squares,
            Campaign::Full => CampaignKind::Full,
        },
        mismatch: arguments.mismatch,
        clean_campaigns: usize::from(arguments.clean),
    };
    if !arguments.score {
        let draw = challenge.draw(&scene, stop)?;
        let folder = output::folder(arguments.scene.out.as_deref(), "challenge")?;
        draw.write(&folder)?;
        sayln!("a campaign with something hidden is in {}; the truth is in truth.json there", folder.display())?;
        return Ok(());
    }
    let options = Options { other_tyres: !arguments.hold_tyres, ..Options::default() };
    let seeds = arguments.seeds.0..arguments.seeds.1;
    let bar = progress_bar(0, "simulations");
    let progress = simulations(&bar, "draws");
    let (draws, mut done) = (seeds.end - seeds.start, 0);
    let mut watch = |scored: &Scored| {
        done += 1;
        bar.suspend(|| tell!("{}", report::line(scored)));
        bar.set_message(format!("{done}/{draws} draws"));
    };
    let result = Scorer::new(&scene, &challenge, &progress, stop)
        .and_then(|scorer| scorer.score(challenge, seeds, &options, &mut watch, stop));
    bar.finish_and_clear();
    let result = result?;
    if arguments.scene.json {
        sayln!("{:#}", report::json(&result))?;
    } else {
        sayln!("{}", report::text(&result))?;
    }
    Ok(())
}
