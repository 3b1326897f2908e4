//! URDF → a model file to begin with: what the URDF says, and a marked assumption for each thing that it does not.
//!
//! Assumptions are scaled from the robot's weight, wheels and track as the shipped robots have them: tyres that squash by a
//! fiftieth of their radius, damped at a third of critical, and at more where a tall robot would rock on; casters that are hard, and
//! as soft as tyres on both sides of the wheels; motors that could drag the robot on twice its weight; a driver that goes as fast as
//! a robot of that track does in a lab. Validated by `describe` in the tests: the shipped robots' own URDFs come back as the wheels
//! that their model files have, and drive.

use super::GRAVITY;
use super::error::SceneError;
use super::robot::Side;
use super::urdf::{Assembly, Candidate, Tree, WheelJoint};
use crate::odometry::OdometryParameters;
use std::fmt::Write;
use std::path::Path;

/// What a URDF cannot say.
#[derive(Debug, Clone, Default)]
pub struct Hints {
    /// Of wheels that the URDF draws as meshes \[m\].
    pub wheel_radius: Option<f64>,
    /// Links of casters; empty: those that are named so.
    pub casters: Vec<String>,
    /// What the robot's controller believes.
    pub odometry: Option<OdometryParameters>,
}

/// A model file and what it describes.
#[derive(Debug, Clone, PartialEq)]
pub struct Description {
    /// The model file, to be written beside the URDF.
    pub text: String,
    /// Driven wheels.
    pub wheels: usize,
    /// Links of casters.
    pub casters: Vec<String>,
    /// Of the first wheel \[m\].
    pub radius: f64,
    /// Between the mean left and the mean right wheel \[m\].
    pub track: f64,
    /// Of everything \[kg\].
    pub mass: f64,
    /// What its owner should know.
    pub notes: Vec<String>,
}

/// Squash of a tyre under its load, over its radius.
const SQUASH: f64 = 0.02;
/// Damping of what a robot stands on, of critical, and at most.
const DAMPING: [f64; 2] = [1.0 / 3.0, 1.0];
/// Rate at which it stops rocking at least \[1/s\]: 3 % are left after the half second before a run.
const CALMING: f64 = 7.0;
/// Squash of a caster under its load \[m\], where it is not to give way to wheels.
const CASTER_SQUASH: f64 = 1e-4;
/// Width of a tyre that is not drawn, over its radius.
const WIDTH: f64 = 0.4;
/// Pull of all motors at standstill, over the weight.
const PULL: f64 = 2.2;
/// Speed of a robot whose motors run free \[m/s\].
const FREE_SPEED: f64 = 1.2;
const GEAR_RATIO: f64 = 30.0;
const TICKS_PER_REVOLUTION: f64 = 4000.0;

/// Describes the robot of a URDF, whose text this is; the model file will name it as `named` and the robot as `name`.
///
/// # Errors
/// A URDF that cannot be read, has no wheels on one side, no radius for them, or nothing that keeps it from tipping.
pub fn describe(file: &Path, text: &str, named: &str, name: &str, hints: &Hints) -> Result<Description, SceneError> {
    let tree = Tree::parse(file, text)?;
    let mut notes = Vec::new();
    let candidates = tree.wheels();
    // A wheel that is drawn as a mesh alone is taken to be as large as the others.
    let drawn = candidates.iter().filter_map(|wheel| wheel.radius).reduce(f64::max);
    let usual = hints.wheel_radius.or(drawn);
    if let Some(first) = candidates.first().filter(|_| usual.is_none()) {
        return Err(SceneError::NoRadius { urdf: file.to_owned(), joint: first.joint.clone() });
    }
    let mut wheels: Vec<Wheel> = candidates.into_iter().filter_map(|wheel| Wheel::of(wheel, usual)).collect();
    // What turns like a wheel and does not reach the ground is none.
    let ground = wheels.iter().map(|wheel| wheel.at[2] - wheel.radius).fold(f64::INFINITY, f64::min);
    wheels.retain(|wheel| {
        let stands = wheel.at[2] - wheel.radius < ground + 0.2 * wheel.radius;
        if !stands {
            notes.push(format!(
                "joint `{}` turns like a wheel and does not reach the ground: no driven wheel",
                wheel.joint
            ));
        }
        stands
    });
    for (side, word) in [(Side::Left, "left"), (Side::Right, "right")] {
        if !wheels.iter().any(|wheel| wheel.side == side) {
            return Err(SceneError::NoWheels {
                urdf: file.to_owned(),
                side: word,
                continuous: tree.continuous_joints(false),
                about_x: tree.continuous_joints(true),
            });
        }
    }
    name_wheels(&mut wheels);

    let given = if hints.casters.is_empty() { tree.links_called(&["caster", "castor"]) } else { hints.casters.clone() };
    let mut casters = Vec::new();
    for link in given {
        let at = tree.link_origin(file, &link)?;
        let radius = at.z - ground;
        if radius > 1e-3 {
            casters.push(Ball { swivel: tree.swivel_of(&link), link, at: [at.x, at.y], radius });
        } else {
            notes.push(format!(
                "link `{link}` lies {:.3} m below the ground that the wheels stand on: no caster",
                -radius
            ));
        }
    }

    let mounted: Vec<(String, WheelJoint)> = wheels
        .iter()
        .map(|wheel| (wheel.name.clone(), WheelJoint { joint: wheel.joint.clone(), side: wheel.side }))
        .collect();
    let on_casters: Vec<_> = casters.iter().map(|caster| (caster.link.clone(), caster.swivel.clone())).collect();
    let assembly = tree.assemble(file, &mounted, &on_casters)?;
    let robot = Whole::of(&wheels, &assembly, ground);
    let stands_on: Vec<f64> =
        wheels.iter().map(|wheel| wheel.at[0]).chain(casters.iter().map(|caster| caster.at[0])).collect();
    let rear = stands_on.iter().copied().fold(f64::INFINITY, f64::min);
    let front = stands_on.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if front - rear < 1e-3 {
        return Err(SceneError::NoSupport { urdf: file.to_owned(), links: tree.links() });
    }
    assembly.check_clear(file, ground)?;
    notes.extend(assembly.notes);
    let text = model_file(named, name, &wheels, &casters, &robot, hints);
    Ok(Description {
        text,
        wheels: wheels.len(),
        casters: casters.into_iter().map(|caster| caster.link).collect(),
        radius: wheels[0].radius,
        track: robot.track,
        mass: robot.mass,
        notes,
    })
}

struct Wheel {
    name: String,
    joint: String,
    side: Side,
    at: [f64; 3],
    radius: f64,
    width: Option<f64>,
}

impl Wheel {
    fn of(found: Candidate, radius: Option<f64>) -> Option<Wheel> {
        Some(Wheel {
            name: String::new(),
            side: if found.at[1] > 0.0 { Side::Left } else { Side::Right },
            radius: found.radius.or(radius)?,
            joint: found.joint,
            at: found.at,
            width: found.width,
        })
    }
}

/// A caster: the ball or wheel about a link's origin that touches the ground.
struct Ball {
    link: String,
    /// The joint that it swivels about.
    swivel: Option<String>,
    /// In the base frame \[m\].
    at: [f64; 2],
    radius: f64,
}

/// Names wheels by axle and side, front first.
fn name_wheels(wheels: &mut [Wheel]) {
    wheels.sort_by(|one, other| other.at[0].total_cmp(&one.at[0]).then(other.at[1].total_cmp(&one.at[1])));
    // Wheels within half a radius along share an axle.
    let mut axle = vec![0; wheels.len()];
    for index in 1..wheels.len() {
        let apart = wheels[index - 1].at[0] - wheels[index].at[0] > 0.5 * wheels[index].radius;
        axle[index] = axle[index - 1] + usize::from(apart);
    }
    let last = axle.last().copied().unwrap_or(0);
    let mut taken: Vec<String> = Vec::new();
    for (wheel, axle) in wheels.iter_mut().zip(axle) {
        let place = match (axle, last) {
            (_, 0) => String::new(),
            (0, _) => "front_".to_owned(),
            (axle, last) if axle == last => "rear_".to_owned(),
            (_, 2) => "middle_".to_owned(),
            (axle, _) => format!("axle_{}_", axle + 1),
        };
        let side = if wheel.side == Side::Left { "left" } else { "right" };
        let twins = taken.iter().filter(|name| **name == format!("{place}{side}")).count();
        taken.push(format!("{place}{side}"));
        // A side's name stays at the end: that is how columns of encoders are told apart.
        wheel.name = if twins == 0 { format!("{place}{side}") } else { format!("{place}{}_{side}", twins + 1) };
    }
}

/// What the parts come to.
struct Whole {
    mass: f64,
    track: f64,
    wheelbase: f64,
    /// Above this point of the ground lies the centre of mass, x and y \[m\].
    stands_over: [f64; 2],
    /// Moments of inertia about it, in pitch and in roll \[kg m²\].
    rocking: [f64; 2],
}

impl Whole {
    fn of(wheels: &[Wheel], assembly: &Assembly, ground: f64) -> Whole {
        let mean = |side| {
            let of: Vec<f64> = wheels.iter().filter(|wheel| wheel.side == side).map(|wheel| wheel.at[1]).collect();
            of.iter().sum::<f64>() / of.len() as f64
        };
        let x = || wheels.iter().map(|wheel| wheel.at[0]);
        let mut whole = assembly.chassis.clone();
        for wheel in &assembly.wheels {
            let (body, rotation) = (&wheel.body, wheel.base_from_wheel.rotation.to_rotation_matrix());
            let inertia = rotation * body.inertia * rotation.transpose();
            whole.add_mass(body.mass, wheel.base_from_wheel * body.centre_of_mass, inertia);
        }
        let centre = whole.centre_of_mass;
        let raised = whole.mass * (centre.z - ground).powi(2);
        Whole {
            mass: whole.mass,
            stands_over: [centre.x, centre.y],
            rocking: [whole.inertia.m22 + raised, whole.inertia.m11 + raised],
            track: mean(Side::Left) - mean(Side::Right),
            wheelbase: x().fold(f64::NEG_INFINITY, f64::max) - x().fold(f64::INFINITY, f64::min),
        }
    }

    /// Damping of its springs, of critical, at which it stops rocking at [`CALMING`]: on dampers c at distances a from the axis
    /// that a moment of inertia I rocks about, Σ c a²/(2 I). `springs` are where they stand and what is critical of them.
    fn damping(&self, springs: impl Iterator<Item = ([f64; 2], f64)>) -> f64 {
        let mut resists = [0.0; 2];
        for (at, critical) in springs {
            for axis in 0..2 {
                resists[axis] += critical * (at[axis] - self.stands_over[axis]).powi(2);
            }
        }
        let [usual, most] = DAMPING;
        (0..2).map(|axis| 2.0 * self.rocking[axis] * CALMING / resists[axis]).fold(usual, f64::max).min(most)
    }
}

/// Two digits: an assumption has no more.
fn about(value: f64) -> f64 {
    let scale = 10f64.powf(value.abs().log10().floor() - 1.0);
    // A power of ten below one is none in binary; a quotient of whole numbers rounds to the decimal that is meant.
    if scale >= 1.0 { (value / scale).round() * scale } else { (value / scale).round() / (1.0 / scale).round() }
}

/// What a URDF says, to the micrometre.
fn stated(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// The text: the URDF's name and the robot's, its parts, what they come to, and what is known besides.
fn model_file(urdf: &str, name: &str, wheels: &[Wheel], casters: &[Ball], robot: &Whole, hints: &Hints) -> String {
    let quoted = |text: &str| toml::Value::from(text).to_string();
    let radius = wheels[0].radius;
    let load = robot.mass * GRAVITY / (wheels.len() + casters.len()) as f64;
    let stiffness = load / (SQUASH * radius);
    // Hard casters on both sides of the wheels would take the weight off them, which a robot's springs see to.
    let is_ahead = |caster: &Ball| wheels.iter().all(|wheel| caster.at[0] > wheel.at[0]);
    let is_behind = |caster: &Ball| wheels.iter().all(|wheel| caster.at[0] < wheel.at[0]);
    let (squash, why) = if casters.iter().any(is_ahead) && casters.iter().any(is_behind) {
        (SQUASH * radius, "as soft as tyres, to leave the wheels their load")
    } else {
        (CASTER_SQUASH, "hard")
    };
    let of_casters = load / squash;
    let critical = |stiffness: f64| 2.0 * (stiffness * load / GRAVITY).sqrt();
    let springs = wheels.iter().map(|wheel| ([wheel.at[0], wheel.at[1]], stiffness));
    let springs = springs.chain(casters.iter().map(|caster| (caster.at, of_casters)));
    let share = robot.damping(springs.map(|(at, stiffness)| (at, critical(stiffness))));
    let damping = |stiffness: f64| share * critical(stiffness);
    let mut file = String::new();
    let mut line = |words: String| {
        let _ = writeln!(file, "{words}");
    };
    line("format = \"treadmark-robot/1\"".to_owned());
    line(format!("name = {}", quoted(name)));
    line(format!("urdf = {}", quoted(urdf)));
    line(String::new());
    line("# Masses, inertias, joints, radii and widths are the URDF's; whatever is marked ASSUMED is not, and waits for a ruler, a".into());
    line("# scale, a data sheet or a look into the controller's settings. A diagnosis trusts all of it but what [doubt] says.".into());

    line("\n[tyre]".to_owned());
    match wheels[0].width {
        Some(width) => line(format!("width_m = {:?}", stated(width))),
        None => line(format!("width_m = {:?}    # ASSUMED: the URDF draws no cylinder", about(WIDTH * radius))),
    }
    line(format!("vertical_stiffness_n_m = {:?}    # ASSUMED: squashed by a fiftieth of its radius", about(stiffness)));
    line(format!("vertical_damping_n_s_m = {:?}    # ASSUMED: {:.2} of critical", about(damping(stiffness)), share));
    line("slip_stiffness = 15.0    # ASSUMED: rubber".to_owned());
    line("friction_along = 0.8    # ASSUMED: rubber on a clean floor".to_owned());
    line("friction_across = 0.8    # ASSUMED".to_owned());

    for wheel in wheels {
        line(format!("\n[wheels.{}]", wheel.name));
        line(format!("joint = {}", quoted(&wheel.joint)));
        line(format!("side = \"{}\"", if wheel.side == Side::Left { "left" } else { "right" }));
        line(format!("free_radius_m = {:?}", stated(wheel.radius)));
        if let Some(width) = wheel.width.filter(|width| Some(*width) != wheels[0].width) {
            line(format!("width_m = {:?}", stated(width)));
        }
    }
    for caster in casters {
        line("\n[[casters]]".to_owned());
        line(format!("link = {}", quoted(&caster.link)));
        if let Some(joint) = &caster.swivel {
            line(format!("swivel = {}    # the joint that it turns about, its wheel trailing", quoted(joint)));
        }
        line(format!("radius_m = {:?}    # from its link's origin to the ground", stated(caster.radius)));
        line(format!("vertical_stiffness_n_m = {:?}    # ASSUMED: {why}", about(of_casters)));
        line(format!("vertical_damping_n_s_m = {:?}    # ASSUMED", about(damping(of_casters))));
        line("drag_coefficient = 0.0    # ASSUMED: it rolls freely".to_owned());
    }

    let torque = PULL * robot.mass * GRAVITY * radius / wheels.len() as f64;
    let free = FREE_SPEED / radius;
    line("\n# ASSUMED, all of it: motors of a usual robot of this weight.".to_owned());
    line("[drivetrain]".to_owned());
    line(format!("gear_ratio = {GEAR_RATIO:?}"));
    line(format!("motor_stall_torque_nm = {:?}", about(torque / GEAR_RATIO)));
    line(format!("motor_no_load_speed_rad_s = {:?}", about(free * GEAR_RATIO)));
    line(format!("rotor_inertia_kg_m2 = {:?}", about(0.04 * robot.mass * radius * radius / (GEAR_RATIO * GEAR_RATIO))));
    line(format!("dry_friction_nm = {:?}", about(0.01 * torque)));
    line(format!("viscous_friction_nm_s = {:?}", about(0.025 * torque / free)));
    line(format!("proportional_gain_nm_s = {:?}", about(0.8 * torque / free)));
    line(format!("integral_gain_nm = {:?}", about(torque)));
    line("loop_rate_hz = 200.0".to_owned());
    line("speed_window_s = 0.02".to_owned());

    let ticks = hints.odometry.and_then(|odometry| odometry.ticks_per_revolution);
    let of_ticks = if ticks.is_some() { "" } else { "    # ASSUMED: counts times gear" };
    let ticks = ticks.unwrap_or(TICKS_PER_REVOLUTION);
    line("\n[encoder]".to_owned());
    line(format!("ticks_per_revolution = {ticks:?}{of_ticks}"));
    line("rate_hz = 200.0    # ASSUMED".to_owned());
    line("latency_s = 0.0    # ASSUMED".to_owned());

    line("\n# What the robot's controller believes.".to_owned());
    line("[odometry]".to_owned());
    match hints.odometry {
        Some(believed) => {
            line(format!("left_wheel_radius_m = {:?}", believed.left_wheel_radius));
            line(format!("right_wheel_radius_m = {:?}", believed.right_wheel_radius));
            line(format!("track_width_m = {:?}", believed.track_width));
        }
        None => {
            line(format!("left_wheel_radius_m = {:?}    # ASSUMED: as drawn", stated(radius)));
            line(format!("right_wheel_radius_m = {:?}    # ASSUMED: as drawn", stated(radius)));
            // b_eff/b = 1 + (l/b)² of two axles under equal load and isotropic friction (science note 2).
            let scrubs = 1.0 + (robot.wheelbase / robot.track).powi(2);
            let why = if robot.wheelbase > 0.0 { "the track times 1 + (wheelbase/track)²" } else { "as drawn" };
            line(format!("track_width_m = {:?}    # ASSUMED: {why}", stated(robot.track * scrubs)));
        }
    }
    line(format!("ticks_per_revolution = {ticks:?}{of_ticks}"));

    let speed = robot.track.clamp(0.1, 0.4);
    line("\n# ASSUMED, all of it: how it drives.".to_owned());
    line("[driver]".to_owned());
    line(format!("cruise_speed_m_s = {:?}", about(speed)));
    line(format!("acceleration_m_s2 = {:?}", about(speed)));
    line("turn_rate_rad_s = 0.6\nturn_acceleration_rad_s2 = 1.2".to_owned());
    line("heading_gain_1_s = 8.0\ndistance_gain_1_s = 3.0".to_owned());
    line(format!("line_gain_rad_m2 = {:?}", about(0.8 / (robot.track * robot.track))));
    line("pause_s = 0.5\nrate_hz = 50.0".to_owned());

    line("\n# Nobody has measured its tyres: 1 σ of ln of their friction, and of their stiffness.".to_owned());
    line("[doubt]\nfriction = 0.15\nstiffness = 0.3".to_owned());
    file
}

#[cfg(test)]
mod tests {
    use super::about;

    #[test]
    fn assumptions_have_two_digits() {
        for (value, expected) in
            [(0.034_72, "0.035"), (1234.0, "1200.0"), (9.96e-7, "1e-6"), (0.5, "0.5"), (12.4, "12.0")]
        {
            assert_eq!(format!("{:?}", about(value)), expected);
        }
    }
}
