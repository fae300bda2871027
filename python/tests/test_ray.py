"""Batches on Ray: local folders and object storage, failures, repeated calls, and a worker that is killed."""

from __future__ import annotations

import json
import os
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import runout

ray = pytest.importorskip("ray")
pytest.importorskip("ray.data")
pyarrow_dataset = pytest.importorskip("pyarrow.dataset")

import runout.ray as batches  # noqa: E402

from conftest import EXAMPLE, pipeline  # noqa: E402

SOURCES = str(Path(runout.__file__).resolve().parent.parent)
PIPELINE = pipeline(load={"plugin": "hdf5", "path": "?"})


@pytest.fixture(scope="module")
def cluster() -> Iterator[None]:
    paths = os.pathsep.join([SOURCES, str(Path(__file__).parent)])
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, runtime_env={"env_vars": {"PYTHONPATH": paths}})
    yield
    ray.shutdown()


@pytest.fixture
def folder(campaign: Path, tmp_path: Path) -> Path:
    """Four recordings, one of which is damaged."""
    source = tmp_path / "recordings"
    source.mkdir()
    for name in ("one", "two", "odd name é"):
        shutil.copy(campaign, source / f"{name}.h5")
        with (source / f"{name}.h5").open("r+b") as file:
            file.seek(0, os.SEEK_END)
            file.write(name.encode())
    (source / "bad.h5").write_bytes(b"nothing")
    return source


def rows(out: Path) -> int:
    return int(pyarrow_dataset.dataset(str(out / "form"), partitioning="hive").count_rows())


def test_one_task_a_recording_and_nothing_twice(cluster: None, folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    report = batches.run(PIPELINE, folder, out)
    assert len(report.of("done")) == 3
    (bad,) = report.failed
    assert bad["recording"].endswith("bad.h5") and bad["error"]
    table = pyarrow_dataset.dataset(str(out / "form"), partitioning="hive").to_table()
    assert len(set(table["recording"].to_pylist())) == 3
    before = {path: path.stat().st_mtime_ns for path in out.rglob("*.parquet")}
    again = batches.run(PIPELINE, folder, out)
    assert len(again.of("skipped")) == 3 and len(again.failed) == 1
    assert before == {path: path.stat().st_mtime_ns for path in out.rglob("*.parquet")}
    changed = batches.run(PIPELINE, folder, tmp_path / "other", set={"preprocess.1.cutoff_hz": 300})
    assert {one["key"] for one in changed.of("done")}.isdisjoint(one["key"] for one in report.of("done"))


def test_a_task_takes_several_of_many_recordings(cluster: None, folder: Path, tmp_path: Path) -> None:
    assert [batches._blocks(rows, None) for rows in (1, 4, 31, 32, 1000)] == [1, 4, 31, 16, 63]
    (folder / "bad.h5").unlink()
    made = batches.recordings(folder, per_task=2)
    assert made.materialize().num_blocks() == 2
    report = batches.run(PIPELINE, made, tmp_path / "out")
    assert len(report.of("done")) == 3


class Killed(batches.Task):
    """A task whose worker is killed once for each recording, after its tables and before it is done."""

    def write(self, result: Any, row: dict[str, Any], name: str, target: Any, root: str) -> None:
        mark = Path(root).parent / f"killed-{name}"
        if not mark.exists():
            mark.touch()
            super().write(result, row, name, Halfway(target), root)
        super().write(result, row, name, target, root)


class Halfway:
    """A file system that kills the process at the second file."""

    def __init__(self, target: Any) -> None:
        self.target, self.protocol, self.written = target, "memory", 0

    def pipe_file(self, path: str, data: bytes) -> None:
        self.written += 1
        if self.written == 2:
            os.kill(os.getpid(), signal.SIGKILL)
        batches._put(self.target, data, path)


def test_a_killed_worker_loses_and_doubles_nothing(cluster: None, folder: Path, tmp_path: Path) -> None:
    (folder / "bad.h5").unlink()
    calm, killed = tmp_path / "calm", tmp_path / "killed" / "out"
    batches.run(PIPELINE, folder, calm)
    killed.parent.mkdir()
    task = Killed.of(PIPELINE, None, "load.path", str(killed), {})
    entries = batches.recordings(folder).map(task, num_cpus=1).take_all()
    assert sorted(entry["status"] for entry in entries) == ["done"] * 3
    assert len(list(killed.parent.glob("killed-*"))) == 3
    assert rows(killed) == rows(calm)
    names = [sorted(str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()) for out in (calm, killed)]
    assert names[0] == names[1]
    for name in names[0]:
        if name.endswith(".parquet"):
            assert (calm / name).read_bytes() == (killed / name).read_bytes()


def test_object_storage_takes_the_place_of_folders(cluster: None, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    server_module = pytest.importorskip("moto.server")
    s3fs = pytest.importorskip("s3fs")
    server = server_module.ThreadedMotoServer(port=0)
    server.start()
    try:
        host, port = server.get_host_and_port()
        storage = {"key": "test", "secret": "test", "client_kwargs": {"endpoint_url": f"http://{host}:{port}", "region_name": "eu-central-1"}}
        files = s3fs.S3FileSystem(**storage)
        files.mkdir("bucket")
        files.put(str(folder), "bucket/recordings", recursive=True)
        report = batches.run(PIPELINE, "s3://bucket/recordings", "s3://bucket/results", storage=storage)
        assert len(report.of("done")) == 3 and len(report.failed) == 1
        files.get("bucket/results", str(tmp_path / "fetched"), recursive=True)
        batches.run(PIPELINE, folder, tmp_path / "local")
        assert rows(tmp_path / "fetched") == rows(tmp_path / "local")
    finally:
        server.stop()


def test_simulated_campaigns_are_a_blind_benchmark(cluster: None, tmp_path: Path) -> None:
    few = {"recording.stations.count": 1, "recording.revolutions": 8}
    scenario = EXAMPLE / "scenario.toml"

    def vary(seed: int) -> dict[str, Any]:
        return few | {"form.rms_um": 2.0 + seed}

    report = batches.campaigns(scenario, PIPELINE, range(3), tmp_path / "out", vary=vary)
    assert [entry["recording"] for entry in report.of("done")] == ["seed-0", "seed-1", "seed-2"], report.failed
    summaries = [json.loads(path.read_text()) for path in (tmp_path / "out" / "summary").iterdir()]
    assert len(summaries) == 3 and all(one["stations"][0]["truth"]["x_rms_error_um"] > 0 for one in summaries)
    again = batches.campaigns(scenario, PIPELINE, range(4), tmp_path / "out", vary=vary)
    assert len(again.of("skipped")) == 3 and len(again.of("done")) == 1
    # The same campaign by hand.
    file = tmp_path / "by-hand.h5"
    runout.simulate(scenario, file, set=vary(2) | {"seed": 2})
    by_hand = runout.run(PIPELINE, set={"load.path": str(file)})
    (written,) = (tmp_path / "out" / "form" / "recording=seed-2").iterdir()
    assert pyarrow_dataset.dataset(str(written)).to_table()["form_um"].to_pylist() == by_hand.tables["form"]["form_um"].tolist()
    (bad,) = batches.campaigns(scenario, PIPELINE, [1], tmp_path / "out", vary=lambda seed: {"form.rms_um": -1}).failed
    assert bad["error"]
    with pytest.raises(ValueError, match="seed"):
        batches.campaigns(scenario, PIPELINE, [], tmp_path / "out")


def test_dask_runs_the_same_task(folder: Path, tmp_path: Path) -> None:
    bag = pytest.importorskip("dask.bag", reason="dask is not installed")
    task = batches.Task.of(PIPELINE, None, "load.path", str(tmp_path / "out"), {})
    paths = sorted(map(str, folder.iterdir()))
    tasks = bag.from_sequence([{"recording": path} for path in paths], npartitions=len(paths)).map(task)
    statuses = [[entry["status"] for entry in tasks.compute(scheduler="processes", num_workers=2)] for _ in range(2)]
    assert statuses == [["failed", "done", "done", "done"], ["failed", "skipped", "skipped", "skipped"]]
    assert rows(tmp_path / "out") > 0
