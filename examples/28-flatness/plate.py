"""Simulates the readings of plate.csv, and prints the true flatness deviation of the places."""

import pathlib

import numpy as np

LINES = {
    "AC": (0, 0, 800, 600),
    "BD": (800, 0, 0, 600),
    "AB": (0, 0, 800, 0),
    "BC": (800, 0, 800, 600),
    "CD": (800, 600, 0, 600),
    "DA": (0, 600, 0, 0),
    "EG": (400, 0, 400, 600),
    "HF": (0, 300, 800, 300),
}


def height_um(x, y):
    """A bowl, a twist, waves and a hollow."""
    u, v = x / 400 - 1, y / 300 - 1
    waves = 0.5 * np.sin(2.6 * u + 0.3) * np.cos(1.9 * v)
    hollow = -1.3 * np.exp(-((x - 560) ** 2 + (y - 300) ** 2) / 9000)
    return 2.4 * (u * u + 0.6 * v * v) - 0.9 * u * v + waves + hollow


random = np.random.default_rng(28)
rows = ["line,from_x_mm,from_y_mm,to_x_mm,to_y_mm,slope_urad"]
places = set()
for name, (x0, y0, x1, y1) in LINES.items():
    steps = round(np.hypot(x1 - x0, y1 - y0) / 100)
    at = [(x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps) for k in range(steps + 1)]
    places.update((round(x, 6), round(y, 6)) for x, y in at)
    for way in ("", "-back"):
        zero_urad = random.normal() * 60
        for number in range(steps):
            k = steps - 1 - number if way else number
            tilt_urad = 10 * (height_um(*at[k + 1]) - height_um(*at[k]))
            slope_urad = tilt_urad + zero_urad + 0.9 * number + 0.5 * random.normal()
            feet = ",".join(f"{value:g}" for value in (*at[k], *at[k + 1]))
            rows.append(f"{name}{way},{feet},{slope_urad:.2f}")
pathlib.Path(__file__).with_name("plate.csv").write_text("\n".join(rows) + "\n")

x, y = np.array(sorted(places)).T
columns = np.stack([np.ones_like(x), x, y], axis=1)
about = height_um(x, y) - columns @ np.linalg.lstsq(columns, height_um(x, y), rcond=None)[0]
print(f"true FLTt about LSPL: {np.ptp(about):.3f} um, FLTq: {about.std():.3f} um")
