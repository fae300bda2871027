"""Reads a map that `runout convert` wrote as X3P and as SDF with the reference libraries, and compares both with the source.

    pip install x3pio sdfio surfalize numpy
    runout convert data/float64.x3p /tmp/map.x3p; runout convert data/float64.x3p /tmp/map.sdf
    python3 check_written.py data/float64.x3p /tmp/map.x3p /tmp/map.sdf
"""

import sys
import warnings

import numpy as np
import sdfio
import surfalize
import x3pio

warnings.simplefilter("ignore")
source, x3p, sdf = sys.argv[1:]
known = x3pio.read(source).layers[0].z
found = {
    "x3pio": x3pio.read(x3p).layers[0].z,
    "sdfio": sdfio.read(sdf).data,
    "surfalize X3P": 1e-6 * surfalize.Surface.load(x3p).data,
    "surfalize SDF": 1e-6 * surfalize.Surface.load(sdf).data,
}
for name, heights in found.items():
    assert np.array_equal(np.isnan(heights), np.isnan(known)), name
    share = np.nanmax(np.abs(heights / known - 1.0))
    print(f"{name:14} {heights.shape[0]} by {heights.shape[1]}, differs by {share:.1e} at most")
    assert share < 1e-12, name
