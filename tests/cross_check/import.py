"""Bags that independent libraries wrote of real campaigns import to datasets that calibrate and diagnose to the same digits.

    python -m venv venv && venv/bin/pip install -r tests/cross_check/requirements.txt
    cargo build --release
    venv/bin/python tests/cross_check/import.py target/release/treadmark --robot optiodom CAMPAIGN…

Each CAMPAIGN is a folder with dataset.toml, runs.csv, encoders.csv in ticks and poses.csv. It is written as one bag a run
(by rosbags: lossless, its poses in a room frame; by mcap-ros2-support: zstd, big headers, tf), imported, and calibrated
beside the original: what `treadmark calibrate` prints must be the same to the last digit, and so must every number of
encoders.csv and poses.csv when printed as the original has it. With --robot, the model to diagnose against, so must all
that `treadmark diagnose` prints; the original has noted in it what bags know anyway and a diagnosis uses, when and where
each run began. Then all runs go into one bag with standstills between them, and must be cut and its
squares recognised as what the original says. Last, an exported run is read by evo.
"""

import argparse
import csv
import difflib
import json
import math
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import numpy
from mcap_ros2.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosbagWriter
from rosbags.typesys import Stores, get_typestore

BEGAN = 1_750_000_000_123_456_789  # [ns] since 1970
ROOM = (1.2, -0.7, 0.4)  # where the mark is in the survey's room [m, m, rad]

JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
TF = """geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""


class Campaign:
    """A dataset's files as they stand there."""

    def __init__(self, folder):
        self.folder = folder
        self.toml = tomllib.loads((folder / "dataset.toml").read_text())
        self.runs = list(csv.DictReader((folder / "runs.csv").open()))
        self.encoders = self.by_run("encoders.csv")
        self.poses = self.by_run("poses.csv")
        odometry = self.toml["odometry"]
        self.ticks = odometry["ticks_per_revolution"]
        self.odometry = ",".join(
            str(odometry[key])
            for key in ("left_wheel_radius_m", "right_wheel_radius_m", "track_width_m", "ticks_per_revolution")
        )

    def by_run(self, name):
        rows = {}
        for row in csv.DictReader((self.folder / name).open()):
            rows.setdefault(row["run"], []).append(row)
        return rows

    def facts(self):
        survey = self.toml["survey"]
        return ["--odometry", self.odometry, "--position-std", str(survey["position_std_m"]), "--heading-std",
                str(survey["heading_std_rad"]), "--name", self.toml["name"]]


def nanoseconds(text):
    whole, _, fraction = text.partition(".")
    return int(whole) * 10**9 + int(fraction.ljust(9, "0"))


def in_room(row, room=ROOM):
    x, y, heading = float(row["x_m"]), float(row["y_m"]), float(row["heading_rad"])
    cos, sin = math.cos(room[2]), math.sin(room[2])
    return room[0] + cos * x - sin * y, room[1] + sin * x + cos * y, room[2] + heading


def stamp(time):
    return {"sec": time // 10**9, "nanosec": time % 10**9}


class Rosbags:
    """One bag by rosbags: joints in radians, poses as PoseStamped, the robot's own odometry as a distraction."""

    unit = []
    options = []

    def __init__(self, path, ticks):
        self.store = get_typestore(Stores.ROS2_HUMBLE)
        self.types = self.store.types
        self.writer = RosbagWriter(path, version=9, storage_plugin=StoragePlugin.MCAP)
        self.writer.open()
        self.topics = {
            name: self.writer.add_connection(name, kind, typestore=self.store)
            for name, kind in [
                ("/joint_states", "sensor_msgs/msg/JointState"),
                ("/mocap/pose", "geometry_msgs/msg/PoseStamped"),
                ("/odom", "nav_msgs/msg/Odometry"),
            ]
        }
        self.radians = 2 * math.pi / ticks

    def header(self, time, frame):
        return self.types["std_msgs/msg/Header"](self.types["builtin_interfaces/msg/Time"](**stamp(time)), frame)

    def pose(self, x, y, heading):
        point = self.types["geometry_msgs/msg/Point"](x, y, 0.0)
        quaternion = self.types["geometry_msgs/msg/Quaternion"](0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2))
        return self.types["geometry_msgs/msg/Pose"](point, quaternion)

    def write(self, name, time, message):
        connection = self.topics[name]
        self.writer.write(connection, time + 1_000_000, self.store.serialize_cdr(message, connection.msgtype))

    def wheels(self, time, left, right):
        message = self.types["sensor_msgs/msg/JointState"]
        positions = numpy.array([0.25, right * self.radians, left * self.radians])
        names = ["caster_wheel_joint", "right_wheel_joint", "left_wheel_joint"]
        self.write("/joint_states", time, message(self.header(time, ""), names, positions, numpy.zeros(3), numpy.zeros(3)))
        twist = self.types["geometry_msgs/msg/TwistWithCovariance"](
            self.types["geometry_msgs/msg/Twist"](
                self.types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0),
                self.types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0),
            ),
            numpy.zeros(36),
        )
        pose = self.types["geometry_msgs/msg/PoseWithCovariance"](self.pose(9.0, 9.0, 0.0), numpy.zeros(36))
        odometry = self.types["nav_msgs/msg/Odometry"](self.header(time, "odom"), "base_link", pose, twist)
        self.write("/odom", time, odometry)

    def survey(self, time, x, y, heading):
        message = self.types["geometry_msgs/msg/PoseStamped"](self.header(time, "room"), self.pose(x, y, heading))
        self.write("/mocap/pose", time, message)

    def close(self):
        self.writer.close()


class McapRos2:
    """One bag by mcap-ros2-support: joints in ticks, poses by tf among other frames."""

    unit = ["--unit", "ticks"]
    options = ["--encoders", "/wheels", "--left", "wl", "--right", "wr", "--pose", "/tf", "--frame", "room/base_link"]

    def __init__(self, path, _ticks):
        self.file = path.with_suffix(".mcap").open("wb")
        self.writer = McapWriter(self.file)
        self.joints = self.writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        self.tf = self.writer.register_msgdef("tf2_msgs/msg/TFMessage", TF)

    def wheels(self, time, left, right):
        header = {"stamp": stamp(time), "frame_id": "wheel encoders of the robot"}
        message = {"header": header, "name": ["wl", "wr"], "position": [left, right], "velocity": [], "effort": []}
        self.writer.write_message("/wheels", self.joints, message, time + 5, time)

    def survey(self, time, x, y, heading):
        def transform(parent, child, x, y, heading):
            rotation = {"x": 0.0, "y": 0.0, "z": math.sin(heading / 2), "w": math.cos(heading / 2)}
            placed = {"translation": {"x": x, "y": y, "z": 0.1}, "rotation": rotation}
            return {"header": {"stamp": stamp(time), "frame_id": parent}, "child_frame_id": child, "transform": placed}

        transforms = [transform("base_link", "lidar", 0.1, 0.0, 0.0), transform("room", "base_link", x, y, heading)]
        self.writer.write_message("/tf", self.tf, {"transforms": transforms}, time + 7, time)

    def close(self):
        self.writer.finish()
        self.file.close()


def write_run(bag, campaign, run, began, counts=(0, 0), room=ROOM):
    """Appends a run; returns its last counts and when it ended."""
    readings = [(nanoseconds(row["t_s"]), 0, row) for row in campaign.encoders[run]]
    readings += [(nanoseconds(row["t_s"]), 1, row) for row in campaign.poses[run]]
    left = right = 0
    for time, kind, row in sorted(readings, key=lambda reading: reading[:2]):
        if kind == 0:
            left, right = counts[0] + int(row["left_ticks"]), counts[1] + int(row["right_ticks"])
            bag.wheels(began + time, left, right)
        else:
            bag.survey(began + time, *in_room(row, room))
    return (left, right), began + readings[-1][0]


def treadmark(binary, *arguments):
    done = subprocess.run([binary, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"treadmark {' '.join(map(str, arguments))}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def same_numbers(campaign, imported):
    """Every time, count and pose, printed with the original's own decimals."""
    compared = 0
    for name, columns in [("encoders.csv", ["t_s", "left_ticks", "right_ticks"]),
                          ("poses.csv", ["t_s", "x_m", "y_m", "heading_rad"])]:
        original = list(csv.DictReader((campaign.folder / name).open()))
        ours = list(csv.DictReader((imported / name).open()))
        assert len(original) == len(ours), f"{name}: {len(original)} rows, {len(ours)} imported"
        for row, our in zip(original, ours, strict=True):
            assert row["run"] == our["run"], f"{name}: {row} {our}"
            for column in columns:
                if column in our:
                    decimals = len(row[column].partition(".")[2])
                    value = f"{float(our[column]) + 0.0:.{decimals}f}"
                    assert float(value) == float(row[column]), f"{name}: {column}: {row} {our}"
                    compared += 1
    return compared


def noted(campaign, began, folder):
    """A copy of a campaign that says when and where each run began."""
    shutil.copytree(campaign.folder, folder)
    starts = {"start_x_m": ROOM[0], "start_y_m": ROOM[1], "start_heading_rad": ROOM[2]}
    rows = [row | starts | {"started_s": (began[row["run"]] - BEGAN) / 1e9} for row in campaign.runs]
    with (folder / "runs.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, rows[0].keys())
        table.writeheader()
        table.writerows(rows)
    return folder


def diagnosis(binary, dataset, robot, out):
    """What a diagnosis says, and its JSON without what names the folder."""
    said = treadmark(binary, "diagnose", dataset, "--robot", robot, "--out", out, "--no-recording")
    said = "".join(line for line in said.splitlines(keepends=True) if str(out) not in line)
    return said, json.loads((out / "diagnosis.json").read_text())


def check(binary, folder, robot, work):
    campaign = Campaign(folder)
    name = campaign.toml["name"]
    original = treadmark(binary, "calibrate", folder)
    original_json = json.loads(treadmark(binary, "calibrate", folder, "--json"))
    sizes = sorted({row["side_m"] for row in campaign.runs if row["side_m"]})
    radii = sorted({row["radius_m"] for row in campaign.runs if row["radius_m"]})
    nominal = (["--side", ",".join(sizes)] if sizes else []) + (["--radius", ",".join(radii)] if radii else [])
    # Runs follow each other with a minute between them.
    starts, began = {}, BEGAN
    for row in campaign.runs:
        starts[row["run"]] = began
        readings = campaign.encoders[row["run"]] + campaign.poses[row["run"]]
        began += max(nanoseconds(reading["t_s"]) for reading in readings) + 60 * 10**9
    if robot:
        diagnosed, diagnosed_json = diagnosis(binary, noted(campaign, starts, work / "noted"), robot, work / "diagnosed")
    for library in (Rosbags, McapRos2):
        bags = []
        for row in campaign.runs:
            path = work / f"{name}-{library.__name__}" / row["run"]
            path.parent.mkdir(exist_ok=True)
            bag = library(path, campaign.ticks)
            write_run(bag, campaign, row["run"], starts[row["run"]])
            bag.close()
            bags.append(path if path.is_dir() else path.with_suffix(".mcap"))
        for how, extra in [("recognised", nominal), ("stated", ["--runs", folder / "runs.csv"])]:
            if how == "recognised" and any(row["protocol"] != "square" for row in campaign.runs):
                # The real circles are spirals, two turns that shrink by a fifth: not stated, they are paths.
                continue
            out = work / f"{name}-{library.__name__}-{how}"
            treadmark(binary, "import", *bags, "--out", out, "--whole", *library.unit, *library.options, *extra,
                      *campaign.facts())
            compared = same_numbers(campaign, out)
            ours = treadmark(binary, "calibrate", out)
            assert ours == original, f"{out}: calibrates differently\n{original}\n{ours}"
            same = json.loads(treadmark(binary, "calibrate", out, "--json")) == original_json
            print(f"{name}: {library.__name__}, protocols {how}: {compared} numbers as printed, "
                  f"`calibrate` the same{', its JSON to the last bit' if same else ''}", flush=True)
        if robot:
            ours, ours_json = diagnosis(binary, out, robot, work / f"diagnosed-{library.__name__}")
            changed = "".join(difflib.unified_diff(diagnosed.splitlines(True), ours.splitlines(True), "original", "imported"))
            assert not changed, f"{out}: diagnosed differently\n{changed}"
            same = ", its JSON to the last bit" if ours_json == diagnosed_json else ""
            print(f"{name}: {library.__name__}: `diagnose` the same {len(ours.splitlines())} lines{same}: "
                  f"{ours.splitlines()[0]}", flush=True)

    # One bag with standstills: robot at rest for ten seconds between runs, carried back to the mark meanwhile.
    bag = Rosbags(work / f"{name}-one", campaign.ticks)
    counts, began = (5, -7), BEGAN
    for index, row in enumerate(campaign.runs):
        room = (0.3 * index, -0.1 * index, 0.2 * index)
        at_rest = {"x_m": "0", "y_m": "0", "heading_rad": "0"}
        for step in range(100):
            bag.wheels(began + step * 50_000_000, *counts)
            bag.survey(began + step * 50_000_000, *in_room(at_rest, room))
        counts, ended = write_run(bag, campaign, row["run"], began + 5 * 10**9, counts, room)
        for step in range(1, 100):
            bag.wheels(ended + step * 50_000_000, *counts)
            bag.survey(ended + step * 50_000_000, *in_room(campaign.poses[row["run"]][-1], room))
        began = ended + 5 * 10**9
    bag.close()
    out = work / f"{name}-cut"
    treadmark(binary, "import", work / f"{name}-one", "--out", out, *nominal, *campaign.facts())
    cut = list(csv.DictReader((out / "runs.csv").open()))
    assert len(cut) == len(campaign.runs), f"{len(cut)} runs"
    for row, ours in zip(campaign.runs, cut, strict=True):
        if row["protocol"] == "square":
            for column in ("protocol", "side_m", "radius_m", "direction"):
                assert float(row[column] or 0) == float(ours.get(column) or 0) if column.endswith("_m") else (
                    row[column] == ours[column]), f"{row} {ours}"
        assert abs(float(row["x_m"]) - float(ours["x_m"])) < 2e-3, f"{row} {ours}"
    ours_json = json.loads(treadmark(binary, "calibrate", out, "--json"))
    print(f"{name}: one bag with standstills: {len(cut)} runs: {', '.join(sorted({row['protocol'] for row in cut}))}")
    for before, after in zip(original_json["methods"], ours_json["methods"], strict=True):
        if before["applicable"] and after["applicable"]:
            both = [method["estimate"][key]["value"] for key in ("diameter_ratio", "track_ratio")
                    for method in (before, after)]
            print(f"    {before['method']}: E_d {both[0]:.6f} {both[1]:.6f}, E_b {both[2]:.6f} {both[3]:.6f}")

    # Exported, read by evo, and imported again.
    tum = work / f"{name}-tum"
    treadmark(binary, "export", folder, "--out", tum)
    from evo.core import metrics, sync
    from evo.tools import file_interface

    run = campaign.runs[0]["run"]
    survey = file_interface.read_tum_trajectory_file(tum / f"{run}.survey.tum")
    odometry = file_interface.read_tum_trajectory_file(tum / f"{run}.odometry.tum")
    survey, odometry = sync.associate_trajectories(survey, odometry)
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((survey, odometry))
    print(f"{name}: evo reads run {run}: {survey.num_poses} poses, APE {error.get_statistic(metrics.StatisticsType.rmse):.4f} m RMS")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary", type=Path)
    parser.add_argument("campaigns", type=Path, nargs="+", metavar="CAMPAIGN")
    parser.add_argument("--robot", help="diagnose too, against this model")
    arguments = parser.parse_args()
    for folder in arguments.campaigns:
        with tempfile.TemporaryDirectory() as work:
            check(arguments.binary.resolve(), folder.resolve(), arguments.robot, Path(work))


if __name__ == "__main__":
    main()
