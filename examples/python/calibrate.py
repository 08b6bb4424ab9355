"""The least calibrator of one's own: reads a dataset folder, solves every beam by itself, writes calibration.json.

    pip install -r tests/requirements.txt
    python examples/python/calibrate.py DATASET calibration.json

It takes the sensor to sit where the drawing puts it, and adds what that may be off by to its covariance. Colors (E_c) are left out: the boards here are white.
"""

import json, sys, tomllib
from pathlib import Path
import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

def turn(q):  # rotation matrix of a quaternion (x, y, z, w)
    x, y, z, w = q
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * k + 2 * k @ k

def spherical(azimuth, elevation):
    return np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])

folder, out = Path(sys.argv[1]), Path(sys.argv[2])
session = tomllib.loads((folder / "session.toml").read_text())
believed, bare = session["believed"], session["bare_structure"]
mount = session["nominal_rig_from_sensor"]

stretches = []  # label, scans, and the first pose of every body, in the order of the recording
with (folder / "observations.mcap").open("rb") as file:
    decoders = DecoderFactory()
    for schema, channel, message in make_reader(file).iter_messages():
        if channel.topic == "/session/pose":
            stretches.append((json.loads(message.data), [], {}))
        elif channel.topic == "/scan" or channel.topic.startswith("/mocap/") and channel.topic != "/mocap/markers":
            data = decoders.decoder_for(channel.message_encoding, schema)(message.data)
            label, scans, poses = stretches[-1]
            if channel.topic == "/scan":
                scans.append(np.array(data.ranges))
            else:
                poses.setdefault(channel.topic[7:], data.pose)

boards = []  # facet, beams, center and normal in the sensor frame, mean range and readings of every beam
for label, scans, poses in (s for s in stretches if s[0]["kind"] == "facet"):
    def of(body):
        p, q = poses[body].position, poses[body].orientation
        return turn((q.x, q.y, q.z, q.w)), np.array([p.x, p.y, p.z])
    (rig, at), (board, center) = of("rig"), of(label["board"])
    back = (rig @ turn(mount["rotation_xyzw"])).T
    center = back @ (center - at - rig @ mount["translation_m"])
    ranges = np.where(np.isfinite(scans), scans, np.nan)
    count = np.isfinite(ranges).sum(axis=0)
    mean = np.where(count > 0, np.nansum(ranges, axis=0) / np.maximum(count, 1), np.nan)
    boards.append((label["facet"], label["beams"], center, back @ board[:, 2], mean, count))

def solve(beam, facet, mirror):
    """The entry of a beam that the drawing sends to a facet."""
    fail = lambda status, reason: {"beam": beam, "status": status, "reason": reason}
    azimuth = np.radians((beam - (session["scanner"]["beams"] - 1) / 2) * session["scanner"]["step_deg"])
    u = spherical(azimuth, 0)
    d = bare["distance_m"][beam - bare["first_beam"]] - 1e-3 * bare["mirror_thickness_mm"] / abs(u @ mirror)
    v = u - 2 * (u @ mirror) * mirror
    x = np.array([np.arctan2(v[1], v[0]), np.arcsin(v[2])])  # azimuth in the sensor frame, elevation
    mine = [b for b in boards if b[0] == facet and b[1][0] <= beam <= b[1][1] and b[5][beam] > 0]
    if len(mine) < 3:
        return fail("too_few_poses", f"{len(mine)} boards, 3 are needed")
    for _ in range(20):
        v = spherical(*x)
        dv = np.stack([spherical(x[0] + np.pi / 2, 0) * np.cos(x[1]), spherical(x[0], x[1] + np.pi / 2)], axis=1)
        rows, rest, variance = [], [], []
        for _, _, center, normal, mean, count in mine:
            closing = normal @ v
            s = normal @ (center - d * u) / closing
            table = believed["bias"]["distance"]  # an empty one means no error
            e_r = np.interp(mean[beam], table["range_m"] or [1], table["error_mm"] or [0])
            e_a = believed["bias"]["angle"]["gain_mm"] * abs(closing) + believed["bias"]["angle"]["offset_mm"]
            rest.append(mean[beam] - 1e-3 * (e_r + e_a) - d - s)
            rows.append(-s / closing * (normal @ dv))
            variance.append((believed["range_noise_sd_mm"] ** 2 / count[beam] + believed["drift_sd_mm"] ** 2) * 1e-6)
        h, rest = np.array(rows), np.array(rest)
        if np.linalg.svd(h, compute_uv=False)[-1] < 0.03:  # a millimetre is 2° there
            return fail("unobservable", "the boards are tilted along one direction, or face-on")
        step = np.linalg.lstsq(h, rest, rcond=None)[0]
        x = x + np.clip(step, -0.2, 0.2)
    rms = np.sqrt(np.mean(rest**2))
    if not np.abs(step).max() < 1e-9 or rms > 0.015:
        return fail("rejected", f"residuals of {1e3 * rms:.1f} mm over {len(mine)} boards")
    gain = np.linalg.pinv(h)
    tilt = np.radians(max(session["mount_tolerance"]["rotation_sd_deg"])) ** 2
    covariance = gain @ np.diag(variance) @ gain.T + tilt * np.diag([1 / np.cos(x[1]) ** 2, 1])
    relative = (x[0] - azimuth + np.pi) % (2 * np.pi) - np.pi  # azimuth_rad is counted from the bare beam
    return {"beam": beam, "status": "solved", "facet": facet, "azimuth_rad": relative, "elevation_rad": x[1],
            "distance_m": d, "covariance_rad2": covariance.tolist(), "poses": len(mine), "rms_residual_m": rms}

beams = {}
for facet in session["facets"]:
    first, last = facet["beams"]
    corners = np.array(facet["corners_mm"])
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    for beam in range(max(first - 12, 0), min(last + 13, session["scanner"]["beams"])):
        if first <= beam <= last:
            beams[beam] = solve(beam, facet["name"], normal / np.linalg.norm(normal))
        else:  # mirrors stand a degree or two off the drawing, so beams beside it may be deflected
            beams.setdefault(beam, {"beam": beam, "status": "rejected", "reason": "beside a mirror as drawn"})
everything = [beams.get(b, {"beam": b, "status": "direct"}) for b in range(session["scanner"]["beams"])]
out.write_text(json.dumps({"schema_version": 1, "method": "own", "frame": "sensor", "beams": everything}))
