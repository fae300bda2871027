"""Checks a measurement file of tests/foreign.rs from the outside: check_measurement.py FILE."""

import sys

import h5py
import numpy

with h5py.File(sys.argv[1]) as file:
    assert file.attrs["format"] == "runout-measurement", file.attrs["format"]
    assert file.attrs["version"] == 1
    assert file.attrs["length_unit"] == "um"
    assert file.attrs["title"] == "Welle µ"
    assert set(file) == {"initial", "reversed", "truth"}, list(file)
    for setup in ("initial", "reversed"):
        station = file[setup]["a"]
        assert station.attrs["z_mm"] == 1.5
        assert station.attrs["speed_rpm"] == 60
        samples = station["samples"]
        assert list(samples.attrs["sensors"]) == ["S1", "S2"], samples.attrs["sensors"]
        assert samples.attrs["sample_rate_hz"] == 50
        assert samples.shape == (20_000, 2), samples.shape
        um = samples[:].astype(float)
        if samples.dtype.kind == "i":
            um = um * samples.attrs["scale"] + samples.attrs["offset"]
        ramp = (numpy.arange(20_000) - 100) / 64
        assert numpy.array_equal(um[:, 0], ramp), um[:5]
        assert numpy.array_equal(um[:, 1], -ramp), um[:5]
        turns = numpy.arange(1, 401)
        assert numpy.array_equal(station["index"][:], turns * 50 - 0.25), station["index"][:5]
    assert file["truth"].attrs["scenario"] == "seed = 1"
    form = file["truth/a/form_um"]
    assert numpy.array_equal(form["S1"][:], numpy.full(36, 0.5))
    assert numpy.array_equal(form["S2"][:], numpy.full(36, 1.5))
