"""How far runout's result is from what the record declares: prints JSON; fails where that is more than its noise allows.

usage: check.py RESULT.h5
"""
import json
import sys

import h5py
import numpy as np

from truth import X, Y, error_um, form_errors_um

# The record has white noise of 0.05 µm rms in each of 8 readings: 120 turns leave 0.05/√120/√8 = 0.0016 µm of form at
# every angle, were there no filter. Motion has half of the readings along each axis; and what does not repeat, 0.02 µm at
# 1.371/rev, ends in the middle of its cycle, which leaves up to some 1e-3 µm in the lowest orders.
FORM_LIMIT_UM = 0.003
MOTION_LIMIT_UM = 0.006

with h5py.File(sys.argv[1]) as file:
    table = {name: column[...] for name, column in file["harmonics"].items()}


def spectra(quantity):
    """One spectrum a station, in the order of their names, orders from 0."""
    rows = table["quantity"] == quantity.encode()
    for station in np.unique(table["station"][rows]):
        at = rows & (table["station"] == station)
        found = np.zeros(table["order"][at].max() + 1, complex)
        found[table["order"][at]] = table["re"][at] + 1j * table["im"][at]
        yield found


form = form_errors_um(spectra("form"))
# Motion is Re Σ c e^{−inΦ} in the file.
motion = [max(error_um(found.conj(), lines) for found in spectra(axis)) for axis, lines in (("x", X), ("y", Y))]
print(json.dumps({"form_error_um": form, "motion_error_um": motion}))
if not (form[1] < FORM_LIMIT_UM and max(motion) < MOTION_LIMIT_UM):
    sys.exit(f"the result is further from the record's declared form and motion than its noise: {form} {motion}")
