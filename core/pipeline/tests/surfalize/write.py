"""Writes values.json: a small surface and what surfalize makes of it. usage: write.py (with surfalize installed)"""
import json, sys, warnings
from importlib.metadata import version
from pathlib import Path

warnings.filterwarnings("ignore")
here = Path(__file__).resolve().parent
sys.path.insert(0, str(here.parents[2] / "benchmarks/areal"))
import numpy as np
from surface import surface, surfalize_profile, surfalize_values
from surfalize import Surface
from surfalize.abbottfirestone import AbbottFirestoneCurve

rows, columns = 72, 120
heights, dx_mm, dy_mm = surface(rows, columns)
heights = np.round(heights * 1e5)                     # whole numbers of 10 pm
um = heights * 1e-5
# Its material ratio curve has 10 000 classes; with as many classes as points it is the points themselves.
curve = AbbottFirestoneCurve(Surface(um, 1e3 * dx_mm, 1e3 * dy_mm), nbins=um.size)
exact = dict(Sk=curve.k(), Spk=curve.pk(), Svk=curve.vk(), Smrk1=curve.mr1(), Smrk2=curve.mr2(), Sdc=curve.dc(2.5, 50),
             Vmp=curve.vmp(), Vmc=curve.vmc(), Vvc=curve.vvc(), Vvv=curve.vvv())
out = dict(program="surfalize " + version("surfalize"), columns=columns, dx_mm=dx_mm, dy_mm=dy_mm,
           areal=surfalize_values(um, dx_mm, dy_mm), as_many_classes_as_points={k: float(v) for k, v in exact.items()},
           profile=surfalize_profile(um[0], dx_mm), heights_10_pm=[int(h) for h in heights.ravel()])
text = json.dumps(out, indent=1)
head, numbers = text.split('"heights_10_pm": [')
numbers = [n.strip() for n in numbers.split("]")[0].split(",")]
lines = [", ".join(numbers[i:i + 24]) for i in range(0, len(numbers), 24)]
(here / "values.json").write_text(head + '"heights_10_pm": [\n  ' + ",\n  ".join(lines) + "\n ]\n}\n")
