#!/usr/bin/env python3
"""Casts the same rays into the same meshes with this project and with other engines, and prints the ratios.

    benches/peers/compare.py                              # all sizes and engines, several minutes
    benches/peers/compare.py --meshes lab,10k --rounds 1  # a quick comparison
    benches/peers/compare.py --simulate --meshes 10k,1m   # the whole simulator in those rooms, files included

Needs cargo and NumPy. Embree is measured if g++ and Debian's `libembree-dev` are installed, Open3D and Mitsuba if the
PyPI packages `open3d` and `mitsuba` are; missing engines are named and skipped. Engines alternate round by round, so a
temporary slowdown of the machine affects all of them; compare ratios, not rates from different days. The distances of
every engine are compared with those of parry in f64.
"""

import argparse
import importlib.util
import json
import os
import resource
import statistics
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOM = (11.0, 9.0, 3.2)
BEAMS, SUB_RAYS, POSES = 1081, 16, 48
SIZES = {"lab": 40, "10k": 10_000, "100k": 100_000, "1m": 1_000_000, "5m": 5_000_000}
OURS = ["beam128", "beam16", "single", "polygons128", "polygons16"]
PEERS = ["embree16", "embree1", "open3d", "mitsuba", "parry"]


# ---- inputs: a cluttered room with the same objects at every size ----------------------------------------------------


def patch(np, corner, along, up, columns, rows):
    """A parallelogram as a grid of triangles."""
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1), indexing="ij")
    points = np.asarray(corner) + u[..., None] * np.asarray(along) + v[..., None] * np.asarray(up)
    number = np.arange(u.size).reshape(u.shape)
    a, b, c, d = (x.ravel() for x in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return points.reshape(-1, 3), np.concatenate([np.stack(t, 1) for t in ((a, b, c), (a, c, d))])


def turn(np, draw):
    """A random rotation."""
    q, r = np.linalg.qr(draw.normal(size=(3, 3)))
    return q * np.sign(np.diag(r))


def cube(np, n, bend=None):
    """Six grids over a cube of side 2; `bend` moves their points."""
    out = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            normal, along = side * np.eye(3)[axis], np.eye(3)[(axis + 1) % 3]
            up = np.cross(normal, along)
            points, triangles = patch(np, normal - along - up, 2 * along, 2 * up, n, n)
            out.append((points if bend is None else bend(points), triangles))
    return out


def room(np, triangles):
    draw = np.random.default_rng(11)
    x, y, z = np.diag(ROOM)
    parts = []
    if triangles < 100:
        # A laboratory: a room, boards and two mirrors.
        parts += [(p * np.array(ROOM) / 2 + np.array(ROOM) / 2, t) for p, t in cube(np, 1)]
        for k in range(12):
            around = 2 * np.pi * k / 12
            middle = np.array(ROOM) / 2 + [3.8 * np.cos(around), 3.0 * np.sin(around), draw.uniform(-0.5, 0.5)]
            frame = turn(np, draw)
            parts.append(patch(np, middle - 0.5 * (frame[0] + frame[1]), frame[0], frame[1], 1, 1))
        for side in (-1, 1):
            parts.append(patch(np, np.array(ROOM) / 2 + [0.8, 0.4 * side, -0.1], [0.1, 0, 0.1], [0, 0.2 * side, 0], 1, 1))
    else:
        n = max(2, int((triangles * 0.15 / 2) ** 0.5))
        points, net = patch(np, 0 * x, x, y, n, n)
        points[:, 2] += 0.05 * np.sin(1.7 * points[:, 0] + 0.4) * np.cos(2.3 * points[:, 1]) + 0.003 * draw.normal(size=len(points))
        parts.append((points, net))
        n = max(1, int((triangles * 0.25 / 10) ** 0.5))
        for corner, along, up in ((0 * x, x, z), (y, x, z), (0 * x, y, z), (x, y, z), (z, x, y)):
            parts.append(patch(np, corner, along, up, n, n))
        n = max(1, int((triangles * 0.6 / 12 / 100) ** 0.5))
        for k in range(100):
            size, middle, frame = draw.uniform(0.06, 0.45, 3), draw.uniform([0.5, 0.5, 0.1], [10.5, 8.5, 2.6]), turn(np, draw)
            waves, phase = draw.uniform(2, 6, 3), draw.uniform(0, 6, 3)

            def ball(p, waves=waves, phase=phase):
                p = p / np.linalg.norm(p, axis=1, keepdims=True)
                return p * (1 + 0.08 * np.sin(p * waves + phase).sum(1, keepdims=True))

            parts += [(p * size @ frame + middle, t) for p, t in cube(np, n, ball if k % 2 else None)]
    first, vertices, faces = 0, [], []
    for points, net in parts:
        vertices.append(points)
        faces.append(net + first)
        first += len(points)
    return np.concatenate(vertices).astype("<f4"), np.concatenate(faces).astype("<u4")


def rays(np):
    """A scanner in many poses: beams in order, each an even spiral of sub-rays over 20 × 2 mrad; and random rays."""
    draw = np.random.default_rng(12)
    k = np.arange(SUB_RAYS)
    radius, around = np.sqrt((k + 0.5) / SUB_RAYS), k * np.pi * (3 - 5**0.5)
    azimuth = np.linspace(-0.75, 0.75, BEAMS)[:, None] * np.pi + 0.010 * radius * np.cos(around)
    height = np.broadcast_to(0.001 * radius * np.sin(around), azimuth.shape)
    plane = np.stack([np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)], -1).reshape(-1, 3)
    scan = []
    for _ in range(POSES):
        origin = np.broadcast_to(draw.uniform([1.5, 1.5, 0.7], [9.5, 7.5, 2.3]), plane.shape)
        scan.append(np.hstack([origin, plane @ turn(np, draw)]))
    direction = draw.normal(size=(1 << 19, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    anywhere = np.hstack([draw.uniform([0.3] * 3, np.array(ROOM) - 0.3, direction.shape), direction])
    return {"scan": np.concatenate(scan).astype("<f4"), "random": anywhere.astype("<f4")}


def make_inputs(np, folder, meshes):
    for name in meshes:
        if not (folder / f"{name}.triangles.u32").exists():
            vertices, triangles = room(np, SIZES[name])
            vertices.tofile(folder / f"{name}.vertices.f32")
            triangles.tofile(folder / f"{name}.triangles.u32")
            print(f"{name}: {len(triangles)} triangles", file=sys.stderr)
    for name, all_rays in rays(np).items():
        all_rays.tofile(folder / f"{name}.rays.f32")


# ---- peers from PyPI, each in its own process -----------------------------------------------------------------------


def python_peer(folder, mesh, engine, rays_name, threads, seconds):
    import numpy as np

    vertices = np.fromfile(folder / f"{mesh}.vertices.f32", "<f4").reshape(-1, 3)
    triangles = np.fromfile(folder / f"{mesh}.triangles.u32", "<u4").reshape(-1, 3)
    all_rays = np.fromfile(folder / f"{rays_name}.rays.f32", "<f4").reshape(-1, 6)
    start = time.perf_counter()
    if engine == "open3d":
        import open3d

        scene = open3d.t.geometry.RaycastingScene(nthreads=threads)
        scene.add_triangles(open3d.core.Tensor(vertices), open3d.core.Tensor(triangles))
        tensor = open3d.core.Tensor(all_rays)

        def cast():
            return scene.cast_rays(tensor, nthreads=threads)["t_hit"].numpy()
    else:
        import drjit
        import mitsuba

        mitsuba.set_variant("llvm_ad_rgb")
        drjit.set_thread_count(threads)
        shape = mitsuba.Mesh("mesh", len(vertices), len(triangles))
        parameters = mitsuba.traverse(shape)
        parameters["vertex_positions"], parameters["faces"] = vertices.ravel(), triangles.ravel()
        parameters.update()
        scene = mitsuba.load_dict({"type": "scene", "mesh": shape})
        columns = [mitsuba.Float(np.ascontiguousarray(all_rays[:, i])) for i in range(6)]
        ray = mitsuba.Ray3f(mitsuba.Point3f(*columns[:3]), mitsuba.Vector3f(*columns[3:]))

        def cast():
            found = scene.ray_intersect_preliminary(ray, coherent=rays_name == "scan").t
            drjit.eval(found)
            drjit.sync_thread()
            return found.numpy()

    build = time.perf_counter() - start
    cast()
    times = []
    while sum(times) < seconds or len(times) < 2:
        start = time.perf_counter()
        distance = cast()
        times.append(time.perf_counter() - start)
    np.asarray(distance, "<f8").tofile(folder / f"{engine}.{mesh}.{rays_name}.f64")
    print(json.dumps({"mrays": len(all_rays) / statistics.median(times) / 1e6, "build_s": build}))


# ---- the whole simulator: a flying scanner, every pulse traced, detected and written -----------------------------------

SCENE = """
schema_version = 1
name = "room-of-{mesh}"

[scanner]
preset = "ust-20lx"
sub_rays = 19
beam = {{ wide_full_mrad = 10, narrow_full_mrad = 10, wide_aperture_mm = 5, narrow_aperture_mm = 5 }}

[superstructure]
marker = [
    {{ name = "a", position_mm = [100, 0, 0] }},
    {{ name = "b", position_mm = [0, 120, 10] }},
    {{ name = "c", position_mm = [-90, -30, 40] }},
]

[[room.surface]]
name = "room"
shape.mesh = {{ file = "{mesh}.ply", units = "m" }}

[[flight]]
name = "across"
waypoint = [
    {{ time_s = 0, position_m = [5.0, 4.2, 1.4] }},
    {{ time_s = {seconds}, position_m = [6.0, 4.8, 1.8], yaw_deg = 170, pitch_deg = 25, roll_deg = 30 }},
]
"""
# Durations of the flights in seconds. Time that the shorter one takes too, mainly reading and indexing, is subtracted.
FLIGHTS = (1, 9)
SCANS_PER_S = 40


def write_ply(np, folder, mesh):
    vertices = np.fromfile(folder / f"{mesh}.vertices.f32", "<f4").reshape(-1, 3)
    triangles = np.fromfile(folder / f"{mesh}.triangles.u32", "<u4").reshape(-1, 3)
    rows = np.empty(len(triangles), [("count", "u1"), ("corners", "<u4", 3)])
    rows["count"], rows["corners"] = 3, triangles
    header = f"""ply
format binary_little_endian 1.0
element vertex {len(vertices)}
property float x
property float y
property float z
element face {len(triangles)}
property list uchar uint vertex_indices
end_header
"""
    with open(folder / f"{mesh}.ply", "wb") as file:
        file.write(header.encode())
        vertices.tofile(file)
        rows.tofile(file)


def clock(threads):
    """Processor time on one thread, which other load on the machine hardly changes; otherwise elapsed time."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return children.ru_utime + children.ru_stime if threads == 1 else time.perf_counter()


def simulate(np, folder, arguments):
    program = arguments.program
    if not program:
        subprocess.run(["cargo", "build", "--release"], cwd=HERE, check=True)
        program = HERE.parent.parent / "target" / "release" / "catoptric"
    print(f"\nthe whole simulator, 19 sub-rays per pulse, {arguments.threads} thread(s)\n")
    print("| mesh | files | k pulses/s | M sub-rays/s | start, s |")
    print("|---|---|---|---|---|")
    for mesh in arguments.meshes.split(","):
        write_ply(np, folder, mesh)
        for files, more in (("recording", []), ("and every return as text", ["--returns"])):
            rates, starts = [], []
            for _ in range(arguments.rounds):
                times = []
                for seconds in FLIGHTS:
                    (folder / f"{mesh}.toml").write_text(SCENE.format(mesh=mesh, seconds=seconds))
                    command = [str(program), "simulate", str(folder / f"{mesh}.toml"), "--out", str(folder / "data"), "--replace"]
                    begin = clock(arguments.threads)
                    done = subprocess.run([*command, "--threads", str(arguments.threads), *more], capture_output=True, text=True)
                    times.append(clock(arguments.threads) - begin)
                    if done.returncode:
                        sys.exit(f"simulate on {mesh}: {done.stderr[-600:]}")
                per_s = (times[1] - times[0]) / (FLIGHTS[1] - FLIGHTS[0])
                rates.append(SCANS_PER_S * BEAMS / per_s)
                starts.append(times[0] - per_s * FLIGHTS[0])
            rate = statistics.median(rates)
            print(f"| {mesh} | {files} | {rate / 1e3:.0f} | {19 * rate / 1e6:.1f} | {statistics.median(starts):.2f} |", flush=True)


# ---- running ---------------------------------------------------------------------------------------------------------


def build_ours():
    command = ["cargo", "bench", "--bench", "peers", "--no-run", "--message-format=json"]
    lines = subprocess.run(command, cwd=HERE, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    built = [json.loads(line) for line in lines if line.startswith("{")]
    return [m["executable"] for m in built if m.get("target", {}).get("name") == "peers" and m.get("executable")][-1]


def build_embree(folder):
    program = folder / "embree"
    command = ["g++", "-O3", "-march=native", "-std=c++17", str(HERE / "embree.cpp"), "-o", str(program), "-lembree3", "-lpthread"]
    try:
        done = subprocess.run(command, capture_output=True, text=True).returncode == 0
    except FileNotFoundError:
        done = False
    return program if done else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=HERE.parent.parent / "target" / "peers", help="for inputs and results")
    parser.add_argument("--meshes", default="lab,10k,100k,1m", help=f"of {','.join(SIZES)}")
    parser.add_argument("--engines", default=",".join(OURS + PEERS))
    parser.add_argument("--rays", default="scan,random")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=1.0, help="per engine and round")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--simulate", action="store_true", help="measure the whole simulator instead")
    parser.add_argument("--program", type=Path, help="for --simulate: a catoptric other than that of this tree")
    parser.add_argument("--peer", nargs=3, metavar=("MESH", "ENGINE", "RAYS"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.peer:
        mesh, engine, rays_name = arguments.peer
        return python_peer(arguments.folder, mesh, engine, rays_name, arguments.threads, arguments.seconds)
    import numpy as np

    folder = arguments.folder
    folder.mkdir(parents=True, exist_ok=True)
    meshes, engines = arguments.meshes.split(","), arguments.engines.split(",")
    make_inputs(np, folder, meshes)
    if arguments.simulate:
        return simulate(np, folder, arguments)
    ours, embree = build_ours(), build_embree(folder)
    there = {
        "embree16": embree,
        "embree1": embree,
        "open3d": importlib.util.find_spec("open3d"),
        "mitsuba": importlib.util.find_spec("mitsuba"),
    }
    for engine in [e for e in engines if not there.get(e, True)]:
        print(f"{engine}: not installed, skipped", file=sys.stderr)
        engines.remove(engine)

    def run(mesh, engine, rays_name):
        common = [str(folder), mesh, engine, rays_name, str(arguments.threads), str(arguments.seconds)]
        if engine.startswith("embree"):
            command = [str(embree), *common]
        elif engine in ("open3d", "mitsuba"):
            command = [sys.executable, __file__, "--folder", str(folder), "--peer", mesh, engine, rays_name]
            command += ["--threads", str(arguments.threads), "--seconds", str(arguments.seconds)]
        else:
            command = [ours, *common]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{engine} on {mesh}: {done.stderr[-600:]}")
        return json.loads(done.stdout.splitlines()[-1])

    for rays_name in arguments.rays.split(","):
        for mesh in meshes:
            # Triangles as polygons are only for the laboratory.
            taking_part = [e for e in engines if not e.startswith("polygons") or mesh == "lab"]
            results = {engine: [] for engine in taking_part}
            for _ in range(arguments.rounds):
                for engine in taking_part:
                    results[engine].append(run(mesh, engine, rays_name))
            judge = "parry" if "parry" in taking_part else taking_part[0]
            read = lambda e: np.fromfile(folder / f"{e}.{mesh}.{rays_name}.f64")  # noqa: E731
            expected = read(judge)
            base = taking_part[0]
            print(f"\n{mesh}, {rays_name} rays, {arguments.threads} thread(s)\n")
            print(f"| engine | M rays/s | {base} is … times as fast | build, s | > 1 mm from {judge} | largest other difference |")
            print("|---|---|---|---|---|---|")
            for engine, found in results.items():
                ratios = [a["mrays"] / b["mrays"] for a, b in zip(results[base], found)]
                distance = read(engine)
                with np.errstate(invalid="ignore"):
                    off = np.where(np.isinf(distance) & np.isinf(expected), 0.0, np.abs(distance - expected))
                far = ~(off <= 1e-3)
                print(
                    f"| {engine} | {statistics.median(f['mrays'] for f in found):.2f} | {statistics.median(ratios):.2f} "
                    f"| {found[0]['build_s']:.3f} | {far.sum()} of {len(off)} | {off[~far].max():.1e} m |",
                    flush=True,
                )


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
