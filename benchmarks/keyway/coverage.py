"""How often intervals of roundness hold the truth beside a keyway.

    python benchmarks/keyway/coverage.py RUNOUT [RECORDINGS] [--uncertainty monte-carlo] [--margin-deg 0]

RUNOUT is the program. It simulates recordings of scenario.toml, whose file holds the true form, and evaluates them. True values are
those of a spline through that form, about a least-squares circle by NumPy, over all angles but the interruption that the pipeline
declares. With --margin-deg they leave out so much more at either edge; 0.3516, the half of a sample, are the angles that the
program's own values have. Needs NumPy, SciPy and h5py; writes into a temporary folder.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import h5py
import numpy as np
from scipy.interpolate import CubicSpline

SCENARIO = Path(__file__).with_name("scenario.toml").read_text()
# Declared half a degree wider than the keyway, 352° to 4°.
DECLARED_DEG = (4.5, 351.5)
# The spline goes through what lies beside the keyway.
BESIDE_DEG = (4.05, 351.95)
SYMBOLS = ("RONp", "RONq", "RONt", "RONv")


def pipeline(uncertainty):
    """The scenario's rig with the interruption, and what a run does with its recording."""
    rig = SCENARIO[SCENARIO.index("[rig]") : SCENARIO.index("[recording]")]
    return f"""
title = "Beside a keyway"
{rig}
interruptions = [{{ from_deg = {DECLARED_DEG[1]}, to_deg = {DECLARED_DEG[0]} }}]
[load]
plugin = "hdf5"
path = "record.h5"
[[preprocess]]
plugin = "synchronous-average"
samples_per_rev = 512
[separate]
plugin = "harmonic-least-squares"
[evaluate]
values = ["roundness"]
references = ["LSCI"]
filter_upr = [50]
uncertainty = "{uncertainty}"
[[export]]
plugin = "parquet"
path = "out"
"""


def true_values(form_um, margin_deg):
    """Values about the least-squares circle, in µm, of a form on equal angles."""
    angle = np.arange(len(form_um)) * 360 / len(form_um)
    beside = (angle > BESIDE_DEG[0]) & (angle < BESIDE_DEG[1])
    spline = CubicSpline(np.radians(angle[beside]), form_um[beside])
    angle = np.radians(np.linspace(DECLARED_DEG[0] + margin_deg, DECLARED_DEG[1] - margin_deg, 16384))
    circle = np.column_stack([np.ones_like(angle), np.cos(angle), np.sin(angle)])
    profile = spline(angle)
    deviation = profile - circle @ np.linalg.lstsq(circle, profile, rcond=None)[0]
    highest, lowest = deviation.max(), -deviation.min()
    return {"RONt": highest + lowest, "RONp": highest, "RONv": lowest, "RONq": np.sqrt(np.mean(deviation**2))}


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("runout", type=lambda path: str(Path(path).resolve()))
    arguments.add_argument("recordings", type=int, nargs="?", default=40)
    arguments.add_argument("--uncertainty", default="linear", choices=["linear", "monte-carlo"])
    arguments.add_argument("--margin-deg", type=float, default=0.0)
    given = arguments.parse_args()
    errors, stds, held = ({symbol: [] for symbol in SYMBOLS} for _ in range(3))
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "pipeline.toml").write_text(pipeline(given.uncertainty))

        def runout(*words):
            subprocess.run([given.runout, *words], cwd=folder, check=True, capture_output=True)

        for seed in range(100, 100 + given.recordings):
            (folder / "scenario.toml").write_text(SCENARIO.replace("seed = 3", f"seed = {seed}"))
            runout("simulate", "scenario.toml", "--out", "record.h5")
            runout("run", "pipeline.toml", "--threads", "1")
            summary = json.loads((folder / "out" / "summary.json").read_text())
            with h5py.File(folder / "record.h5") as record:
                for station in summary["stations"]:
                    for section in station["sections"]:
                        form_um = record[f"truth/{station['station']}/form_um/{section['section']}"][:]
                        truth = true_values(form_um, given.margin_deg)
                        for value in section["values"]:
                            symbol = value["symbol"]
                            if symbol not in SYMBOLS or value["filter"] != "none":
                                continue
                            low, high = value["uncertainty"]["interval_95"]
                            errors[symbol].append(value["value"] - truth[symbol])
                            stds[symbol].append(value["uncertainty"]["std"])
                            held[symbol].append(low <= truth[symbol] <= high)
    print(f"{given.recordings} recordings, {given.uncertainty}; errors and stated standard uncertainties in µm, rms")
    for symbol in SYMBOLS:
        error, std = (np.sqrt(np.mean(np.square(some[symbol]))) for some in (errors, stds))
        print(f"{symbol}  {len(held[symbol])} values  {100 * np.mean(held[symbol]):.1f} % held  error {error:.4f}  stated {std:.4f}")


if __name__ == "__main__":
    main()
