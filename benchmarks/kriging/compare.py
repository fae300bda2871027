"""Times predictions of runout, scikit-learn and pykrige from the same points and prints a Markdown table.

usage: compare.py PROGRAM PEERS SCRATCH [POINTS QUERIES ROUNDS]

PROGRAM is the example spatial_error_bench of runout-spatial-error. Points, readings and covariance are those of the peers'
kriging_bench.py; all programs have one thread and take turns. scikit-learn and pykrige each predict with a mean of their own: runout is
timed and compared with both, with a mean of zero and with a fitted one.
"""
import os
import sys

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
import json
import subprocess
import time
import warnings
from pathlib import Path

import numpy as np
from pykrige.ok3d import OrdinaryKriging3D
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF

warnings.filterwarnings("ignore")
program, _, scratch = (Path(path).resolve() for path in sys.argv[1:4])
count, asked, rounds = (int(word) for word in (sys.argv[4:7] or ["1000", "100000", "3"]))
scratch.mkdir(parents=True, exist_ok=True)
rng = np.random.default_rng(0)
RANGE, NUGGET = 0.35, 1e-6


def truth(p):
    x, y, z = p.T
    return np.sin(3 * x) * np.cos(2 * y) + .5 * np.sin(4 * z + x) + .3 * x * y * z


queries = rng.random((asked, 3))
points = rng.random((count, 3))
values = truth(points) + 1e-3 * rng.standard_normal(count)
data = scratch / "kriging.f64"
np.concatenate([[count, asked, RANGE, NUGGET], points.ravel(), values, queries.ravel()]).astype("<f8").tofile(data)
gp = GaussianProcessRegressor(RBF(RANGE), alpha=NUGGET, optimizer=None).fit(points, values)
parameters = dict(sill=1.0 + NUGGET, range=RANGE * np.sqrt(2) * 7 / 4, nugget=NUGGET)
ok = OrdinaryKriging3D(*points.T, values, variogram_model="gaussian", variogram_parameters=parameters)


def seconds(work):
    start = time.perf_counter()
    result = work()
    return time.perf_counter() - start, result


best = {}
for _ in range(rounds):
    def take(name, pair):
        if name not in best or pair[0] < best[name][0]:
            best[name] = pair
    take("scikit-learn mean", seconds(lambda: gp.predict(queries)))
    take("scikit-learn mean and variance", seconds(lambda: gp.predict(queries, return_std=True)))
    take("pykrige mean and variance", seconds(lambda: ok.execute("points", *queries.T, backend="vectorized")))
    lines = subprocess.run([str(program), str(data), str(scratch)], check=True, stdout=subprocess.PIPE, text=True).stdout
    for line in map(json.loads, lines.splitlines()):
        out = np.fromfile(scratch / f"kriging-{line['trend']}.f64", "<f8").reshape(2, asked)
        take(f"runout {line['trend']} {line['what']}", (line["seconds"], out))

print(f"{count} points, {asked} queries, gaussian covariance, one thread, least of {rounds} rounds in turns")
print("| what | runout, s | scikit-learn, s | pykrige, s | fastest peer / runout | wanted |")
print("| --- | --- | --- | --- | --- | --- |")
kriged = best["pykrige mean and variance"]
for what, wanted in (("mean", 4), ("mean and variance", 1.5)):
    own = max(best[f"runout zero {what}"][0], best[f"runout fitted {what}"][0])
    learned = best[f"scikit-learn {what}"][0]
    ratio = min(learned, kriged[0]) / own
    print(f"| {what} | {own:.3f} | {learned:.3f} | {kriged[0]:.3f} | {ratio:.2f} | {wanted} |")
mean, std = best["scikit-learn mean and variance"][1]
own = best["runout zero mean and variance"][1]
print(f"\nbeside scikit-learn: mean {np.abs(own[0] - mean).max() / np.abs(mean).max():.1e} of the largest, "
      f"variance {np.abs(own[1] - std ** 2).max():.1e} of the sill")
mean, variance = (np.asarray(part) for part in kriged[1])
own = best["runout fitted mean and variance"][1]
print(f"beside pykrige: mean {np.abs(own[0] - mean).max() / np.abs(mean).max():.1e} of the largest, "
      f"variance {np.abs(own[1] + NUGGET - variance).max():.1e} of the sill")
