//! Scores of hidden-effect challenges as tables and JSON.

use super::text::{Style, table};
use crate::experiment::{Call, Interval, Score, Scored, Tally};
use serde_json::{Value, json};
use statrs::function::beta::inv_beta_reg;
use std::collections::BTreeMap;
use std::fmt::Write;

/// 95 % interval of the chance of which `hits` of `of` came, exact: it covers at least as often as it says
/// [Clopper, Pearson 1934, *Biometrika* 26].
pub fn binomial(hits: usize, of: usize) -> [f64; 2] {
    const BEYOND: f64 = 0.025;
    let [n, other] = [hits, of - hits].map(|count| count as f64);
    [
        if hits == 0 { 0.0 } else { inv_beta_reg(n, other + 1.0, BEYOND) },
        if hits == of { 1.0 } else { inv_beta_reg(n + 1.0, other, 1.0 - BEYOND) },
    ]
}

/// ", 90.4 % (83.5 to 95.1 %)"; nothing is said of none.
fn share(hits: usize, of: usize) -> String {
    if of == 0 {
        return String::new();
    }
    let [low, high] = binomial(hits, of).map(|share| 100.0 * share);
    format!(", {:.1} % ({low:.1} to {high:.1} %)", 100.0 * hits as f64 / of as f64)
}

/// Draws of which silence, or one of two effects alone, would be a miss, and those that have their truth in the answer.
#[derive(Debug, Clone, Copy)]
struct CalledFor {
    draws: usize,
    answered: usize,
    of_two: Option<OfTwo>,
}

/// Of those draws, where each hides two effects.
#[derive(Debug, Clone, Copy)]
struct OfTwo {
    /// That have both within odds of 50 to 1 of the likeliest answer.
    stand: usize,
    /// That would have both named by whoever has the oracle's evidence, and noise.
    at_best: f64,
    /// … by whoever knows the world by clean campaigns alone.
    at_best_as_told: Option<f64>,
}

impl CalledFor {
    fn of(score: &Score, called_for: &dyn Fn(&Scored) -> Option<Call>) -> CalledFor {
        let is_called_for = |scored: &&Scored| called_for(scored).is_some_and(|call| call.for_answer);
        let draws: Vec<&Scored> = score.draws.iter().filter(is_called_for).collect();
        let answered = draws.iter().filter(|scored| !matches!(scored.tally, Tally::Missed | Tally::Wrong)).count();
        // The sum of nothing is −0; adding zero makes it a 0.
        let at_best = |call: &dyn Fn(&Scored) -> Option<Call>| {
            draws.iter().filter_map(|scored| call(scored)?.pair).map(|pair| pair.chance()).sum::<f64>() + 0.0
        };
        let of_two = score.draws.iter().any(|scored| scored.both_stand.is_some()).then(|| OfTwo {
            stand: draws.iter().filter(|scored| scored.both_stand == Some(true)).count(),
            at_best: at_best(&|scored| Some(scored.called_for)),
            at_best_as_told: is_told(score).then(|| at_best(&|scored| scored.called_for_as_told)),
        });
        CalledFor { draws: draws.len(), answered, of_two }
    }

    fn json(self) -> Value {
        let mut json = json!({"draws": self.draws, "answered": self.answered});
        if let Some(OfTwo { stand, at_best, at_best_as_told }) = self.of_two {
            json["both_stand"] = stand.into();
            json["both_named_at_best"] = at_best.into();
            json["both_named_at_best_as_told"] = at_best_as_told.into();
        }
        json
    }

    /// In words: `who` calls for an answer.
    fn words(self, who: &str) -> String {
        let CalledFor { draws, answered, of_two } = self;
        let share = share(answered, draws);
        let mut words =
            format!("{who} calls for an answer in {draws} draws: {answered} have the truth in theirs{share}");
        if let Some(OfTwo { stand, at_best, at_best_as_told }) = of_two {
            let _ = write!(words, ", {stand} have both effects within odds of 50 to 1 of it");
            let _ = write!(words, ", and under noise the oracle's evidence would name both in {at_best:.1}");
            if let Some(as_told) = at_best_as_told {
                let _ = write!(words, ", in {as_told:.1} where the world is known by the clean campaigns alone");
            }
        }
        words
    }
}

/// Whether there is an oracle, too, which knows the world by clean campaigns alone.
fn is_told(score: &Score) -> bool {
    score.draws.iter().any(|scored| scored.called_for_as_told.is_some())
}

/// Sums of a score.
struct Sums {
    runs: usize,
    called_for: CalledFor,
    called_for_as_told: Option<CalledFor>,
    hidden: usize,
    covered: [usize; 2],
    set_size: f64,
    oracle_set_size: f64,
    regret: f64,
    gain: f64,
    gain_on_fresh: f64,
    seconds: f64,
    detectable: [usize; 2],
}

impl Sums {
    /// What the extended models are worth, in words; nothing is said where an oracle would gain nothing.
    fn gains(&self) -> String {
        let of = [(self.gain, "on held-out folds"), (self.gain_on_fresh, "on another campaign of the same world")];
        let said: Vec<String> =
            of.iter().filter(|(gain, _)| gain.is_finite()).map(|(gain, on)| format!("{gain:.2} {on}")).collect();
        if said.is_empty() {
            "no gain that an oracle would have".to_owned()
        } else {
            format!("gain over the oracle's {}", said.join(", "))
        }
    }

    fn of(score: &Score) -> Sums {
        // The sum of nothing is −0; adding zero makes it a 0.
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len().max(1) as f64 + 0.0;
        let covered: Vec<bool> =
            score.draws.iter().flat_map(|scored| &scored.intervals).map(Interval::covers).collect();
        let ratios: Vec<f64> = score.draws.iter().flat_map(|scored| scored.detectable_ratio.iter().copied()).collect();
        let share = |gain: &dyn Fn(&Scored) -> Option<[f64; 2]>| {
            let gains: Vec<[f64; 2]> = score.draws.iter().filter_map(gain).collect();
            let [found, of_oracle] = [0, 1].map(|part| gains.iter().map(|gain| gain[part]).sum::<f64>());
            if of_oracle > 0.0 { found / of_oracle } else { f64::NAN }
        };
        Sums {
            runs: score.draws.len(),
            called_for: CalledFor::of(score, &|scored| Some(scored.called_for)),
            called_for_as_told: is_told(score).then(|| CalledFor::of(score, &|scored| scored.called_for_as_told)),
            hidden: score.draws.iter().filter(|scored| !scored.truth.is_empty()).count(),
            covered: [covered.iter().filter(|it| **it).count(), covered.len()],
            set_size: mean(score.draws.iter().filter_map(|scored| scored.set_size.map(|size| size as f64)).collect()),
            oracle_set_size: mean(
                score
                    .draws
                    .iter()
                    .filter(|scored| scored.strength >= 5.0 && !scored.oracle_set.is_empty())
                    .map(|scored| scored.oracle_set.len() as f64)
                    .collect(),
            ),
            regret: mean(score.draws.iter().filter_map(|scored| scored.regret).collect()),
            gain: share(&|scored| scored.gain),
            gain_on_fresh: share(&|scored| scored.gain_on_fresh),
            seconds: mean(score.draws.iter().map(|scored| scored.seconds).collect()),
            detectable: [ratios.iter().filter(|ratio| (0.5..=2.0).contains(*ratio)).count(), ratios.len()],
        }
    }
}

/// `challenge --score --json`.
pub fn json(score: &Score) -> Value {
    let sums = Sums::of(score);
    let finite = |value: f64| if value.is_finite() { Value::from(value) } else { Value::Null };
    let coverage = if sums.covered[1] > 0 { sums.covered[0] as f64 / sums.covered[1] as f64 } else { f64::NAN };
    json!({
        "runs": sums.runs,
        "clean": score.count(Tally::Clean),
        "false_alarms": score.count(Tally::FalseAlarm),
        "named": score.count(Tally::Named),
        "oracle_nameable": score.oracle_nameable,
        "right_group": score.count(Tally::RightGroup),
        "half": score.count(Tally::Half),
        "silent_rightly": score.count(Tally::SilentRightly),
        "missed": score.count(Tally::Missed),
        "wrong": score.count(Tally::Wrong),
        "both_not_called_for": score.count(Tally::AsFarAsCalledFor),
        "both_exact": score.count(Tally::BothExact),
        "both_in_sets": score.count(Tally::BothInSets),
        "outside_right": score.count(Tally::Unexplained),
        "called_for": sums.called_for.json(),
        "called_for_as_told": sums.called_for_as_told.map(CalledFor::json),
        "coverage": finite(coverage),
        "coverage_of": sums.covered[1],
        "smallest_detectable_within_factor_2": finite(sums.detectable[0] as f64 / sums.detectable[1] as f64),
        "mean_set_size": sums.set_size,
        "mean_oracle_set_size": sums.oracle_set_size,
        "log_score_regret": sums.regret,
        "gain_over_oracle": finite(sums.gain),
        "gain_on_fresh_campaign_over_oracle": finite(sums.gain_on_fresh),
        "seconds_per_diagnosis": sums.seconds,
        "draws": score.draws.iter().map(draw).collect::<Vec<_>>(),
    })
}

/// One draw: tallies, coverage and gains of several scores follow from their draws together.
fn draw(scored: &Scored) -> Value {
    let gain = |gain: Option<[f64; 2]>| gain.map(|[found, oracle]| json!({"found": found, "oracle": oracle}));
    let interval = |it: &Interval| json!({"effect": it.effect, "parameter": it.parameter, "off_sigma": it.off});
    json!({
        "seed": scored.seed,
        "hidden": scored.truth,
        "strength_sigma": scored.strength,
        "oracle_set": scored.oracle_set,
        "answer": scored.answer,
        "came_to": words(scored.tally),
        "called_for": scored.called_for.for_answer,
        "log_odds_of_both": scored.called_for.pair.map(|pair| pair.log_odds()),
        "called_for_as_told": scored.called_for_as_told.map(|call| call.for_answer),
        "log_odds_of_both_as_told": scored.called_for_as_told.and_then(|call| call.pair).map(|pair| pair.log_odds()),
        "both_stand": scored.both_stand,
        "intervals": scored.intervals.iter().map(interval).collect::<Vec<_>>(),
        "gain": gain(scored.gain),
        "gain_on_fresh_campaign": gain(scored.gain_on_fresh),
        "seconds": scored.seconds,
    })
}

/// The score as tables: totals with binomial intervals, then effect by effect.
pub fn text(score: &Score) -> String {
    let sums = Sums::of(score);
    let clean = sums.runs - sums.hidden;
    let rate = |tally: Tally, of: usize| {
        let hits = score.count(tally);
        let [low, high] = binomial(hits, of);
        vec![
            words(tally).to_owned(),
            hits.to_string(),
            of.to_string(),
            format!("{:.1} %", 100.0 * hits as f64 / of.max(1) as f64),
            format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high),
        ]
    };
    let mut rows = vec![rate(Tally::Clean, clean), rate(Tally::FalseAlarm, clean)];
    for tally in [
        Tally::Named,
        Tally::RightGroup,
        Tally::Half,
        Tally::SilentRightly,
        Tally::Missed,
        Tally::Wrong,
        Tally::AsFarAsCalledFor,
        Tally::BothExact,
        Tally::BothInSets,
        Tally::Unexplained,
    ] {
        if score.count(tally) > 0 || matches!(tally, Tally::Named | Tally::Missed | Tally::Wrong) {
            rows.push(rate(tally, sums.hidden));
        }
    }
    let mut out = String::new();
    let mut totals = table(Style::Terminal, &["", "draws", "of", "share", "95 %"]);
    totals.add_rows(rows);
    let _ = writeln!(out, "{totals}");
    let _ = writeln!(
        out,
        "named {}, where an oracle could name {}; 95 % intervals cover {} of {}{}; smallest detectable sizes within a factor \
         of two of the oracle's: {} of {}; {}; mean set {:.2} (oracle {:.2}); regret {:.2}; {:.1} s a diagnosis",
        score.count(Tally::Named) + score.count(Tally::BothExact),
        score.oracle_nameable,
        sums.covered[0],
        sums.covered[1],
        share(sums.covered[0], sums.covered[1]),
        sums.detectable[0],
        sums.detectable[1],
        sums.gains(),
        sums.set_size,
        sums.oracle_set_size,
        sums.regret,
        sums.seconds
    );
    let _ = write!(out, "{}", sums.called_for.words("the oracle, which knows the world,"));
    if let Some(as_told) = sums.called_for_as_told {
        let _ = write!(out, "; {}", as_told.words("one that knows it by the clean campaigns alone"));
    }
    let _ = writeln!(out);
    let mut of_effect: BTreeMap<String, Vec<&Scored>> = BTreeMap::new();
    for scored in &score.draws {
        let names: Vec<&str> = scored.truth.iter().map(|line| line.split(':').next().unwrap_or(line)).collect();
        let name = if names.is_empty() { "nothing".to_owned() } else { names.join(" & ") };
        of_effect.entry(name).or_default().push(scored);
    }
    if of_effect.len() <= 40 {
        let mut effects = table(Style::Terminal, &["hidden", "draws", "what came of them"]);
        for (name, draws) in of_effect {
            let mut tallies: BTreeMap<Tally, usize> = BTreeMap::new();
            for scored in &draws {
                *tallies.entry(scored.tally).or_default() += 1;
            }
            let tallies: Vec<String> =
                tallies.iter().map(|(tally, count)| format!("{count} {}", words(*tally))).collect();
            effects.add_row(vec![name, draws.len().to_string(), tallies.join(", ")]);
        }
        let _ = writeln!(out, "{effects}");
    }
    out
}

/// One draw in a line.
pub fn line(scored: &Scored) -> String {
    let off = scored.intervals.iter().filter(|interval| !interval.covers());
    let off: Vec<String> = off.map(|it| format!("; {}.{} off by {:+.1} σ", it.effect, it.parameter, it.off)).collect();
    let gain = scored.gain.map(|[found, of_oracle]| format!("; gain {found:.2} (oracle {of_oracle:.2})"));
    let fresh = scored.gain_on_fresh.map(|[found, of_oracle]| format!(", on fresh {found:.2} ({of_oracle:.2})"));
    format!(
        "{:>5} {}: hidden {}; δ {:.1}; oracle {}; answer {}{}{}{}; {:.1} s",
        scored.seed,
        words(scored.tally),
        if scored.truth.is_empty() { "nothing".to_owned() } else { scored.truth.join(" & ") },
        scored.strength,
        if scored.oracle_set.is_empty() { "–".to_owned() } else { scored.oracle_set.join(", ") },
        scored.answer,
        off.concat(),
        gain.unwrap_or_default(),
        fresh.unwrap_or_default(),
        scored.seconds
    )
}

fn words(tally: Tally) -> &'static str {
    match tally {
        Tally::Clean => "rightly clean",
        Tally::FalseAlarm => "false alarm",
        Tally::Named => "named",
        Tally::RightGroup => "right group",
        Tally::Half => "half",
        Tally::SilentRightly => "rightly silent",
        Tally::Missed => "missed",
        Tally::Wrong => "wrong",
        Tally::AsFarAsCalledFor => "not called for both",
        Tally::BothExact => "both, each alone",
        Tally::BothInSets => "both, in sets",
        Tally::Unexplained => "unexplained or mimic",
    }
}

#[cfg(test)]
mod tests {
    use super::binomial;

    /// Where nothing of n came the bound is in closed form, and both ways round are one.
    #[test]
    fn bounds_of_nothing_and_of_all_are_in_closed_form() {
        for of in [1, 20, 152] {
            let [low, high] = binomial(0, of);
            assert_eq!(low, 0.0);
            assert!((high - (1.0 - 0.025_f64.powf(1.0 / of as f64))).abs() < 1e-9, "{high} of {of}");
            let [of_all, one] = binomial(of, of);
            assert!((of_all - (1.0 - high)).abs() < 1e-9 && one == 1.0);
        }
        assert_eq!(binomial(0, 0), [0.0, 1.0]);
    }

    /// Whatever the chance is, the interval misses it in a fortieth of cases at most on either side.
    #[test]
    fn intervals_cover_at_least_as_often_as_they_say() {
        const DRAWS: usize = 30;
        for chance in (1..100).map(|percent| f64::from(percent) / 100.0) {
            let odds = chance / (1.0 - chance);
            let mut of_count = (1.0 - chance).powi(DRAWS as i32);
            let (mut above, mut below) = (0.0, 0.0);
            for hits in 0..=DRAWS {
                let [low, high] = binomial(hits, DRAWS);
                above += if chance < low { of_count } else { 0.0 };
                below += if high < chance { of_count } else { 0.0 };
                of_count *= odds * (DRAWS - hits) as f64 / (hits + 1) as f64;
            }
            assert!(above <= 0.025 && below <= 0.025, "{above} above {chance}, {below} below");
        }
    }
}
