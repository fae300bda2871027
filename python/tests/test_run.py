"""Runs: from files, from arrays, from pipelines in code; equal to the command line's."""

from __future__ import annotations

import csv
import json
import pickle
import subprocess
import sys
import threading
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import runout
from runout.loaders import Hdf5
from runout.preprocessors import LowPass, SynchronousAverage, Trim
from runout.separators import FourSensorReversal

from conftest import EXAMPLE, RIG, pipeline, small_pipeline, small_recording, turns

PROBE = EXAMPLE.parent / "15-touch-probe"
SETUPS = [{"id": "r0"}, {"id": "r100", "ring_deg": 100.0}, {"id": "r217", "ring_deg": 217.0}]


def program(*words: object) -> subprocess.CompletedProcess[str]:
    """The command line of the package."""
    return subprocess.run([sys.executable, "-m", "runout", *map(str, words)], capture_output=True, text=True)


def comparable(found: Any) -> Any:
    """Without the truth, which only the simulated file carries, and warnings, which name their file."""
    if isinstance(found, dict):
        own = ("truth", "truth_form_rms_error_um", "warnings")
        return {key: comparable(value) for key, value in found.items() if key not in own}
    return [comparable(value) for value in found] if isinstance(found, list) else found


def test_arrays_give_the_command_line_s_result_to_the_last_bit(campaign: Path, arrays: runout.Recording, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    pyarrow = pytest.importorskip("pyarrow")
    settings = [f"load.path={campaign}", f"export=[{{ plugin = 'parquet', path = '{tmp_path}' }}]"]
    done = program("run", EXAMPLE / "pipeline.toml", "--json", *(word for one in settings for word in ("--set", one)))
    assert done.returncode == 0, done.stderr
    result = runout.run(EXAMPLE / "pipeline.toml", arrays, set={"export": []})
    expected = json.loads(done.stdout)
    for key in ("stations", "values", "lost_orders", "part"):
        assert comparable(result.summary.get(key)) == comparable(expected.get(key)), key
    for name, table in result.tables.items():
        written = parquet.read_table(tmp_path / f"{name}.parquet")
        here = pyarrow.table(table).cast(written.schema)
        for column in written.column_names:
            ours, theirs = here[column].to_numpy(), written[column].to_numpy()
            if ours.dtype == np.float64:
                ours, theirs = ours.view(np.int64), theirs.view(np.int64)
            assert np.array_equal(ours, theirs), (name, column)


def test_a_pipeline_in_code_is_the_same_as_one_in_toml(campaign: Path, arrays: runout.Recording) -> None:
    stages: dict[str, Any] = {
        "preprocess": [Trim(), LowPass(cutoff_hz=500), SynchronousAverage(samples_per_rev=512)],
        "separate": FourSensorReversal(),
        "rig": RIG,
    }
    from_code = runout.run(runout.Pipeline(load=arrays, **stages))
    from_file = runout.run(runout.Pipeline(load=Hdf5(path=str(campaign)), **stages))
    from_dictionary = runout.run(pipeline(), arrays)
    assert from_code.summary["stations"] == from_dictionary.summary["stations"]
    form = [one.tables["form"]["form_um"] for one in (from_code, from_file, from_dictionary)]
    assert np.array_equal(form[0], form[1]) and np.array_equal(form[0], form[2])


def test_modules_of_stages_need_no_import_of_their_own() -> None:
    script = "import runout; print(runout.loaders.Hdf5.__name__, runout.separators.FourSensorReversal.__name__, 'tables' in dir(runout))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.split() == ["Hdf5", "FourSensorReversal", "True"], done.stderr
    with pytest.raises(AttributeError, match="no attribute `loader`"):
        runout.loader  # type: ignore[attr-defined]


def test_contiguous_samples_are_not_copied() -> None:
    samples, marks = turns(count=4000)
    assert samples.nbytes > 16e6
    tracemalloc.start()
    capture = runout.Capture(samples=samples, marks=marks)
    recording = runout.Recording.from_arrays({"initial": {"s1": capture}, "reversed": {"s1": capture}}, sample_rate_hz=1280)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    held = recording.stations[0].captures["initial"].samples
    assert held is samples and peak < samples.nbytes / 10


def test_other_dtypes_strides_and_read_only_arrays_give_the_same() -> None:
    samples, marks = turns()
    samples = np.round(samples * 100)
    expected = runout.run(small_pipeline(), recorded(samples, marks)).tables["form"]["form_um"]
    wide = np.zeros((samples.shape[0] * 2, samples.shape[1]))
    wide[::2] = samples
    read_only = samples.copy()
    read_only.flags.writeable = False
    same = [samples.astype(np.float32), samples.astype(np.int16), np.asfortranarray(samples), wide[::2], read_only,
            samples.astype(">f8"), samples.tolist()]
    for other in same:
        assert np.array_equal(runout.run(small_pipeline(), recorded(other, marks)).tables["form"]["form_um"], expected)


def recorded(samples: Any, marks: Any) -> runout.Recording:
    return runout.Recording.from_arrays({"initial": {"s1": (samples, marks)}, "reversed": {"s1": (samples, marks)}}, sample_rate_hz=1280)


def test_an_encoder_s_angle_takes_the_place_of_marks() -> None:
    samples, marks = turns()
    angle = np.arange(samples.shape[0]) * 360 / 128
    capture = runout.Capture(samples=samples, angle_deg=angle)
    by_angle = runout.Recording.from_arrays({"initial": {"s1": capture}, "reversed": {"s1": capture}}, sample_rate_hz=1280)
    form = [runout.run(small_pipeline(), one).tables["form"]["form_um"] for one in (by_angle, recorded(samples, marks))]
    # An angle has one turn less than the marks say: the noise of 0.01 µm is averaged over other readings.
    assert np.allclose(form[0], form[1], atol=5e-3)


def test_sensors_may_be_named_in_any_order() -> None:
    samples, marks = turns()
    names = ["S3", "spare", "S1", "S4", "S2"]
    shuffled = np.stack([samples[:, 2], samples[:, 0] * 0, samples[:, 0], samples[:, 3], samples[:, 1]], axis=1)
    capture = runout.Capture(samples=shuffled, marks=marks, sensors=names)
    named = runout.Recording.from_arrays({"initial": {"s1": capture}, "reversed": {"s1": capture}}, sample_rate_hz=1280)
    form = [runout.run(small_pipeline(), one).tables["form"]["form_um"] for one in (named, recorded(samples, marks))]
    assert np.array_equal(form[0], form[1])


def test_progress_is_called_and_may_stop_the_work(campaign: Path) -> None:
    seen: list[tuple[int, int, str]] = []
    settings = {"load.path": str(campaign), "export": []}
    runout.run(EXAMPLE / "pipeline.toml", set=settings, progress=lambda *state: seen.append(state))
    assert [state[:2] for state in seen] == [(1, 3), (2, 3), (3, 3)]

    def refuse(done: int, of: int, name: str) -> None:
        raise ZeroDivisionError(name)

    with pytest.raises(ZeroDivisionError):
        runout.run(EXAMPLE / "pipeline.toml", set=settings, progress=refuse)


def test_what_is_stopped_leaves_no_file(campaign: Path, tmp_path: Path) -> None:
    export = [{"plugin": "hdf5", "path": str(tmp_path / "result.h5")}]

    def refuse(done: int, of: int, name: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        runout.run(EXAMPLE / "pipeline.toml", set={"load.path": str(campaign), "export": export}, progress=refuse)
    assert not list(tmp_path.rglob("*.*"))


def test_ctrl_c_stops_a_run(tmp_path: Path) -> None:
    script = """
import os, signal, sys, threading
sys.path.insert(0, sys.argv[1])
import runout
from conftest import small_pipeline, turns
capture = turns(count=40000)
captures = {setup: {f"s{station}": capture for station in range(200)} for setup in ("initial", "reversed")}
recording = runout.Recording.from_arrays(captures, sample_rate_hz=1280)
threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    runout.run(small_pipeline(export=[{"plugin": "hdf5", "path": sys.argv[2]}]), recording)
except KeyboardInterrupt:
    sys.exit(42)
"""
    out = tmp_path / "result.h5"
    words = [sys.executable, "-c", script, str(Path(__file__).parent), str(out)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60)
    assert done.returncode == 42, done.stderr
    assert not list(tmp_path.rglob("*.*"))


def test_two_threads_run_at_once() -> None:
    results: list[np.ndarray] = []
    recording = small_recording()

    def work() -> None:
        results.append(runout.run(small_pipeline(), recording).tables["form"]["form_um"])

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 4 and all(np.array_equal(results[0], other) for other in results)


def test_check_compare_plan_and_inspect_give_documents(campaign: Path, arrays: runout.Recording) -> None:
    report = runout.check(pipeline(), arrays)
    assert report["rig"]["sensors"] == 4 and not report["lost_orders"]["form"]
    comparison = runout.compare(pipeline(), ["harmonic-least-squares"], arrays)
    assert len(comparison["stations"]) == 3
    plan = runout.plan(RIG, orders=(2, 20))
    assert plan["lost_orders"]["form"] == []
    assert runout.inspect(campaign)
    lost = runout.check(pipeline(), set={"rig.setups.1.sensors_deg": 0})
    assert lost["lost_orders"]["form"][:2] == [2, 4]


def test_diagnose_finds_what_the_rig_lacks(tmp_path: Path) -> None:
    example = EXAMPLE.parent / "06-closed-loop"
    file = tmp_path / "campaign.h5"
    runout.simulate(example / "scenario.toml", file)
    diagnosis = runout.diagnose(example / "pipeline.toml", set={"load.path": str(file), "export": []})
    assert [added.effect for added in diagnosis.added] == ["reversal-angle"]
    (parameter,) = [one for one in diagnosis.added[0].parameters]
    assert parameter.unit and abs(parameter.value) > 0
    assert diagnosis.after.residual_rms < diagnosis.before.residual_rms
    assert "reversal-angle" in diagnosis._repr_html_() and "form" in diagnosis.tables


def test_the_program_is_in_the_package() -> None:
    assert "runout" in program("--version").stdout
    assert program("run", "nothing.toml").returncode == 2
    assert program("walk").returncode == 2


def test_points_in_memory_are_those_of_a_file() -> None:
    with open(PROBE / "touches.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    columns = {name: [row[place] for row in rows[1:]] for place, name in enumerate(rows[0])}
    given = {name: of if any(not _is_number(one) for one in of) else np.array(of, dtype=float) for name, of in columns.items()}
    keys = {"separate": {"plugin": "touch-probe", "ring_radius_mm": 25.0, "max_order": 15, "setups": SETUPS}}
    of_file = runout.run(keys | {"load": {"plugin": "points", "path": str(PROBE / "touches.csv")}})
    points = runout.Points.from_arrays(given)
    of_arrays = runout.run(keys | {"load": {"plugin": "arrays"}}, points)
    assert of_arrays.summary["values"] == of_file.summary["values"]
    built = runout.Pipeline(load=points, separate=keys["separate"])
    assert len(runout.run(built).values) == len(of_file.values)
    assert runout.diagnose(built).verdict == runout.diagnose(keys | {"load": {"plugin": "points", "path": str(PROBE / "touches.csv")}}).verdict


def test_messages_name_points_in_memory() -> None:
    points = runout.Points.from_arrays(x_mm=[1.0, 2.0], y_mm=[1.0, 2.0])
    keys = {"separate": {"plugin": "touch-probe", "ring_radius_mm": 25.0, "max_order": 15, "setups": SETUPS}, "load": {"plugin": "arrays"}}
    with pytest.raises(runout.Error) as raised:
        runout.run(keys, points)
    said = " ".join([str(raised.value), *raised.value.causes])
    assert "runout.Points" in said and "points.csv" not in said and "runout-" not in said


def test_points_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="one length"):
        runout.Points.from_arrays(x_mm=[1.0, 2.0], y_mm=[1.0])
    with pytest.raises(ValueError, match="found none"):
        runout.Points.from_arrays({})
    with pytest.raises(ValueError, match="a column"):
        runout.Points.from_arrays(x_mm=np.zeros((2, 2)))
    with pytest.raises(TypeError, match="numbers or texts"):
        runout.Points.from_arrays(x_mm=np.array([1j]))


def test_a_comparison_and_a_plan_say_what_is_in_them(arrays: runout.Recording) -> None:
    comparison = runout.compare(pipeline(), ["harmonic-least-squares"], arrays)
    assert comparison.methods == ["four-sensor-reversal", "harmonic-least-squares"] and comparison.refused == {}
    row = comparison.rows[0]
    assert row["method"] == "four-sensor-reversal" and row["quantity"] == "form" and row["rms"] > 0
    assert any(row["worst_e_n"] is not None for row in comparison.rows)
    assert "Comparison" in comparison._repr_html_() and "four-sensor" in repr(comparison)
    plan = runout.plan(RIG, orders=(2, 20))
    assert plan.lost_orders == plan["lost_orders"] and set(plan.noise_gain) == set(range(2, 21))
    assert "Plan" in plan._repr_html_() and repr(plan).startswith("<runout.Plan: lost orders: ")
    assert pickle.loads(pickle.dumps(comparison)) == comparison


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def test_an_angle_may_begin_anew_each_turn() -> None:
    samples, _ = turns()
    angle = np.arange(len(samples)) * 360.0 / 128 + 10
    values = []
    for given in (angle, np.mod(angle, 360), np.mod(angle + 180, 360) - 180):
        captures = {setup: {"s1": runout.Capture(samples, angle_deg=given)} for setup in ("initial", "reversed")}
        recording = runout.Recording.from_arrays(captures, sample_rate_hz=1280.0)
        values.append(runout.run(small_pipeline(), recording).value("RONt", section="a", reference="LSCI", filter="none").value)
    # An angle from -180 on counts its turns from another sample.
    assert values[1] == pytest.approx(values[0], rel=1e-9) and values[2] == pytest.approx(values[0], rel=0.1)
