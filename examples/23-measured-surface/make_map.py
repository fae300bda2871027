"""Writes ground.x3p: the map of a ground roller as a white-light interferometer would give it (simulated), with voids and spikes.

    pip install numpy x3pio
    python3 make_map.py
"""

import datetime
import pathlib

import numpy as np
import x3pio

rng = np.random.default_rng(23)
rows, columns, step_um, radius_um = 240, 320, 2.0, 10_000.0
x, y = np.meshgrid(np.arange(columns) * step_um, np.arange(rows) * step_um)

# Grinding marks along x: random scratches across y, smoothed over 4 µm, that slowly change along x.
marks = rng.normal(size=(rows, 5))
width = np.exp(-0.5 * (np.arange(-6, 7) / 2.0) ** 2)
marks = np.apply_along_axis(lambda line: np.convolve(line, width / np.sqrt(np.sum(width**2)), "same"), 0, marks)
share = np.stack([np.cos(np.pi * order * x[0] / x[0, -1]) for order in range(5)]) * np.array([0.36, 0.05, 0.05, 0.03, 0.03])[:, None]
um = marks @ share
# The roller: radius 10 mm, axis along x, turned by 2° and tilted; and 5 nm of noise.
turn = np.radians(2.0)
across = -(x - 300.0) * np.sin(turn) + (y - 260.0) * np.cos(turn)
um += np.sqrt(radius_um**2 - across**2) - radius_um + 0.0015 * x + 0.0008 * y
um += 0.005 * rng.normal(size=um.shape)
# Steep flanks without light, and dust.
for _ in range(40):
    row, column = rng.integers(2, rows - 4), rng.integers(2, columns - 9)
    um[row : row + rng.integers(1, 3), column : column + rng.integers(2, 8)] = np.nan
for _ in range(12):
    um[rng.integers(1, rows - 1), rng.integers(1, columns - 1)] += rng.uniform(4.0, 9.0)

date = datetime.datetime(2026, 11, 28, tzinfo=datetime.timezone.utc)
probe = x3pio.ProbingSystem(type=x3pio.ProbingType.SOFTWARE, identification="simulated")
metadata = x3pio.Metadata(date=date, calibration_date=date, creator="make_map.py", probing_system=probe)
x3pio.write(
    pathlib.Path(__file__).parent / "ground.x3p",
    1e-6 * um,
    x_scale=1e-6 * step_um,
    y_scale=1e-6 * step_um,
    z_type=x3pio.DataType.INT16,
    metadata=metadata,
)
