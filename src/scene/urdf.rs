//! URDF → one chassis body and the driven wheels.
//!
//! Links that are not driven wheels are joined to the chassis with their masses, whatever joint holds them: a joint that
//! could move is held at zero and a note says so. `<dynamics>` and `<limit>` of wheel joints are superseded by the model
//! file's drivetrain.

use super::error::{SceneError, SwivelProblem, WheelProblem};
use super::left_out::LeftOut;
use super::misread::Misread;
use super::robot::{Side, Swivel};
use super::shape::{Body, PlacedShape, Placement, Shape};
use nalgebra::{Matrix3, Point3, Translation3, Unit, UnitQuaternion, UnitVector3, Vector3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use urdf_rs::{Geometry, JointType, Link};

/// Sines of angles by which an axle lies off the lateral axis because somebody wrote 1.57 for π/2, and no wheel is mounted so
/// exactly; below the first it is computers that round.
const ROUNDING: (f64, f64) = (1e-9, 1e-3);

/// A joint that the model file names as a driven wheel's.
pub(super) struct WheelJoint {
    pub joint: String,
    pub side: Side,
}

/// A wheel as the URDF mounts it.
pub(super) struct MountedWheel {
    pub body: Body,
    pub base_from_wheel: Placement,
    pub axle: UnitVector3<f64>,
}

/// A caster as the URDF mounts it.
pub(super) struct MountedCaster {
    /// Of its ball, or of its wheel where it trails straight behind, in the base frame.
    pub centre: Point3<f64>,
    pub swivel: Option<Swivel>,
}

/// A joint that a caster swivels about.
struct Fork {
    /// The link that turns.
    link: usize,
    trail: f64,
    /// Where the axis passes the wheel's centre, x ahead of it as drawn, in the base frame.
    base_from_fork: Placement,
    /// What turns with it, in its own frame.
    visuals: Vec<PlacedShape>,
}

/// What may be a driven wheel.
pub(super) struct Candidate {
    pub joint: String,
    /// Where its hub stands in the base frame \[m\].
    pub at: [f64; 3],
    /// As its shapes are drawn \[m\].
    pub radius: Option<f64>,
    /// Likewise \[m\].
    pub width: Option<f64>,
}

/// What a URDF comes to.
pub(super) struct Assembly {
    pub chassis: Body,
    /// In the order asked for.
    pub wheels: Vec<MountedWheel>,
    /// Likewise.
    pub casters: Vec<MountedCaster>,
    pub notes: Vec<String>,
    /// The link of the chassis whose collision shapes reach lowest, and how high above the base frame \[m\].
    lowest: Option<(String, f64)>,
}

/// What drawings round \[m\].
const DRAWN: f64 = 1e-4;

/// Trail that a swivel has at least \[m\]: of less, a wheel turns about within a step or two at any speed that robots go.
const LEAST_TRAIL: f64 = 5e-3;

/// How far an axle may point off the lateral axis.
const LATERAL: f64 = 0.9397; // cos 20°

/// How far the axis of a swivel may lean.
const UPRIGHT: f64 = 0.9998; // cos 1°

impl Assembly {
    /// Of chassis and wheels \[kg\].
    pub(super) fn mass(&self) -> f64 {
        self.chassis.mass + self.wheels.iter().map(|wheel| wheel.body.mass).sum::<f64>()
    }

    /// Refuses a chassis that the robot would stand on: its shapes reach below the `ground` that its wheels stand on \[m\].
    pub(super) fn check_clear(&self, urdf: &Path, ground: f64) -> Result<(), SceneError> {
        match &self.lowest {
            Some((link, height)) if *height < ground - DRAWN => {
                Err(SceneError::Grounded { urdf: urdf.to_owned(), link: link.clone(), depth: ground - height })
            }
            _ => Ok(()),
        }
    }

    /// What is near enough to the `ground` for the chassis to rub on it where tyres squash by `squash` \[m\].
    pub(super) fn rubs(&self, ground: f64, squash: f64) -> Option<String> {
        let (link, height) = self.lowest.as_ref().filter(|(_, height)| *height < ground + squash)?;
        let (clear, squash) = (1e3 * (height - ground), 1e3 * squash);
        Some(format!(
            "link `{link}`: its collision shape clears the ground by {clear:.1} mm as drawn, and the tyres squash by \
             {squash:.1} mm under the robot: it rubs"
        ))
    }
}

/// A parsed URDF whose links form a tree.
pub(super) struct Tree {
    file: PathBuf,
    robot: urdf_rs::Robot,
    /// Index of each link by name.
    link_index: HashMap<String, usize>,
    /// For each link the joint that holds it; `None` for the root.
    parent_joint: Vec<Option<usize>>,
    /// root_from_link at rest.
    placements: Vec<Placement>,
}

impl Tree {
    pub(super) fn parse(file: &Path, text: &str) -> Result<Tree, SceneError> {
        let robot = urdf_rs::read_from_string(text).map_err(|source| {
            let (file, source) = (file.to_owned(), Box::new(source));
            match unexpanded(text) {
                _ if text.contains("<xacro:") => SceneError::Xacro { file },
                Some((line, expression)) => SceneError::Unexpanded { file, line, expression, source },
                None => match Misread::of(text) {
                    Some(misread) => SceneError::Misread { file, misread },
                    None => SceneError::Urdf { file, source },
                },
            }
        })?;
        let link_index: HashMap<String, usize> =
            robot.links.iter().enumerate().map(|(index, link)| (link.name.clone(), index)).collect();
        let mut tree = Tree {
            file: file.to_owned(),
            link_index,
            parent_joint: vec![None; robot.links.len()],
            placements: vec![Placement::identity(); robot.links.len()],
            robot,
        };
        tree.check_numbers()?;
        tree.place_links()?;
        Ok(tree)
    }

    /// Where the origin of `link` stands in the base frame.
    pub(super) fn link_origin(&self, model: &Path, link: &str) -> Result<Point3<f64>, SceneError> {
        match self.link_index.get(link) {
            Some(&index) => Ok(Point3::from(self.placements[index].translation.vector)),
            None => Err(SceneError::MissingLink {
                model: model.to_owned(),
                urdf: self.file.clone(),
                link: link.to_owned(),
                links: self.links(),
            }),
        }
    }

    /// Joins links to bodies; each of `wheels` (name, joint) becomes a body of its own. What the links of `casters` (link, joint
    /// that it swivels about) and those on them hit is left to the casters; what swivels adds its mass to the chassis as drawn.
    pub(super) fn assemble(
        &self,
        model: &Path,
        wheels: &[(String, WheelJoint)],
        casters: &[(String, Option<String>)],
    ) -> Result<Assembly, SceneError> {
        let mut wheel_of_joint = HashMap::new();
        for (position, (name, wheel)) in wheels.iter().enumerate() {
            let joint = self.wheel_joint(model, name, wheel)?;
            wheel_of_joint.insert(joint, position);
        }

        let root = self.root();
        let mut left_out = LeftOut::default();
        let mut chassis = Body::empty(&self.robot.links[root].name);
        let mut mounted: Vec<MountedWheel> = wheels.iter().map(|(_, wheel)| self.mount(wheel)).collect();
        let forks =
            casters.iter().map(|(link, joint)| joint.as_ref().map(|joint| self.fork(model, link, joint)).transpose());
        let mut forks = forks.collect::<Result<Vec<_>, _>>()?;
        let mut lowest: Option<(String, f64)> = None;
        for (index, link) in self.robot.links.iter().enumerate() {
            if let Some((wheel, hub)) = self.carrier(index, &wheel_of_joint) {
                let wheel_from_link = self.placements[hub].inv_mul(&self.placements[index]);
                self.join(&mut mounted[wheel].body, link, wheel_from_link, true, &mut left_out)?;
                continue;
            }
            let (known, drawn) = (chassis.collisions.len(), chassis.visuals.len());
            let is_of = |caster: &str| self.lineage(index).any(|link| self.robot.links[link].name == caster);
            let fork = forks.iter_mut().flatten().find(|fork| self.is_on(index, fork));
            let hits = fork.is_none() && !casters.iter().any(|(caster, _)| is_of(caster));
            self.join(&mut chassis, link, self.placements[index], hits, &mut left_out)?;
            if let Some(Fork { base_from_fork, visuals, .. }) = fork {
                let moved =
                    |shape: PlacedShape| PlacedShape { placement: base_from_fork.inv_mul(&shape.placement), ..shape };
                visuals.extend(chassis.visuals.drain(drawn..).map(moved));
            }
            let height = chassis.collisions[known..].iter().map(PlacedShape::lowest).fold(f64::INFINITY, f64::min);
            if lowest.as_ref().is_none_or(|(_, least)| height < *least) {
                lowest = Some((link.name.clone(), height));
            }
        }
        for (joint_index, joint) in self.robot.joints.iter().enumerate() {
            let moves = !matches!(joint.joint_type, JointType::Fixed);
            let child = self.link_index[&joint.child.link];
            let swivels = forks.iter().flatten().any(|fork| self.is_on(child, fork));
            if moves && !swivels && !wheel_of_joint.contains_key(&joint_index) {
                left_out.held.push(joint.name.clone());
            }
        }

        self.check_body(&chassis)?;
        for wheel in &mounted {
            self.check_body(&wheel.body)?;
        }
        let casters = casters.iter().zip(forks).map(|((link, _), fork)| {
            Ok(match fork {
                Some(Fork { trail, base_from_fork, visuals, .. }) => MountedCaster {
                    centre: Point3::from(base_from_fork.translation.vector) - Vector3::x() * trail,
                    swivel: Some(Swivel { trail, visuals }),
                },
                None => MountedCaster { centre: self.link_origin(model, link)?, swivel: None },
            })
        });
        let casters = casters.collect::<Result<Vec<_>, SceneError>>()?;
        Ok(Assembly { chassis, wheels: mounted, casters, notes: left_out.notes(), lowest })
    }

    /// The joint that a caster's link swivels about, if it is drawn with one that will do.
    pub(super) fn swivel_of(&self, link: &str) -> Option<String> {
        let index = *self.link_index.get(link)?;
        let mut above = self.lineage(index).filter_map(|link| self.parent_joint[link]);
        above.find_map(|joint| {
            let name = &self.robot.joints[joint].name;
            self.fork(&self.file, link, name).ok().map(|_| name.clone())
        })
    }

    /// The fork of caster `link`, which turns about `joint`.
    fn fork(&self, model: &Path, link: &str, joint: &str) -> Result<Fork, SceneError> {
        let wheel = self.link_origin(model, link)?;
        let above: Vec<usize> =
            self.lineage(self.link_index[link]).filter_map(|link| self.parent_joint[link]).collect();
        let named = |index: &usize| self.robot.joints[*index].name.clone();
        let fails = |problem| SceneError::NotASwivel {
            urdf: self.file.clone(),
            link: link.to_owned(),
            joint: joint.to_owned(),
            problem,
        };
        let Some(&index) = above.iter().find(|index| named(index) == joint) else {
            return Err(fails(SwivelProblem::NotAbove { above: above.iter().map(named).collect() }));
        };
        let found = &self.robot.joints[index];
        if !matches!(found.joint_type, JointType::Continuous | JointType::Revolute) {
            return Err(fails(SwivelProblem::DoesNotTurn { kind: format!("{:?}", found.joint_type).to_lowercase() }));
        }
        let (turns, axis) = (self.link_index[&found.child.link], self.axis(index));
        let upright = axis.z.abs();
        if upright.is_nan() || upright < UPRIGHT {
            return Err(fails(SwivelProblem::NotUpright(axis.x, axis.y, axis.z)));
        }
        let pivot = self.placements[turns].translation;
        let ahead = Vector3::new(pivot.x - wheel.x, pivot.y - wheel.y, 0.0);
        let trail = ahead.norm();
        if trail < LEAST_TRAIL {
            return Err(fails(SwivelProblem::NoTrail { trail, least: LEAST_TRAIL }));
        }
        let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), ahead.y.atan2(ahead.x));
        let base_from_fork = Placement::from_parts(Translation3::new(pivot.x, pivot.y, wheel.z), turned);
        Ok(Fork { link: turns, trail, base_from_fork, visuals: Vec::new() })
    }

    /// What may be driven wheels: what turns without end about the lateral axis on the chassis, in the URDF's order.
    pub(super) fn wheels(&self) -> Vec<Candidate> {
        let continuous = |joint: &&urdf_rs::Joint| matches!(joint.joint_type, JointType::Continuous);
        let candidates = self.robot.joints.iter().filter(continuous).filter_map(|joint| {
            let hub = self.link_index[&joint.child.link];
            let at = self.placements[hub].translation;
            let side = if at.y > 0.0 { Side::Left } else { Side::Right };
            let index = self.wheel_joint(&self.file, "", &WheelJoint { joint: joint.name.clone(), side }).ok()?;
            let own = HashMap::from([(index, 0)]);
            let links: Vec<usize> =
                (0..self.robot.links.len()).filter(|&it| self.carrier(it, &own).is_some()).collect();
            let round = |of: fn(&Link) -> Vec<(&urdf_rs::Pose, &Geometry)>| {
                let sizes = links.iter().flat_map(|&link| {
                    let base_from_link = self.placements[link];
                    of(&self.robot.links[link]).into_iter().filter_map(move |(origin, geometry)| {
                        let axis = (base_from_link * placement(origin)).rotation * Vector3::z();
                        match *geometry {
                            Geometry::Cylinder { radius, length } if axis.y.abs() > 0.9 => Some((radius, Some(length))),
                            Geometry::Sphere { radius } => Some((radius, None)),
                            _ => None,
                        }
                    })
                });
                sizes.max_by(|(one, _), (other, _)| one.total_cmp(other))
            };
            let collision = round(|link| link.collision.iter().map(|part| (&part.origin, &part.geometry)).collect());
            let visual = || round(|link| link.visual.iter().map(|part| (&part.origin, &part.geometry)).collect());
            let size = collision.or_else(visual);
            let (radius, width) = (size.map(|(radius, _)| radius), size.and_then(|(_, width)| width));
            Some(Candidate { joint: joint.name.clone(), at: [at.x, at.y, at.z], radius, width })
        });
        candidates.collect()
    }

    /// Links whose names hold one of `words`, and none of whose children's do.
    pub(super) fn links_called(&self, words: &[&str]) -> Vec<String> {
        let called = |name: &str| words.iter().any(|word| name.to_lowercase().contains(word));
        let has_child =
            |name: &str| self.robot.joints.iter().any(|joint| joint.parent.link == name && called(&joint.child.link));
        self.links().into_iter().filter(|name| called(name) && !has_child(name)).collect()
    }

    /// Joints that turn without end; of those only that do so on the chassis about its x axis.
    pub(super) fn continuous_joints(&self, about_x: bool) -> Vec<String> {
        let turns = |(index, joint): &(usize, &urdf_rs::Joint)| {
            let is_about_x = || self.axis(*index).x.abs() > LATERAL && self.is_on_chassis(joint);
            matches!(joint.joint_type, JointType::Continuous) && (!about_x || is_about_x())
        };
        self.robot.joints.iter().enumerate().filter(turns).map(|(_, joint)| joint.name.clone()).collect()
    }

    pub(super) fn joints(&self) -> Vec<String> {
        self.robot.joints.iter().map(|joint| joint.name.clone()).collect()
    }

    pub(super) fn links(&self) -> Vec<String> {
        self.robot.links.iter().map(|link| link.name.clone()).collect()
    }

    fn root(&self) -> usize {
        self.parent_joint.iter().position(Option::is_none).unwrap_or(0)
    }

    /// Follows joints from the root outward; every link must be reached exactly once.
    fn place_links(&mut self) -> Result<(), SceneError> {
        let mut children: HashMap<&str, Vec<usize>> = HashMap::new();
        for (joint_index, joint) in self.robot.joints.iter().enumerate() {
            for end in [&joint.parent.link, &joint.child.link] {
                if !self.link_index.contains_key(end) {
                    return Err(SceneError::LooseJoint {
                        urdf: self.file.clone(),
                        joint: joint.name.clone(),
                        link: end.clone(),
                        links: self.links(),
                    });
                }
            }
            self.parent_joint[self.link_index[&joint.child.link]] = Some(joint_index);
            children.entry(&joint.parent.link).or_default().push(joint_index);
        }
        let roots: Vec<usize> = (0..self.robot.links.len()).filter(|&link| self.parent_joint[link].is_none()).collect();
        let mut reached = 0;
        let mut open = roots.clone();
        while let Some(link) = open.pop() {
            reached += 1;
            for &joint_index in children.get(self.robot.links[link].name.as_str()).into_iter().flatten() {
                let joint = &self.robot.joints[joint_index];
                let child = self.link_index[&joint.child.link];
                self.placements[child] = self.placements[link] * placement(&joint.origin);
                open.push(child);
            }
        }
        if roots.len() != 1 || reached != self.robot.links.len() {
            let roots = roots.iter().map(|&link| self.robot.links[link].name.clone()).collect();
            return Err(SceneError::NotATree { urdf: self.file.clone(), roots });
        }
        Ok(())
    }

    /// A link and all that it hangs on.
    fn lineage(&self, index: usize) -> impl Iterator<Item = usize> {
        let above = |link: &usize| Some(self.link_index[&self.robot.joints[self.parent_joint[*link]?].parent.link]);
        std::iter::successors(Some(index), above)
    }

    /// Whether a link turns with a fork.
    fn is_on(&self, index: usize, fork: &Fork) -> bool {
        self.lineage(index).any(|link| link == fork.link)
    }

    /// The wheel body that carries link `index`, with the wheel's hub link; `None`: the chassis carries it.
    fn carrier(&self, mut index: usize, wheel_of_joint: &HashMap<usize, usize>) -> Option<(usize, usize)> {
        while let Some(joint) = self.parent_joint[index] {
            if let Some(&wheel) = wheel_of_joint.get(&joint) {
                return Some((wheel, index));
            }
            index = self.link_index[&self.robot.joints[joint].parent.link];
        }
        None
    }

    /// The index of a driven wheel's joint, checked for being one.
    fn wheel_joint(&self, model: &Path, name: &str, wheel: &WheelJoint) -> Result<usize, SceneError> {
        let Some(index) = self.robot.joints.iter().position(|joint| joint.name == wheel.joint) else {
            return Err(SceneError::MissingJoint {
                model: model.to_owned(),
                urdf: self.file.clone(),
                wheel: name.to_owned(),
                joint: wheel.joint.clone(),
                joints: self.joints(),
            });
        };
        let fails = |problem| {
            Err(SceneError::NotAWheel {
                urdf: self.file.clone(),
                wheel: name.to_owned(),
                joint: wheel.joint.clone(),
                problem,
            })
        };
        let joint = &self.robot.joints[index];
        if !matches!(joint.joint_type, JointType::Continuous | JointType::Revolute) {
            return fails(WheelProblem::DoesNotTurn { kind: format!("{:?}", joint.joint_type).to_lowercase() });
        }
        let hub = self.link_index[&joint.child.link];
        let axis = self.axis(index);
        let lateral = axis.y.abs();
        if lateral.is_nan() {
            return fails(WheelProblem::NoAxis);
        }
        if lateral < LATERAL {
            return fails(WheelProblem::NotLateral(axis.x, axis.y, axis.z));
        }
        let y = self.placements[hub].translation.y;
        let (on_its_side, side) = match wheel.side {
            Side::Left => (y > 0.0, "left"),
            Side::Right => (y < 0.0, "right"),
        };
        if !on_its_side {
            return fails(WheelProblem::WrongSide { y, side });
        }
        if !self.is_on_chassis(joint) {
            return fails(WheelProblem::NotOnChassis { parent: joint.parent.link.clone() });
        }
        Ok(index)
    }

    /// Whether between a joint and the root lies nothing that moves but a suspension: what slides, or swings about the lateral axis.
    fn is_on_chassis(&self, joint: &urdf_rs::Joint) -> bool {
        let mut above = self.lineage(self.link_index[&joint.parent.link]).filter_map(|link| self.parent_joint[link]);
        above.all(|joint| match self.robot.joints[joint].joint_type {
            JointType::Fixed | JointType::Prismatic => true,
            JointType::Revolute => self.axis(joint).y.abs() > LATERAL,
            _ => false,
        })
    }

    /// The axis of a joint in the base frame; of length 1, or not a number.
    fn axis(&self, joint: usize) -> Vector3<f64> {
        let joint = &self.robot.joints[joint];
        (self.placements[self.link_index[&joint.child.link]].rotation * Vector3::from(*joint.axis.xyz)).normalize()
    }

    /// The empty body of a wheel whose joint has been checked.
    fn mount(&self, wheel: &WheelJoint) -> MountedWheel {
        let joint = self.robot.joints.iter().find(|joint| joint.name == wheel.joint).expect("checked by wheel_joint");
        let base_from_wheel = self.placements[self.link_index[&joint.child.link]];
        let axis = Unit::new_normalize(Vector3::from(*joint.axis.xyz));
        let axle = if (base_from_wheel.rotation * axis).y > 0.0 { axis } else { -axis };
        let lateral = base_from_wheel.rotation.inverse() * Vector3::y_axis();
        let off = axle.cross(&lateral).norm();
        let is_rounded = (ROUNDING.0..ROUNDING.1).contains(&off);
        MountedWheel {
            body: Body::empty(&joint.child.link),
            base_from_wheel,
            axle: if is_rounded { lateral } else { axle },
        }
    }

    /// Adds a link's mass and shapes to the body that carries it; whether it hits anything is for who asks.
    fn join(
        &self,
        body: &mut Body,
        link: &Link,
        body_from_link: Placement,
        hits: bool,
        left_out: &mut LeftOut,
    ) -> Result<(), SceneError> {
        let inertial = &link.inertial;
        let mass = inertial.mass.value;
        if mass < 0.0 {
            return Err(self.bad_inertia(&link.name, "mass", mass, "it must be 0 or above"));
        }
        if mass > 0.0 {
            let body_from_centre = body_from_link * placement(&inertial.origin);
            let i = &inertial.inertia;
            let local = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
            let rotation = body_from_centre.rotation.to_rotation_matrix();
            body.add_mass(
                mass,
                Point3::from(body_from_centre.translation.vector),
                rotation * local * rotation.transpose(),
            );
        }
        let placed = |origin: &urdf_rs::Pose, geometry: &Geometry, colour| {
            let shape = shape(geometry)?;
            Some(PlacedShape { shape, placement: body_from_link * placement(origin), colour })
        };
        let (mut meshes, drawn) = (0, body.visuals.len());
        for visual in &link.visual {
            let colour = visual.material.as_ref().and_then(|material| {
                let named = self.robot.materials.iter().find(|other| other.name == material.name);
                let colour = material.color.as_ref().or(named.and_then(|material| material.color.as_ref()));
                colour.map(|colour| *colour.rgba)
            });
            match placed(&visual.origin, &visual.geometry, colour) {
                Some(shape) => body.visuals.push(shape),
                None => meshes += 1,
            }
        }
        // What is drawn as meshes alone is shown as what it hits with.
        let undrawn = meshes > 0 && body.visuals.len() == drawn;
        let mut meshes_hit = false;
        for collision in &link.collision {
            match placed(&collision.origin, &collision.geometry, None) {
                Some(shape) => {
                    if undrawn {
                        body.visuals.push(shape.clone());
                    }
                    if hits {
                        body.collisions.push(shape);
                    }
                }
                None => meshes_hit = hits,
            }
        }
        if meshes_hit {
            left_out.hit_nothing.push(link.name.clone());
        }
        if meshes > 0 {
            let otherwise = undrawn && body.visuals.len() > drawn;
            let kind = if otherwise { &mut left_out.shown_otherwise } else { &mut left_out.not_shown };
            kind.push(link.name.clone());
        }
        Ok(())
    }

    /// A body that moves needs a mass and a positive definite inertia whose principal moments obey the triangle
    /// inequality.
    fn check_body(&self, body: &Body) -> Result<(), SceneError> {
        if body.mass <= 0.0 {
            return Err(self.bad_inertia(&body.name, "mass", body.mass, "it must be above 0 kg"));
        }
        let mut moments = body.inertia.symmetric_eigenvalues();
        moments.as_mut_slice().sort_by(f64::total_cmp);
        if moments[0] <= 0.0 {
            return Err(self.bad_inertia(
                &body.name,
                "its smallest principal moment of inertia",
                moments[0],
                "all three must be above 0 kg m²",
            ));
        }
        if moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-6) {
            return Err(self.bad_inertia(
                &body.name,
                "its largest principal moment of inertia",
                moments[2],
                "no rigid body has one above the sum of the other two",
            ));
        }
        Ok(())
    }

    fn bad_inertia(&self, link: &str, quantity: &'static str, value: f64, allowed: &'static str) -> SceneError {
        SceneError::Inertia { urdf: self.file.clone(), link: link.to_owned(), quantity, value, allowed }
    }

    fn check_numbers(&self) -> Result<(), SceneError> {
        let finite = |pose: &urdf_rs::Pose| pose.xyz.iter().chain(pose.rpy.iter()).all(|value| value.is_finite());
        let not_finite = |place: String| SceneError::NotFinite { urdf: self.file.clone(), place };
        for joint in &self.robot.joints {
            if !finite(&joint.origin) || !joint.axis.xyz.iter().all(|value| value.is_finite()) {
                return Err(not_finite(format!("joint `{}`", joint.name)));
            }
        }
        for link in &self.robot.links {
            let i = &link.inertial.inertia;
            let inertia = [link.inertial.mass.value, i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz];
            let drawn = link.visual.iter().map(|visual| (&visual.origin, &visual.geometry));
            let hit = link.collision.iter().map(|collision| (&collision.origin, &collision.geometry));
            let shapes: Vec<_> = drawn.chain(hit).map(|(origin, geometry)| (origin, sizes(geometry))).collect();
            let shapes_finite =
                shapes.iter().all(|(origin, sizes)| finite(origin) && sizes.iter().all(|it| it.is_finite()));
            if !finite(&link.inertial.origin) || !inertia.iter().all(|value| value.is_finite()) || !shapes_finite {
                return Err(not_finite(format!("link `{}`", link.name)));
            }
            if let Some(size) = shapes.into_iter().flat_map(|(_, sizes)| sizes).find(|size| *size < 0.0) {
                return Err(SceneError::Size { urdf: self.file.clone(), link: link.name.clone(), size });
            }
        }
        Ok(())
    }
}

/// Line and text of the first expression that a macro processor would have replaced.
fn unexpanded(text: &str) -> Option<(usize, String)> {
    let (line, at) = text.lines().zip(1..).find_map(|(words, line)| {
        let at = ["$(", "${"].iter().filter_map(|opens| words.find(opens)).min()?;
        Some((line, &words[at..]))
    })?;
    let end = at.find([')', '}']).map_or(at.len(), |end| end + 1);
    Some((line, at[..end].to_owned()))
}

fn placement(pose: &urdf_rs::Pose) -> Placement {
    let [x, y, z] = *pose.xyz;
    let [roll, pitch, yaw] = *pose.rpy;
    Placement::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}

fn shape(geometry: &Geometry) -> Option<Shape> {
    match *geometry {
        Geometry::Box { ref size } => Some(Shape::Box { size: **size }),
        Geometry::Cylinder { radius, length } => Some(Shape::Cylinder { radius, length }),
        Geometry::Sphere { radius } => Some(Shape::Sphere { radius }),
        Geometry::Capsule { .. } | Geometry::Mesh { .. } => None,
    }
}

/// How large a shape is, along or about each of its axes \[m\]; a mesh says nothing of that.
fn sizes(geometry: &Geometry) -> Vec<f64> {
    match *geometry {
        Geometry::Box { ref size } => size.to_vec(),
        Geometry::Cylinder { radius, length } | Geometry::Capsule { radius, length } => vec![radius, length],
        Geometry::Sphere { radius } => vec![radius],
        Geometry::Mesh { .. } => Vec::new(),
    }
}
