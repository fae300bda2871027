"""What an external program may be, as an object without a process: the same tables, the same checks, tracebacks."""

from __future__ import annotations

import importlib.util
import sys
import traceback
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import runout

pa = pytest.importorskip("pyarrow")
csv = pytest.importorskip("pyarrow.csv")
from conftest import small_pipeline, small_recording, turns  # noqa: E402
from runout import external  # noqa: E402

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
EXAMPLE = EXAMPLES / "26-own-program"


def module(file: Path) -> Any:
    spec = importlib.util.spec_from_file_location(file.stem, file)
    assert spec is not None and spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Example 26 with a small campaign, without exports."""
    folder = tmp_path_factory.mktemp("own")
    few = {"recording.stations.count": 2, "recording.revolutions": 20}
    runout.simulate(EXAMPLE / "scenario.toml", folder / "shaft.h5", set=few)
    for name in ("pipeline.toml", "sphere.toml"):
        text = (EXAMPLE / name).read_text().partition("[[export]]")[0].partition("[[evaluator]]")[0]
        (folder / name).write_text(text)
    (folder / "sphere.csv").write_text((EXAMPLE / "sphere.csv").read_text())
    return folder


def same(one: runout.Result, other: runout.Result) -> None:
    """All tables, to the bit."""
    assert set(one.tables) == set(other.tables)
    for name in one.tables:
        found, expected = (pa.table(result.tables[name]) for result in (one, other))
        # NaN is what is lost.
        assert repr(found.to_pydict()) == repr(expected.to_pydict()) and found.schema == expected.schema, name


def served(folder: Path, text: str) -> list[str]:
    """The command of a script that serves the object `plugin`."""
    script = folder / "own.py"
    script.write_text(f"{text}\nif __name__ == '__main__':\n    import runout.external\n    runout.external.serve(plugin)\n")
    return [sys.executable, str(script)]


def test_a_separator_of_turns_gives_what_the_program_of_its_class_gives(folder: Path) -> None:
    plugin = module(EXAMPLE / "served.py").ThreePoint()
    command = [sys.executable, str(EXAMPLE / "served.py")]
    stages = folder / "pipeline.toml"
    program = runout.run(stages, set={"separate.command": command})
    config = {"max_noise_gain": 30}
    own = runout.run(stages, set={"separate": {"plugin": plugin, "config": config}})
    same(own, program)
    assert own.summary["warnings"] == program.summary["warnings"]
    # Other ways to name it.
    named = runout.run(stages, plugins=[plugin], set={"separate": {"plugin": plugin.name, "config": config}})
    same(named, program)
    same(runout.run(stages, set={"separate": plugin}), program)
    report = runout.check(stages, set={"separate": plugin})
    assert any("known after the run" in note for note in report["notes"])
    comparison = runout.compare(stages, [plugin, "three-point"], set={"separate": plugin})
    assert plugin.name in str(comparison["methods"]) and "three-point" in str(comparison["methods"])


GAIN = '''
import numpy as np

class Gain:
    """Divides the first sensor by its gain."""

    def preprocess(self, average):
        gain = np.ones(average.readings.shape)
        gain[:, average.sensors.index(average.config["sensor"])] /= average.config["gain"]
        average.warnings.append(f"{average.setup}: {average.turns} turns")
        return gain * average.readings, gain

plugin = Gain()
'''


def test_a_preprocessor_gives_what_the_program_of_its_class_gives(folder: Path) -> None:
    (folder / "gain_class.py").write_text(GAIN)
    plugin, command = module(folder / "gain_class.py").plugin, served(folder, GAIN)
    config = {"sensor": "S2", "gain": 1.25}

    def ran(*preprocess: dict[str, Any], **gain: float) -> runout.Result:
        stages = small_pipeline()
        sensors = [sensor | (gain if sensor["id"] == "S2" else {}) for sensor in stages["rig"]["sensors"]]
        stages = stages | {"rig": stages["rig"] | {"sensors": sensors}, "preprocess": [*stages["preprocess"], *preprocess]}
        return runout.run(stages, small_recording())

    program = ran({"plugin": "external", "command": command, "config": config})
    own = ran({"plugin": plugin, "config": config})
    same(own, program)
    assert any("initial: " in text for text in own.summary["warnings"])
    # What the rig says of the gain does the same.
    found, expected = (pa.table(result.tables["harmonics"]) for result in (own, ran(gain=1.25)))
    for name in ("re", "im", "std"):
        assert np.allclose(found[name].to_numpy(), expected[name].to_numpy(), rtol=1e-6, atol=1e-9, equal_nan=True), name


SPHERE = '''
import numpy as np
from runout.external import Value

class Sphere:
    """Least-squares sphere."""
    columns = ["x_mm", "y_mm", "z_mm"]
    symbols = [("centre", "mm"), ("radius", "mm")]

    def values(self, points, config):
        found = np.array([points[name].mean() for name in self.columns] + [config.get("start_mm", 10.0)])
        for _ in range(20):
            away = np.stack([points[name] for name in self.columns], 1) - found[:3]
            distance = np.linalg.norm(away, axis=1)
            jacobian = np.column_stack([-away / distance[:, None], -np.ones(len(away))])
            found += np.linalg.lstsq(jacobian, found[3] - distance, rcond=None)[0]
        left = np.linalg.norm(away, axis=1) - found[3]
        std = np.sqrt(left @ left / (len(left) - 4) * np.diag(np.linalg.inv(jacobian.T @ jacobian)))
        of = ["x", "y", "z", None]
        return [Value("radius" if axis is None else "centre", *pair, "mm", axis) for axis, *pair in zip(of, found, std)], 1e3 * left

plugin = Sphere()
'''


def sphere(folder: Path, text: str = SPHERE) -> Any:
    (folder / "sphere_class.py").write_text(text)
    return module(folder / "sphere_class.py").plugin


def test_a_separator_of_points_gives_what_the_program_of_its_class_gives(folder: Path) -> None:
    plugin, command = sphere(folder), served(folder, SPHERE)
    limit = [{"symbol": "radius", "lower": 14.9, "upper": 15.1, "unit": "mm"}]
    symbols = [{"symbol": symbol, "unit": unit} for symbol, unit in plugin.symbols]
    program = runout.run(folder / "sphere.toml", set={"separate.command": command, "separate.symbols": symbols, "limit": limit})
    own = runout.run(folder / "sphere.toml", set={"separate": plugin, "limit": limit})
    same(own, program)
    assert own.summary["values"] == program.summary["values"] and len(own.summary["values"]) == 4
    assert own.summary["limits"][0]["decision"] == "conforms"
    radius = own.summary["values"][3]
    assert abs(radius["value"] - 15) < 0.01 and radius["std"] < 0.01


class WarmAir:
    """Readings that follow the temperature of the air."""

    name = "warm-air"
    parameters = [("slope", "urad/K", 0.5)]
    columns = ["temperature_k"]

    def change(self, points: dict[str, Any], config: dict[str, Any]) -> dict[str, dict[str, Any]]:
        return {"slope": {"slope_urad": points["temperature_k"] - 20}}


def test_an_effect_of_points_is_found_and_taken_out(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    rows = ["line,from_x_mm,from_y_mm,to_x_mm,to_y_mm,slope_urad,temperature_k"]
    lines = {f"row {n}": lambda s, n=n: (s, n) for n in range(8)} | {f"column {n}": lambda s, n=n: (n, s) for n in range(8)}
    lines |= {"rising": lambda s: (s, s), "falling": lambda s: (s, 7 - s)}
    for name, place in lines.items():
        for step in range(7):
            (x0, y0), (x1, y1) = place(step), place(step + 1)
            height = [2 * np.sin(x / 3) + y * y / 12 + 0.1 * x * y for x, y in ((x0, y0), (x1, y1))]
            kelvin = 20 + np.sin(0.37 * len(rows))
            tilt = 10 * (height[1] - height[0]) / np.hypot(x1 - x0, y1 - y0)
            slope = tilt + 3 * (len(name) % 3) + 0.8 * (kelvin - 20) + 0.1 * rng.standard_normal()
            rows.append(f"{name},{100 * x0},{100 * y0},{100 * x1},{100 * y1},{slope},{kelvin}")
    (tmp_path / "plate.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "plate.toml").write_text('load = { plugin = "points", path = "plate.csv" }\nseparate = { plugin = "flatness" }\n')
    found = runout.diagnose(tmp_path / "plate.toml", plugins=[WarmAir()])
    (added,) = found.added
    (slope,) = added.parameters
    assert added.effect == "warm-air" and slope.std is not None and abs(slope.value - 0.8) < 4 * slope.std < 0.3

    class Short(WarmAir):
        def change(self, points: dict[str, Any], config: dict[str, Any]) -> dict[str, dict[str, Any]]:
            return {"slope": {"slope_urad": points["temperature_k"][1:]}}

    with pytest.raises(ValueError, match=r"expected one number a point, 126, of `slope_urad`, found the shape \(125,\)"):
        runout.diagnose(tmp_path / "plate.toml", plugins=[Short()])


class Lobes:
    """The largest harmonic of each section's form, and its order."""

    symbols = [("largest-harmonic", "um"), ("largest-order", "1/rev")]

    def evaluate(self, tables: dict[str, Any], config: dict[str, Any]) -> list[external.Value]:
        rows = [row for row in tables["harmonics"].to_pylist() if row["quantity"] == "form" and row["observable"]]
        assert {"form", "motion", "values"} <= set(tables) and len(tables["values"]) > 0
        found = []
        for station in dict.fromkeys(row["station"] for row in rows):
            here = [row for row in rows if row["station"] == station and row["order"] >= config.get("first", 2)]
            largest = max(here, key=lambda row: abs(complex(row["re"], row["im"])))
            size = abs(complex(largest["re"], largest["im"]))
            found.append(external.Value("largest-harmonic", size, largest["std"], "um", station, "largest harmonic of form"))
            found.append(external.Value("largest-order", largest["order"], None, "1/rev", station))
        return found


def test_an_evaluator_adds_values_that_limits_decide(folder: Path) -> None:
    stages = {"separate": {"plugin": "three-point"}, "limit": [{"symbol": "largest-harmonic", "upper": 100, "unit": "um"}]}
    result = runout.run(folder / "pipeline.toml", set=stages | {"evaluator": [{"plugin": Lobes(), "config": {"first": 3}}]})
    values = result.summary["values"]
    assert [value["symbol"] for value in values] == ["largest-harmonic", "largest-order"] * 2
    coefficients, std = result.coefficients("form", station=values[0]["of"])
    order = int(np.nanargmax(np.abs(coefficients[3:]))) + 3
    assert values[1]["value"] == order and values[0]["value"] == pytest.approx(abs(coefficients[order]), abs=1e-12)
    assert values[0]["std"] == pytest.approx(std[order], rel=1e-9)
    assert result.summary["limits"][0]["decision"] == "conforms"
    assert len(result.tables["named_values"]) == 4
    # The same object by its name, and as a program.
    named = runout.run(folder / "pipeline.toml", plugins=[Lobes()], set=stages | {"evaluator": [{"plugin": "lobes", "config": {"first": 3}}]})
    assert named.summary["values"] == values


def test_an_exporter_and_a_loader_write_and_read_files(folder: Path, tmp_path: Path) -> None:
    class Title:
        def export(self, tables: dict[str, Any], summary: dict[str, Any], files: dict[str, str], config: dict[str, Any]) -> None:
            assert len(tables["form"]) > 100
            Path(files["title.txt"]).write_text(summary["title"] + config["end"])

    export = [{"plugin": Title(), "path": str(tmp_path / "out"), "files": ["title.txt"], "config": {"end": "!"}}]
    runout.run(folder / "pipeline.toml", set={"separate": {"plugin": "three-point"}, "export": export})
    assert (tmp_path / "out" / "title.txt").read_text() == "Turned shaft, three sensors, a program separates!"

    class Reads:
        def load(self, path: str, columns: Any, config: dict[str, Any]) -> dict[str, Any]:
            assert [column.name for column in columns] == ["x_mm", "y_mm", "z_mm"] and columns[0].kind == "number"
            return dict(zip(("x_mm", "y_mm", "z_mm"), np.loadtxt(path, delimiter=";").T * config["mm"]))

    table = csv.read_csv(folder / "sphere.csv")
    mm = np.stack([table[name].to_numpy() for name in ("x_mm", "y_mm", "z_mm")], 1)
    np.savetxt(tmp_path / "points.txt", mm * 1e3, fmt="%.17g", delimiter=";")
    load = {"plugin": Reads(), "path": str(tmp_path / "points.txt"), "config": {"mm": 1e-3}}
    own = runout.run(folder / "sphere.toml", set={"separate": sphere(folder), "load": load})
    expected = runout.run(folder / "sphere.toml", set={"separate": sphere(folder)})
    for value, other in zip(own.summary["values"], expected.summary["values"]):
        assert value["value"] == pytest.approx(other["value"], abs=1e-9)


class Fails:
    """Raises at the second station, below another function."""

    def __init__(self) -> None:
        self.asked = 0

    def separate(self, station: external.Station) -> Any:
        self.asked += 1
        return self.deeper(station)

    def deeper(self, station: external.Station) -> Any:
        if self.asked > 1:
            raise KeyError("the author's own mistake")
        return {("form", "a"): np.full(len(station.orders), np.nan)}


def test_an_exception_comes_back_with_its_traceback_and_nothing_is_written(folder: Path, tmp_path: Path) -> None:
    export = [{"plugin": "parquet", "path": str(tmp_path / "out")}]
    with pytest.raises(KeyError, match="the author's own mistake") as raised:
        runout.run(folder / "pipeline.toml", set={"separate": Fails(), "export": export}, threads=1)
    frames = [frame.name for frame in traceback.extract_tb(raised.value.__traceback__)]
    assert frames[-2:] == ["separate", "deeper"], frames
    assert not list(tmp_path.iterdir()), "nothing is written"


@pytest.mark.parametrize(
    ("returned", "kind", "words"),
    [
        ({("form", "a"): np.zeros(3)}, ValueError, "one number an order"),
        ({("form", "b"): None}, runout.DataError, r"plugin `gives` gave harmonics of `form b`"),
        ({"z": None}, runout.DataError, "gave harmonics of `z`"),
        (3, AttributeError, "items"),
        (None, AttributeError, "items"),
        (({("form", "a"): None}, {("form", "a"): "negative"}), runout.DataError, "with a `std` below 0"),
        ({("form", "a"): "infinite"}, runout.DataError, "gave inf in row"),
    ],
)
def test_what_is_no_answer_is_refused(folder: Path, tmp_path: Path, returned: Any, kind: Any, words: str) -> None:
    class Gives:
        def separate(self, station: external.Station) -> Any:
            made = {None: 1.0, "negative": -1.0, "infinite": np.inf}

            def filled(found: Any) -> Any:
                if isinstance(found, tuple):
                    return tuple(filled(part) for part in found)
                if not isinstance(found, dict):
                    return found
                return {key: np.full(len(station.orders), made[of]) if of is None or isinstance(of, str) else of for key, of in found.items()}

            return filled(returned)

    export = [{"plugin": "parquet", "path": str(tmp_path / "out")}]
    with pytest.raises(kind, match=words):
        runout.run(folder / "pipeline.toml", set={"separate": Gives(), "export": export})
    assert not list(tmp_path.iterdir()), "nothing is written"


def test_values_are_checked_as_those_of_programs(folder: Path) -> None:
    stages = {"separate": {"plugin": "three-point"}}
    for value, words in [
        (external.Value("largest-harmonic", float("nan"), None, "um"), "gave NaN in row 1 of the column `value`"),
        (external.Value("largest-harmonic", 1.0, -1.0, "um"), "with a `std` below 0"),
        (external.Value("largest-harmonic", 1.0, None, "mm"), "`symbols` declares `um`"),
        (external.Value("other", 1.0, None, "mm"), "which `symbols` does not declare"),
    ]:
        plugin = Lobes()
        plugin.evaluate = lambda tables, config, value=value: [value]  # type: ignore[method-assign, misc]
        with pytest.raises(runout.DataError, match=words):
            runout.run(folder / "pipeline.toml", set=stages | {"evaluator": [plugin]})


def test_what_an_object_lacks_is_said(folder: Path) -> None:
    def refused(attributes: dict[str, Any], error: Any, words: str) -> None:
        plugin = type("Odd", (), attributes)()
        with pytest.raises(error, match=words):
            runout.run(folder / "sphere.toml", plugins=[plugin])

    does: Any = lambda self, *_: None  # noqa: E731
    refused({"values": does}, ValueError, "expected `columns`")
    refused({"values": does, "columns": "x_mm"}, ValueError, "expected `columns`, a list")
    refused({"values": does, "columns": ["x_mm"], "symbols": [1]}, ValueError, "expected `symbols`")
    refused({"evaluate": does}, ValueError, "expected `symbols`")
    refused({"evaluate": does, "export": does}, TypeError, "found one with evaluate, export")
    refused({"separate": does, "name": "Odd"}, ValueError, "kebab-case")
    refused({"load": does, "name": "points"}, runout.CommandError, "there is a plugin `points` already")
    refused({}, TypeError, "expected an object with the method")


def test_an_effect_is_a_program_too(tmp_path: Path) -> None:
    text = '''
import numpy as np

class LowPass:
    name = "low-pass-in-numpy"
    parameters = [("inverse-cut-off", "rev", 1e-3)]

    def transfer(self, orders, p):
        return 1 / (1 - 1j * orders * p)

plugin = LowPass()
'''
    campaign = tmp_path / "campaign.h5"
    example = EXAMPLES / "06-closed-loop"
    effect = [{"plugin": "filter-attenuation", "targets": ["S2"], "cutoff_hz": 600}]
    runout.simulate(example / "scenario.toml", campaign, set={"effect": effect})
    settings = {"load.path": str(campaign), "export": [], "diagnose.effects": ["low-pass-in-numpy", "sensor-gain"]}
    parameters = [{"name": "inverse-cut-off", "unit": "rev", "usual": 1e-3}]
    (tmp_path / "low_pass.py").write_text(text)
    external_effect = {"plugin": "external", "id": "low-pass-in-numpy", "command": served(tmp_path, text), "parameters": parameters}
    program = runout.diagnose(example / "pipeline.toml", set=settings | {"effect": [external_effect]})
    own = runout.diagnose(example / "pipeline.toml", plugins=[module(tmp_path / "low_pass.py").plugin], set=settings)
    (one,), (other,) = program.added, own.added
    assert one.targets == other.targets == ["S2"]
    assert one.parameters[0].value == pytest.approx(other.parameters[0].value, rel=1e-12)


class Made:
    """The recording of `small_recording`, read from its arrays block by block."""

    captured = {"initial": 1, "reversed": 2}

    def captures(self, path: str, rig: dict[str, Any], config: dict[str, Any]) -> list[external.Captured]:
        assert Path(path).read_text() == "turns" and config == {"um": 1.0} and len(rig["sensors"]) == 4
        made = {setup: turns(seed=seed) for setup, seed in self.captured.items()}
        self.read = {setup: channels for setup, (channels, _) in made.items()}
        return [external.Captured("s1", setup, len(channels), marks, sample_rate_hz=1280.0) for setup, (channels, marks) in made.items()]

    def samples(self, station: str, setup: str, first: int, count: int) -> Any:
        return self.read[setup][first : first + count]


def test_a_recording_is_read_block_by_block(tmp_path: Path) -> None:
    (tmp_path / "turns.txt").write_text("turns")
    load = {"path": str(tmp_path / "turns.txt"), "config": {"um": 1.0}}
    expected = runout.run(small_pipeline(), small_recording())
    same(runout.run(small_pipeline(load={"plugin": Made(), **load})), expected)

    class Short(Made):
        def samples(self, station: str, setup: str, first: int, count: int) -> Any:
            return super().samples(station, setup, first, count)[:, :3]

    with pytest.raises(ValueError, match=r"samples: expected the shape \(1536, 4\), found \(1536, 3\)"):
        runout.run(small_pipeline(load={"plugin": Short(), **load}))

    class Half(Made):
        captured = {"initial": 1}

    with pytest.raises(runout.DataError, match="plugin `half` gave no capture of station s1 in setup reversed"):
        runout.run(small_pipeline(load={"plugin": Half(), **load}))
