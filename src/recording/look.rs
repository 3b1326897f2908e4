//! What recordings look like: every colour, width, scale and word of theirs.
//!
//! Colours are those of Okabe and Ito, which colour-blind readers can tell apart. Hue says which way round a square was
//! driven, strength says at which stage (pale before calibration, strong after it, dark after another one), and a dashed dark line is what the robot believes. Wheels have
//! hues of their own: left green, right purple, the front ones strong.

use super::Outline;
use crate::scene::{Robot, Side, Wheel};
use rerun::{Color, Radius};

/// A colour, sRGB.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Rgb(pub u8, pub u8, pub u8);

/// Clockwise.
pub(super) const BLUE: Rgb = Rgb(0x00, 0x72, 0xB2);
/// Counter-clockwise.
pub(super) const VERMILLION: Rgb = Rgb(0xD5, 0x5E, 0x00);
/// Wheels on the left.
pub(super) const GREEN: Rgb = Rgb(0x00, 0x9E, 0x73);
/// Wheels on the right.
pub(super) const PURPLE: Rgb = Rgb(0xCC, 0x79, 0xA7);
/// What the robot believes; what it is asked to do.
pub(super) const BELIEF: Rgb = Rgb(0x45, 0x4B, 0x54);

pub(super) const WHITE: Rgb = Rgb(0xFF, 0xFF, 0xFF);
const BLACK: Rgb = Rgb(0x00, 0x00, 0x00);
/// Behind everything.
pub(super) const PAPER: Rgb = Rgb(0xF3, 0xF4, 0xF2);
pub(super) const FLOOR: Rgb = Rgb(0xE6, 0xE8, 0xE4);
pub(super) const GRID: Rgb = Rgb(0xCB, 0xCF, 0xC9);
/// Axes, ticks and words on paper.
pub(super) const INK: Rgb = Rgb(0x5A, 0x60, 0x68);
pub(super) const OBSTACLE: Rgb = Rgb(0xB9, 0xB1, 0xA2);
pub(super) const LESS_GRIP: Rgb = Rgb(0xBF, 0xDC, 0xEC);
pub(super) const MORE_GRIP: Rgb = Rgb(0xE8, 0xD9, 0xB4);
pub(super) const TYRE: Rgb = Rgb(0x2A, 0x2C, 0x30);
pub(super) const LUG: Rgb = Rgb(0x45, 0x48, 0x4E);
pub(super) const RIM: Rgb = Rgb(0x8A, 0x90, 0x98);
pub(super) const SPOKE: Rgb = Rgb(0xE8, 0xEA, 0xEC);
pub(super) const CHASSIS: Rgb = Rgb(0x8C, 0x98, 0xA6);
/// Shear in a patch.
pub(super) const TRACTION: Rgb = Rgb(0xB0, 0x00, 0x6A);
/// The whole force on a wheel.
pub(super) const FORCE: Rgb = Rgb(0x20, 0x24, 0x2A);

/// Length of a traction arrow \[m/Pa\]: 40 kPa, about what a tyre of a small robot can bear, is drawn 60 mm long.
pub(super) const TRACTION_SCALE: f64 = 1.5e-6;
/// Length of a force arrow \[m/N\]: 50 N is drawn 0.2 m long.
pub(super) const FORCE_SCALE: f64 = 4e-3;

/// How much of a colour stays before calibration, and after a second one \[–\].
const PALE: f64 = 0.45;
const DARK: f64 = 0.6;

impl Rgb {
    /// Part of the way from `other` to this.
    pub(super) fn over(self, other: Rgb, share: f64) -> Rgb {
        let mix = |one: u8, two: u8| (share * f64::from(one) + (1.0 - share) * f64::from(two)).round() as u8;
        Rgb(mix(self.0, other.0), mix(self.1, other.1), mix(self.2, other.2))
    }

    /// A URDF's colour, 0..1.
    pub(super) fn from_urdf([red, green, blue, _]: [f64; 4]) -> Rgb {
        let byte = |share: f64| (255.0 * share.clamp(0.0, 1.0)).round() as u8;
        Rgb(byte(red), byte(green), byte(blue))
    }
}

impl From<Rgb> for Color {
    fn from(Rgb(red, green, blue): Rgb) -> Color {
        Color::from_rgb(red, green, blue)
    }
}

/// A width that does not change with distance \[points of the screen\].
pub(super) fn points(width: f32) -> Radius {
    Radius::new_ui_points(0.5 * width)
}

/// A size in the scene \[m, or mm in end-point plots\].
pub(super) fn metres(width: f32) -> Radius {
    Radius::new_scene_units(0.5 * width)
}

/// The colour of a way round.
pub(super) fn of_direction(direction: &str) -> Rgb {
    match direction {
        "cw" | "reverse" => BLUE,
        _ => VERMILLION,
    }
}

/// When a stage comes: 0 for the first one, which is drawn as the uncalibrated one where there are others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stage {
    pub index: usize,
    /// How many there are.
    pub of: usize,
}

impl Stage {
    /// Before calibration, beside others that are after it.
    pub(super) fn is_before(self) -> bool {
        self.of > 1 && self.index == 0
    }

    /// A colour as it is at this stage, on paper.
    pub(super) fn tone(self, colour: Rgb) -> Rgb {
        match self.index {
            _ if self.is_before() => colour.over(WHITE, PALE),
            0 | 1 => colour,
            _ => colour.over(BLACK, DARK),
        }
    }

    /// A colour as it is at this stage, in plots, which the viewer may have on black.
    pub(super) fn tone_of_line(self, colour: Rgb) -> Rgb {
        if self.is_before() { colour.over(WHITE, PALE) } else { colour }
    }
}

/// A name for readers: `after_umbmark_2m` → `after umbmark 2m`.
pub(super) fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// A colour and a line's width \[points\] for each wheel, in the robot's order. Lines of the left are wide and drawn first,
/// so that they show behind those of the right where both sides do the same.
pub(super) fn of_wheels(robot: &Robot) -> Vec<(Rgb, f32)> {
    let forward = |wheel: &Wheel| wheel.base_from_wheel.translation.x;
    let style = |wheel: &Wheel| {
        let mates = || robot.wheels.iter().filter(|mate| mate.side == wheel.side);
        let further_back = mates().filter(|mate| forward(mate) > forward(wheel)).count() as f64;
        let strength = 1.0 - 0.6 * further_back / mates().count().max(2) as f64;
        match wheel.side {
            Side::Left => (GREEN.over(WHITE, strength), 3.5),
            Side::Right => (PURPLE.over(WHITE, strength), 1.5),
        }
    };
    robot.wheels.iter().map(style).collect()
}

/// What the eye meets, and in which colours and scales.
pub(super) fn how_to_read(outline: &Outline) -> String {
    let mut stages = String::new();
    for (index, stage) in outline.stages.iter().enumerate().filter(|_| outline.stages.len() > 1) {
        let strength = ["pale", "strong", "dark"][index.min(2)];
        let gap = if index == 0 { "; " } else { ", " };
        stages.push_str(&format!("{gap}{strength} {}", words(stage)));
    }
    format!(
        "Vermillion is counter-clockwise, blue is clockwise{stages}. The dashed dark line is where \
         the robot believes it drove, and the wire frame where it believes it is; what lies between these and the solid \
         line is the odometry's error. Through the floor of glass, front upwards, one sees what the floor does to the tyres: \
         magenta the traction of each piece of rubber (60 mm for 40 kPa), black the whole force on a wheel (0.1 m for 25 N). \
         Series of wheels are green on the left, purple on the right, pale at the rear. Space stops the time."
    )
}
