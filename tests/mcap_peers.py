"""Opens a dataset with readers that are not ours, and checks what they see.

    pip install -r tests/requirements.txt
    python tests/mcap_peers.py DATASET

The recording is decoded twice, by `mcap` with `mcap-ros2-support` and by `rosbags`; both must see the same values,
and the values must be what the dataset's other files and the message conventions (REP-103, REP-117) say.
Ends with exit code 1 at the first thing that is wrong.
"""

import argparse
import hashlib
import json
import math
import subprocess
import sys
import tempfile
import tomllib
from collections import defaultdict
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

EPOCH_NS = 1_518_000_000 * 10**9
LABEL_TOPIC = "/session/pose"
TYPES = {
    LABEL_TOPIC: "std_msgs/msg/String",
    "/scan": "sensor_msgs/msg/LaserScan",
    "/echoes": "sensor_msgs/msg/MultiEchoLaserScan",
    "/points": "sensor_msgs/msg/PointCloud2",
    "/mocap/markers": "mocap4r2_msgs/msg/Markers",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
}


def check(condition, message):
    """Stops at the first thing that is not as it should be."""
    if not condition:
        sys.exit(f"mcap_peers: {message}")


def plain(value):
    """A decoded message as dictionaries, lists and numbers, whichever library decoded it."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (bytes, bytearray, memoryview)):
        return list(value)
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, (bool, int, float, str)) or value is None:
        return value
    if isinstance(value, np.generic):
        return value.item()
    names = getattr(value, "__slots__", None) or vars(value)
    # Constants of the type (upper case) and the type's own name are not fields.
    return {n: plain(getattr(value, n)) for n in names if not n.startswith("_") and not n.isupper()}


def same(a, b):
    """Equality of plain values that takes NaN for equal to NaN."""
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, float) and isinstance(b, float) and math.isnan(a):
        return math.isnan(b)
    return a == b


def read_with_mcap(path):
    """Every message as (topic, type, log time in ns, plain message), in the order of the file."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        header = reader.get_header()
        check(header.profile == "ros2", f"profile is {header.profile!r}, not 'ros2'")
        check(header.library.startswith("catoptric "), f"library is {header.library!r}")
        decoders = DecoderFactory()
        messages = []
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            check(message.log_time == message.publish_time, f"{channel.topic}: log time is not publish time")
            check(schema.encoding == "ros2msg", f"{channel.topic}: schema encoding {schema.encoding!r}")
            decoded = plain(decoders.decoder_for(channel.message_encoding, schema)(message.data))
            messages.append((channel.topic, schema.name, message.log_time, decoded))
        counted = reader.get_summary().statistics.message_count
        check(counted == len(messages), f"the summary counts {counted} messages, the file holds {len(messages)}")
    return messages


def read_with_rosbags(path):
    """The same, in order of time."""
    with AnyReader([path]) as reader:
        messages = []
        for connection, time, data in reader.messages():
            decoded = plain(reader.deserialize(data, connection.msgtype))
            messages.append((connection.topic, connection.msgtype, time, decoded))
    return messages


def check_agreement(ours, theirs):
    """Both libraries saw the same messages of every topic."""

    def by_topic(messages):
        grouped = defaultdict(list)
        for topic, *rest in messages:
            grouped[topic].append(rest)
        return grouped

    a, b = by_topic(ours), by_topic(theirs)
    check(a.keys() == b.keys(), f"mcap sees topics {sorted(a)}, rosbags {sorted(b)}")
    for topic in a:
        check(len(a[topic]) == len(b[topic]), f"{topic}: {len(a[topic])} messages by mcap, {len(b[topic])} by rosbags")
        for i, (x, y) in enumerate(zip(a[topic], b[topic])):
            check(same(x, y), f"{topic}: message {i} differs between mcap and rosbags:\n{x}\n{y}")


def stamp_ns(header):
    """Time of a header in nanoseconds."""
    return header["stamp"]["sec"] * 10**9 + header["stamp"]["nanosec"]


def vector(xyz):
    """A point or vector as an array."""
    return np.array([xyz["x"], xyz["y"], xyz["z"]])


def check_rotation(q, where):
    """A quaternion of unit length."""
    length = math.sqrt(q["x"] ** 2 + q["y"] ** 2 + q["z"] ** 2 + q["w"] ** 2)
    check(abs(length - 1) < 1e-9, f"{where}: a quaternion of length {length}")


def transform(pose, point):
    """A point of the body in the frame of its pose."""
    q = pose["orientation"]
    u = vector(q)
    return vector(pose["position"]) + point + 2 * np.cross(u, np.cross(u, point) + q["w"] * point)


def check_scan(scan, scanner, where):
    """Angles, times and readings of one scan."""
    step = math.radians(scanner["step_deg"])
    beams = scanner["beams"]
    first = -(beams - 1) / 2 * step
    period = 1 / scanner["scan_rate_hz"]
    check(scan["header"]["frame_id"] == "laser", f"{where}: frame {scan['header']['frame_id']!r}")
    expected = {
        "angle_min": first,
        "angle_max": -first,
        "angle_increment": step,
        "time_increment": period * scanner["step_deg"] / 360,
        "scan_time": period,
        "range_min": scanner["range_min_m"],
        "range_max": scanner["range_max_m"],
    }
    for name, value in expected.items():
        check(scan[name] == float(np.float32(value)), f"{where}: {name} is {scan[name]}, not {value}")
    ranges = np.array(scan["ranges"])
    check(len(ranges) == beams, f"{where}: {len(ranges)} ranges, the scanner has {beams} beams")
    check(len(scan["intensities"]) in (0, len(scan["ranges"])), f"{where}: intensities of some readings only")
    finite = ranges[np.isfinite(ranges)]
    inside = (finite >= np.float32(scanner["range_min_m"])) & (finite <= np.float32(scanner["range_max_m"]))
    check(inside.all(), f"{where}: a finite range outside [range_min, range_max]: {finite[~inside][:3]}")
    millimeters = np.round(finite * 1e3)
    whole = finite == (millimeters / 1e3).astype(np.float32)
    check(whole.all(), f"{where}: a range that is not whole millimeters: {finite[~whole][:3]}")
    return ranges


def check_points(cloud, ranges, scanner, where):
    """The plane as scanned: finite ranges along their beams."""
    fields = [(f["name"], f["offset"], f["datatype"], f["count"]) for f in cloud["fields"]]
    check(fields == [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1)], f"{where}: fields {fields}")
    check(cloud["height"] == 1 and cloud["point_step"] == 12, f"{where}: not a row of three 32-bit numbers")
    check(cloud["row_step"] == len(cloud["data"]) == 12 * cloud["width"], f"{where}: row_step is not the data's length")
    check(not cloud["is_bigendian"] and cloud["is_dense"], f"{where}: big-endian, or not dense")
    points = np.frombuffer(bytes(cloud["data"]), "<f4").reshape(-1, 3)
    azimuth = (np.arange(len(ranges)) - (len(ranges) - 1) / 2) * math.radians(scanner["step_deg"])
    finite = np.isfinite(ranges)
    expected = np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=1)[finite] * ranges[finite, None]
    check(points.shape == expected.shape, f"{where}: {len(points)} points, {len(expected)} finite ranges")
    worst = np.abs(points - expected).max(initial=0)
    check(worst < 1e-5, f"{where}: a point {worst} m from range·(cos, sin)")


def check_markers(message, poses, templates, where):
    """Markers have known names and stand where the pose puts the template."""
    for marker in message["markers"]:
        name = marker["marker_name"]
        subject, _, label = name.partition("/")
        check(subject in templates and label in templates[subject], f"{where}: marker {name!r} is not in session.toml")
        check(marker["id_type"] == 2, f"{where}: id_type {marker['id_type']} of {name!r} is not USE_BOTH")
        index = list(templates[subject]).index(label)
        check(marker["marker_index"] == index, f"{where}: {name!r} has index {marker['marker_index']}, not {index}")
        if subject in poses:
            place = transform(poses[subject], templates[subject][label])
            off = np.linalg.norm(vector(marker["translation"]) - place)
            check(off < 10e-3, f"{where}: {name!r} is {off * 1e3:.1f} mm from where the pose puts it")


def check_stretch(label, messages, session, templates):
    """The messages between one label and the next."""
    where = f"pose {label['pose']}"
    scanner = session["scanner"]
    times = [time for _, time, _ in messages]
    check(times == sorted(times), f"{where}: messages are not in order of time")
    grouped = defaultdict(list)
    for topic, time, message in messages:
        header = message["transforms"][0]["header"] if topic == "/tf" and message["transforms"] else message.get("header")
        if header:
            check(stamp_ns(header) == time, f"{where}: {topic}: stamp is not log time")
        grouped[topic].append((time, message))

    scans = grouped["/scan"]
    check(len(scans) == label["scans"], f"{where}: {len(scans)} scans, the label says {label['scans']}")
    ranges = [check_scan(scan, scanner, f"{where}, scan {k}") for k, (_, scan) in enumerate(scans)]
    gaps = np.diff([time for time, _ in scans])
    period = 1e9 / scanner["scan_rate_hz"]
    check((np.abs(gaps - period) <= 1).all(), f"{where}: scans are not {period} ns apart: {gaps[:5]}")
    if scans:
        check(len(grouped["/points"]) == 1, f"{where}: {len(grouped['/points'])} messages on /points, not 1")
        check_points(grouped["/points"][0][1], ranges[0], scanner, f"{where}, /points")

    poses = defaultdict(dict)
    for topic, messages_of_topic in grouped.items():
        subject = topic.removeprefix("/mocap/")
        if subject == topic or topic == "/mocap/markers":
            continue
        check(subject in templates, f"{where}: {topic} is of nobody in session.toml")
        for time, message in messages_of_topic:
            check(message["header"]["frame_id"] == "room", f"{where}: {topic} is not in the room frame")
            check_rotation(message["pose"]["orientation"], f"{where}: {topic}")
            poses[time][subject] = message["pose"]
    for time, message in grouped["/mocap/markers"]:
        check(message["header"]["frame_id"] == "room", f"{where}: /mocap/markers is not in the room frame")
        check_markers(message, poses[time], templates, f"{where}, /mocap/markers")

    seen = {subject for at in poses.values() for subject in at}
    check("rig" in seen, f"{where}: the rig was never tracked")
    check(label.get("board", "rig") in seen, f"{where}: board {label.get('board')!r} was never tracked")
    expected = len(grouped["/mocap/rig"]) if label["kind"] == "flight" else 1
    check(len(grouped["/tf"]) == expected, f"{where}: {len(grouped['/tf'])} messages on /tf, not {expected}")
    for (time, message), (_, seen_then) in zip(grouped["/tf"][1:], grouped["/mocap/rig"][1:]):
        (t,) = message["transforms"]
        off = np.abs(vector(t["transform"]["translation"]) - vector(seen_then["pose"]["position"])).max()
        check(t["child_frame_id"] == "rig" and off == 0, f"{where}: /tf at {time} is not where the rig was seen")
    placed = {t["child_frame_id"] for t in grouped["/tf"][0][1]["transforms"]}
    check(placed == seen, f"{where}: /tf places {sorted(placed)}, motion capture saw {sorted(seen)}")
    for t in grouped["/tf"][0][1]["transforms"]:
        check(t["header"]["frame_id"] == "room", f"{where}: /tf is not in the room frame")
        check_rotation(t["transform"]["rotation"], f"{where}: /tf")
    return len(scans), len(grouped["/mocap/markers"])


def check_static(messages, session):
    """The mounting as drawn, once, at the beginning."""
    static = [(time, m) for topic, _, time, m in messages if topic == "/tf_static"]
    check(len(static) == 1 and messages[0][0] == "/tf_static", "/tf_static is not the one first message")
    time, message = static[0]
    check(time == EPOCH_NS, f"the recording begins at {time} ns, not {EPOCH_NS}")
    (t,) = message["transforms"]
    check((t["header"]["frame_id"], t["child_frame_id"]) == ("rig", "laser"), "/tf_static is not laser in rig")
    nominal = session["nominal_rig_from_sensor"]
    q = t["transform"]["rotation"]
    check_rotation(q, "/tf_static")
    check(np.allclose(vector(t["transform"]["translation"]), nominal["translation_m"], atol=1e-12), "/tf_static: position")
    found = np.array([q["x"], q["y"], q["z"], q["w"]])
    check(abs(abs(found @ nominal["rotation_xyzw"]) - 1) < 1e-6, "/tf_static: rotation")


def check_manifest(dataset):
    """Every file is what it was when it was written."""
    manifest = json.loads((dataset / "manifest.json").read_text())
    for name, expected in manifest["files"].items():
        path = dataset / name
        if name.startswith("truth/") and not path.exists():
            continue  # a blind dataset
        check(path.exists(), f"{name} is in the manifest but not there")
        check(hashlib.sha256(path.read_bytes()).hexdigest() == expected, f"{name}: SHA-256 is not the manifest's")
    there = {p.relative_to(dataset).as_posix() for p in dataset.rglob("*") if p.is_file()}
    extra = there - manifest["files"].keys() - {"manifest.json"}
    check(not extra, f"files that the manifest does not know: {sorted(extra)}")
    check(list(manifest["files"]) == sorted(manifest["files"]), "the manifest's files are not sorted")
    return len(manifest["files"])


def check_conversions(recording, messages):
    """`rosbags-convert` without options writes every format that it knows, and each is read back whole."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ["as.bag", "as-sqlite3", "as-mcap"]:
            options = ["--dst-storage", name.removeprefix("as-")] if name != "as.bag" else []
            out = Path(folder) / name
            convert = str(Path(sys.executable).parent / "rosbags-convert")
            command = [convert, "--src", str(recording), "--dst", str(out), *options]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            check(done.returncode == 0, f"{' '.join(command)}: {done.stderr}")
            with AnyReader([out]) as reader:
                check(reader.message_count == len(messages), f"{name} has {reader.message_count} messages")


def main():
    """Checks one dataset."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    dataset = parser.parse_args().dataset
    recording = dataset / "observations.mcap"
    check(recording.is_file(), f"{recording} is not there")

    files = check_manifest(dataset)
    session = tomllib.loads((dataset / "session.toml").read_text())
    bodies = {"rig": session["rig_markers"]} | {b["name"]: b["markers"] for b in session.get("boards", [])}
    templates = {
        subject: {m["name"]: np.array(m["position_mm"]) * 1e-3 for m in markers} for subject, markers in bodies.items()
    }

    messages = read_with_mcap(recording)
    check_agreement(messages, read_with_rosbags(recording))
    check_conversions(recording, messages)
    for topic, kind, _, _ in messages:
        known = TYPES.get(topic, "geometry_msgs/msg/PoseStamped")
        check(kind == known, f"{topic} holds {kind}, not {known}")
    check_static(messages, session)

    stretches = []
    for topic, _, time, message in messages[1:]:
        if topic == LABEL_TOPIC:
            stretches.append((json.loads(message["data"]), []))
        else:
            check(stretches, f"{topic}: a message before the first label")
            stretches[-1][1].append((topic, time, message))
    check(stretches, "the recording holds no stretch")
    counts = [check_stretch(label, rest, session, templates) for label, rest in stretches]
    scans, frames = (sum(c) for c in zip(*counts))
    print(f"{dataset}: {len(stretches)} stretches, {scans} scans, {frames} motion-capture frames, {files} files: good")


if __name__ == "__main__":
    main()
