"""Areal and profile values of one surface by runout and by surfalize, side by side; Markdown on stdout.

usage: compare.py PROGRAM SCRATCH ROWS COLUMNS ROUNDS (PROGRAM is the core's example surface_values)
"""
import json, os, subprocess, sys, time, warnings
from importlib.metadata import version
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[name] = "1"
warnings.filterwarnings("ignore")
import numpy as np
from surface import surface, surfalize_profile, surfalize_values

program, scratch = sys.argv[1], Path(sys.argv[2])
rows, columns, rounds = (int(word) for word in sys.argv[3:6])
SAME = 1e-6                                           # values nearer than this are the same
CLASSES = "its curve has 10 000 classes, runout's every point"
WHY = {
    "Sdq": "forward differences there, over seven points here",
    "Rdq": "forward differences there, over seven points here",
    "Sal": "it takes the nearest of 1000 points on rays to whole points, runout the crossing of the grid's lines",
    "Std": "steps of 0.5° in both; other bins win",
    **{name: CLASSES for name in ("Sdc", "Sk", "Smrk1", "Smrk2", "Spkx", "Svkx")},
    **{name: CLASSES + "; its areas end at the nearest class, not on it"
       for name in ("Spk", "Svk", "Sak1", "Sak2", "Vmp", "Vmc", "Vvc", "Vvv")},
}
WHY["Str"] = WHY["Sal"]


def runout(ends, heights, dx_mm, dy_mm, count):
    file = scratch / "heights.f64"
    heights.astype("<f8").tofile(file)
    command = [program, file, str(heights.shape[1]), repr(dx_mm), repr(dy_mm), ends, str(count)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def seven(z, axis, distance):
    """Differences over seven points along an axis, where they fit."""
    z = np.moveaxis(z, axis, -1)
    n = z.shape[-1]
    at = lambda step: z[..., 3 + step:n - 3 + step]
    slope = (45 * (at(1) - at(-1)) - 9 * (at(2) - at(-2)) + (at(3) - at(-3))) / (60 * distance)
    return np.moveaxis(slope, -1, axis)


def row(symbol, unit, ours, theirs, why):
    show = lambda value: "none" if value is None or value != value else f"{value:.6g}"
    both = ours is not None and theirs == theirs and theirs != 0
    ratio = f"{ours / theirs:.5f}" if both else ""
    same = both and abs(ours / theirs - 1) < SAME or ours == theirs
    print(f"| {symbol} | {unit} | {show(ours)} | {show(theirs)} | {ratio} | {'' if same else why} |")


def table(ours, theirs):
    print("| | unit | runout | surfalize | ratio | why they differ |\n| --- | --- | --- | --- | --- | --- |")
    for symbol, value in theirs.items():
        row(symbol, ours[symbol]["unit"], ours[symbol]["value"], value, WHY.get(symbol, "NOT EXPLAINED"))
    print()


def shortest(work, count):
    times = []
    for _ in range(count):
        start = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - start)
    return result, min(times)


scratch.mkdir(parents=True, exist_ok=True)
heights, dx_mm, dy_mm = surface(rows, columns)
ours = runout("open", heights, dx_mm, dy_mm, rounds)
theirs, areal_s = shortest(lambda: surfalize_values(heights, dx_mm, dy_mm), max(1, rounds // 3))
profile, profile_s = shortest(lambda: surfalize_profile(heights[0], dx_mm), rounds)
print(f"{rows} rings of {columns} points, not closed, surfalize {version('surfalize')}, one thread; the shortest of the rounds.\n")
table(ours["areal"], theirs)
print(f"Time of these {len(theirs)} values: runout {ours['areal_s']:.3f} s, surfalize {areal_s:.3f} s, "
      f"{areal_s / ours['areal_s']:.1f} times as long.\n")
# The explanation of Sdq, checked: by runout's differences this map has runout's value.
z = 1e-3 * heights
both = seven(z, 1, dx_mm)[3:-3] ** 2 + seven(z, 0, dy_mm)[:, 3:-3] ** 2
print(f"Sdq over seven points by NumPy: {np.sqrt(both.mean()):.9g}; runout: {ours['areal']['Sdq']['value']:.9g}.\n")
print(f"The profile of the first ring, unfiltered, five sections (surfalize {1e3 * profile_s:.2f} ms, runout with Rsm "
      f"{1e3 * ours['profile_s']:.2f} ms):\n")
table(ours["profile"], profile)
closed = runout("closed", heights, dx_mm, dy_mm, 1)
print("What closing the map changes (no program beside it closes one): the ring's last cell is measured, Sal and Str are\n"
      "circular, hills across the seam are whole.\n")
print("| | unit | closed | open | ratio |\n| --- | --- | --- | --- | --- |")
for symbol in ("Sdq", "Sdr", "Sal", "Str", "Spd", "Svd", "S10z"):
    value, unit, other = closed["areal"][symbol]["value"], ours["areal"][symbol]["unit"], ours["areal"][symbol]["value"]
    print(f"| {symbol} | {unit} | {value:.6g} | {other:.6g} | {value / other:.5f} |")
