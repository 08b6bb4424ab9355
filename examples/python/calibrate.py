"""A whole calibrator of one's own: python calibrate.py DATASET calibration.json, with catoptric on the PATH."""
import json, os, subprocess, sys, tomllib
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

folder, out = sys.argv[1:]
program = os.getenv("CATOPTRIC", "catoptric")
subprocess.run([program, "export", folder, "--format", "csv", "--out", out + ".csv"], check=True)
rows = np.genfromtxt(out + ".csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
session = tomllib.load(open(folder + "/session.toml", "rb"))
believed, bare, drawn, loose = (session[k] for k in ("believed", "bare_structure", "nominal_rig_from_sensor", "mount_tolerance"))
white, drift, marker = (max(1e-3 * believed[k + "_sd_mm"], 1e-5) for k in ("range_noise", "drift", "marker"))
served = {b for f in session["facets"] for b in range(f["beams"][0], f["beams"][1] + 1)}
beside = {b + k for b in served for k in range(-12, 13)}
rows = rows[rows["sd_m"] < 2.5 * white + 1e-3]  # the others read two surfaces in turn
noise = lambda r: np.hypot(white / np.sqrt(r["readings"]), 3e-4)  # of a mean, in whole millimetres
dot = lambda a, b: (a * b).sum(-1)
xyz = lambda r, name: np.stack([r[name.replace("*", axis)] for axis in "xyz"], -1)
ray = lambda a, e: np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e) + 0 * a], -1)

def board(r, mount):  # in a sensor that is shifted and turned by `mount` from where it is drawn: centers, normals
    turn = Rotation.from_quat(drawn["rotation_xyzw"])
    back = (turn * Rotation.from_rotvec(mount[3:])).inv()
    at = drawn["translation_m"] + turn.apply(mount[:3])
    return back.apply(xyz(r, "rig_center_*_m") - at), back.apply(xyz(r, "rig_normal_*"))

def reading(r, mount, u, d, v):  # of beams that go d along u, then along v; and |cos| of their incidence
    center, normal = board(r, mount)
    path, cosine = d + dot(normal, center - d * u) / dot(normal, v), abs(dot(normal, v))
    by_range, by_angle = believed["bias"]["distance"], believed["bias"]["angle"]
    e_r = np.interp(path, by_range["range_m"] or [1], by_range["error_mm"] or [0])
    return path + 1e-3 * (e_r + by_angle["gain_mm"] * cosine + by_angle["offset_mm"]), cosine

# Where the sensor sits: boards before undeflected beams, each with a drift of its own.
r = rows[(rows["kind"] == "direct") & ~np.isin(rows["beam"], list(beside))]
u, center, normal, along = ray(r["azimuth_rad"], 0), *(xyz(r, "drawn_" + k) for k in ("center_*_m", "normal_*", "along_*"))
hit = u * (dot(normal, center) / dot(normal, u))[:, None] - center
half = np.array([[5e-4 * b["width_mm"], 5e-4 * b["height_mm"]] for n in r["board"] for b in session["boards"] if b["name"] == n])
on_it = (abs(np.stack([dot(hit, along), dot(hit, np.cross(normal, along))], -1)) < half - 0.05).all(-1) & (dot(hit + center, u) > 0)
r, u = r[on_it], u[on_it]
_, pose = np.unique(r["pose"], return_inverse=True)
sd = np.concatenate([1e-3 * np.array(loose["translation_sd_mm"]), np.radians(loose["rotation_sd_deg"]), np.full(pose.max() + 1, np.hypot(drift, marker))])
rest = lambda x: (r["mean_m"] - reading(r, sd[:6] * x[:6], u, 0, u)[0] - (sd[6:] * x[6:])[pose]) / noise(r)
fit = least_squares(lambda x: np.concatenate([rest(x), x]), np.zeros(len(sd)), loss="soft_l1", max_nfev=50)
mount, mount_covariance = sd[:6] * fit.x[:6], (np.linalg.inv(fit.jac.T @ fit.jac) * np.outer(sd, sd))[:6, :6]

def solve(beam, fail=lambda beam, status, reason: {"beam": beam, "status": status, "reason": reason}):
    r = rows[(rows["kind"] == "facet") & (rows["beam"] == beam)]
    r = r[(r["set_up_for"] == 1) & np.isfinite(r["bare_distance_m"])]
    if len(r) < 3:
        return fail(beam, "too_few_poses", f"{len(r)} boards, 3 are needed")
    base, deep = r["azimuth_rad"][0], r["bare_distance_m"][0]
    u, (center, normal) = ray(base, 0), board(r, mount)
    depth = lambda v: deep - 1e-3 * bare["mirror_thickness_mm"] / np.sqrt((1 - u @ v) / 2)  # a mirror halves u and v
    rest = lambda x, mount, e=0: r["mean_m"] - reading(r, mount, u, depth(ray(*x)) + e, ray(*x))[0]
    # Closed form: 1/s = (n / n·(c - d·u)) · v is linear in v.
    v = np.linalg.lstsq(normal / dot(normal, center - deep * u)[:, None], 1 / (r["mean_m"] - deep), rcond=None)[0]
    x = np.array([np.arctan2(v[1], v[0]), np.arctan2(v[2], np.hypot(v[0], v[1]))])
    shared = [1e-3 * np.full(len(r), believed["distance_bias_sd_mm"]),  # what all boards of a beam have in common
              1e-3 * believed["angle_gain_sd_mm"] * (1 - reading(r, mount, u, deep, ray(*x))[1]),
              rest(x, mount, 1e-3 * bare["distance_sd_mm"]) - rest(x, mount)]
    whole = np.diag(noise(r) ** 2 + drift**2 + marker**2) + sum(np.outer(s, s) for s in shared)
    weight = np.linalg.inv(np.linalg.cholesky(whole))
    fit = least_squares(lambda x: weight @ rest(x, mount), x, max_nfev=50)
    rms = np.sqrt(np.mean(rest(fit.x, mount) ** 2))
    if np.linalg.svd(fit.jac / [np.cos(fit.x[1]), 1], compute_uv=False)[-1] < 1 / np.radians(0.5):
        return fail(beam, "unobservable", "the boards leave a direction open by more than half a degree")
    if rms > 0.01 or not fit.success:
        return fail(beam, "rejected", f"residuals of {1e3 * rms:.0f} mm over {len(r)} boards")
    gain = np.linalg.pinv(fit.jac) @ weight
    moved = gain @ np.stack([rest(fit.x, mount + h) - rest(fit.x, mount) for h in 1e-6 * np.eye(6)], -1) * 1e6
    covariance = gain @ whole @ gain.T + moved @ mount_covariance @ moved.T
    return {"beam": beam, "status": "solved", "facet": str(r["facet"][0]), "distance_m": depth(ray(*fit.x)),
            "azimuth_rad": (fit.x[0] - base + np.pi) % (2 * np.pi) - np.pi, "elevation_rad": fit.x[1],
            "covariance_rad2": covariance.tolist(), "poses": len(r), "rms_residual_m": rms}

beams = [solve(b) if b in served else {"beam": b, "status": "rejected", "reason": "beside a mirror as drawn"}
         if b in beside else {"beam": b, "status": "direct"} for b in range(session["scanner"]["beams"])]
json.dump({"schema_version": 1, "method": "own", "frame": "sensor", "beams": beams}, open(out, "w"))
