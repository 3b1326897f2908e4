//! How a wheel turned, from counts that are coarse and stamps that are a little off.
//!
//! A staircase of ticks, and all the more stamps that come a millisecond early or late, make a wheel that follows them shake; and a
//! tyre whose slip is shaken resists less aside. A log of 50 Hz whose stamps are off by 2 ms turned the JNPF-4WD by 94 mrad too
//! much in a square. Wheels have inertia: their speed is taken for a random walk, as strong as the log has it over a tenth of a
//! second, and a reading is as uncertain as a tick, as the time by which rows are off from their neighbours (stamps that are late, an
//! encoder that is uneven, or sits before gears that are), and as a queue that held it up. The most likely way is a cubic smoothing
//! spline [Wahba, *J. R. Stat. Soc. B* 40 (1978) 364–372], found by a Kalman filter and the smoother of Bryson and Frazier
//! [Bierman, *Int. J. Control* 18 (1973) 1–16]. Where readings are finer than what a wheel may do between rows, that is the log itself.

/// Time over which a wheel's speed is told \[s\].
const TELLS: f64 = 0.1;
/// Fewer rows than this are taken as they are.
const FEWEST: usize = 8;
/// What a cubic through two neighbours on either side is off by where speed is a random walk of unit strength and rows are a unit of
/// time apart: its variance over that of readings of unit noise.
const OF_WALK: f64 = 0.0381;
/// Median of the square of a normal deviate.
const MEDIAN_SQUARE: f64 = 0.4549;
/// Share of a column's steps that are multiples of a tick, to a tenth, where there is one.
const ALL_BUT: f64 = 0.95;

/// Angles at the times of `read` as the wheel most likely turned \[rad\]. `tick` \[rad\] is what its column counts in, where that
/// is known, `held_up` how late its rows were stamped.
pub(super) fn turned(time: &[f64], read: &[f64], tick: Option<f64>, held_up: &[f64]) -> Vec<f64> {
    if read.len() < FEWEST {
        return read.to_vec();
    }
    let speed = speeds(time, read);
    let walk = walk(time, read);
    let tick = quantum(read).into_iter().chain(tick).reduce(f64::min).unwrap_or(0.0);
    let late = stamps_off(time, read, &speed, walk, tick);
    let of_row =
        |(speed, held_up): (&f64, &f64)| tick * tick / 12.0 + speed * speed * (late * late + held_up * held_up);
    let variance: Vec<f64> = speed.iter().zip(held_up).map(of_row).collect();
    smoothed(time, read, &variance, walk, &speed)
}

/// How late each row was stamped \[s\] where rows were held up on their way: after a pause they come on one another's heels until
/// they have caught up with the usual time between them.
pub(super) fn held_up(time: &[f64]) -> Vec<f64> {
    /// What a pause is, in usual times between rows: more than rounded stamps are apart.
    const PAUSE: f64 = 1.5;
    let mut late = vec![0.0; time.len()];
    if time.len() < FEWEST {
        return late;
    }
    let apart: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mean = (time[time.len() - 1] - time[0]) / apart.len() as f64;
    let usual = median(&mut apart.clone()).min(mean);
    for (row, apart) in apart.iter().enumerate() {
        let before: f64 = late[row];
        if before > 0.0 || *apart > PAUSE * usual {
            late[row + 1] = (before + apart - usual).max(0.0);
        }
    }
    // Rows that do not catch up were not late.
    let mut caught_up = 0.0;
    let mut rows = late.iter_mut().rev();
    if let Some(last) = rows.next() {
        *last = 0.0;
    }
    for (late, apart) in rows.zip(apart.iter().rev()) {
        caught_up = (caught_up + usual - apart).max(0.0);
        *late = late.min(caught_up);
    }
    late
}

/// Speed about each row, over [`TELLS`] or the rows beside it \[rad/s\].
fn speeds(time: &[f64], read: &[f64]) -> Vec<f64> {
    let last = read.len() - 1;
    let (mut from, mut to) = (0, 0);
    let of_row = |row: usize| {
        while from + 1 < row && time[from + 1] <= time[row] - 0.5 * TELLS {
            from += 1;
        }
        to = to.max((row + 1).min(last));
        while to < last && time[to] < time[row] + 0.5 * TELLS {
            to += 1;
        }
        let lasts = time[to] - time[from];
        if lasts > 0.0 { (read[to] - read[from]) / lasts } else { 0.0 }
    };
    (0..=last).map(of_row).collect()
}

/// Strength of the random walk of a wheel's speed \[rad²/s³\]: how much it changes from one [`TELLS`] to the next.
fn walk(time: &[f64], read: &[f64]) -> f64 {
    let (mut before, mut from) = (None, 0);
    let (mut squares, mut lasted) = (0.0, 0.0);
    for row in 1..read.len() {
        let lasts = time[row] - time[from];
        if lasts < TELLS {
            continue;
        }
        let speed = (read[row] - read[from]) / lasts;
        if let Some((previous, took)) = before.replace((speed, lasts)) {
            squares += (speed - previous).powi(2);
            lasted += 0.5 * (took + lasts);
        }
        from = row;
    }
    if lasted > 0.0 { squares / lasted } else { 0.0 }
}

/// What a column counts in \[rad\]: its least step, where nearly all steps are multiples of it and some are of several; a wheel that
/// turns evenly shows none.
fn quantum(read: &[f64]) -> Option<f64> {
    const LEAST: f64 = 1e-9;
    let steps = || read.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > LEAST);
    let (least, most) = steps().fold((f64::INFINITY, 0.0f64), |(least, most), step| (least.min(step), most.max(step)));
    let whole = steps().filter(|step| ((step / least).round() - step / least).abs() < 0.1).count();
    (most > 4.0 * least && whole as f64 >= ALL_BUT * steps().count() as f64).then_some(least)
}

/// By how much rows are off in time \[s\], 1 σ: what they are off by from a cubic through their neighbours while a wheel is brisk,
/// beyond a tick's and the random walk's share. A median tells it: a few rows about every start and stop are off by what a walk
/// does not know.
fn stamps_off(time: &[f64], read: &[f64], speed: &[f64], walk: f64, tick: f64) -> f64 {
    let brisk = 0.5 * (speed.iter().map(|speed| speed * speed).sum::<f64>() / speed.len() as f64).sqrt();
    let off = (2..read.len() - 2).filter(|&row| speed[row].abs() > brisk).filter_map(|row| {
        let beside = [row - 2, row - 1, row + 1, row + 2];
        let rows = [row - 2, row - 1, row, row + 1, row + 2];
        if rows.windows(2).any(|pair| time[pair[1]] <= time[pair[0]]) {
            return None;
        }
        let weights = beside.map(|of| {
            let others = beside.iter().filter(|&&other| other != of);
            others.map(|&other| (time[row] - time[other]) / (time[of] - time[other])).product::<f64>()
        });
        let cubic: f64 = beside.iter().zip(weights).map(|(&row, weight)| weight * read[row]).sum();
        let square = (read[row] - cubic).powi(2) / (1.0 + weights.iter().map(|weight| weight * weight).sum::<f64>());
        let apart = 0.25 * (time[row + 2] - time[row - 2]);
        let explained = 0.25 * tick * tick + OF_WALK * walk * apart.powi(3);
        let squared = speed[row] * speed[row];
        Some((square / squared, explained / squared))
    });
    let (mut squares, mut explained): (Vec<f64>, Vec<f64>) = off.unzip();
    if squares.is_empty() {
        return 0.0;
    }
    (median(&mut squares) / MEDIAN_SQUARE - median(&mut explained)).max(0.0).sqrt()
}

/// Of at least one.
fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// A row as the filter has it.
struct Filtered {
    /// Angle and speed, and their covariance (θθ, θω, ωω).
    state: [f64; 2],
    covariance: [f64; 3],
    /// Innovation over its variance, and the gain of angle and speed.
    surprise: f64,
    gain: [f64; 2],
    /// Time since the row before \[s\].
    since: f64,
}

/// Angles where speed is a random walk of strength `walk` and readings have these variances.
fn smoothed(time: &[f64], read: &[f64], variance: &[f64], walk: f64, speed: &[f64]) -> Vec<f64> {
    /// Readings are never finer than this \[rad²\].
    const FINEST: f64 = 1e-20;
    let fastest = speed.iter().fold(0.0f64, |fastest, speed| fastest.max(speed.abs()));
    let mut state = [read[0], speed[0]];
    let mut covariance = [variance[0].max(FINEST), 0.0, 4.0 * fastest * fastest];
    let mut rows: Vec<Filtered> = Vec::with_capacity(read.len());
    for row in 0..read.len() {
        let since = if row > 0 { time[row] - time[row - 1] } else { 0.0 };
        state[0] += since * state[1];
        let [angle, both, rate] = covariance;
        let walked = walk * since;
        covariance = [
            angle + since * (2.0 * both + since * (rate + walked / 3.0)),
            both + since * (rate + 0.5 * walked),
            rate + walked,
        ];
        let [angle, both, rate] = covariance;
        let noise = variance[row].max(FINEST);
        let precision = 1.0 / (angle + noise);
        let innovation = read[row] - state[0];
        let gain = [angle * precision, both * precision];
        state = [state[0] + gain[0] * innovation, state[1] + gain[1] * innovation];
        covariance = [angle * noise * precision, both * noise * precision, rate - gain[1] * both];
        rows.push(Filtered { state, covariance, surprise: innovation * precision, gain, since });
    }
    let mut angles = vec![0.0; read.len()];
    // Adjoint of the state after each row, last to first.
    let mut adjoint = [0.0; 2];
    for (angle, row) in angles.iter_mut().zip(&rows).rev() {
        *angle = row.state[0] - row.covariance[0] * adjoint[0] - row.covariance[1] * adjoint[1];
        let seen = adjoint[0] * (1.0 - row.gain[0]) - adjoint[1] * row.gain[1] - row.surprise;
        adjoint = [seen, adjoint[1] + row.since * seen];
    }
    angles
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use std::f64::consts::TAU;

    const TICK: f64 = TAU / 8192.0;
    const FAST: f64 = 5.0;

    /// From rest up to [`FAST`] within a second, on at it, and to rest within a second after 4 s \[rad\].
    fn law(time: f64) -> f64 {
        let up = |time: f64| 0.5 * FAST * time.clamp(0.0, 1.0).powi(2) + FAST * (time - 1.0).max(0.0);
        up(time) - up(time - 4.0)
    }

    fn rows(rate: f64) -> Vec<f64> {
        (0..).map(|row| f64::from(row) / rate).take_while(|time| *time <= 6.0).collect()
    }

    /// Of a log of this wheel alone.
    fn turned(time: &[f64], read: &[f64], tick: Option<f64>) -> Vec<f64> {
        super::turned(time, read, tick, &held_up(time))
    }

    fn counted(angle: f64) -> f64 {
        (angle / TICK).floor() * TICK
    }

    /// Root mean square of what speeds from row to row are off by while the law's is [`FAST`], over that.
    fn shaken(time: &[f64], angle: &[f64]) -> f64 {
        let steps = (1..time.len()).filter(|&row| time[row - 1] > 1.3 && time[row] < 3.7 && time[row] > time[row - 1]);
        let squares: Vec<f64> = steps
            .map(|row| ((angle[row] - angle[row - 1]) / (time[row] - time[row - 1]) / FAST - 1.0).powi(2))
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    /// Angles finer than any walk are kept, evenly stamped or not.
    #[test]
    fn what_is_known_is_left_as_it_is() {
        for uneven in [0.0, 0.4] {
            let time: Vec<f64> = (0..200).map(|row| 0.03 * (f64::from(row) + uneven * f64::from(row).sin())).collect();
            let read: Vec<f64> = time.iter().map(|&time| law(time)).collect();
            for (row, (turned, read)) in turned(&time, &read, None).iter().zip(&read).enumerate() {
                assert!((turned - read).abs() < 1e-6, "row {row}: {turned} for {read}");
            }
        }
    }

    /// Many counts a second: a wheel turns as evenly as it did, to within a tick of what was counted, and stands where it stood.
    #[test]
    fn a_staircase_is_a_way() {
        for rate in [50.0, 200.0] {
            let time = rows(rate);
            let read: Vec<f64> = time.iter().map(|&time| counted(law(time))).collect();
            let angle = turned(&time, &read, Some(TICK));
            for (row, (angle, read)) in angle.iter().zip(&read).enumerate() {
                assert!((angle - read).abs() < TICK, "{rate} Hz, row {row}: {angle} for {read}");
            }
            let (stairs, way) = (shaken(&time, &read), shaken(&time, &angle));
            // A staircase is off by the difference of two even deviates of a tick.
            let expected = TICK * rate / 6f64.sqrt() / FAST;
            assert!((0.5..2.0).contains(&(stairs / expected)), "{rate} Hz: {stairs} for {expected}");
            assert!(way < 0.01 && way < 0.9 * stairs, "{rate} Hz: speeds are off by {way}, of stairs by {stairs}");
            let stands = &angle[time.partition_point(|time| *time < 5.2)..];
            let moves = stands.iter().fold(0.0f64, |most, angle| most.max((angle - stands[0]).abs()));
            assert!(moves < 0.2 * TICK, "{rate} Hz: it moves by {moves} rad while it stands");
        }
    }

    /// Stamps that are off from row to row shake a wheel by √2 times what they are off by over the time between rows: by 4 to 40 %
    /// here. It turns evenly, to a fiftieth, all the same, which takes less than a thousandth of a tyre's friction.
    #[test]
    fn stamps_that_are_off_do_not_shake_a_wheel() {
        for off in [0.0005, 0.002, 0.004] {
            let mut rng = ChaCha8Rng::seed_from_u64(3);
            let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
            let mut latest = 0.0f64;
            let mut stamped = |time: f64| {
                latest = latest.max(time + off * normal());
                latest
            };
            let when = rows(50.0);
            let time: Vec<f64> = when.iter().map(|&time| stamped(time)).collect();
            let read: Vec<f64> = when.iter().map(|&time| counted(law(time))).collect();
            let raw = shaken(&time, &read);
            assert!(raw > 0.8 * 2f64.sqrt() * off * 50.0, "{off} s: {raw}");
            let way = shaken(&time, &turned(&time, &read, Some(TICK)));
            assert!(way < 0.02, "{off} s: speeds are off by {way}, and were by {raw}");
            let (speed, walk) = (speeds(&time, &read), walk(&time, &read));
            let found = stamps_off(&time, &read, &speed, walk, TICK);
            assert!((0.5..1.5).contains(&(found / off)), "{found} s for {off} s");
        }
    }

    /// Ticks are told from angles, and from a wheel that turns evenly.
    #[test]
    fn what_a_column_counts_in_is_known() {
        let time = rows(50.0);
        let angles = |of: fn(f64) -> f64| time.iter().map(|&time| of(time)).collect::<Vec<f64>>();
        let noted = |angle: f64| (angle * 1e7).round() / 1e7;
        let ticks: Vec<f64> = angles(law).into_iter().map(|angle| noted(counted(angle))).collect();
        assert!(quantum(&ticks).is_some_and(|tick| (tick / TICK - 1.0).abs() < 1e-3), "{:?}", quantum(&ticks));
        assert_eq!(quantum(&angles(f64::sin)), None);
        assert_eq!(quantum(&angles(|time| 0.3 * time)), None);
        assert_eq!(quantum(&[0.0; 20]), None);
    }

    /// A queue that was held up is known to the row; stamps that are rounded, rows left out and a rate that changes are no queue.
    #[test]
    fn rows_that_were_held_up_are_known() {
        let mut free = 0.0;
        let mut late = Vec::new();
        let time: Vec<f64> = (0..400)
            .map(|row| {
                let due = 0.02 * f64::from(row);
                if [50, 51, 120, 203].contains(&row) {
                    free = due + 0.055;
                }
                let stamp = due.max(free);
                late.push(stamp - due);
                stamp
            })
            .collect();
        for (row, (found, late)) in held_up(&time).iter().zip(&late).enumerate() {
            assert!((found - late).abs() < 1e-9, "row {row}: {found} s for {late} s");
        }
        let rounded = (0..300).map(|row| (f64::from(row) / 60.0 * 100.0).round() / 100.0);
        let left_out = (0..300).filter(|row| row % 7 != 3 && row % 11 != 5).map(|row| 0.02 * f64::from(row));
        let changing = (0..200).map(|row| 0.02 * f64::from(row)).chain((0..200).map(|row| 4.0 + 0.01 * f64::from(row)));
        let honest: [Vec<f64>; 3] = [rounded.collect(), left_out.collect(), changing.collect()];
        for time in honest {
            assert!(held_up(&time).iter().all(|late| *late < 1e-9), "{time:?}");
        }
    }
}
