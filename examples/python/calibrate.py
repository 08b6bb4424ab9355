"""A complete custom calibrator: python calibrate.py DATASET calibration.json, with catoptric on the PATH."""
import hashlib, json, os, subprocess, sys, tomllib
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

folder, out = sys.argv[1:]
program = os.getenv("CATOPTRIC", "catoptric")
subprocess.run([program, "export", folder, "--format", "csv", "--out", out + ".csv"], check=True)
rows = np.genfromtxt(out + ".csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
session = tomllib.load(open(folder + "/session.toml", "rb"))
believed, bare, drawn = session["believed"], session["bare_structure"], session["nominal_rig_from_sensor"]
loose, scanner = session["mount_tolerance"], session["scanner"]
around = scanner["beams"] if scanner["beams"] * scanner["step_deg"] > 359 else 1 << 20  # beams after which the scan closes
white, drift, marker = (max(1e-3 * believed[k + "_sd_mm"], 1e-5) for k in ("range_noise", "drift", "marker"))
rows = rows[rows["sd_m"] < 2.5 * white + 1e-3]  # the others alternate between two surfaces
noise = lambda r: np.hypot(white / np.sqrt(r["readings"]), 3e-4)  # of a mean of whole millimeters
ray = lambda a, e: np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e) + 0 * a], -1)
runs = [f["beams"] for f in session["facets"]]
served = {(first + k) % around for first, last in runs for k in range((last - first) % around + 1)}
beside = {(b + k) % around for b in served for k in range(-12, 13)}  # mirrors are off their drawing

def reading(r, mount, u, d, v):  # of beams d along u and then along v, sensor shifted and rotated by `mount`; |cos|
    turn = Rotation.from_quat(drawn["rotation_xyzw"])
    back, at = (turn * Rotation.from_rotvec(mount[3:])).inv(), drawn["translation_m"] + turn.apply(mount[:3])
    center = back.apply(np.stack([r[f"rig_center_{k}_m"] for k in "xyz"], -1) - at) - d * u
    normal = back.apply(np.stack([r[f"rig_normal_{k}"] for k in "xyz"], -1))
    toward, closing, bias = (normal * center).sum(-1), (normal * v).sum(-1), believed["bias"]
    path = d + toward / closing
    e_r = np.interp(path, bias["distance"]["range_m"] or [1], bias["distance"]["error_mm"] or [0])
    e_a = bias["angle"]["gain_mm"] * abs(closing) + bias["angle"]["offset_mm"]
    return path + 1e-3 * (e_r + e_a), normal / toward[:, None], abs(closing)

# The mounting, from undeflected beams on boards, each board with its own drift.
near = rows[(rows["inside_edge_m"] > 0.05) & ~np.isin(rows["beam"], list(beside))]
u, pose = ray(near["azimuth_rad"], 0), np.unique(near["pose"], return_inverse=True)[1]
sd = np.array([*(1e-3 * np.array(loose["translation_sd_mm"])), *np.radians(loose["rotation_sd_deg"]),
               *np.full(pose.max() + 1, np.hypot(drift, marker))])
rest = lambda x: (near["mean_m"] - reading(near, sd[:6] * x[:6], u, 0, u)[0] - (sd[6:] * x[6:])[pose]) / noise(near)
fit = least_squares(lambda x: np.append(rest(x), x), np.zeros(len(sd)), loss="soft_l1")
mount, mount_covariance = sd[:6] * fit.x[:6], (np.linalg.inv(fit.jac.T @ fit.jac) * np.outer(sd, sd))[:6, :6]

def solve(beam):
    r = rows[(rows["kind"] == "facet") & (rows["beam"] == beam) & (rows["set_up_for"] == 1)]
    r = r[r["bare_distance_m"] > 0]
    if len(r) < 3:
        return {"status": "too_few_poses", "reason": f"{len(r)} boards, 3 are needed"}
    base, deep, u = r["azimuth_rad"][0], r["bare_distance_m"][0], ray(r["azimuth_rad"][0], 0)
    depth = lambda v: deep - 1e-3 * bare["mirror_thickness_mm"] / np.sqrt((1 - u @ v) / 2)  # the normal bisects −u and v
    rest = lambda x, m=mount, e=0: r["mean_m"] - reading(r, m, u, depth(ray(*x)) + e, ray(*x))[0]
    v = np.linalg.lstsq(reading(r, mount, u, deep, u)[1], 1 / (r["mean_m"] - deep), rcond=None)[0]  # 1/s is linear in v
    x = np.array([np.arctan2(v[1], v[0]), np.arctan2(v[2], np.hypot(v[0], v[1]))])
    shared = [np.full(len(r), 1e-3 * believed["distance_bias_sd_mm"]),  # 1σ of the errors that a beam's boards share
              1e-3 * believed["angle_gain_sd_mm"] * (1 - reading(r, mount, u, deep, ray(*x))[2]),
              rest(x, e=1e-3 * bare["distance_sd_mm"]) - rest(x)]
    whole = np.diag(noise(r) ** 2 + drift**2 + marker**2) + sum(np.outer(s, s) for s in shared)
    weight = np.linalg.inv(np.linalg.cholesky(whole))
    fit = least_squares(lambda x: weight @ rest(x), x, max_nfev=50)
    x, rms, gain = fit.x, np.sqrt(np.mean(rest(fit.x) ** 2)), np.linalg.pinv(fit.jac) @ weight
    if np.linalg.svd(fit.jac / [np.cos(x[1]), 1], compute_uv=False)[-1] < 1 / np.radians(0.5):
        return {"status": "unobservable", "reason": "the boards leave a direction open by more than half a degree"}
    if rms > 0.01 or not fit.success:
        return {"status": "rejected", "reason": f"residuals of {1e3 * rms:.0f} mm over {len(r)} boards"}
    moved = gain @ np.stack([rest(x, mount + h) - rest(x) for h in 1e-6 * np.eye(6)], -1) * 1e6
    covariance = gain @ whole @ gain.T + moved @ mount_covariance @ moved.T
    return {"status": "solved", "azimuth_rad": (x[0] - base + np.pi) % (2 * np.pi) - np.pi, "elevation_rad": x[1],
            "distance_m": depth(ray(*x)), "covariance_rad2": covariance.tolist(), "poses": len(r)}

unsure, direct = {"status": "rejected", "reason": "next to a mirror as drawn"}, {"status": "direct"}
beams = [{"beam": b, **(solve(b) if b in served else unsure if b in beside else direct)}
         for b in range(scanner["beams"])]
made_of = {"scanner": {k: scanner[k] for k in ("first_deg", "step_deg", "beams", "direction")},
           "dataset": hashlib.sha256(open(folder + "/observations.mcap", "rb").read()).hexdigest()}
json.dump({"schema_version": 2, "method": "own", "frame": "sensor", **made_of, "beams": beams}, open(out, "w"))
