//! Times as whole nanoseconds: a stamp since 1970 in `f64` seconds is only good to 0.2 µs, and a bag's own are whole.

/// A time by some clock \[ns\].
pub(super) type Nanoseconds = i64;

/// \[s\]
pub(super) fn seconds(time: Nanoseconds) -> f64 {
    time as f64 / 1e9
}

/// The decimal number in `text` times 10^`exponent`, rounded to a whole one; every digit that is written counts.
pub(super) fn scaled(text: &str, exponent: i32) -> Option<Nanoseconds> {
    let (mantissa, power) = match text.split_once(['e', 'E']) {
        Some((mantissa, power)) => (mantissa, power.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let (negative, unsigned) = match mantissa.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, mantissa.strip_prefix('+').unwrap_or(mantissa)),
    };
    let (whole, fraction) = unsigned.split_once('.').unwrap_or((unsigned, ""));
    let digits = format!("{whole}{fraction}");
    if digits.is_empty() || digits.len() > 36 || !digits.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    let value: i128 = digits.parse().ok()?;
    let shift = exponent.checked_add(power)?.checked_sub(i32::try_from(fraction.len()).ok()?)?;
    let factor = 10_i128.checked_pow(shift.unsigned_abs())?;
    let scaled = if shift >= 0 { value.checked_mul(factor)? } else { (value + factor / 2) / factor };
    Nanoseconds::try_from(if negative { -scaled } else { scaled }).ok()
}

#[cfg(test)]
mod tests {
    use super::scaled;

    #[test]
    fn every_digit_counts() {
        for (text, exponent, expected) in [
            ("0.050", 9, Some(50_000_000)),
            ("1700000000.123456789", 9, Some(1_700_000_000_123_456_789)),
            ("1.305031102175800085e+09", 9, Some(1_305_031_102_175_800_085)),
            ("-3", 6, Some(-3_000_000)),
            ("+.5", 9, Some(500_000_000)),
            ("0.0000000006", 9, Some(1)),
            ("1e400", 9, None),
            ("nan", 9, None),
            ("", 9, None),
            ("1,5", 9, None),
            ("99999999999", 9, None),
        ] {
            assert_eq!(scaled(text, exponent), expected, "{text}");
        }
    }
}
