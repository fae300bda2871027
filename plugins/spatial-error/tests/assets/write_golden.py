"""Predictions of scikit-learn and pykrige for covariances that are given: golden.json, which tests compare with.

    python write_golden.py > golden.json

Three fields at 60 places are predicted at 25 others. scikit-learn has a mean of zero (`declared = []`), the nugget as `alpha`;
pykrige a mean that is fitted (`declared = ["translation"]`), ranges of its own (exponential: 3 times ours; gaussian: sqrt(2) * 7/4),
scaled coordinates for anisotropy, and a variance that includes the nugget, which is taken out here.
"""
import json
import sys
import warnings

import numpy as np
from pykrige.ok3d import OrdinaryKriging3D
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern

warnings.filterwarnings("ignore")
rng = np.random.default_rng(21)
SIZE = np.array([600.0, 400.0, 350.0])
places = np.round(rng.random((60, 3)) * SIZE, 3)
queries = np.round(rng.random((25, 3)) * SIZE * 1.2 - 0.1 * SIZE, 3)
u = places / SIZE
fields = np.stack([
    8 * np.sin(3 * u[:, 0]) * np.cos(2 * u[:, 1]) + 3 * u[:, 2],
    5 * np.sin(4 * u[:, 2] + u[:, 0]) - 2,
    12 * u[:, 0] * u[:, 1] * u[:, 2] + rng.standard_normal(60),
]).round(3)
kernels = {
    "gaussian": RBF,
    "exponential": lambda length_scale: Matern(length_scale, nu=0.5),
    "matern-3/2": lambda length_scale: Matern(length_scale, nu=1.5),
    "matern-5/2": lambda length_scale: Matern(length_scale, nu=2.5),
}
cases = []


def add(peer, declared, family, sill, ranges, nugget, predict):
    mean, std = zip(*(predict(field) for field in fields))
    cases.append(dict(
        peer=peer, declared=declared, variogram=family, sill_um=sill, range_mm=ranges, nugget_um=nugget,
        mean=[one.tolist() for one in mean], std=[one.tolist() for one in std],
    ))


def sklearn(family, sill, ranges, nugget):
    kernel = ConstantKernel(sill ** 2, "fixed") * kernels[family](np.array(ranges))
    model = GaussianProcessRegressor(kernel, alpha=nugget ** 2, optimizer=None)
    add("scikit-learn", [], family, sill, ranges, nugget, lambda field: model.fit(places, field).predict(queries, return_std=True))


def pykrige(family, sill, ranges, nugget):
    own = {"exponential": 3.0, "gaussian": np.sqrt(2) * 7 / 4, "spherical": 1.0}[family]

    def predict(field):
        model = OrdinaryKriging3D(
            *places.T, field, variogram_model=family,
            variogram_parameters=dict(sill=sill ** 2 + nugget ** 2, range=own * ranges[0], nugget=nugget ** 2),
            anisotropy_scaling_y=ranges[0] / ranges[1], anisotropy_scaling_z=ranges[0] / ranges[2],
        )
        mean, variance = model.execute("points", *queries.T, backend="vectorized")
        return np.asarray(mean), np.sqrt(np.asarray(variance) - nugget ** 2)

    add("pykrige", ["translation"], family, sill, ranges, nugget, predict)


for family in kernels:
    sklearn(family, 6.0, [220.0, 150.0, 180.0], 0.7)
for family in ("exponential", "gaussian", "spherical"):
    pykrige(family, 6.0, [220.0, 150.0, 180.0], 0.7)
pykrige("spherical", 6.0, [500.0, 500.0, 500.0], 0.0)
sklearn("matern-3/2", 20.0, [900.0, 900.0, 300.0], 0.05)
json.dump(dict(places_mm=places.tolist(), queries_mm=queries.tolist(), fields_um=fields.tolist(), cases=cases), sys.stdout)
