"""`runout.external`: a class as a program, in a pipeline and by itself."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import runout

pa = pytest.importorskip("pyarrow")
from runout import external  # noqa: E402

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "26-own-program"


def stream(table: Any) -> bytes:
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema) as writer:
        writer.write_table(table)
    return bytes(sink.getvalue().to_pybytes())


def request(stage: str = "separate-turns") -> bytes:
    rig = {"part_radius_mm": 30, "rotation": "ccw", "sensors": [{"id": "A", "angle_deg": 0, "z_mm": 0, "section": "a"}], "setups": [{"id": "k"}]}
    about = {"protocol": "1", "stage": stage, "config": "{}", "rig": json.dumps(rig), "station": '{"station": "s", "z_mm": 1.5, "turns": [9]}'}
    about = {f"runout.{key}": value for key, value in about.items()}
    ids = {"station": ["s"] * 4, "setup": ["k"] * 4}
    numbers = {"re": np.arange(4.0), "im": np.zeros(4)}
    profiles = pa.table(ids | {"sensor": ["A"] * 4, "order": np.arange(4)} | numbers).replace_schema_metadata(about)
    covariance = pa.table(ids | {"order": np.arange(4), "sensor_a": ["A"] * 4, "sensor_b": ["A"] * 4} | numbers).replace_schema_metadata(about)
    bodies = [("profiles", stream(profiles)), ("covariance", stream(covariance))]
    return b"".join(f"{name} {len(body)}\n".encode() + body for name, body in bodies) + b"end 0\n"


def answers(written: bytes) -> list[tuple[str, bytes]]:
    source, found = io.BytesIO(written), []
    while line := source.readline():
        name, size = line.decode().split()
        found.append((name, source.read(int(size))))
    return found


def test_a_class_is_asked_and_prints_to_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    class Mine:
        def separate(self, station: external.Station) -> Any:
            print("working")
            assert (station.name, station.z_mm, station.turns, station.sensors) == ("s", 1.5, [9], ["A"])
            assert station.readings.shape == (1, 4, 1) and station.covariance is not None and station.covariance.shape == (1, 4, 1, 1)
            station.warnings.append("a guess")
            form = np.array([np.nan, np.nan, 2 + 1j, 3])
            return {("form", "a"): form, "x": form}, {"x": np.full(4, 0.5)}

    out = io.BytesIO()
    external.serve(Mine(), io.BytesIO(request() * 2), out)
    found = answers(out.getvalue())
    assert [name for name, _ in found] == ["harmonics", "warning", "end"] * 2 and found[1][1] == b"a guess"
    table = pa.ipc.open_stream(found[0][1]).read_all()
    assert table["re"].to_pylist() == [None, None, 2.0, 3.0] * 2
    assert table["std"].to_pylist() == [None] * 6 + [0.5, 0.5]
    assert table["section"].to_pylist() == ["a"] * 4 + [None] * 4
    assert capsys.readouterr().err == "working\nworking\n"


def test_what_does_not_fit_is_raised() -> None:
    class Short:
        def separate(self, station: external.Station) -> Any:
            return {"x": np.zeros(3)}

    with pytest.raises(ValueError, match="expected one number an order, 4, found the shape"):
        external.serve(Short(), io.BytesIO(request()), io.BytesIO())
    with pytest.raises(TypeError, match="Short is asked for separate-points: expected a class with the method `values`"):
        external.serve(Short(), io.BytesIO(request("separate-points")), io.BytesIO())


def test_a_served_class_is_equal_to_the_built_in_method(tmp_path: Path) -> None:
    scenario = (EXAMPLE / "scenario.toml").read_text()
    (tmp_path / "scenario.toml").write_text(scenario)
    runout.simulate(tmp_path / "scenario.toml")
    (tmp_path / "served.py").write_text((EXAMPLE / "served.py").read_text())
    pipeline = (EXAMPLE / "pipeline.toml").read_text().partition("[[export]]")[0]
    (tmp_path / "pipeline.toml").write_text(pipeline)
    comparison = runout.compare(tmp_path / "pipeline.toml", set={"separate.command": [sys.executable, "served.py"]})
    stations = comparison["stations"]
    assert len(stations) == 5
    for quantity in (quantity for station in stations for quantity in station["quantities"]):
        one, other = quantity["values"]
        for part in ("re", "im"):
            a, b = (np.array(value["harmonics"][part], float) for value in (one, other))
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-9)


def test_an_exporter_gets_all_tables_and_writes_its_files(tmp_path: Path) -> None:
    class Mine:
        def export(self, tables: dict[str, Any], summary: dict[str, Any], files: dict[str, str], config: dict[str, Any]) -> None:
            assert tables["form"]["form_um"].to_pylist() == [1.0, 2.0, 1.0, 2.0] and config == {"digits": 3}
            Path(files["a.txt"]).write_text(summary["title"])

    about = {"runout.protocol": "1", "runout.stage": "export", "runout.config": '{"digits": 3}'}
    files = pa.table({"name": ["a.txt"], "path": [str(tmp_path / "b")]}).replace_schema_metadata(about)
    form = pa.table({"form_um": [1.0, 2.0]}).replace_schema_metadata(about)
    bodies = [("files", stream(files)), ("form", stream(form)), ("form", stream(form)), ("summary", b'{"title": "shaft"}')]
    asked = b"".join(f"{name} {len(body)}\n".encode() + body + b"end 0\n" for name, body in bodies)
    out = io.BytesIO()
    external.serve(Mine(), io.BytesIO(asked), out)
    assert out.getvalue() == b"end 0\n" * 4 and (tmp_path / "b").read_text() == "shaft"
    with pytest.raises(TypeError, match="asked for export: expected a class with the method `export`"):
        external.serve(object(), io.BytesIO(asked), io.BytesIO())  # type: ignore[arg-type]


def test_a_program_started_from_a_terminal_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    with pytest.raises(SystemExit, match="runout plugins test -- "):
        external.serve(object())  # type: ignore[arg-type]
