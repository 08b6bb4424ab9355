"""What every scene goes through: the verbs with few scans, seeds and layouts, and the runs of them."""

import json
import math
import os
import re
import struct
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent

# Four scenes that between them have every kind of output: two mirrors, parameters to optimize, a moving sensor among
# meshes and echoes, and the bare sensor that is characterized.
QUICK = ["two-mirror", "prototype-parametric", "flight-through-a-duct", "ust-20lx-cooper"]
# Scenes whose simulation also writes the logs of returns, readings and sub-rays, which are large.
LOGGED = ["two-mirror", "two-echoes", "flight-through-a-duct", "tiers/t4-outliers", "traps/hole"]
METHODS = ["joint", "facet", "beam-gls", "beam", "recursive", "closed-form", "prior"]
RAYS = 300
TIMEOUT_S = 900


def scene_names():
    """Every scene that is shipped, by its path below scenes/."""
    folder = ROOT / "scenes"
    return sorted(str(p.relative_to(folder).with_suffix("")) for p in folder.rglob("*.toml"))


def steps(scene):
    """The verbs that a scene goes through, in order: name, arguments. A name that ends in .json says that standard
    output is JSON and kept under that name."""
    path = ROOT / "scenes" / f"{scene}.toml"
    text = path.read_text(encoding="utf-8")
    path = str(path)
    # A scene without a scanner only traces rays, and has nothing to be set.
    few = lambda *sets: [w for s in sets for w in ("--set", s)] if re.search(r"^\[scanner\]", text, re.M) else []
    scans = few("experiment.scans_per_pose=3")
    yield "check", ["check", path]
    yield "simulate.json", ["simulate", path, "--out", "data", "--json", *scans]
    yield "trace-csv.json", ["trace", path, "--rays", "../rays.csv", "--out", "paths.csv", "--json"]
    yield "trace-npy.json", ["trace", path, "--rays", "../rays.npy", "--out", "paths.npy", "--json"]
    if scene in LOGGED:
        once = few("experiment.scans_per_pose=1", "experiment.room_scans=1", "scanner.sub_rays=7")
        logs = ["--returns", "--readings", "--sub-rays"]
        yield "simulate-logs", ["simulate", path, "--out", "logs", "--seed", "5", *logs, *once]
        yield "simulate-blind", ["simulate", path, "--out", "blind", "--blind", *once]
    yield "characterize.json", ["characterize", "data", "--out", "characterization.json", "--json"]
    for method in METHODS:
        out = f"calibration-{method}.json"
        yield f"calibrate-{method}", ["calibrate", "data", "--method", method, "--out", out]
        yield f"validate-{method}", ["validate", out]
        yield f"score-{method}.json", ["score", "data", out, "--json"]
    checked = ["--cross-validate", "--jacobian", "central"]
    yield "calibrate-checked", ["calibrate", "data", *checked, "--out", "calibration-checked.json"]
    known = ["--characterization", "characterization.json"]
    yield "calibrate-known", ["calibrate", "data", "--method", "beam", *known, "--out", "calibration-known.json"]
    yield "score-limit", ["score", "data", "calibration-joint.json", "--max-rms-deg", "0.01"]
    if scene in LOGGED:
        yield "calibrate-blind", ["calibrate", "blind", "--out", "calibration-blind.json"]
        yield "score-blind.json", ["score", "blind", "calibration-blind.json", "--json"]
    both = ["calibration-joint.json", "calibration-beam.json"]
    yield "compare.json", ["compare", "data", *both, "--json"]
    yield "report", ["report", "data", *both, "--out", "report.html"]
    for frame, end in [("sensor", "ply"), ("rig", "pcd"), ("room", "ply")]:
        yield f"apply-{frame}", ["apply", "data", both[0], "--frame", frame, "--out", f"cloud-{frame}.{end}"]
    yield "apply-pose", ["apply", "data", both[0], "--pose", "1", "--out", "cloud-pose.ply"]
    yield "layout.json", ["layout", path, "--json", "--out", "layout"]
    yield "layout-built.json", ["layout", path, "--json", "--coarse", "--as-built", "--seed", "3"]
    for part in ["mirrors", "frame", "all"]:
        yield f"export-{part}", ["export", path, "--format", "stl", "--part", part, "--out", f"{part}.stl"]
    for kind in ["glb", "csv", "urdf"]:
        yield f"export-{kind}", ["export", path, "--format", kind, "--out", f"drawn.{kind}"]
        built = ["--as-built", "--seed", "3", "--out", f"built.{kind}"]
        yield f"export-built-{kind}", ["export", path, "--format", kind, *built]
    yield "export-data", ["export", "data", "--format", "csv", "--out", "readings.csv"]
    twice = few("experiment.scans_per_pose=2")
    study = ["--seeds", "2", "--methods", "joint,beam,oracle", "--uncorrected", "--elements"]
    yield "study.json", ["study", path, *study, "--out", "study", "--json", *twice]
    goals = ["--goal", "field_of_regard", "--goal", "size"]
    yield "optimize.json", ["optimize", path, *goals, "--evaluations", "30", "--coarse", "--out", "best", "--json"]
    drawn = ["--draws", "3", "--bounds", "1", "--calibrate", "1", "--out", "tolerance"]
    yield "tolerance.json", ["tolerance", path, *drawn, "--json", *twice]
    plan = ["--poses", "1", "--out", "planned.toml", "--report", "plan.html", "--json"]
    yield "plan.json", ["plan", path, *plan, *twice]
    if scene in LOGGED:
        yield "plan-data.json", ["plan", "data", "--poses", "1", "--criterion", "a", "--json"]


# What does not depend on a scene.
GENERAL = [
    ("schema.json", ["schema"]),
    *((f"new-{layout}", ["new", f"{layout}.toml", "--layout", layout])
      for layout in ["prototype", "two-mirror", "pyramid", "altimeter"]),
]


def write_rays(folder):
    """Rays from around the place of the rig into all directions, as CSV and as NumPy's array."""
    golden = math.pi * (3 - math.sqrt(5))
    rays = []
    for k in range(RAYS):
        up = 1 - (2 * k + 1) / RAYS
        flat = math.sqrt(1 - up * up)
        direction = [flat * math.cos(golden * k), flat * math.sin(golden * k), up]
        rays.append([0.3 * math.sin(k), 0.3 * math.cos(3 * k), 1.2 + 0.5 * math.sin(2 * k), *direction])
    lines = ["x_m,y_m,z_m,dx,dy,dz", *(",".join(map(repr, ray)) for ray in rays)]
    (folder / "rays.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({RAYS}, 6), }}"
    header = (header + " " * (-(len(header) + 11) % 64) + "\n").encode()
    values = struct.pack(f"<{6 * RAYS}d", *(x for ray in rays for x in ray))
    (folder / "rays.npy").write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + values)


def run_steps(program, named_steps, folder):
    """Runs every step in a folder, and leaves the exit codes beside what it wrote."""
    folder.mkdir(parents=True)
    codes = {}
    environment = {**os.environ, "NO_COLOR": "1"}
    for name, arguments in named_steps:
        command = [str(program), "--threads", "1", "--quiet", *arguments]
        done = subprocess.run(
            command, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, timeout=TIMEOUT_S, env=environment
        )
        codes[name] = done.returncode
        if done.returncode not in (0, 1, 2, 3):
            print(f"{name}: ended with {done.returncode}: {done.stderr.decode(errors='replace')[-400:]}", file=sys.stderr)
        if name.endswith(".json") and done.stdout:
            printed = folder / "printed"
            printed.mkdir(exist_ok=True)
            (printed / name).write_bytes(done.stdout)
    (folder / "exit-codes.json").write_text(json.dumps(codes), encoding="utf-8")
