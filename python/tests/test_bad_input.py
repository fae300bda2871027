"""Bad input from Python: exceptions that say what was expected, never a crash."""

from __future__ import annotations

import gc
import pickle
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import runout

from conftest import EXAMPLE, RIG, pipeline, small_pipeline, small_recording, turns
from fuzz import calls

SAMPLES, MARKS = turns()


@pytest.mark.parametrize(
    ("samples", "marks", "error", "says"),
    [
        (SAMPLES[:0], MARKS, ValueError, "expected samples"),
        (SAMPLES[:, :0], MARKS, ValueError, "expected samples"),
        (SAMPLES.reshape(-1, 2, 2), MARKS, ValueError, "dimension"),
        (np.float64(3), MARKS, ValueError, "dimension"),
        (SAMPLES.astype(complex), MARKS, TypeError, "real numbers"),
        (SAMPLES.astype(bool), MARKS, TypeError, "real numbers"),
        (SAMPLES.astype(object), MARKS, TypeError, "real numbers"),
        (SAMPLES.astype(str), MARKS, TypeError, "real numbers"),
        ("samples", MARKS, TypeError, "real numbers"),
        (None, MARKS, TypeError, "real numbers"),
        (SAMPLES, MARKS[::-1], ValueError, "mark 1: expected a position above"),
        (SAMPLES, MARKS * np.nan, ValueError, "mark 0: expected a sample position"),
        (SAMPLES, MARKS + 1e9, ValueError, "mark 0: expected a sample position"),
        (SAMPLES, MARKS.reshape(1, -1), ValueError, "dimension"),
        (SAMPLES, None, ValueError, "either marks"),
    ],
)
def test_arrays_that_cannot_be_are_refused(samples: Any, marks: Any, error: type[Exception], says: str) -> None:
    with pytest.raises(error, match=says):
        runout.Recording.from_arrays({"initial": {"s1": runout.Capture(samples=samples, marks=marks)}})


@pytest.mark.parametrize(
    ("captures", "error"),
    [
        ({}, ValueError),
        ([], ValueError),
        ({"initial": {}}, ValueError),
        ({"initial": []}, ValueError),
        ({"initial": {"s1": SAMPLES}}, TypeError),
        ({"initial": {"s1": (SAMPLES,)}}, TypeError),
        ({"initial": {"s1": None}}, TypeError),
        ({"initial": {7: (SAMPLES, MARKS)}}, TypeError),
    ],
)
def test_captures_that_cannot_be_are_refused(captures: Any, error: type[Exception]) -> None:
    with pytest.raises(error):
        runout.run(small_pipeline(), runout.Recording.from_arrays(captures))


def test_keyword_arguments_that_cannot_be_are_refused() -> None:
    for more in ({"sample_rate_hz": 0}, {"sample_rate_hz": float("nan")}, {"speed_rpm": -1}, {"sensors": ["S1"]}, {"z_mm": {"s9": 1}},
                 {"z_mm": {"s1": float("inf")}}):
        with pytest.raises(ValueError):
            small_recording(**more)
    with pytest.raises(TypeError, match="list of sensor ids"):
        small_recording(sensors="S1")


def test_a_recording_that_does_not_fit_the_rig_is_a_data_error() -> None:
    recording = runout.Recording.from_arrays({"initial": {"s1": (SAMPLES, MARKS)}}, sample_rate_hz=1280)
    with pytest.raises(runout.DataError, match="no such capture") as found:
        runout.run(small_pipeline(), recording)
    assert found.value.kind == "unsuitable-data"
    narrow = (SAMPLES[:, :3], MARKS)
    with pytest.raises(runout.DataError, match="expected 4 channels") as found:
        runout.run(small_pipeline(), runout.Recording.from_arrays({"initial": {"s1": narrow}, "reversed": {"s1": narrow}}))
    assert found.value.help
    with pytest.raises(runout.DataError, match="expected a channel for the sensor `S2`"):
        runout.run(small_pipeline(), small_recording(sensors=["S1", "T2", "S3", "S4"]))
    with pytest.raises(runout.DataError, match="in memory, and there is none"):
        runout.run(small_pipeline())


def test_readings_that_are_no_numbers_are_reported() -> None:
    for bad in (np.nan, np.inf, 1e300):
        samples = SAMPLES.copy()
        samples[300:310, 1] = bad
        capture = (samples, MARKS)
        recording = runout.Recording.from_arrays({"initial": {"s1": capture}, "reversed": {"s1": capture}}, sample_rate_hz=1280)
        result = runout.run(small_pipeline(), recording)
        captures = result.summary["stations"][0]["captures"]
        assert all(one["turns_used"] < one["turns_recorded"] for one in captures), bad
    capture = (SAMPLES * np.nan, MARKS)
    with pytest.raises(runout.DataError):
        runout.run(small_pipeline(), runout.Recording.from_arrays({"initial": {"s1": capture}, "reversed": {"s1": capture}}))


def test_mistakes_of_a_configuration_have_their_place() -> None:
    with pytest.raises(runout.ConfigurationError) as found:
        runout.run(small_pipeline(separate={"plugin": "four-sensor-reversa"}), small_recording())
    assert "did you mean `four-sensor-reversal`" in (found.value.help or "") and (found.value.line or 0) > 1
    with pytest.raises(runout.ConfigurationError, match="--set preprocess.0.samples_per_rev"):
        runout.run(small_pipeline(), small_recording(), set={"preprocess.0.samples_per_rev": "many"})
    with pytest.raises(TypeError, match="rig.sensors.0.angle_deg"):
        runout.run(small_pipeline(rig={"sensors": [{"angle_deg": 1j}]}), small_recording())
    with pytest.raises(runout.ConfigurationError):
        runout.run(small_pipeline(rig=RIG | {"part_radius_mm": float("nan")}), small_recording())
    with pytest.raises(runout.DataError) as missing:
        runout.run("there is none.toml")
    assert missing.value.kind == "missing-file"
    for wrong in (None, 3, b"x", ["a"]):
        with pytest.raises(TypeError):
            runout.run(wrong)  # type: ignore[arg-type]
    with pytest.raises((ValueError, TypeError, OverflowError)):
        runout.run(small_pipeline(), small_recording(), threads=0)
    with pytest.raises(runout.CommandError):
        runout.compare(small_pipeline(), ["nothing"], small_recording())
    with pytest.raises(runout.CommandError):
        runout.plan(RIG, orders=(9, 2))
    with pytest.raises(ValueError, match="out"):
        runout.simulate({"plugin": "spindle"})
    assert isinstance(pickle.loads(pickle.dumps(found.value)), runout.ConfigurationError)


def test_hostile_names_are_only_names() -> None:
    hostile = ['"', "\\", "\n", "é✓", "a" * 10_000, "../../x", "{}", "\x7f", "'''"]
    for name in hostile:
        captures = {"initial": {name: turns(seed=1)}, "reversed": {name: turns(seed=2)}}
        result = runout.run(small_pipeline(title=name), runout.Recording.from_arrays(captures, sample_rate_hz=1280))
        assert result.title == name and result.summary["stations"][0]["station"] == name
    with pytest.raises((ValueError, TypeError)):
        runout.run(small_pipeline(title="\ud800"), small_recording())


def test_arrays_may_be_let_go_or_resized_while_they_are_read() -> None:
    samples, marks = turns(count=20_000)
    capture = (samples, marks)
    captures = {setup: {f"s{station}": capture for station in range(8)} for setup in ("initial", "reversed")}
    recording = runout.Recording.from_arrays(captures, sample_rate_hz=1280)
    outcome: list[object] = []

    def work() -> None:
        try:
            outcome.append(runout.run(small_pipeline(), recording))
        except runout.DataError as error:
            outcome.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    del captures, capture, recording
    gc.collect()
    samples.resize((1, 4), refcheck=False)
    thread.join()
    assert len(outcome) == 1


def test_writing_while_a_run_reads_does_not_crash() -> None:
    samples, marks = turns(count=5000)
    capture = (samples, marks)
    recording = runout.Recording.from_arrays({"initial": {"s1": capture}, "reversed": {"s1": capture}}, sample_rate_hz=1280)
    over = threading.Event()

    def write() -> None:
        while not over.is_set():
            samples[:] = samples[::-1]

    thread = threading.Thread(target=write)
    thread.start()
    try:
        for _ in range(3):
            try:
                runout.run(small_pipeline(), recording)
            except runout.Error:
                pass
    finally:
        over.set()
        thread.join()


def test_a_short_fuzz() -> None:
    assert calls(200, seed=5) == 200


def test_relative_paths_start_at_the_folder(campaign: Path) -> None:
    stages = {key: of for key, of in pipeline(load={"plugin": "hdf5", "path": campaign.name}).items()}
    result = runout.run(runout.Pipeline(folder=campaign.parent, **stages))
    assert len(result.summary["stations"]) == 3 and EXAMPLE.is_dir()
