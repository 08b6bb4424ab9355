"""The test of the test: outputs that are spoiled on purpose, and what must be said of each."""

import json
import re
import shutil
from pathlib import Path

from net.compare import compare_folders, matches, mcap_library
from net.meant import CannotTry, Meant, lines_of_changes
from net.verbs import run_steps, steps, write_rays

# Two-mirror has no parameters to search, and is worse than the limit that `score-limit` sets; a drawing states no covariance
# that could be judged.
EXPECTED_FAILURES = {"optimize.json": 2, "score-limit": 1, "score-prior.json": 1}


def replace(pattern, by):
    """Replaces the first match in a text file; there must be one."""

    def spoil(path):
        text = path.read_text(encoding="utf-8")
        spoiled, count = re.subn(pattern, by, text, count=1)
        assert count == 1 and spoiled != text, f"{path} has nothing like {pattern}"
        path.write_text(spoiled, encoding="utf-8")

    return spoil


def flip_byte(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def other_library(path):
    data = path.read_bytes()
    library = mcap_library(data)
    path.write_bytes(data.replace(library, library.replace(b"0", b"9"), 1))


def other_library_and_byte(path):
    flip_byte(path)
    other_library(path)


# What is spoiled, how, and where it must be reported: file and path; None if it must not be.
SPOILS = [
    ("calibration-joint.json", replace(r"(\"azimuth_rad\": -?\d\.\d*)[1-8]", r"\g<1>9"), "beams[*].azimuth_rad"),
    ("calibration-joint.json", replace(r"\"poses\": 6,", '"poses": 6.0,'), "beams[*].poses"),
    ("printed/score-beam.json", replace(r"\"verdict\"", '"extra": 1, "verdict"'), "extra"),
    ("printed/score-beam.json", replace(r"\"coverage_95\":[^,]*,", ""), "coverage_95"),
    ("printed/score-beam.json", replace(r"(\"method\": *)\"beam\"", r'\1"bean"'), "method"),
    ("data/truth/truth.json", replace(r"(\"distance_m\": \d\.\d*)\d(\d)", r"\g<1>\2"), "beams[*].distance_m"),
    ("exit-codes.json", replace(r"(\"report\": )0", r"\g<1>2"), "report"),
    ("data/session.toml", replace(r"range_min_m = 0", "range_min_m = 1"), "scanner.range_min_m"),
    ("data/observations.mcap", flip_byte, ""),
    ("data/observations.mcap", other_library_and_byte, ""),
    ("cloud-sensor.ply", flip_byte, ""),
    ("cloud-rig.pcd", flip_byte, ""),
    ("paths.npy", flip_byte, ""),
    ("paths.csv", replace(r"(\n1,.*\.\d*)[0-8](\d,)", r"\g<1>9\2"), "*"),
    ("all.stl", flip_byte, ""),
    ("drawn.glb", flip_byte, ""),
    ("drawn.urdf", replace(r"xyz=\"", 'xyz="1'), ""),
    ("layout/perspective.png", flip_byte, ""),
    ("layout/above.svg", replace(r"points=\"\d", 'points="77'), ""),
    ("report.html", replace(r"<td>([^<]*)\d", r"<td>\g<1>77"), ""),
    ("study/runs.csv", replace(r"\n0,", "\n7,"), "*"),
    ("drawn.csv", Path.unlink, ""),
    ("data/manifest.json", replace(r"(\"seed\": )\d", r"\g<1>77"), "seed"),
    ("data/manifest.json", replace(r"\"rng_rule\": ", '"rule": '), "rng_rule"),
    ("new.json", lambda path: path.write_text("{}", encoding="utf-8"), ""),
    ("data/manifest.json", replace(r"(\"git_hash\": \")\w", r"\g<1>z"), None),
    ("data/manifest.json", replace(r"(mcap\": \")\w", r"\g<1>z"), None),
    ("data/observations.mcap", other_library, None),
    ("printed/simulate.json", replace(r"(\"trace_s\": *)", r"\g<1>7"), None),
    ("report.html", replace(r"<h1>", "<h1>Other words: "), None),
]


def self_test(program, work):
    """Spoils a copy of what one scene gives, one file at a time."""
    write_rays(work)
    whole, spoiled = work / "whole", work / "spoiled"
    run_steps(program, list(steps("two-mirror")), whole)
    shutil.copytree(whole, spoiled)
    codes = json.loads((whole / "exit-codes.json").read_text())
    wrong = [] if compare_folders(whole, spoiled)[0] == [] else ["a copy differs from itself"]
    # The programs must have worked, or nothing is compared.
    wrong += [f"{name} ended with {code}" for name, code in codes.items() if code != 0 and name not in EXPECTED_FAILURES]
    for file, spoil, where in SPOILS:
        spoil(spoiled / file)
        found, _ = compare_folders(whole, spoiled)
        seen = [path for name, path, _ in found if name == file]
        if where is None and found or where is not None and not any(matches(where, path) for path in seen):
            wrong.append(f"{file}, spoiled at {where!r}: reported {found[:3]}")
        if where is not None and not any(Meant(f"*:{file}").covers("two-mirror", *d[:2]) for d in found):
            wrong.append(f"{file}: not covered by an exception that names it")
        if (whole / file).exists():
            shutil.copy2(whole / file, spoiled / file)
        else:
            (spoiled / file).unlink()
    covers = lambda text, *what: Meant(text).covers(*what)
    for text, what, expected in [
        ("*:*.json:schema_version", ("a", "score.json", "schema_version"), True),
        ("*:*.json:schema_version", ("a", "score.json", "beams[3].beam"), False),
        ("*:score.json:mounting", ("a", "printed/score.json", "mounting.nees"), True),
        ("two-mirror:*", ("prototype", "score.json", ""), False),
        ("*:score.json:nees", ("a", "score.json", "nees_mean"), False),
        ("*:session.toml:scanner.*", ("a", "data/session.toml", "scanner.beams"), True),
    ]:
        if covers(text, *what) != expected:
            wrong.append(f"{text!r} and {what}: not {expected}")
    try:
        lines_of_changes("*:*.json:schema_version")
        wrong.append("a change without a reason is accepted")
    except CannotTry:
        pass
    for line in wrong:
        print(f"    {line}")
    print(f"{len(SPOILS)} files spoiled, {len(wrong)} wrong")
    return not wrong
