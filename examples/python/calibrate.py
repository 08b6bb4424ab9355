"""A calibrator of one's own, whole: calibrate.py DATASET calibration.json. White boards; E_a by its law; see chapter 9."""
import json, os, subprocess, sys, tomllib
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

folder, out = sys.argv[1:]
subprocess.run([os.getenv("CATOPTRIC", "catoptric"), "export", folder, "--format", "csv", "--out", out + ".csv"], check=True)
rows = np.genfromtxt(out + ".csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
session = tomllib.load(open(folder + "/session.toml", "rb"))
believed, bare, drawn, bias = session["believed"], session["bare_structure"], session["nominal_rig_from_sensor"], session["believed"]["bias"]
white, drift, marker = (np.maximum(1e-3 * believed[f"{name}_sd_mm"], 1e-5) for name in ("range_noise", "drift", "marker"))
rows = rows[rows["sd_m"] < 2.5 * white + 1e-3]  # the others read two surfaces at once, or what passed by
noise = lambda r: np.hypot(white / np.sqrt(r["readings"]), 3e-4)  # of a mean; readings come in whole millimetres
ray = lambda azimuth, elevation: np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation) + 0 * azimuth], -1)
xyz = lambda r, name: np.stack([r[name.replace("*", axis)] for axis in "xyz"], -1)

def board(r, mount):  # centers and normals in a sensor moved by three shifts and three turns from where it is drawn
    turn = Rotation.from_quat(drawn["rotation_xyzw"])
    back = (turn * Rotation.from_rotvec(mount[3:])).inv()
    return back.apply(xyz(r, "rig_center_*_m") - drawn["translation_m"] - turn.apply(mount[:3])), back.apply(xyz(r, "rig_normal_*"))

def reading(r, mount, u, d, v):  # what beams read that go d along u and then along v, and |cos| of their incidence
    center, normal = board(r, mount)
    closing = (normal * v).sum(-1)
    path = d + (normal * (center - d * u)).sum(-1) / closing
    error = np.interp(path, bias["distance"]["range_m"] or [1], bias["distance"]["error_mm"] or [0])
    return path + 1e-3 * (error + bias["angle"]["gain_mm"] * abs(closing) + bias["angle"]["offset_mm"]), abs(closing)

# Where the sensor sits: boards before undeflected beams, each with a drift of its own; what stands out hardly counts.
direct, faced = rows[rows["kind"] == "direct"], rows[rows["kind"] == "facet"]
_, pose = np.unique(direct["pose"], return_inverse=True)
tolerance = session["mount_tolerance"]
sd = np.concatenate([1e-3 * np.array(tolerance["translation_sd_mm"]), np.radians(tolerance["rotation_sd_deg"]), np.full(pose.max() + 1, np.hypot(drift, marker))])
u = ray(direct["azimuth_rad"], 0)
seen = lambda x: (direct["mean_m"] - reading(direct, sd[:6] * x[:6], u, 0, u)[0] - (sd * x)[6:][pose]) / noise(direct)
placed = least_squares(lambda x: np.concatenate([seen(x), x]), np.zeros(len(sd)), loss="soft_l1")
mount, mount_covariance = sd[:6] * placed.x[:6], (np.linalg.inv(placed.jac.T @ placed.jac) * np.outer(sd, sd))[:6, :6]

def solve(beam):
    r = faced[faced["beam"] == beam]
    r = r[~np.isnan(r["bare_distance_m"])]
    if len(r) < 3:
        return {"beam": beam, "status": "too_few_poses", "reason": f"{len(r)} boards, 3 are needed"}
    u, deep = ray(r["azimuth_rad"][0], 0), r["bare_distance_m"][0]
    depth = lambda v: deep - 1e-3 * bare["mirror_thickness_mm"] / np.sqrt((1 - u @ v) / 2)  # the mirror halves u and v
    center, normal = board(r, mount)
    slope = normal / (normal * (center - deep * u)).sum(-1)[:, None]  # closed form: slope · v = 1/s
    v = np.linalg.lstsq(slope, 1 / (r["mean_m"] - deep), rcond=None)[0]
    x = np.array([np.arctan2(v[1], v[0]), np.arctan2(v[2], np.hypot(v[0], v[1]))])
    rest = lambda x, mount, e=0: r["mean_m"] - reading(r, mount, u, depth(ray(*x)) + e, ray(*x))[0]
    cosine = reading(r, mount, u, deep, ray(*x))[1]
    shared = [1e-3 * np.full(len(r), believed["distance_bias_sd_mm"]), 1e-3 * believed["angle_gain_sd_mm"] * (1 - cosine),
              rest(x, mount, 1e-3 * bare["distance_sd_mm"]) - rest(x, mount)]
    whole = np.diag(noise(r) ** 2 + drift**2 + marker**2) + sum(np.outer(s, s) for s in shared)
    weight = np.linalg.inv(np.linalg.cholesky(whole))
    fit = least_squares(lambda x: weight @ rest(x, mount), x, method="lm")
    x, sharp = fit.x, np.linalg.svd(fit.jac / [np.cos(fit.x[1]), 1], compute_uv=False)[-1]
    rms = np.sqrt(np.mean(rest(x, mount) ** 2))
    if sharp < 1 / np.radians(0.5):
        return {"beam": beam, "status": "unobservable", "reason": "the boards leave a direction open by more than half a degree"}
    if rms > 0.01:
        return {"beam": beam, "status": "rejected", "reason": f"residuals of {1e3 * rms:.0f} mm"}
    step = 1e-6 * np.eye(6)
    carried = np.linalg.pinv(fit.jac) @ weight @ np.stack([(rest(x, mount + h) - rest(x, mount)) / 1e-6 for h in step], -1)
    covariance = np.linalg.inv(fit.jac.T @ fit.jac) + carried @ mount_covariance @ carried.T
    relative = (x[0] - r["azimuth_rad"][0] + np.pi) % (2 * np.pi) - np.pi
    return {"beam": beam, "status": "solved", "facet": str(r["facet"][0]), "azimuth_rad": relative, "elevation_rad": x[1],
            "distance_m": depth(ray(*x)), "covariance_rad2": covariance.tolist(), "poses": len(r), "rms_residual_m": rms}

served = {b for f in session["facets"] for b in range(f["beams"][0], f["beams"][1] + 1)}
beside = {b + k for b in served for k in range(-12, 13)}
beams = [solve(b) if b in served else {"beam": b, "status": "rejected", "reason": "beside a mirror as drawn"} if b in beside
         else {"beam": b, "status": "direct"} for b in range(session["scanner"]["beams"])]
json.dump({"schema_version": 1, "method": "own", "frame": "sensor", "beams": beams}, open(out, "w"))
