"""Two angles per element from ten ranges: catoptric, SciPy and Ceres on the same 1081 elements, side by side.

    python benches/peers/elements.py [--rounds 3] [--elements 1081]

Needs numpy and scipy, and includes pyceres if it is installed. All must agree on the angles. Compare ratios: absolute
times depend on the machine.
"""

import argparse
import json
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

ROOT = Path(__file__).resolve().parents[2]
BOARDS, DISTANCE, NOISE_M, START_RAD, AGREEMENT_RAD = 10, 0.06, 0.005, 0.05, 1e-6


def direction(azimuth, elevation):
    return np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], -1)


def problem(elements):
    """Boards at 0.5 to 4 m whose normals scatter around the beam, ranges with 5 mm of noise, starts 0.05 rad away."""
    rng = np.random.default_rng(7)
    base = np.radians(np.linspace(-135, 135, elements))
    truth = np.stack([rng.normal(0, 0.2, elements), rng.uniform(0.3, 0.9, elements)], 1)
    v = direction(base + truth[:, 0], truth[:, 1])
    origin = DISTANCE * direction(base, 0 * base)
    n = -v[:, None] + rng.normal(0, 0.5, (elements, BOARDS, 3))
    n /= np.linalg.norm(n, axis=2, keepdims=True)
    steep = np.einsum("ekc,ec->ek", n, v) > -0.3
    n[steep] = np.broadcast_to(-v[:, None], n.shape)[steep]
    s = rng.uniform(0.5, 4, (elements, BOARDS))
    point = origin[:, None] + v[:, None] * s[..., None]
    return base, origin, n, point, DISTANCE + s + rng.normal(0, NOISE_M, s.shape), truth + rng.normal(0, START_RAD, truth.shape)


def residual(x, base, offset, n, z):
    """offset = n·(point − origin)."""
    return DISTANCE + offset / (n @ direction(base + x[0], x[1])) - z


def jacobian(x, base, offset, n, z):
    a, e = base + x[0], x[1]
    q = n @ direction(a, e)
    k = -offset / q**2
    return np.stack([k * (n @ [-np.cos(e) * np.sin(a), np.cos(e) * np.cos(a), 0]),
                     k * (n @ [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)])], 1)


def scipy_solver(**options):
    def solve(base, offset, n, z, start):
        return np.array([least_squares(residual, start[i], args=(base[i], offset[i], n[i], z[i]), **options).x for i in range(len(base))])
    return solve


def ceres_solver(pyceres):
    class Cost(pyceres.CostFunction):
        def __init__(self, *arguments):
            super().__init__()
            self.arguments = arguments
            self.set_num_residuals(BOARDS)
            self.set_parameter_block_sizes([2])

        def Evaluate(self, parameters, residuals, jacobians):
            residuals[:] = residual(parameters[0], *self.arguments)
            if jacobians is not None:
                jacobians[0][:] = jacobian(parameters[0], *self.arguments).ravel()
            return True

    def solve(base, offset, n, z, start):
        options = pyceres.SolverOptions()
        options.num_threads, options.logging_type = 1, pyceres.LoggingType.SILENT
        # The default tolerances stop short of the minimum by a hundredth of the noise.
        options.function_tolerance = options.parameter_tolerance = options.gradient_tolerance = 1e-12
        found = start.copy()
        for i in range(len(base)):
            one, x = pyceres.Problem(), found[i].copy()
            one.add_residual_block(Cost(base[i], offset[i], n[i], z[i]), None, [x])
            pyceres.solve(options, one, pyceres.SolverSummary())
            found[i] = x
        return found
    return solve


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--elements", type=int, default=1081)
    arguments = parser.parse_args()
    base, origin, n, point, z, start = problem(arguments.elements)
    offset = np.einsum("ekc,ekc->ek", n, point - origin[:, None])
    peers = {"scipy lm, analytic Jacobian": scipy_solver(method="lm", jac=jacobian),
             "scipy lm, differences": scipy_solver(method="lm"),
             "scipy trf, differences": scipy_solver()}
    try:
        import pyceres
        peers["Ceres, cost in Python"] = ceres_solver(pyceres)
    except ImportError:
        pass
    subprocess.run(["cargo", "build", "--release", "--example", "fit_elements", "--quiet"], cwd=ROOT, check=True)
    times = {"catoptric": []} | {name: [] for name in peers}
    with tempfile.TemporaryDirectory() as folder:
        rows, answers = Path(folder) / "rows.csv", Path(folder) / "answers.csv"
        with open(rows, "w") as file:
            for i in range(len(base)):
                for k in range(BOARDS):
                    numbers = [i, base[i], DISTANCE, *start[i], *n[i, k], *point[i, k], z[i, k]]
                    file.write(",".join(repr(float(x)) for x in numbers) + "\n")
        for _ in range(arguments.rounds):
            run = subprocess.run(["cargo", "run", "--release", "--quiet", "--example", "fit_elements", "--", rows, answers],
                                 cwd=ROOT, check=True, capture_output=True, text=True)
            times["catoptric"].append(json.loads(run.stdout)["us_per_element"])
            ours = np.loadtxt(answers, delimiter=",")
            for name, solve in peers.items():
                begin = time.perf_counter()
                found = solve(base, offset, n, z, start)
                times[name].append((time.perf_counter() - begin) * 1e6 / len(base))
                apart = np.abs(found - ours).max(axis=1)
                if not (apart < AGREEMENT_RAD).mean() > 0.99:
                    raise SystemExit(f"{name} disagrees on {(~(apart < AGREEMENT_RAD)).sum()} of {len(base)} elements")
    best = statistics.median(times["catoptric"])
    print(f"{'solver':32} {'us per element':>15} {'relative time':>14}")
    for name, values in times.items():
        print(f"{name:32} {statistics.median(values):15.2f} {statistics.median(values) / best:14.1f}")


if __name__ == "__main__":
    main()
