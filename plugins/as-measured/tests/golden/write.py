"""Writes surface.x3p, profile.x3p and values.json: a turned, ground surface, and what surfalize, SurfaceTopography and SciPy make of it.

    pip install surfalize SurfaceTopography scipy x3pio numpy
    python3 write.py
"""

import datetime
import json
import pathlib
import warnings
from importlib.metadata import version

import numpy as np
import scipy.optimize
import x3pio
from SurfaceTopography import Topography
from surfalize import Surface

warnings.simplefilter("ignore")
here = pathlib.Path(__file__).parent
rng = np.random.default_rng(2026)
rows, columns, step_um = 70, 96, 2.5
x, y = np.meshgrid(np.arange(columns) * step_um, np.arange(rows) * step_um)

# Grinding marks along x, a lay of some degrees, a cylinder of 1.9 mm across it and tilted.
um = 0.35 * np.sin(2 * np.pi * (y + 0.05 * x) / 21.0) + 0.2 * np.sin(2 * np.pi * (y - 0.02 * x) / 7.3)
um += 0.15 * np.repeat(rng.normal(size=rows)[:, None], columns, 1) + 0.03 * rng.normal(size=(rows, columns))
turn = np.radians(17.0)
across = -(x - 130.0) * np.sin(turn) + (y - 80.0) * np.cos(turn)
um += np.sqrt(1900.0**2 - across**2) - 1900.0 + 0.004 * x - 0.003 * y
# i32 with a digit of 1 pm: what is written is what is evaluated.
um = np.round(um, 6)
voids = um.copy()
voids[20:24, 31:37] = np.nan
voids[60, 5] = np.nan

stamp = datetime.datetime(2026, 11, 28, tzinfo=datetime.timezone.utc)
probe = x3pio.ProbingSystem(type=x3pio.ProbingType.SOFTWARE, identification="none")
meta = x3pio.Metadata(date=stamp, calibration_date=stamp, creator="write.py", probing_system=probe)


def x3p(name, heights_um):
    options = dict(z_type=x3pio.DataType.INT32, z_scale=1e-12, metadata=meta)
    y_scale = {} if heights_um.ndim == 1 else {"y_scale": 1e-6 * step_um}
    x3pio.write(here / name, 1e-6 * heights_um, x_scale=1e-6 * step_um, **y_scale, **options)


x3p("surface.x3p", um)
x3p("voids.x3p", voids)
x3p("profile.x3p", um[:, 40])


def areal(heights_um):
    found = Surface(heights_um, step_um, step_um)
    return {name: float(getattr(found, name)()) for name in ("Sa", "Sq", "Sp", "Sv", "Sz", "Ssk", "Sku")}


def bodies(heights_um, residual, start):
    """Least squares of the vertical distance, by SciPy, from the body in its own parameters."""
    known = np.isfinite(heights_um)
    found = scipy.optimize.least_squares(lambda p: residual(p)[known] - heights_um[known], start, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=20000)
    return heights_um - residual(found.x), found.x


def sphere(p):
    # Level, curvature, place of the centre in radii.
    radius = 1.0 / p[1]
    return p[0] + np.sqrt(radius**2 - (x - p[2] * radius) ** 2 - (y - p[3] * radius) ** 2) - radius


def cylinder(p):
    # Radius, place of the axis across it, direction, rise along it, level.
    u, v = x * np.cos(p[2]) + y * np.sin(p[2]), -x * np.sin(p[2]) + y * np.cos(p[2])
    return p[4] + u * np.tan(p[3]) + (np.sqrt(p[0] ** 2 - (v - p[1]) ** 2) - p[0]) / np.cos(p[3])


level = Surface(um, step_um, step_um)
on_sphere, of_sphere = bodies(um, sphere, [0.0, 1 / 4000.0, 120.0 / 4000.0, 80.0 / 4000.0])
on_cylinder, of_cylinder = bodies(um, cylinder, [1900.0, 40.0, turn, 0.004, 0.0])
topography = Topography(um, (columns * step_um, rows * step_um), unit="um")
masked = Topography(np.ma.masked_invalid(voids), (columns * step_um, rows * step_um), unit="um")
out = {
    "programs": {name: version(name) for name in ("surfalize", "SurfaceTopography", "scipy", "x3pio")},
    "plane": areal(level.level().data),
    "polynomial2": areal(level.detrend_polynomial(2).data),
    "polynomial3": areal(level.detrend_polynomial(3).data),
    "sphere": areal(on_sphere) | {"radius": float(1.0 / of_sphere[1])},
    "cylinder": areal(on_cylinder) | {"radius": float(of_cylinder[0]), "axis": float(np.degrees(of_cylinder[2]) % 180)},
    "topography_curvature_Sq": float(topography.detrend("curvature").rms_height_from_area()),
    "topography_voids_plane_Sq": float(masked.detrend("height").rms_height_from_area()),
}

profile = um[:, 40]
place = np.arange(rows) * step_um
line = profile - np.polyval(np.polyfit(place, profile, 1), place)
out["profile"] = {"Pa": float(np.mean(np.abs(line))), "Pq": float(np.sqrt(np.mean(line**2))), "STRt": float(np.ptp(line)), "STRq": float(np.sqrt(np.mean(line**2)))}
circle = scipy.optimize.least_squares(
    lambda p: p[0] + np.sqrt(p[1] ** 2 - (place - p[2]) ** 2) - p[1] - profile, [0.0, 1900.0, 80.0], x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=20000
)
out["circle"] = {"radius": float(circle.x[1]), "Pq": float(np.sqrt(np.mean((circle.fun - circle.fun.mean()) ** 2)))}
(here / "values.json").write_text(json.dumps(out, indent=1) + "\n")
print(json.dumps(out, indent=1))
