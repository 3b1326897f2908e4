//! Letters drawn as lines.
//!
//! The viewer puts its own labels into boxes whose colour follows its theme, which blot a plot out. Numbers on axes are
//! few enough to be drawn.

/// Width and height of a letter, and the gap to the next one, in steps of the grid that letters are drawn on.
const WIDTH: f64 = 4.0;
const HEIGHT: f64 = 6.0;
const GAP: f64 = 2.0;

/// The strokes of a letter: points as pairs of digits, x to the right and y up, strokes set apart by blanks.
fn strokes(letter: char) -> &'static str {
    match letter {
        '0' => "0040460600",
        '1' => "152620",
        '2' => "064643030040",
        '3' => "06464000 0343",
        '4' => "060343 4640",
        '5' => "460603434000",
        '6' => "460600404303",
        '7' => "064620",
        '8' => "0040460600 0343",
        '9' => "430306464000",
        '-' | '−' => "0343",
        '.' => "2021",
        'a' => "044440000242",
        'b' => "0600404404",
        'c' => "44040040",
        'd' => "4640000444",
        'e' => "024244040040",
        'f' => "361610 0434",
        'g' => "0040440402 0242",
        'h' => "0600 044440",
        'i' => "2420 2526",
        'j' => "242000 2526",
        'k' => "0600 440240",
        'l' => "2620",
        'm' => "00044440 2420",
        'n' => "00044440",
        'o' => "0004444000",
        'p' => "0004444101",
        'q' => "4044040141",
        'r' => "0004 031444",
        's' => "440402424000",
        't' => "262040 0444",
        'u' => "04004044",
        'v' => "042044",
        'w' => "04004044 2420",
        'x' => "0440 0044",
        'y' => "0422 4400",
        'z' => "04440040",
        '/' => "0046",
        ',' => "2110",
        'A' => "00064640 0343",
        'F' => "460600 0333",
        'G' => "460600404323",
        'I' => "2026",
        'L' => "060040",
        'P' => "0006464303",
        'R' => "0006464303 2340",
        'S' => "460603434000",
        '%' => "0046 0616150506 3141403031",
        '[' => "36161030",
        ']' => "16363010",
        _ => "",
    }
}

/// Lines of `text` at `height`; its middle is `anchor` where `align` is 0.5, its left end where 0, its right end where 1.
pub(super) fn lines(text: &str, anchor: [f64; 2], height: f64, align: f64) -> Vec<Vec<[f64; 2]>> {
    let scale = height / HEIGHT;
    let advance = scale * (WIDTH + GAP);
    let length = advance * text.chars().count() as f64 - scale * GAP;
    let left = anchor[0] - align * length;
    let base = anchor[1] - 0.5 * height;
    let mut lines = Vec::new();
    for (place, letter) in text.chars().enumerate() {
        let start = left + advance * place as f64;
        for stroke in strokes(letter).split_ascii_whitespace() {
            let point = |pair: &[u8]| {
                let step = |digit: u8| scale * f64::from(digit - b'0');
                [start + step(pair[0]), base + step(pair[1])]
            };
            lines.push(stroke.as_bytes().chunks_exact(2).map(point).collect());
        }
    }
    lines
}
