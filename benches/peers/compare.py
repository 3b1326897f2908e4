#!/usr/bin/env python3
"""The same skid-steer robot in a steady spin on the spot: treadmark beside MuJoCo, Bullet and Drake.

    python3 -m venv /tmp/peers && /tmp/peers/bin/pip install -r benches/peers/requirements.txt
    cargo build --release
    /tmp/peers/bin/python benches/peers/compare.py            # all; or: compare.py mujoco
    /tmp/peers/bin/python benches/peers/compare.py duel       # cost alone, treadmark and MuJoCo turn about

Four wheels of radius 0.10 m and width 0.05 m, axles 0.40 m and contact centres 0.46 m apart, 18 kg of chassis and 1.5 kg
a wheel, mu = 0.8. Any isotropic law of friction between points gives b_eff/b = 1 + (l/b)^2 = 1.7561 whatever mass, speed
and mu; a patch of this size adds some 0.5 %. Each engine is driven at several steps and settings, its own best ones
included; an engine that cannot be imported is named and left out. One core, no rendering.
"""

import json
import math
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[variable] = "1"

ROOT = Path(__file__).resolve().parents[2]
BINARY = Path(os.environ.get("TREADMARK", ROOT / "target" / "release" / "treadmark"))

L, B, R, W, MU = 0.40, 0.46, 0.10, 0.05, 0.8
CHASSIS, WHEEL, ROTOR = 18.0, 1.5, 0.009  # [kg], and a rotor's inertia as its wheel feels it [kg m²]
MOTOR = 5.0  # torque over speed error [N m s]: wheels lag, which measured angles do not mind
BOX, BOX_Z = (0.5, 0.3, 0.12), 0.06
THEORY = 1.0 + (L / B) ** 2
SPEED = 2.5  # of the wheels [rad/s]
SETTLE, RAMP, WAIT, WINDOW = 0.5, 1.0, 2.0, 4.0  # [s], as treadmark's own bench has them
STEPS = (0.25e-3, 0.5e-3, 1e-3, 2e-3, 5e-3)
PLACES = [("front_left", 1, 1), ("front_right", 1, -1), ("rear_left", -1, 1), ("rear_right", -1, -1)]

I_AXLE = 0.5 * WHEEL * R * R
I_CROSS = WHEEL * (3 * R * R + W * W) / 12
I_BOX = [CHASSIS * (BOX[i] ** 2 + BOX[j] ** 2) / 12 for i, j in ((1, 2), (0, 2), (0, 1))]


def commanded(t):
    """Speed of the right wheels; the left ones turn with them or against."""
    return SPEED * min(max((t - SETTLE) / RAMP, 0.0), 1.0)


def measure(make, dt):
    """b_eff/b in a steady spin and the processor time of a simulated second, by the engine's own rolling radius on a straight.

    `make()` -> `step()`, `command(left, right)` and `read()` -> (left, right, heading, x, y), robot at rest at the origin.
    """
    left, right, _, path, _ = travel(make(), dt, 1.0)
    radius = 2 * path / (left + right)
    left, right, turned, _, wall = travel(make(), dt, -1.0)
    factor = (right - left) * radius / turned / B if abs(turned) > 1e-3 else math.inf
    return factor, wall, radius


def travel(engine, dt, left_sign):
    """What wheels, heading and base did over the window, and the processor time of a simulated second."""
    step, command, read = engine
    ahead, total = round((SETTLE + RAMP + WAIT) / dt), round(WINDOW / dt)
    # Read ten times a second: no engine turns by half a turn meanwhile.
    every = max(1, round(0.1 / dt))
    start = last = None
    turned, path, wall = 0.0, 0.0, 0.0
    for k in range(ahead + total + 1):
        if k >= ahead and ((k - ahead) % every == 0 or k == ahead + total):
            now = read()
            if not all(map(math.isfinite, now)):
                raise FloatingPointError("it diverged")
            if start is None:
                start = now
            else:
                turned += math.remainder(now[2] - last[2], math.tau)
                path += math.hypot(now[3] - last[3], now[4] - last[4])
            last = now
        if k < ahead + total:
            began = time.process_time()
            speed = commanded(k * dt)
            command(left_sign * speed, speed)
            step()
            wall += time.process_time() - began
    return last[0] - start[0], last[1] - start[1], turned, path, wall / ((ahead + total) * dt)


def yaw(w, x, y, z):
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


# ---------------------------------------------------------------- treadmark

def treadmark_robot(folder):
    """The shipped JNPF robot with these dimensions and equal tyres."""
    toml = (ROOT / "robots/jnpf_4wd.toml").read_text()
    toml = toml.replace("0.10006", str(R)).replace("0.09994", str(R))
    urdf = (ROOT / "robots/jnpf_4wd.urdf").read_text()
    for sign in ("", "-"):
        urdf = urdf.replace(f'xyz="{sign}0.15 ', f'xyz="{sign}{L / 2} ').replace(f' {sign}0.2 0"', f' {sign}{B / 2} 0"')
    (folder / "jnpf_4wd.toml").write_text(toml)
    (folder / "jnpf_4wd.urdf").write_text(urdf)
    return str(folder / "jnpf_4wd.toml")


def treadmark_cost(file, dt, rigid=False, attempts=1):
    """Processor time of a simulated second of a spin by the driver, logging and controllers included: what a spin of ten
    turns takes more than one of one turn, as whole processes. With it what the driver says of the long one."""

    def drive(turns):
        with tempfile.TemporaryDirectory() as name:
            arguments = [BINARY, "drive", "--robot", file, "--protocol", "spin", "--turn", str(turns * 6.2832),
                         "--time-step", str(dt), "--no-survey-noise", "--no-scatter", "--no-recording", "--json",
                         "--out", f"{name}/out"] + (["--tyre", "rigid"] if rigid else [])
            child = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            text = child.stdout.read()
            _, status, usage = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
            child.stdout.close()
            return usage.ru_utime + usage.ru_stime, json.loads(text)

    short, long = ([drive(turns) for _ in range(attempts)] for turns in (1, 10))
    least = lambda runs: min(cost for cost, _ in runs)
    done = long[0][1]
    return (least(long) - least(short)) / (done["simulated_s"] - short[0][1]["simulated_s"]), done


def treadmark():
    def run(dt, rigid=False):
        with tempfile.TemporaryDirectory() as name:
            file = treadmark_robot(Path(name))
            cost, done = treadmark_cost(file, dt, rigid, 3)
            if rigid:
                believed = 0.5966  # track in the model file
                return done["odometry"]["heading_rad"] * believed / done["actual"]["heading_rad"] / B, cost, R
            out = subprocess.run([BINARY, "certify", file, "--time-step", str(dt), "--json"],
                                 capture_output=True, text=True).stdout
            found = json.loads(out)
            return found["track_factor"], cost, found["rolling_radius_m"]

    for dt in (0.625e-3, 1e-3, 1.25e-3, 2.5e-3, 5e-3):
        yield "tyre patches", dt, lambda dt=dt: run(dt)
    for dt in (0.625e-3, 1e-3, 1.25e-3, 2.5e-3, 5e-3):
        yield "rapier's own cylinders", dt, lambda dt=dt: run(dt, rigid=True)


# ---------------------------------------------------------------- MuJoCo

def mujoco_model(dt, option, geom, shape):
    wheel = f'type="cylinder" size="{R} {W / 2}" euler="90 0 0"' if shape == "cylinder" else \
        f'type="ellipsoid" size="{R} {W / 2} {R}"'
    wheels, motors = "", ""
    for name, x, y in PLACES:
        wheels += f"""
      <body name="{name}" pos="{x * L / 2} {y * B / 2} 0">
    <joint name="{name}" axis="0 1 0" armature="{ROTOR}"/>
    <inertial pos="0 0 0" mass="{WHEEL}" diaginertia="{I_CROSS} {I_AXLE} {I_CROSS}"/>
    <geom {wheel} friction="{MU} 0.005 0.0001" {geom}/>
      </body>"""
        motors += f'<velocity joint="{name}" kv="{MOTOR}"/>'
    return f"""
<mujoco><compiler angle="degree"/><option timestep="{dt}" gravity="0 0 -9.80665" {option}/>
  <worldbody>
    <geom type="plane" size="20 20 1" friction="{MU} 0.005 0.0001" {geom}/>
    <body name="base" pos="0 0 {R}"><freejoint/>
      <inertial pos="0 0 {BOX_Z}" mass="{CHASSIS}" diaginertia="{I_BOX[0]} {I_BOX[1]} {I_BOX[2]}"/>{wheels}
    </body>
  </worldbody><actuator>{motors}</actuator></mujoco>"""


# Found by search over some sixty settings: contact that gets stiff over 2 mm does not make wheels hop.
SOFT = 'solref="-600 -50" solimp="0 0.95 0.002 0.5 1"'


def mujoco_engine():
    import mujoco

    def make(dt, option, geom, shape):
        m = mujoco.MjModel.from_xml_string(mujoco_model(dt, option, geom, shape))
        d = mujoco.MjData(m)

        def command(left, right):
            d.ctrl[:] = [left, right, left, right]

        def read():
            # MuJoCo starts anew where it diverges, and counts that.
            if sum(warning.number for warning in d.warning):
                raise FloatingPointError("it diverged")
            q = d.qpos
            return 0.5 * (q[7] + q[9]), 0.5 * (q[8] + q[10]), yaw(*q[3:7]), q[0], q[1]

        return lambda: mujoco.mj_step(m, d), command, read

    def run(dt, option, geom, shape):
        return measure(lambda: make(dt, option, geom, shape), dt)

    best = 'cone="elliptic" integrator="implicitfast"'
    sharp = best + ' impratio="100"'
    settings = [
        ("default", "", "", "cylinder"),
        ("elliptic, implicitfast", best, "", "cylinder"),
        ("… impratio 100", sharp, "", "cylinder"),
        ("… noslip 50", best + ' noslip_iterations="50"', "", "cylinder"),
        ("… impratio 100, solref 0.05", sharp, 'solref="0.05 1"', "cylinder"),
        ("elliptic, implicitfast, contact soft over 2 mm", best, SOFT, "cylinder"),
        ("pyramid, contact soft over 2 mm", 'integrator="implicitfast"', SOFT, "cylinder"),
        ("ellipsoid wheels, elliptic, implicitfast", best, "", "ellipsoid"),
        ("ellipsoid wheels, contact soft over 2 mm", best, SOFT, "ellipsoid"),
    ]
    for name, option, geom, shape in settings:
        for dt in STEPS:
            yield name, dt, lambda dt=dt, option=option, geom=geom, shape=shape: run(dt, option, geom, shape)


# ---------------------------------------------------------------- Bullet

def urdf(shape="cylinder", properties=""):
    """The robot for Bullet and Drake."""
    wheel = {"cylinder": f'<cylinder radius="{R}" length="{W}"/>', "sphere": f'<sphere radius="{R}"/>'}[shape]
    text = f"""<?xml version="1.0"?><robot name="robot">
  <link name="base"><inertial><origin xyz="0 0 {BOX_Z}"/><mass value="{CHASSIS}"/>
    <inertia ixx="{I_BOX[0]}" iyy="{I_BOX[1]}" izz="{I_BOX[2]}" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
    for name, x, y in PLACES:
        text += f"""
  <link name="{name}_link"><inertial><mass value="{WHEEL}"/>
    <inertia ixx="{I_CROSS}" iyy="{I_AXLE}" izz="{I_CROSS}" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin rpy="1.5707963267948966 0 0"/><geometry>{wheel}</geometry>{properties}</collision></link>
  <joint name="{name}" type="continuous"><parent link="base"/><child link="{name}_link"/>
    <origin xyz="{x * L / 2} {y * B / 2} 0"/><axis xyz="0 1 0"/></joint>
  <transmission name="{name}_t" type="transmission"><type>transmission_interface/SimpleTransmission</type>
    <joint name="{name}"><hardwareInterface>EffortJointInterface</hardwareInterface></joint>
    <actuator name="{name}_motor"><mechanicalReduction>1</mechanicalReduction></actuator></transmission>"""
    return text + "\n</robot>\n"


def bullet_engine():
    import pybullet as p

    def make(dt, engine, dynamics, shape):
        p.resetSimulation()
        p.setGravity(0, 0, -9.80665)
        p.setTimeStep(dt)
        p.setPhysicsEngineParameter(**engine)
        floor = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
        with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
            file.write(urdf(shape))
            file.flush()
            body = p.loadURDF(file.name, [0, 0, R], flags=p.URDF_USE_INERTIA_FROM_FILE)
        p.changeDynamics(floor, -1, lateralFriction=1.0, **dynamics)
        p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
        joints = {p.getJointInfo(body, j)[1].decode(): j for j in range(p.getNumJoints(body))}
        for j in joints.values():
            p.changeDynamics(body, j, lateralFriction=MU, rollingFriction=0, spinningFriction=0, linearDamping=0,
                             angularDamping=0, jointDamping=0, **dynamics)
        order = [joints[name] for name, _, _ in PLACES]

        def command(left, right):
            p.setJointMotorControlArray(body, order, p.VELOCITY_CONTROL, targetVelocities=[left, right, left, right],
                                        forces=[15.0] * 4)

        def read():
            a = [state[0] for state in p.getJointStates(body, order)]
            (px, py, _), (x, y, z, w) = p.getBasePositionAndOrientation(body)
            return 0.5 * (a[0] + a[2]), 0.5 * (a[1] + a[3]), yaw(w, x, y, z), px, py

        return p.stepSimulation, command, read

    def run(dt, engine, dynamics, shape):
        # A fresh server each: engine parameters outlive a reset.
        client = p.connect(p.DIRECT)
        try:
            return measure(lambda: make(dt, engine, dynamics, shape), dt)
        finally:
            p.disconnect(client)

    tight = {"numSolverIterations": 200, "solverResidualThreshold": 0}
    pyramid = {"enableConeFriction": 0}
    spring = {"contactStiffness": 60e3, "contactDamping": 400.0}
    settings = [
        ("default", {}, {}, "cylinder"),
        ("pyramid", pyramid, {}, "cylinder"),
        ("200 iterations", tight, {}, "cylinder"),
        ("contact and friction ERP 0.2", {"contactERP": 0.2, "frictionERP": 0.2}, {}, "cylinder"),
        ("friction anchors", {}, {"frictionAnchor": 1}, "cylinder"),
        ("spring 60 kN/m", {}, spring, "cylinder"),
        ("spring 60 kN/m, CFM 1e-6", {"globalCFM": 1e-6}, spring, "cylinder"),
        ("spring 60 kN/m, 10 sub-steps", {"numSubSteps": 10}, spring, "cylinder"),
        ("pyramid, spring 60 kN/m", pyramid, spring, "cylinder"),
        ("pyramid, 200 iterations", {**pyramid, **tight}, {}, "cylinder"),
        ("sphere wheels, default", {}, {}, "sphere"),
        ("sphere wheels, pyramid", pyramid, {}, "sphere"),
    ]
    for name, engine, dynamics, shape in settings:
        for dt in STEPS:
            if dt < (1e-3 if engine else 0.5e-3):
                continue  # minutes, for what the longer steps show already
            yield name, dt, lambda dt=dt, e=engine, d=dynamics, shape=shape: run(dt, e, d, shape)


# ---------------------------------------------------------------- Drake

def drake_engine():
    from pydrake.geometry import AddContactMaterial, AddRigidHydroelasticProperties, HalfSpace, ProximityProperties
    from pydrake.math import RigidTransform
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
    from pydrake.multibody.tree import PdControllerGains
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder

    def make(dt, contact="point", solver="sap", stiffness=60e3, modulus=None, shape="cylinder"):
        builder = DiagramBuilder()
        config = MultibodyPlantConfig(time_step=dt, contact_model=contact, discrete_contact_approximation=solver)
        plant, _ = AddMultibodyPlant(config, builder)
        if modulus is None:
            # As stiff as the tyre against a floor as good as rigid, dissipation a third of critical.
            extra = f"<drake:point_contact_stiffness value='{stiffness}'/><drake:hunt_crossley_dissipation value='10'/>" \
                    "<drake:relaxation_time value='0.006'/>"
        else:
            extra = f"<drake:compliant_hydroelastic/><drake:hydroelastic_modulus value='{modulus}'/>" \
                    f"<drake:mesh_resolution_hint value='0.01'/><drake:hunt_crossley_dissipation value='10'/>" \
                    "<drake:relaxation_time value='0.006'/>"
        proximity = f"<drake:proximity_properties>{extra}<drake:mu_dynamic value='{MU}'/><drake:mu_static value='{MU}'/>" \
                    "</drake:proximity_properties>"
        text = urdf(shape, proximity).replace("<robot ", '<robot xmlns:drake="http://drake.mit.edu" ')
        robot = Parser(plant).AddModelsFromString(text, "urdf")[0]
        floor = ProximityProperties()
        if modulus is None:
            AddContactMaterial(dissipation=0.0, point_stiffness=1e9, friction=CoulombFriction(MU, MU), properties=floor)
        else:
            AddContactMaterial(dissipation=0.0, friction=CoulombFriction(MU, MU), properties=floor)
            AddRigidHydroelasticProperties(floor)
        plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "floor", floor)
        for name, _, _ in PLACES:
            plant.get_joint_actuator(plant.GetJointActuatorByName(f"{name}_motor").index()).set_controller_gains(
                PdControllerGains(p=0.0, d=MOTOR))
            plant.get_joint_actuator(plant.GetJointActuatorByName(f"{name}_motor").index()).set_default_rotor_inertia(ROTOR)
        plant.mutable_gravity_field().set_gravity_vector([0, 0, -9.80665])
        plant.Finalize()
        diagram = builder.Build()
        simulator = Simulator(diagram)
        root = simulator.get_mutable_context()
        context = plant.GetMyMutableContextFromRoot(root)
        plant.SetFreeBodyPose(context, plant.GetBodyByName("base"), RigidTransform([0, 0, R]))
        port = plant.get_desired_state_input_port(robot)
        joints = [plant.GetJointByName(name) for name, _, _ in PLACES]
        base = plant.GetBodyByName("base")
        simulator.Initialize()
        clock = [0]
        order = [plant.GetJointActuatorByName(f"{name}_motor").index() for name, _, _ in PLACES]
        order = sorted(range(4), key=lambda i: order[i])

        def command(left, right):
            speeds = [left, right, left, right]
            port.FixValue(context, [0.0] * 4 + [speeds[i] for i in order])

        def step():
            clock[0] += 1
            simulator.AdvanceTo(clock[0] * dt)

        def read():
            a = [joint.get_angle(context) for joint in joints]
            pose = plant.EvalBodyPoseInWorld(context, base)
            q, at = pose.rotation().ToQuaternion(), pose.translation()
            return 0.5 * (a[0] + a[2]), 0.5 * (a[1] + a[3]), yaw(q.w(), q.x(), q.y(), q.z()), at[0], at[1]

        return step, command, read

    def run(dt, **options):
        return measure(lambda: make(dt, **options), dt)

    settings = [
        ("point, SAP", dict(contact="point", solver="sap")),
        ("point, lagged", dict(contact="point", solver="lagged")),
        ("point, similar", dict(contact="point", solver="similar")),
        ("hydroelastic 1 MPa, SAP", dict(contact="hydroelastic", solver="sap", modulus=1e6)),
        ("hydroelastic 1 MPa, lagged", dict(contact="hydroelastic", solver="lagged", modulus=1e6)),
        ("sphere wheels, point, SAP", dict(contact="point", solver="sap", shape="sphere")),
    ]
    for name, options in settings:
        for dt in STEPS:
            if dt < (1e-3 if "hydro" in name else 0.5e-3):
                continue  # minutes, for what the longer steps show already
            yield name, dt, lambda dt=dt, options=options: run(dt, **options)


# ---------------------------------------------------------------- the table

def versions(package):
    try:
        from importlib.metadata import version
        return version(package)
    except Exception:
        return "missing"


# ---------------------------------------------------------------- cost alone

def duel(rounds=6):
    """Processor time of a simulated second of treadmark and of MuJoCo, turn about on one core, the least of `rounds` of each.

    MuJoCo steps a hundred times a call, so that Python has no part in it; treadmark's drivers, encoders and logs have."""
    import mujoco

    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    fast = 'integrator="implicitfast"'

    def spinning(dt, option, geom, shape):
        m = mujoco.MjModel.from_xml_string(mujoco_model(dt, option, geom, shape))
        d = mujoco.MjData(m)
        d.ctrl[:] = [-SPEED, SPEED, -SPEED, SPEED]
        steps = 100
        mujoco.mj_step(m, d, nstep=round(1.0 / dt))

        def once():
            began = time.process_time()
            for _ in range(round(4.0 / dt) // steps):
                mujoco.mj_step(m, d, nstep=steps)
            return (time.process_time() - began) / 4.0

        return once

    with tempfile.TemporaryDirectory() as name:
        file = treadmark_robot(Path(name))
        label = f"MuJoCo {mujoco.__version__}"
        contestants = [("treadmark", "tyre patches", dt, lambda dt=dt: treadmark_cost(file, dt)[0])
                       for dt in (1e-3, 2.5e-3, 5e-3)]
        contestants += [(label, setting, dt, spinning(dt, option, geom, shape))
                        for setting, option, geom, shape in (
                            ("default", "", "", "cylinder"),
                            ("pyramid, contact soft over 2 mm", fast, SOFT, "cylinder"),
                            ("ellipsoid wheels, contact soft over 2 mm", 'cone="elliptic" ' + fast, SOFT, "ellipsoid"))
                        for dt in (1e-3, 2.5e-3, 5e-3)]
        least = [math.inf] * len(contestants)
        for _ in range(rounds):
            for index, (_, _, _, once) in enumerate(contestants):
                least[index] = min(least[index], once())
    print("| engine | setting | step [ms] | cost [ms/s] | µs a step |")
    print("|---|---|---|---|---|")
    for (engine, setting, dt, _), cost in zip(contestants, least):
        print(f"| {engine} | {setting} | {1e3 * dt:g} | {1e3 * cost:.2f} | {1e6 * cost * dt:.2f} |")


def main():
    wanted = sys.argv[1:]
    if wanted == ["duel"]:
        return duel()
    engines = [("treadmark", treadmark, None), ("MuJoCo", mujoco_engine, "mujoco"), ("Bullet", bullet_engine, "pybullet"),
               ("Drake", drake_engine, "drake")]
    print(f"Python {platform.python_version()}, one core; theory for points 1 + (l/b)² = {THEORY:.4f}")
    rows = {}
    for engine, trials, package in engines:
        if wanted and engine.lower() not in [name.lower() for name in wanted]:
            continue
        label = f"{engine} {versions(package)}" if package else engine
        try:
            trials = list(trials())
        except ImportError as error:
            print(f"{engine}: no wheel for this Python, left out ({error})")
            continue
        for setting, dt, run in trials:
            try:
                factor, cost, radius = run()
            except Exception as error:  # An engine's refusal is a result of its own.
                print(f"{label}, {setting}, {1e3 * dt:g} ms: {type(error).__name__}: {str(error).splitlines()[0][:120]}")
                continue
            rows.setdefault((label, setting), []).append((dt, factor, cost))
            print(f"  {label}, {setting}, {1e3 * dt:g} ms: {factor:.4f}, radius {1e3 * radius:.2f} mm, {1e3 * cost:.1f} ms/s", file=sys.stderr)

    print("\n| engine | setting | b_eff/b at each step [ms] | spread over steps | error at 1 ms | cost at 1 ms [ms/s] | best error | at [ms] | its cost [ms/s] |")
    print("|---|---|---|---|---|---|---|---|---|")
    for (label, setting), found in rows.items():
        each = ", ".join(f"{1e3 * dt:g}: {factor:.3f}" for dt, factor, _ in found)
        finite = [factor for _, factor, _ in found if math.isfinite(factor)]
        spread = f"{1e2 * (max(finite) - min(finite)) / THEORY:.2f} %" if finite else "–"
        at = {round(1e6 * dt): (factor, cost) for dt, factor, cost in found}
        error = lambda factor: f"{1e2 * (factor / THEORY - 1):+.2f} %"
        one = at.get(1000)
        best = min(found, key=lambda row: abs(row[1] / THEORY - 1) if math.isfinite(row[1]) else math.inf)
        print(f"| {label} | {setting} | {each} | {spread} | {error(one[0]) if one else '–'} | "
              f"{f'{1e3 * one[1]:.1f}' if one else '–'} | {error(best[1])} | {1e3 * best[0]:g} | {1e3 * best[2]:.1f} |")


if __name__ == "__main__":
    main()
