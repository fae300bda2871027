"""Checks the result file of tests/result.rs from the outside: check_result.py FILE."""

import json
import sys

import h5py
import numpy

with h5py.File(sys.argv[1]) as file:
    assert file.attrs["format"] == "runout-result"
    assert file.attrs["version"] == 1
    assert file.attrs["title"] == "Shaft"
    assert file.attrs["program"] == "runout 0.1.0"

    form = file["form"]
    assert set(form) == {"section", "station", "z_mm", "angle_deg", "form_um", "std_um"}, list(form)
    angle_rad = numpy.radians(form["angle_deg"][:])
    assert numpy.array_equal(numpy.degrees(angle_rad), numpy.tile(numpy.arange(8) * 45.0, 2))
    # Form is Re sum c e^{+in alpha}; order 1 is lost and left out.
    expected = numpy.real((2 - 1j) * numpy.exp(2j * angle_rad))
    assert numpy.allclose(form["form_um"][:], expected, rtol=0, atol=1e-14)
    assert list(form["section"].asstr()[:]) == ["ä"] * 16
    assert list(form["station"].asstr()[:]) == ["s1"] * 8 + ["s2"] * 8
    assert (form["z_mm"][:] == 212.5).all()

    motion = file["motion"]
    names = ["x_um", "y_um", "tilt_x_urad", "tilt_y_urad"]
    assert set(motion) == {"station", "angle_deg", *names, *("std_" + name for name in names)}, list(motion)
    phi = numpy.radians(motion["angle_deg"][:])
    expected = numpy.real((0.5 + 0.25j) * numpy.exp(-1j * phi) + 1j * numpy.exp(-2j * phi))
    assert numpy.allclose(motion["x_um"][:], expected, rtol=0, atol=1e-14)
    assert numpy.isnan(motion["y_um"][:]).all()

    harmonics = file["harmonics"]
    assert harmonics["observable"].dtype == bool
    assert list(harmonics["observable"][:4]) == [False, True, True, True]
    assert numpy.isnan(harmonics["re"][0]) and numpy.isnan(harmonics["std"][0])
    assert list(harmonics["order"][:]) == [1, 2] * 4

    assert json.loads(file["summary"].asstr()[()])["lost_orders"]["form"] == [1]
    assert list(file["warnings"].asstr()[:]) == ["order 1 of the form is lost", "s1: left out 3 points"]
    provenance = file["provenance"]
    assert "µm" in provenance["configuration"].asstr()[()]
    assert list(provenance["inputs/path"].asstr()[:]) == ["shaft.h5"]
    assert list(provenance["inputs/bytes"][:]) == [1234]
    assert provenance["inputs/blake3"].asstr()[0] == "ab" * 32
