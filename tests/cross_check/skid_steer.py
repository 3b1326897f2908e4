"""A skid-steer robot of another hand: what is hidden in its campaigns is found, though its tyres obey another law.

    cargo build --release --no-default-features
    python tests/cross_check/skid_steer.py target/release/treadmark --seeds 0..20 [--effects two] [--data endpoints] [--out DIR]
    python tests/cross_check/skid_steer.py target/release/treadmark --responses

Needs numpy, and shares nothing with the simulator but the data format and what robots/jnpf_4wd says of its robot. Each seed
draws a tyre law with its friction and stiffness, and an effect of the catalogue with its size from the catalogue's prior
(one seed in five draws none), two of them, or something that the catalogue is without: a tether, a wheel out of round, a
carpet with a grain. The robot then drives 2 m and 4 m squares, five each way round, once clean and once with what is hidden;
`treadmark diagnose` extends the shipped model on the clean campaign and explains the other on top of it. Squares without
noise, which no model saw, say what that gains: how far off their ends `treadmark predict` is before and after. One line a
seed says what was hidden, answered and gained, and the last one counts. Exit code 1 where a wrong name was given. With
--responses, the ends of squares without noise are held against those of `treadmark drive`, and what effects do to them.

The robot is a rigid body on four equal springs. Its wheels turn as they are told; slip at six points of a patch makes force,
by tanh or by a root, up to friction; all of it is stepped implicitly by Newton's method, all runs side by side. Corners
stray by 2.5 mrad, headings by 1 mrad/√m, the distance of a run by 0.1 %; readings are good to 2 mm and 3 mrad, and those of
a log correlate over 0.5 s. Its rubber remembers nothing: what winds up on a straight and is let go in a corner, as wheels
do whose axles fight, is not in it. `encoder_latency` is not drawn, since this robot's driver looks at no counts.
"""

import argparse
import csv
import json
import math
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

WHEELS = ["front_left", "front_right", "rear_left", "rear_right"]
AHEAD, ASIDE = 0.15, 0.20  # of a contact [m]
X, Y = AHEAD * np.array([1, 1, -1, -1]), ASIDE * np.array([1, -1, 1, -1])
RADIUS, UNEQUAL = 0.100, 6e-4  # of a free wheel [m]; left larger, right smaller by [1]
MASS, HEIGHT, INERTIA, GRAVITY = 24.0, 0.115, 0.83, 9.81  # [kg, m, kg m², m/s²]
TRACK, TICKS = 0.5966, 8192  # what the driver believes [m]; of a revolution
SPEED, ACCELERATION, TURN_RATE, TURN_ACCELERATION = 0.4, 0.4, 0.8, 1.6  # [m/s, m/s², rad/s, rad/s²]
PAUSE, COAST, BETWEEN = 0.5, 0.15, 40.0  # stands at a corner, coasts of it, stands between runs [s]
STEP, ROW, POSE = 0.01, 2, 10  # [s]; steps a row of the encoders' log and of the poses'
SURVEY, CORRELATION = (2e-3, 2e-3, 3e-3), 0.5  # [m, m, rad], [s]
SCATTER = (2.5e-3, 1e-3, 1e-3)  # of a corner, a heading and a way [rad, rad/√m, 1]
SIDES, REPEATS = (2.0, 4.0), 5


@dataclass
class Tyres:
    """A law that is not the simulator's."""

    law: str  # tanh or root
    friction: float
    stiffness: float  # slip force over load and slip
    spring: float  # [N/m]
    half_patch: float  # [m]

    @staticmethod
    def drawn(rng):
        law = ["tanh", "root"][rng.integers(2)]
        return Tyres(law, rng.uniform(0.5, 0.9), rng.uniform(10, 25), rng.uniform(4e4, 8e4), rng.uniform(4e-3, 12e-3))

    def grip(self, slip, friction):
        """Force over load at a slip."""
        reach = self.stiffness * slip / friction
        return friction * (np.tanh(reach) if self.law == "tanh" else reach / np.sqrt(1 + reach**2))


@dataclass
class Hidden:
    """Effects of the catalogue with their values, as this robot knows them, and what the catalogue is without."""

    causes: dict = field(default_factory=dict)

    def get(self, effect, parameter):
        return self.causes.get(effect, {}).get(parameter, 0.0)

    @staticmethod
    def drawn(rng, effects):
        """One or none of the catalogue's, two of them, or something else; sizes are of the catalogue's priors."""
        if effects == "one" and rng.random() < 0.2:
            return Hidden()
        draws = other_draws(rng) if effects == "outside" else catalogue_draws(rng)
        chosen = [rng.integers(len(draws))]
        if effects == "two":
            chosen.append((chosen[0] + rng.integers(1, len(draws))) % len(draws))
        return Hidden({effect: draws[effect]() for effect in (list(draws)[index] for index in chosen)})

    def __str__(self):
        told = lambda values: ", ".join(f"{key} {value:.4g}" for key, value in values.items())
        return " and ".join(f"{effect} {told(values)}" for effect, values in self.causes.items()) or "nothing"


def catalogue_draws(rng):
    """What draws the values of each effect."""
    ratio = lambda std: {"ratio_minus_one": rng.normal(0, std)}
    angle = lambda std: {"angle_rad": rng.normal(0, std)}
    # Where all four wheels pass: a quarter turn at the end of a leg, either way round.
    side = SIDES[rng.integers(len(SIDES))]
    corner = [(side, 0.0), (side, side), (0.0, side), (side, -side), (0.0, -side)][rng.integers(5)]
    return {
        "wheel_diameter_mismatch": lambda: ratio(0.004),
        "wheel_diameter_scale": lambda: ratio(0.005),
        "axle_diameter_mismatch": lambda: ratio(0.01),
        "tyre_radius_drift": lambda: {"per_hour": rng.normal(0, 0.005)},
        "tyre_grip_anisotropy": lambda: ratio(0.05),
        "wheel_toe": lambda: angle(0.01) | {"wheel": int(rng.integers(4))},
        "load_offset_longitudinal": lambda: {"x_m": rng.normal(0, 0.01)},
        "load_offset_lateral": lambda: {"y_m": rng.normal(0, 0.01)},
        "floor_slope": lambda: {
            "gradient": abs(rng.normal(0, 0.01)),
            "downhill_heading_rad": rng.uniform(-math.pi, math.pi),
        },
        "floor_grip_patch": lambda: {
            "x_m": corner[0] + rng.uniform(-0.15, 0.15),
            "y_m": corner[1] + rng.uniform(-0.15, 0.15),
            "radius_m": 0.3,
            "ratio": np.clip(rng.normal(0.65, 0.2), 0.1, 0.95),
        },
        "encoder_count_loss": lambda: {"fraction": abs(rng.normal(0, 0.002)), "side": int(rng.integers(2))},
        "gear_backlash": lambda: {"angle_rad": abs(rng.normal(0, 0.008))},
        "stop_overrun": lambda: {"angle_rad": abs(rng.normal(0, 0.02))},
        "start_heading_error": lambda: angle(0.01),
        "tracked_frame_turned": lambda: angle(0.01),
        "survey_lever_arm": lambda: {"x_m": rng.normal(0, 0.05), "y_m": rng.normal(0, 0.05)},
        "survey_scale": lambda: ratio(0.003),
        "survey_time_offset": lambda: {"offset_s": rng.normal(0, 0.1)},
    }


def other_draws(rng):
    """What draws what no effect of the catalogue does."""
    bearing = lambda: rng.uniform(-math.pi, math.pi)

    def tether():
        to, pull = bearing(), rng.uniform(4, 10)
        return {"x_m": 1 + 4 * math.cos(to), "y_m": 4 * math.sin(to), "pull_n": pull}

    return {
        "tether": tether,
        "out_of_round": lambda: {"amplitude": rng.uniform(0.02, 0.05), "phase_rad": bearing(), "wheel": int(rng.integers(4))},
        # Pile that turns wheels into its lie, by so much a metre across the grain at an eighth of a turn.
        "carpet_grain": lambda: {"rad_per_m": rng.uniform(0.005, 0.015), "lie_rad": bearing()},
    }


def ramped(way, speed, acceleration):
    """What is gone a step along a way that is begun and ended by ramps."""
    speed = min(speed, math.sqrt(way * acceleration))
    ramp = speed / acceleration
    lasts = way / speed + ramp
    t = np.minimum(np.arange(0, lasts + STEP, STEP), lasts)
    begun, ended = 0.5 * acceleration * t**2, way - 0.5 * acceleration * (lasts - t) ** 2
    return np.diff(np.where(t < ramp, begun, np.where(t < lasts - ramp, speed * (t - ramp / 2), ended)))


def planned(side, sign, overrun):
    """A square as its driver counts it: angles of the sides a step, what they coast on uncounted, parts of a corner."""
    stand, coasts = round(PAUSE / STEP), round(COAST / STEP)
    counted, coasted, corner = [np.zeros((stand, 2))], [np.zeros((stand, 2))], [np.zeros(stand)]
    for part in 4 * [0, 1]:
        if part == 0:
            angle = ramped(side, SPEED, ACCELERATION)[:, None] / RADIUS * np.ones(2)
        else:
            turned = ramped(math.pi / 2, TURN_RATE, TURN_ACCELERATION)[:, None]
            angle = turned * TRACK / 2 / RADIUS * sign * np.array([-1, 1])
        on = np.zeros((stand, 2))
        on[:coasts] = np.sign(angle.sum(0)) * overrun / coasts
        counted += [angle, np.zeros((stand, 2))]
        coasted += [np.zeros_like(angle), on]
        corner += [np.full(len(angle), part / len(angle)), np.zeros(stand)]
    return np.concatenate(counted), np.concatenate(coasted), np.concatenate(corner)


def with_play(shaft, play):
    """Angles of wheels that follow their shafts within a play; they begin as if driven forward last."""
    wheel, turned = shaft[:, 0] - play / 2, np.empty_like(shaft)
    for step in range(shaft.shape[1]):
        wheel = np.clip(wheel, shaft[:, step] - play / 2, shaft[:, step] + play / 2)
        turned[:, step] = wheel
    return turned


class Campaign:
    """Squares of this robot: `ways` are its poses, runs × steps × (x, y, heading)."""

    def __init__(self, tyres, hidden, rng, repeats=REPEATS, scatter=SCATTER, survey=SURVEY):
        self.hidden, self.rng, self.scatter, self.survey = hidden, rng, scatter, np.array(survey)
        self.runs = [(side, sign) for side in SIDES for _ in range(repeats) for sign in (-1, 1)]
        plans = [planned(side, sign, hidden.get("stop_overrun", "angle_rad")) for side, sign in self.runs]
        self.steps = [len(counted) for counted, _, _ in plans]
        longest = max(self.steps)
        padded = lambda part: np.concatenate([part, np.zeros((longest - len(part), *part.shape[1:]))])
        self.counted, coasted, self.corner = (np.stack([padded(part) for part in parts]) for parts in zip(*plans))
        self.started = np.concatenate([[0], np.cumsum(self.steps)[:-1] * STEP]) + BETWEEN * np.arange(len(self.runs))
        lost = np.zeros(2)
        lost[int(hidden.get("encoder_count_loss", "side"))] = hidden.get("encoder_count_loss", "fraction")
        shaft = np.cumsum(self.counted / (1 - lost) + coasted, 1)
        turned = with_play(shaft, hidden.get("gear_backlash", "angle_rad"))
        # Both wheels of a side turn alike; rad/s.
        self.rates = (np.diff(turned, axis=1, prepend=turned[:, :1]) / STEP)[:, :, [0, 1, 0, 1]]
        self.drive(tyres)

    def radii(self):
        """Of free wheels, runs × wheels."""
        get, right, rear = self.hidden.get, np.array([-1, 1, -1, 1]), np.array([-1, -1, 1, 1])
        free = RADIUS * (1 - UNEQUAL * right) * (1 + get("wheel_diameter_scale", "ratio_minus_one"))
        free = free * (1 + right * get("wheel_diameter_mismatch", "ratio_minus_one") / 2)
        free = free * (1 + rear * get("axle_diameter_mismatch", "ratio_minus_one") / 2)
        return free * (1 + get("tyre_radius_drift", "per_hour") * self.started[:, None] / 3600)

    def drive(self, tyres):
        get, runs, rng = self.hidden.get, len(self.runs), self.rng
        free = self.radii()
        toe = np.zeros(4)
        toe[int(get("wheel_toe", "wheel"))] = get("wheel_toe", "angle_rad")
        ahead, aside = get("load_offset_longitudinal", "x_m"), get("load_offset_lateral", "y_m")
        gradient, downhill = get("floor_slope", "gradient"), get("floor_slope", "downhill_heading_rad")
        across = 1 + get("tyre_grip_anisotropy", "ratio_minus_one")
        corner_std, heading_std, way_std = self.scatter
        of_corner = rng.normal(0, corner_std, (runs, 4))
        stretched = 1 + rng.normal(0, way_std, runs)
        corners = np.clip(np.ceil(np.cumsum(self.corner, 1) - 1e-9).astype(int) - 1, 0, 3)
        points = np.array([(u * tyres.half_patch * 0.7, v * 0.015) for u in (-1, 0, 1) for v in (-1, 1)])
        px, py = X[:, None] + points[:, 0], Y[:, None] + points[:, 1]
        cos, sin = np.cos(toe)[:, None], np.sin(toe)[:, None]

        def pull(twist, roll, load, friction):
            """Force along, force across and moment of all patches."""
            vx, vy, turn = twist.T[:, :, None, None]
            vx, vy = vx - turn * py, vy + turn * px
            speed = np.abs(roll) + 0.004
            along, sideways = (vx * cos + vy * sin - roll) / speed, (vy * cos - vx * sin) / speed
            slip = np.sqrt(along**2 + sideways**2) + 1e-12
            force = tyres.grip(slip, friction) * load / len(points)
            fx, fy = -force * along / slip, -across * force * sideways / slip
            fx, fy = fx * cos - fy * sin, fx * sin + fy * cos
            return np.stack([fx.sum((1, 2)), fy.sum((1, 2)), (px * fy - py * fx).sum((1, 2))], 1)

        pose, twist, rolled = np.zeros((runs, 3)), np.zeros((runs, 3)), np.zeros(runs)
        grain, lie = get("carpet_grain", "rad_per_m"), get("carpet_grain", "lie_rad")
        self.ways = np.zeros((runs, self.rates.shape[1] + 1, 3))
        for step in range(self.rates.shape[1]):
            x, y, heading = pose.T
            pulls = MASS * GRAVITY * gradient * np.stack([np.cos(downhill - heading), np.sin(downhill - heading)], 1)
            tips = MASS * GRAVITY * np.array([ahead, aside]) + pulls * HEIGHT
            if tether := self.hidden.causes.get("tether"):
                off = np.stack([tether["x_m"] - x, tether["y_m"] - y])
                east, north = tether["pull_n"] * off / np.hypot(*off)
                cos_h, sin_h = np.cos(heading), np.sin(heading)
                pulls = pulls + np.stack([cos_h * east + sin_h * north, cos_h * north - sin_h * east], 1)
            load = MASS * GRAVITY / 4 + tips[:, :1] * X / (4 * AHEAD**2) + tips[:, 1:] * Y / (4 * ASIDE**2)
            rolling = free - load / tyres.spring / 3
            if oval := self.hidden.causes.get("out_of_round"):
                rolled = rolled + self.rates[:, step, oval["wheel"]] * STEP
                rolling[:, oval["wheel"]] += RADIUS * oval["amplitude"] * np.cos(rolled + oval["phase_rad"])
            roll = (self.rates[:, step] * rolling)[:, :, None]
            friction = np.full((runs, 4, 1), tyres.friction)
            if spot := self.hidden.causes.get("floor_grip_patch"):
                wx = x[:, None] + np.cos(heading)[:, None] * X - np.sin(heading)[:, None] * Y
                wy = y[:, None] + np.sin(heading)[:, None] * X + np.cos(heading)[:, None] * Y
                on = np.hypot(wx - spot["x_m"], wy - spot["y_m"]) < spot["radius_m"]
                friction = friction * np.where(on, spot["ratio"], 1.0)[:, :, None]

            def unbalanced(now):
                """Newton and Euler about the middle, the centre of mass at (ahead, aside)."""
                change = (now - twist) / STEP
                ax = change[:, 0] - now[:, 2] * now[:, 1] - change[:, 2] * aside - now[:, 2] ** 2 * ahead
                ay = change[:, 1] + now[:, 2] * now[:, 0] + change[:, 2] * ahead - now[:, 2] ** 2 * aside
                moment = INERTIA * change[:, 2] + ahead * (MASS * ay - pulls[:, 1]) - aside * (MASS * ax - pulls[:, 0])
                inertial = np.stack([MASS * ax - pulls[:, 0], MASS * ay - pulls[:, 1], moment], 1)
                return inertial - pull(now, roll, load[:, :, None], friction)

            twist = solved(unbalanced, twist)
            moved = twist[:, :2] * STEP
            strays = of_corner[np.arange(runs), corners[:, step]] * self.corner[:, step]
            strays += grain * np.abs(moved[:, 0]) * np.sin(2 * (lie - heading))
            strays += heading_std * np.sqrt(np.abs(moved[:, 0])) * rng.normal(0, 1, runs)
            middle = heading + twist[:, 2] * STEP / 2
            along = moved[:, 0] * stretched
            pose = pose + np.stack([
                along * np.cos(middle) - moved[:, 1] * np.sin(middle),
                along * np.sin(middle) + moved[:, 1] * np.cos(middle),
                twist[:, 2] * STEP + strays,
            ], 1)
            self.ways[:, step + 1] = pose

    def surveyed(self):
        """Ways as the survey sees them, without noise."""
        get, (x, y, heading) = self.hidden.get, np.moveaxis(self.ways, 2, 0)
        ahead, aside = get("survey_lever_arm", "x_m"), get("survey_lever_arm", "y_m")
        scale, turned = 1 + get("survey_scale", "ratio_minus_one"), get("start_heading_error", "angle_rad")
        cos, sin = np.cos(heading), np.sin(heading)
        x, y = scale * (x + cos * ahead - sin * aside - ahead), scale * (y + sin * ahead + cos * aside - aside)
        by = turned - get("tracked_frame_turned", "angle_rad")
        return np.stack([np.cos(by) * x - np.sin(by) * y, np.sin(by) * x + np.cos(by) * y, heading + turned], 2)

    def write(self, folder, logs):
        folder.mkdir(parents=True)
        (folder / "dataset.toml").write_text(
            f'format = "treadmark-dataset/1"\nname = "{folder.name}"\n\n[robot]\ndrive = "skid-steer"\n\n[odometry]\n'
            f"left_wheel_radius_m = {RADIUS}\nright_wheel_radius_m = {RADIUS}\ntrack_width_m = {TRACK}\n"
            f"ticks_per_revolution = {TICKS}\n\n[survey]\nposition_std_m = {SURVEY[0]}\nheading_std_rad = {SURVEY[2]}\n"
        )
        rng, ways, keep = self.rng, self.surveyed(), math.exp(-POSE * STEP / CORRELATION)
        runs = ["run,protocol,side_m,direction,speed_m_s,turn_rate_rad_s,started_s,start_x_m,start_y_m,start_heading_rad,"
                "x_m,y_m,heading_rad"]
        encoders = ["run,t_s," + ",".join(f"{wheel}_ticks" for wheel in WHEELS)]
        poses = ["run,t_s,x_m,y_m,heading_rad"]
        late = self.hidden.get("survey_time_offset", "offset_s")
        for run, ((side, sign), steps) in enumerate(zip(self.runs, self.steps)):
            start = rng.normal(0, self.survey)

            def read(step, noise):
                x, y, heading = ways[run, step] + noise - start
                cos, sin = math.cos(start[2]), math.sin(start[2])
                return f"{cos * x + sin * y:.6f},{cos * y - sin * x:.6f},{heading:.6f}"

            direction = "cw" if sign < 0 else "ccw"
            began = ",".join(f"{value:.6f}" for value in start)
            runs.append(f"{run:02},square,{side},{direction},{SPEED},{TURN_RATE},{self.started[run]:.0f},{began},"
                        + read(steps, rng.normal(0, self.survey)))
            ticks = np.floor(np.cumsum(self.counted[run], 0) / math.tau * TICKS).astype(int)
            encoders.append(f"{run:02},0,0,0,0,0")
            for step in range(ROW, steps + 1, ROW):
                left, right = ticks[step - 1]
                encoders.append(f"{run:02},{step * STEP:.2f},{left},{right},{left},{right}")
            noise = rng.normal(0, self.survey)
            poses.append(f"{run:02},{late:.6f},0,0,0")
            for step in range(POSE, steps + 1, POSE):
                noise = keep * noise + math.sqrt(1 - keep**2) * rng.normal(0, self.survey)
                poses.append(f"{run:02},{step * STEP + late:.6f}," + read(step, noise))
        (folder / "runs.csv").write_text("\n".join(runs) + "\n")
        if logs:
            (folder / "encoders.csv").write_text("\n".join(encoders) + "\n")
            (folder / "poses.csv").write_text("\n".join(poses) + "\n")


def solved(unbalanced, start):
    """Where nothing is unbalanced, a row a run, by Newton's method with steps that are halved until they help."""
    found = start.copy()
    for _ in range(25):
        left = unbalanced(found)
        if np.abs(left).max() < 1e-7:
            break
        slopes = np.stack([(unbalanced(found + 1e-8 * axis) - left) / 1e-8 for axis in np.eye(3)], 2)
        newton = np.linalg.solve(slopes, -left[:, :, None])[:, :, 0]
        share = np.ones((len(found), 1))
        for _ in range(12):
            worse = (unbalanced(found + share * newton) ** 2).sum(1) > (left**2).sum(1) * (1 - 1e-4 * share[:, 0]) ** 2
            if not worse.any():
                break
            share = np.where(worse[:, None], share / 2, share)
        found = found + share * newton
    return found


def asked(*command):
    """What a command prints as JSON."""
    return json.loads(subprocess.run(list(map(str, command)), check=True, capture_output=True, text=True).stdout)


def diagnosed(treadmark, dataset, robot, out):
    return asked(treadmark, "diagnose", dataset, "--robot", robot, "--json", "--out", out)


# What to compare responses of: an effect, its size here, and what `--set` calls it.
RESPONSES = [
    ("wheel_diameter_mismatch", {"ratio_minus_one": 0.004}, {}),
    ("wheel_toe", {"angle_rad": 0.01, "wheel": 0}, {"wheel": WHEELS[0]}),
    ("load_offset_lateral", {"y_m": 0.01}, {}),
    ("load_offset_longitudinal", {"x_m": 0.01}, {}),
    ("floor_slope", {"gradient": 0.01, "downhill_heading_rad": 1.0}, {}),
]


def compare_responses(treadmark):
    """Ends of four squares without noise here and there, and which share of an effect there it has here."""

    def here(hidden):
        drawn = Campaign(Tyres("tanh", 0.8, 15, 6e4, 8e-3), hidden, np.random.default_rng(0), 1, (0, 0, 0))
        return np.array([way[steps] for way, steps in zip(drawn.ways, drawn.steps)])

    def there(*settings):
        drive = [treadmark, "drive", "--no-survey-noise", "--no-scatter", "--no-recording", "--json", *settings]
        squares = [(side, direction) for side in SIDES for direction in ("cw", "ccw")]
        ends = [asked(*drive, "--side", side, "--direction", direction)["actual"] for side, direction in squares]
        return np.array([[end["x_m"], end["y_m"], end["heading_rad"]] for end in ends])

    plain_here, plain_there = here(Hidden()), there()
    apart = np.abs(plain_here - plain_there).max(0)
    print(f"ends of squares without noise: within {1e3 * apart[:2].max():.1f} mm and {1e3 * apart[2]:.1f} mrad")
    # 1 mm weighs as much as 1 mrad.
    for effect, values, chosen in RESPONSES:
        named = [f"--set={effect}.{key}={value}" for key, value in (values | chosen).items()]
        response, theirs = here(Hidden({effect: values})) - plain_here, there(*named) - plain_there
        share = (response * theirs).sum() / (theirs**2).sum()
        rest = np.abs(response - share * theirs).max(0)
        print(f"{effect}: {share:.3f} of it, and beside that {1e3 * rest[:2].max():.1f} mm and {1e3 * rest[2]:.2f} mrad")


# What four wheels cannot tell from another track, by whatever name it goes.
TRACK_CLASS = {"tyre_grip_anisotropy", "load_offset_longitudinal", "effective_track"}


def judged(hidden, answer):
    """What an answer is worth: right alone, right in groups, in part, silent or wrong, as the challenge scores it without an
    oracle, which would know of mimics, too."""
    sets = [{finding["effect"], *finding["confounded_with"]} for finding in answer["findings"]]
    outside = not set(hidden.causes) <= set(catalogue_draws(np.random.default_rng()))
    if answer["verdict"] == "unexplained":
        return "unexplained" if outside else "wrong"
    if not sets:
        return "silent" if hidden.causes else "rightly clean"
    if outside:
        return "mimic or wrong"
    holds = lambda one, effect: effect in one or ("effective_track" in one and effect in TRACK_CLASS)
    if not all(any(holds(one, effect) for effect in hidden.causes) for one in sets):
        return "wrong"
    if not all(any(holds(one, effect) for one in sets) for effect in hidden.causes):
        return "in part"
    return "named" if all(len(one) == 1 for one in sets) else "in a group"


def gained(treadmark, folder, tyres, hidden, logs):
    """How far squares without noise end from where the model sees them, before the answer and after; and before, where
    nothing is hidden: the model's own error, which the best answer leaves [m]."""

    def off(driven, name, model):
        dataset, predicted = folder / f"{name}-fresh", folder / f"{name}-{model.parent.name}"
        if not dataset.exists():
            driven.write(dataset, logs)
        subprocess.run([treadmark, "predict", dataset, "--robot", model, "--out", predicted], check=True, capture_output=True)
        with open(predicted / "runs.csv") as runs:
            ends = np.array([[float(run["x_m"]), float(run["y_m"])] for run in csv.DictReader(runs)])
        surveyed = driven.surveyed()
        actual = np.array([surveyed[run, steps, :2] for run, steps in enumerate(driven.steps)])
        return math.sqrt(((ends - actual) ** 2).sum(1).mean())

    fresh = lambda of: Campaign(tyres, of, np.random.default_rng(0), 1, (0, 0, 0), (0, 0, 0))
    before, after = (folder / name / "extended_model.toml" for name in ("model", "answer"))
    with_it = fresh(hidden)
    return off(with_it, "hidden", before), off(with_it, "hidden", after), off(fresh(Hidden()), "clean", before)


def in_words(finding):
    sought = [(key, found) for key, found in finding["parameters"].items() if found.get("std_dev")]
    values = ", ".join(f"{key} {found['value']:.4g} ± {found['std_dev']:.2g}" for key, found in sought)
    return f"{' or '.join([finding['effect'], *finding['confounded_with']])} {values}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("treadmark")
    parser.add_argument("--seeds", default="0..20", help="A..B, B not included")
    parser.add_argument("--effects", choices=["one", "two", "outside"], default="one")
    parser.add_argument("--data", choices=["logs", "endpoints"], default="logs")
    parser.add_argument("--robot", default="jnpf_4wd")
    parser.add_argument("--out", help="a new folder for campaigns and answers")
    parser.add_argument("--responses", action="store_true", help="hold what effects do against `treadmark drive`")
    arguments = parser.parse_args()
    if arguments.responses:
        return compare_responses(arguments.treadmark)
    first, end = map(int, arguments.seeds.split(".."))
    counts, gains = {}, np.zeros(2)
    with tempfile.TemporaryDirectory() as temporary:
        for seed in range(first, end):
            rng, folder = np.random.default_rng(seed), Path(arguments.out or temporary) / str(seed)
            tyres, hidden = Tyres.drawn(rng), Hidden.drawn(rng, arguments.effects)
            logs = arguments.data == "logs"
            for name, of in (("clean", Hidden()), ("hidden", hidden)):
                Campaign(tyres, of, rng).write(folder / name, logs)
            diagnosed(arguments.treadmark, folder / "clean", arguments.robot, folder / "model")
            model = folder / "model" / "extended_model.toml"
            answer = diagnosed(arguments.treadmark, folder / "hidden", model, folder / "answer")
            verdict = judged(hidden, answer)
            counts[verdict] = counts.get(verdict, 0) + 1
            said = "; ".join(map(in_words, answer["findings"]))
            before, after, least = gained(arguments.treadmark, folder, tyres, hidden, logs)
            gains += np.array([1 - after / before, 1 - least / before])
            off = f"{1e3 * before:.1f} to {1e3 * after:.1f} mm, {1e3 * least:.1f} with nothing hidden"
            print(f"{seed} {verdict}: hidden {hidden}; {answer['verdict']} {said}; {off}", flush=True)
    print(", ".join(f"{verdict} {count}" for verdict, count in sorted(counts.items())))
    print(f"gain of end positions: {gains[0] / gains[1]:.2f} of what the truth gains")
    sys.exit("wrong" in counts)


if __name__ == "__main__":
    main()
