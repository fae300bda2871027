"""A cylinder's height map: waves, a lay, scratches, pits, noise. Rows are rings, columns generatrices; heights in um."""
import numpy as np

RADIUS_MM, LENGTH_MM = 15.0, 14.7


def smoothed(noise, points):
    """Noise through a circular Gaussian, standard deviations in points along rows and columns; of unit variance."""
    fy, fx = np.fft.fftfreq(noise.shape[0])[:, None], np.fft.rfftfreq(noise.shape[1])
    shape = np.exp(-2 * np.pi**2 * ((points[0] * fy)**2 + (points[1] * fx)**2))
    smooth = np.fft.irfft2(np.fft.rfft2(noise) * shape, noise.shape)
    return smooth / smooth.std()


def surface(rows, columns, seed=5):
    """Heights (rows, columns), and the distances of columns and rows in mm."""
    random = np.random.default_rng(seed)
    angle = 2 * np.pi * np.arange(columns) / columns
    z = np.linspace(0, 1, rows)[:, None]
    heights = .03 * np.cos(2 * angle + z) + .02 * np.cos(5 * angle) + .05 * np.cos(columns // 32 * angle + 2 * np.pi * rows // 40 * z)
    heights = heights + .2 * smoothed(random.standard_normal((rows, columns)), (5, 3))
    heights -= .6 * np.clip(smoothed(random.standard_normal((rows, columns)), (2, 2)) - 2.5, 0, None)
    heights += .005 * random.standard_normal((rows, columns))
    return heights, 2 * np.pi * RADIUS_MM / columns, LENGTH_MM / (rows - 1)


def surfalize_values(heights, dx_mm, dy_mm):
    """surfalize's areal values, in our symbols and units; for its angle, rows run upwards."""
    from surfalize import Surface
    surface = Surface(heights[::-1].copy(), 1e3 * dx_mm, 1e3 * dy_mm)
    names = {"Smr1": "Smrk1", "Smr2": "Smrk2"}
    values = {names.get(name, name): float(getattr(surface, name)()) for name in surface.ISO_PARAMETERS if name != "Sxp"}
    # It leaves the direction to its own method.
    values["Std"] = float(surface.Std())
    scale = {"Sal": 1e-3, "Ssw": 1e-3, "Spd": 1e6, "Svd": 1e6, "Spc": 1e3, "Svc": 1e3}
    return {name: value * scale.get(name, 1.0) for name, value in values.items()}


def surfalize_profile(heights, dx_mm):
    """Its profile values of one row."""
    from surfalize import Profile
    profile = Profile(heights, 1e3 * dx_mm)
    return {name: float(getattr(profile, name)()) for name in ("Ra", "Rq", "Rp", "Rv", "Rz", "Rt", "Rsk", "Rku", "Rdq")}
