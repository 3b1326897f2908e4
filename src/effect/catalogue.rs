//! The catalogue: one entry an effect, with its physics beside it.
//!
//! Signs: x forward, y left, angles counter-clockwise. Each entry has a physical test, `effects::*`.

use super::{Choice, Effect, Family, Needs, Parameter, Prior};
use crate::geometry::Pose2;
use crate::scene::{GripRegion, RegionShape, Scene, Side, Wheel};
use nalgebra::{UnitQuaternion, Vector3};

const fn normal(name: &'static str, meaning: &'static str, std_dev: f64, bound: f64) -> Parameter {
    Parameter { name, meaning, bounds: [-bound, bound], prior: Prior::Normal { mean: 0.0, std_dev } }
}

const fn half_normal(name: &'static str, meaning: &'static str, std_dev: f64, bound: f64) -> Parameter {
    Parameter { name, meaning, bounds: [0.0, bound], prior: Prior::HalfNormal { std_dev } }
}

const UMBMARK: &str = "Borenstein & Feng 1996, IEEE Trans. Robotics and Automation 12(6)";
const PACEJKA: &str = "Pacejka, Tyre and Vehicle Dynamics";
const SKID: &str =
    "equilibrium of a steady spin under Coulomb friction: b_eff/b = 1 + k²(l/b)², k = μ_y/μ_x (evidence: quasi_static)";

/// Every effect.
pub static EFFECTS: [Effect; 22] = [
    Effect {
        id: "wheel_diameter_mismatch",
        family: Family::Tyres,
        cause: "left and right tyres differ in diameter (E_d): straights bend",
        shown_by: "squares both ways round; a straight",
        source: UMBMARK,
        parameters: &[normal("ratio_minus_one", "D_R/D_L − 1, mean kept", 0.004, 0.3)],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| {
            let ratio = 1.0 + values[0];
            scale_radii(scene, |wheel| if wheel.side == Side::Left { 2.0 } else { 2.0 * ratio } / (1.0 + ratio));
        },
    },
    Effect {
        id: "wheel_diameter_scale",
        family: Family::Tyres,
        cause: "the mean wheel diameter is not the model's (E_s): everything is longer or shorter",
        shown_by: "a tape-measured straight; logged poses",
        source: UMBMARK,
        parameters: &[normal("ratio_minus_one", "D_actual/D_model − 1", 0.005, 0.3)],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| scale_radii(scene, |_| 1.0 + values[0]),
    },
    Effect {
        id: "axle_diameter_mismatch",
        family: Family::Tyres,
        cause: "front and rear tyres differ in diameter: the axles fight",
        shown_by: "logged poses; spins against straights",
        source: PACEJKA,
        parameters: &[normal("ratio_minus_one", "D_rear/D_front − 1, mean kept", 0.01, 0.3)],
        choice: None,
        needs: Needs::TwoAxles,
        edit: |scene, values, _| {
            let ratio = 1.0 + values[0];
            let middle = middle_of_wheels(scene);
            let rear = move |wheel: &Wheel| wheel.base_from_wheel.translation.x < middle;
            scale_radii(scene, |wheel| if rear(wheel) { 2.0 * ratio } else { 2.0 } / (1.0 + ratio));
        },
    },
    Effect {
        id: "tyre_radius_drift",
        family: Family::Tyres,
        cause: "tyres warm up or deflate over the campaign: its scale drifts from run to run",
        shown_by: "runs of one kind, early and late in the campaign, with their start times",
        source: PACEJKA,
        parameters: &[normal("per_hour", "relative growth of the radius an hour; negative shrinks", 0.005, 0.2)],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| scene.robot.tyre_growth += values[0],
    },
    Effect {
        id: "tyre_grip_anisotropy",
        family: Family::Tyres,
        cause: "the tread grips less sideways than along: moves the effective track",
        shown_by: "turns on the spot against straights",
        source: SKID,
        parameters: &[normal("ratio_minus_one", "μ_y/μ_x − 1 over the model's", 0.05, 0.6)],
        choice: None,
        needs: Needs::Patches,
        edit: |scene, values, _| {
            for wheel in &mut scene.robot.wheels {
                wheel.tyre.friction_across *= 1.0 + values[0];
            }
        },
    },
    Effect {
        id: "wheel_toe",
        family: Family::Tyres,
        cause: "a wheel is mounted off its rolling direction and pulls to its side",
        shown_by: "a straight with end heading and offset; logged poses",
        source: PACEJKA,
        parameters: &[normal("angle_rad", "counter-clockwise turn of the wheel about the vertical", 0.01, 0.3)],
        choice: Some(Choice::Wheel),
        needs: Needs::Nothing,
        edit: |scene, values, choice| {
            let toe = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), values[0]);
            for wheel in scene.robot.wheels.iter_mut().filter(|wheel| wheel.name == choice) {
                wheel.base_from_wheel.rotation = toe * wheel.base_from_wheel.rotation;
            }
        },
    },
    Effect {
        id: "load_offset_longitudinal",
        family: Family::Mass,
        cause: "payload sits fore or aft: one axle grips, the other scrubs, and the turn centre moves along",
        shown_by: "squares of two sizes: the shift of the turn centre does not grow with the side",
        source: SKID,
        parameters: &[normal("x_m", "shift of the centre of mass, forward", 0.01, 0.3)],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| shift_centre_of_mass(scene, values[0], 0.0),
    },
    Effect {
        id: "load_offset_lateral",
        family: Family::Mass,
        cause: "payload sits to one side: tyres compress unequally",
        shown_by: "circles of two radii against straights",
        source: PACEJKA,
        parameters: &[normal("y_m", "shift of the centre of mass, to the left", 0.01, 0.2)],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| shift_centre_of_mass(scene, 0.0, values[0]),
    },
    Effect {
        id: "caster_drag",
        family: Family::Mass,
        cause: "an unpowered caster resists being moved: the driven tyres creep against its drag",
        shown_by: "circles of several radii against turns on the spot",
        source: PACEJKA,
        parameters: &[half_normal("coefficient", "drag force over the caster's load, added", 0.05, 1.0)],
        choice: None,
        needs: Needs::Caster,
        edit: |scene, values, _| {
            for caster in &mut scene.robot.casters {
                caster.drag_coefficient += values[0];
            }
        },
    },
    Effect {
        id: "effective_track",
        family: Family::Class,
        cause: "the effective track is not the model's, whatever makes it so (E_b): anisotropy, fore-aft load or patch size",
        shown_by: "squares both ways round; spins",
        source: UMBMARK,
        parameters: &[normal("ratio_minus_one", "b_eff/b_model − 1", 0.02, 0.5)],
        choice: None,
        needs: Needs::PatchesOrOneAxle,
        edit: |scene, values, _| change_effective_track(scene, values[0]),
    },
    Effect {
        id: "floor_slope",
        family: Family::Floor,
        cause: "the floor is not level: the robot creeps downhill while its tyres roll",
        shown_by: "straights and squares in known headings, logged poses",
        source: PACEJKA,
        parameters: &[
            half_normal("gradient", "fall over run", 0.01, 0.3),
            Parameter {
                name: "downhill_heading_rad",
                meaning: "heading that points straight downhill, in the room",
                bounds: [-10.0, 10.0],
                prior: Prior::AnyHeading,
            },
        ],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| {
            if values[0] == 0.0 {
                return; // there and back through polar coordinates would cost a last bit
            }
            let floor = &mut scene.floor;
            let of = |gradient: f64, heading: f64| (gradient * heading.cos(), gradient * heading.sin());
            let (x, y) = of(floor.gradient, floor.downhill_heading);
            let (more_x, more_y) = of(values[0], values[1]);
            (floor.gradient, floor.downhill_heading) = ((x + more_x).hypot(y + more_y), (y + more_y).atan2(x + more_x));
        },
    },
    Effect {
        id: "floor_grip_patch",
        family: Family::Floor,
        cause: "a slippery spot lies on the path, and turns on it come out otherwise",
        shown_by: "runs that turn on it beside runs that do not; logged poses",
        source: SKID,
        parameters: &[
            Parameter { name: "x_m", meaning: "centre, in the room", bounds: [-100.0, 100.0], prior: Prior::OnPath },
            Parameter { name: "y_m", meaning: "centre, in the room", bounds: [-100.0, 100.0], prior: Prior::OnPath },
            Parameter { name: "radius_m", meaning: "radius", bounds: [0.01, 100.0], prior: Prior::Known(0.3) },
            Parameter {
                name: "ratio",
                meaning: "grip in it over grip around it",
                bounds: [0.05, 3.0],
                prior: Prior::Normal { mean: 0.65, std_dev: 0.2 },
            },
        ],
        choice: None,
        needs: Needs::FlatFloor,
        edit: |scene, values, _| {
            if values[3] == 1.0 {
                return;
            }
            let shape = RegionShape::Disc { x: values[0], y: values[1], radius: values[2] };
            scene.floor.regions.push(GripRegion { shape, grip_ratio: values[3] });
        },
    },
    Effect {
        id: "encoder_count_loss",
        family: Family::Drivetrain,
        cause: "one encoder drops counts while it turns: its wheel goes farther than it counts",
        shown_by: "a straight beside squares: it moves diameter ratio and scale together",
        source: UMBMARK,
        parameters: &[half_normal("fraction", "share of the counts that is lost", 0.002, 0.5)],
        choice: Some(Choice::Side),
        needs: Needs::Nothing,
        edit: |scene, values, choice| {
            let side = if choice == "left" { Side::Left } else { Side::Right };
            for wheel in scene.robot.wheels.iter_mut().filter(|wheel| wheel.side == side) {
                wheel.count_loss += values[0] * (1.0 - wheel.count_loss);
            }
        },
    },
    Effect {
        id: "encoder_latency",
        family: Family::Drivetrain,
        cause: "counts reach the controller late, and it overshoots; logged stamps are not late",
        shown_by: "runs at two speeds, without logs or in the logs' own overshoot",
        source: UMBMARK,
        parameters: &[half_normal("delay_s", "age of a count when the controller gets it", 0.05, 0.5)],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| scene.robot.encoder.latency += values[0],
    },
    Effect {
        id: "gear_backlash",
        family: Family::Drivetrain,
        cause: "play between encoder and wheel is counted on every reversal, and not driven",
        shown_by: "squares (wheels reverse at corners) beside spins and straights",
        source: UMBMARK,
        parameters: &[half_normal("angle_rad", "play at the wheel", 0.008, 0.3)],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| scene.robot.drivetrain.backlash += values[0],
    },
    Effect {
        id: "drivetrain_wind_up",
        family: Family::Drivetrain,
        cause: "shafts, belts or soft tyres wind up between encoder and tread while a turn scrubs: the robot lags its counts",
        shown_by: "logged poses where turns begin and end",
        source: "elastic–perfectly plastic scrub: c T of the wheel's way before tread slips (evidence: effects)",
        parameters: &[half_normal(
            "compliance_rad_nm",
            "lead of the encoder over the tread a newton metre",
            0.002,
            0.2,
        )],
        choice: None,
        needs: Needs::WindUp,
        edit: |scene, values, _| {
            if let Some(wind_up) = &mut scene.robot.drivetrain.wind_up {
                *wind_up += values[0];
            }
        },
    },
    Effect {
        id: "stop_overrun",
        family: Family::Drivetrain,
        cause: "wheels coast on after a stop while nobody counts",
        shown_by: "runs with many stops beside runs with few; spins at two rates",
        source: UMBMARK,
        parameters: &[half_normal("angle_rad", "way of a wheel after each stop", 0.02, 0.5)],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| scene.robot.drivetrain.stop_overrun += values[0],
    },
    Effect {
        id: "start_heading_error",
        family: Family::Survey,
        cause: "the robot was not placed along the start mark, and its heading was not surveyed",
        shown_by: "a straight; open shapes; logged poses",
        source: UMBMARK,
        parameters: &[normal("angle_rad", "positions and end headings turn by it", 0.01, 1.0)],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| scene.survey.start_heading_error += values[0],
    },
    Effect {
        id: "tracked_frame_turned",
        family: Family::Survey,
        cause: "the tracked frame is turned against the robot's axis: positions turn, headings do not",
        shown_by: "a straight with its heading; logged poses",
        source: "Censi et al. 2013, IEEE Trans. Robotics 29(2)",
        parameters: &[normal("angle_rad", "turn of the tracked frame; positions turn by minus it", 0.01, 1.0)],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| scene.survey.base_from_tracked.heading += values[0],
    },
    Effect {
        id: "survey_lever_arm",
        family: Family::Survey,
        cause: "the tracked point is not the robot's origin: it swings out in turns",
        shown_by: "poses on the way; spins that do not close",
        source: "Censi et al. 2013, IEEE Trans. Robotics 29(2)",
        parameters: &[
            normal("x_m", "tracked point in the robot, forward", 0.05, 2.0),
            normal("y_m", "tracked point in the robot, to the left", 0.05, 2.0),
        ],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| {
            let frame = scene.survey.base_from_tracked;
            scene.survey.base_from_tracked = Pose2::new(frame.x + values[0], frame.y + values[1], frame.heading);
        },
    },
    Effect {
        id: "survey_scale",
        family: Family::Survey,
        cause: "the tape or the tracking volume is off in scale",
        shown_by: "it acts like the wheels' scale on lengths, and not at all on headings",
        source: UMBMARK,
        parameters: &[normal("ratio_minus_one", "length as read over length − 1", 0.003, 0.5)],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| scene.survey.scale *= 1.0 + values[0],
    },
    Effect {
        id: "survey_time_offset",
        family: Family::Survey,
        cause: "the clocks of poses and encoders disagree",
        shown_by: "poses on the way while the robot speeds up, slows down or turns",
        source: "Censi et al. 2013, IEEE Trans. Robotics 29(2)",
        parameters: &[
            normal("offset_s", "pose stamp − encoder stamp, of the campaign", 0.1, 10.0),
            normal("rate_minus_one", "rate of the pose clock over the encoders' − 1", 0.001, 0.1),
            half_normal("run_offset_std_s", "σ of offsets that differ from run to run", 0.1, 10.0),
        ],
        choice: None,
        needs: Needs::Nothing,
        edit: |scene, values, _| {
            let survey = &mut scene.survey;
            survey.time_offset += values[0];
            survey.clock_rate *= 1.0 + values[1];
            survey.time_offset_std = survey.time_offset_std.hypot(values[2]);
        },
    },
];

/// What stands in the place of a cause where none is known: an empirical term. It is not in the catalogue.
pub static NO_CAUSE: Effect = Effect {
    id: "empirical",
    family: Family::Class,
    cause: "no known cause: a formula of the body's twist",
    shown_by: "whatever the known causes leave",
    source: "Brunton, Proctor & Kutz 2016, PNAS 113(15), for sparse terms",
    parameters: &[],
    choice: None,
    needs: Needs::Nothing,
    edit: |_, _, _| {},
};

fn scale_radii(scene: &mut Scene, factor: impl Fn(&Wheel) -> f64) {
    for wheel in &mut scene.robot.wheels {
        wheel.tyre.free_radius *= factor(wheel);
    }
}

fn middle_of_wheels(scene: &Scene) -> f64 {
    let wheels = &scene.robot.wheels;
    wheels.iter().map(|wheel| wheel.base_from_wheel.translation.x).sum::<f64>() / wheels.len() as f64
}

/// Moves the centre of mass of the whole robot \[m\] by moving what the chassis carries.
fn shift_centre_of_mass(scene: &mut Scene, x: f64, y: f64) {
    let share = scene.robot.mass() / scene.robot.chassis.mass;
    scene.robot.chassis.centre_of_mass += Vector3::new(x, y, 0.0) * share;
}

/// Changes the effective track by `ratio` − 1: on two axles through the friction ratio k, from b_eff/b = 1 + k²(l/b)², so
/// k² = ((1 + ratio)(1 + k₀²(l/b)²) − 1)/(l/b)²; on one axle, where friction does not move it, through the lateral place of
/// the wheels.
fn change_effective_track(scene: &mut Scene, ratio: f64) {
    if ratio == 0.0 {
        return; // there and back through k² would cost a last bit
    }
    let (b, l) = (scene.robot.track_width(), scene.robot.wheelbase());
    if l == 0.0 {
        let middle = scene.robot.wheels.iter().map(|wheel| wheel.base_from_wheel.translation.y).sum::<f64>()
            / scene.robot.wheels.len() as f64;
        for wheel in &mut scene.robot.wheels {
            wheel.base_from_wheel.translation.y += ratio * (wheel.base_from_wheel.translation.y - middle);
        }
        return;
    }
    let q = (l / b).powi(2);
    for wheel in &mut scene.robot.wheels {
        let k2 = (wheel.tyre.friction_across / wheel.tyre.friction_along).powi(2);
        let changed = ((1.0 + ratio) * (1.0 + k2 * q) - 1.0) / q;
        wheel.tyre.friction_across = wheel.tyre.friction_along * changed.max(0.01).sqrt();
    }
}
