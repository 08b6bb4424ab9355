"""Meshes of polygons as another reader takes them, and as the program does: the same rays must end at the same places.

    pip install -r tests/requirements.txt
    python tests/mesh_peers.py PROGRAM [--meshes 60] [--seed 1]

Random closed bodies with convex faces (prisms, antiprisms, pyramids and hulls of points, turned, stretched and moved) are
written as OBJ, PLY (text, and binary of both byte orders) and STL, in several writers' styles. `trimesh` reads each file,
and NumPy casts rays at its triangles; `catoptric trace` casts the same rays at the same file. Concave faces are not tried
here, since trimesh fans them: their judge is the parity of crossings, in crates/files/src/mesh/polygon.rs. Ends with exit
code 1 at the first ray that differs.
"""

import argparse
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

RAYS = 300
# Coordinates are written in full, or as the 32-bit numbers that the format has: what is compared are two readings of one file.
TOLERANCE_M = 1e-9


def prism(random, count, top):
    """A body between two convex polygons of `count` corners: of the same size, turned (antiprism), or with a point on top."""
    angles = np.sort(random.uniform(0.0, 2.0 * np.pi, count))
    # Corners that nearly coincide are not what is tried here, and the largest gap has to leave the center inside.
    angles = (angles + 2.0 * np.pi * np.arange(count) / count) / 2.0
    low = np.column_stack([np.cos(angles), np.sin(angles), -np.ones(count)])
    floor = list(range(count))[::-1]
    if top == "point":
        faces = [[i, (i + 1) % count, count] for i in range(count)]
        return np.vstack([low, [[0.0, 0.0, 1.0]]]), [floor, *faces]
    high = low * random.uniform(0.3, 1.0) + [0.0, 0.0, 2.0]
    high[:, 2] = 1.0
    ceiling = list(range(count, 2 * count))
    sides = [[i, (i + 1) % count, count + (i + 1) % count, count + i] for i in range(count)]
    return np.vstack([low, high]), [floor, ceiling, *sides]


def hull(random, count):
    """The hull of points on a sphere: triangles alone."""
    points = random.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    found = ConvexHull(points)
    faces = []
    for corners, outward in zip(found.simplices, found.equations[:, :3]):
        a, b, c = points[corners]
        faces.append(list(corners if np.dot(np.cross(b - a, c - a), outward) > 0.0 else corners[::-1]))
    return points, faces


def body(random):
    kind = random.integers(4)
    vertices, faces = hull(random, random.integers(4, 40)) if kind == 3 else prism(
        random, random.integers(3, 13), ["same", "same", "point"][kind])
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    if np.linalg.det(turn) < 0.0:
        turn[:, 0] *= -1.0
    return vertices * random.uniform(0.2, 2.0, 3) @ turn.T + random.uniform(-1.0, 1.0, 3), faces


def fans(faces):
    return [[face[0], face[i], face[i + 1]] for face in faces for i in range(1, len(face) - 1)]


def obj(random, vertices, faces):
    """Corners by their numbers, from the front or the back, with a normal or without."""
    lines = ["# polygons", *(f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()), "vn 0 0 1"]
    from_back, more = random.integers(2), ["", "//1"][random.integers(2)]
    for face in faces:
        numbers = [f"{i - len(vertices) if from_back else i + 1}{more}" for i in face]
        lines.append("f " + " ".join(numbers))
    return "\n".join(lines).encode() + b"\n"


def ply(random, vertices, faces):
    style = ["ascii", "binary_little_endian", "binary_big_endian"][random.integers(3)]
    order = ">" if style == "binary_big_endian" else "<"
    number, code = [("float", "f"), ("double", "d")][random.integers(2)]
    if style == "ascii":
        # trimesh rounds what a text calls `float` to 32 bits; we take the digits that are there.
        number = "double"
    else:
        # trimesh takes binary lists of one length only.
        faces = fans(faces)
    head = f"""ply
format {style} 1.0
element vertex {len(vertices)}
property {number} x
property {number} y
property {number} z
element face {len(faces)}
property list uchar int vertex_indices
end_header
""".encode()
    if style == "ascii":
        rows = [*(f"{x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()),
                *(" ".join(map(str, [len(face), *face])) for face in faces)]
        return head + "\n".join(rows).encode() + b"\n"
    return head + b"".join(
        [struct.pack(f"{order}3{code}", *v) for v in vertices]
        + [struct.pack(f"{order}B{len(face)}i", len(face), *face) for face in faces])


def stl(random, vertices, faces):
    triangles = np.array([[vertices[i] for i in face] for face in fans(faces)])
    if random.integers(2):
        return bytes(80) + struct.pack("<I", len(triangles)) + b"".join(
            struct.pack("<12fH", 0.0, 0.0, 0.0, *t.ravel(), 0) for t in triangles)
    corners = ["\n".join(f"vertex {x!r} {y!r} {z!r}" for x, y, z in t.tolist()) for t in triangles]
    facets = "".join(f"facet normal 0 0 0\nouter loop\n{c}\nendloop\nendfacet\n" for c in corners)
    return f"solid body\n{facets}endsolid body\n".encode()


def cast(triangles, starts, directions):
    """Distance to the nearest triangle by brute force (Möller and Trumbore), and how near to an edge it was met."""
    a, ab, ac = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    distances, margins = np.full(len(starts), np.inf), np.full(len(starts), np.inf)
    for i, (start, direction) in enumerate(zip(starts, directions)):
        p = np.cross(direction, ac)
        determinant = np.einsum("ij,ij->i", ab, p)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.einsum("ij,ij->i", start - a, p) / determinant
            q = np.cross(start - a, ab)
            v = q @ direction / determinant
            t = np.einsum("ij,ij->i", ac, q) / determinant
        inside = np.minimum(np.minimum(u, v), 1.0 - u - v)
        hit = (inside >= 0.0) & (t > 0.0)
        if hit.any():
            distances[i] = t[hit].min()
        margins[i] = np.abs(inside[(t > 0.0) & np.isfinite(inside)]).min(initial=np.inf)
    return distances, margins


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("program", type=Path)
    parser.add_argument("--meshes", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    program = options.program.resolve()
    rays = hits = 0
    largest = 0.0
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for number in range(options.meshes):
            random = np.random.default_rng([options.seed, number])
            vertices, faces = body(random)
            suffix, write = [("obj", obj), ("ply", ply), ("stl", stl)][number % 3]
            file = folder / f"body.{suffix}"
            file.write_bytes(write(random, vertices, faces))
            (folder / "scene.toml").write_text(
                f'schema_version = 1\nname = "body"\n[[room.surface]]\nname = "body"\n'
                f'shape.mesh = {{ file = "{file.name}", units = "m" }}\n')
            # From outside and from inside, at places in and about the body.
            starts = vertices.mean(axis=0) + random.normal(size=(RAYS, 3)) * random.choice([0.1, 6.0], (RAYS, 1))
            aims = vertices.mean(axis=0) + random.normal(size=(RAYS, 3)) * 0.7
            directions = (aims - starts) / np.linalg.norm(aims - starts, axis=1)[:, None]
            np.save(folder / "rays.npy", np.column_stack([starts, directions]))
            done = subprocess.run(
                [program, "trace", "scene.toml", "--rays", "rays.npy", "--out", "paths.npy", "--quiet"],
                cwd=folder, capture_output=True, text=True)
            if done.returncode != 0:
                sys.exit(f"mesh_peers: mesh {number} of seed {options.seed}, {file.name}: {done.stderr}")
            (folder / "paths.npy").replace(folder / "ours.npy")
            ours = np.load(folder / "ours.npy")[:, 0]
            theirs = trimesh.load(file, process=False, force="mesh")
            if theirs.triangles.shape[0] != len(fans(faces)):
                sys.exit(f"mesh_peers: mesh {number}: trimesh reads {theirs.triangles.shape[0]} triangles")
            distances, margins = cast(theirs.triangles.astype(float), starts, directions)
            # Along an edge either answer is right for one of two triangles that round differently.
            clear = margins > 1e-9
            both = np.isfinite(distances) & np.isfinite(ours)
            same = np.where(both, np.abs(np.subtract(distances, ours, where=both, out=np.zeros(RAYS))) <= TOLERANCE_M,
                            np.isfinite(distances) == np.isfinite(ours))
            if not same[clear].all():
                ray = np.flatnonzero(clear & ~same)[0]
                sys.exit(f"mesh_peers: mesh {number} of seed {options.seed}, {file.name}, ray {ray}: "
                         f"{ours[ray]} m here, {distances[ray]} m by trimesh's triangles")
            rays, hits = rays + int(clear.sum()), hits + int((clear & both).sum())
            largest = max(largest, float(np.abs(np.subtract(distances, ours, where=both & clear, out=np.zeros(RAYS))).max()))
    if hits < rays // 4 or hits == rays:
        sys.exit(f"mesh_peers: of {rays} rays {hits} meet a body, which tries nothing")
    print(f"{options.meshes} meshes, {rays} rays, {hits} of them meet a body: {largest:.1e} m apart at most")


if __name__ == "__main__":
    main()
