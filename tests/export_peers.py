"""Opens an exported layout with readers that are not ours, and checks what they see.

    pip install -r tests/requirements.txt
    python tests/export_peers.py STEM

STEM.stl, STEM.glb, STEM.csv and STEM.urdf are one scene, exported with the defaults. `trimesh` must find every body of the
STL closed and outward, in millimeters, and the GLB of the same size in meters; the table and the frames must agree with
them. Ends with exit code 1 at the first thing that is wrong.
"""

import argparse
import csv
import sys
import xml.etree.ElementTree as ElementTree
from collections import defaultdict

import numpy as np
import trimesh


def check(condition, what):
    if not condition:
        sys.exit(f"export_peers: {what}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("stem")
    stem = parser.parse_args().stem

    solid = trimesh.load(f"{stem}.stl")
    check(solid.is_watertight and solid.is_winding_consistent, "the STL is not closed")
    bodies = solid.split(only_watertight=False)
    for body in bodies:
        check(body.is_watertight and body.volume > 0.0, "a body of the STL is open or inside out")

    corners = defaultdict(list)
    rows = {}
    with open(f"{stem}.csv", newline="") as file:
        for row in csv.DictReader(file):
            corners[row["facet"]].append([float(row[k]) for k in ("x_mm", "y_mm", "z_mm")])
            rows[row["facet"]] = row
    check(corners, "the table is empty")

    # Every corner of the drawing is a vertex of the STL, to a micrometer.
    for facet, points in corners.items():
        for point in points:
            nearest = np.linalg.norm(solid.vertices - np.array(point), axis=1).min()
            check(nearest < 1e-3, f"a corner of {facet} is {nearest} mm from the STL")

    scene = trimesh.load(f"{stem}.glb")
    for facet, points in corners.items():
        check(facet in scene.geometry, f"the GLB has no {facet}")
        plate = scene.geometry[facet]
        check(f"beams {facet}" in scene.geometry, f"the GLB has no beams of {facet}")
        area, thickness = float(rows[facet]["area_mm2"]), float(rows[facet]["thickness_mm"])
        # Corners come once for each of the faces that meet there, each with its own normal.
        plate.merge_vertices(merge_norm=True, merge_tex=True)
        volume = plate.volume * 1e9
        check(plate.is_watertight, f"{facet} is not closed in the GLB")
        check(abs(volume / (area * thickness) - 1.0) < 1e-4, f"{facet} has {volume} mm³ in the GLB")
        # The format's up is y: the drawing's (x, y, z) is (x, z, -y) there.
        transform, _ = scene.graph.get(facet)
        placed = trimesh.transform_points(plate.vertices, transform)
        for x, y, z in points:
            nearest = np.linalg.norm(placed - np.array([x, z, -y]) * 1e-3, axis=1).min()
            check(nearest < 1e-6, f"a corner of {facet} is {nearest} m from the GLB")

    robot = ElementTree.parse(f"{stem}.urdf").getroot()
    links = {link.get("name") for link in robot.findall("link")}
    joints = {joint.find("child").get("link"): joint for joint in robot.findall("joint")}
    check({"rig", "laser"} <= links and links - {"rig"} == set(joints), "the links of the URDF do not hang together")
    for facet, points in corners.items():
        origin = joints[f"mirror_{facet}"].find("origin")
        place = np.array([float(c) for c in origin.get("xyz").split()])
        check(np.allclose(place, np.mean(points, axis=0) * 1e-3, atol=1e-8), f"{facet} is elsewhere in the URDF")
        turn = trimesh.transformations.euler_matrix(*[float(c) for c in origin.get("rpy").split()], axes="sxyz")
        normal = [float(rows[facet][k]) for k in ("normal_x", "normal_y", "normal_z")]
        check(np.allclose(turn[:3, 2], normal, atol=1e-5), f"{facet} faces elsewhere in the URDF")

    extents = ", ".join(f"{e:.1f}" for e in solid.extents)
    print(f"{stem}: {len(bodies)} closed bodies of {extents} mm, {len(corners)} mirrors in every format")


if __name__ == "__main__":
    main()
