"""A program as users write it, for the type checker."""

import numpy as np

import runout
from runout.exporters import Parquet
from runout.preprocessors import LowPass, SynchronousAverage
from runout.separators import FourSensorReversal
from runout.tables import Rig

samples = np.zeros((1280, 4))
marks = np.arange(11) * 128.0
recording = runout.Recording.from_arrays(
    {"initial": {"s1": (samples, marks)}, "reversed": {"s1": runout.Capture(samples=samples, marks=marks)}}, sample_rate_hz=1280
)
rig = Rig(part_radius_mm=30, sensors=[{"id": "S1", "angle_deg": 0}], setups=[{"id": "initial"}])
pipeline = runout.Pipeline(
    load=recording,
    rig=rig,
    preprocess=[LowPass(cutoff_hz=500), SynchronousAverage(samples_per_rev=64)],
    separate=FourSensorReversal(),
    export=[Parquet(path="out")],
)


def report() -> float:
    """What a program does with a result."""
    result = runout.run(pipeline, set={"preprocess.0.cutoff_hz": 300}, progress=lambda done, of, name: print(done, of, name))
    value: runout.Value = result.value("RONt", section="a")
    coefficients, std = result.coefficients("form", section="a")
    diagnosis: runout.Diagnosis = runout.diagnose(pipeline)
    largest: float = float(np.nanmax(np.abs(coefficients) / std))
    return value.value + largest + diagnosis.after.residual_rms
