"""Many recordings on many machines, by Ray Data: one task a recording, or a few, a partitioned Parquet data set out.

    report = runout.ray.run("pipeline.toml", "s3://bucket/recordings", "s3://bucket/results")
    report = runout.ray.campaigns("scenario.toml", "pipeline.toml", range(10_000), "blind")

A task is known by the checksum of its recording and of its configuration. Its files get their names when they are whole, and the last of
them says that the recording is done: a worker that is killed loses nothing and doubles nothing, and a later call does only
what is not done. Needs the extra `ray`: `pip install runout[ray]`.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import tempfile
import uuid
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union
from urllib.parse import quote

from ._commands import diagnose as _diagnose
from ._commands import run as _run
from ._commands import simulate as _simulate
from ._native import __version__
from ._toml import document as _document
from ._toml import value as _toml_value
from .errors import Error
from .pipeline import Pipeline, Source
from .result import Diagnosis, Result

if TYPE_CHECKING:
    from typing_extensions import Self

DONE = "_done"
BLOCK_BYTES = 1 << 20
MOST_PER_TASK = 16
Scenario = Union[str, os.PathLike[str], Mapping[str, Any]]


@dataclasses.dataclass(frozen=True)
class Report:
    """What became of each recording: entries with `recording`, `key`, `status` ("done", "skipped", "failed") and `error`."""

    entries: list[dict[str, Any]]

    def of(self, status: str) -> list[dict[str, Any]]:
        """The entries with this status."""
        return [entry for entry in self.entries if entry["status"] == status]

    @property
    def failed(self) -> list[dict[str, Any]]:
        """The recordings that failed, each with its error."""
        return self.of("failed")


def recordings(
    location: str | os.PathLike[str] | Sequence[str],
    suffix: str = ".h5",
    storage: Mapping[str, Any] | None = None,
    per_task: int | None = None,
) -> Any:
    """A Ray Data set with one row a recording: `recording`, the address. A block is what one task takes: `per_task` recordings, without it
    one of few recordings and up to 16 of many, since a task costs Ray some 27 ms of processor time.

    `location` is a folder (also `s3://…`, or what else fsspec opens with the options of `storage`) or a list of addresses.
    """
    import ray

    addresses = _addresses(location, suffix, dict(storage or {}))
    if not addresses:
        raise FileNotFoundError(f"{location}: expected recordings that end in `{suffix}`, found none")
    return ray.data.from_items([{"recording": one} for one in addresses], override_num_blocks=_blocks(len(addresses), per_task))


def run(
    pipeline: Source,
    location: Any,
    out: str | os.PathLike[str],
    *,
    set: Mapping[str, Any] | None = None,
    key: str = "load.path",
    suffix: str = ".h5",
    storage: Mapping[str, Any] | None = None,
    concurrency: int | None = None,
    cpus_per_task: float = 1,
) -> Report:
    """Runs a pipeline on each recording of `location`: a folder, a list of addresses, or a data set of `recordings`.

    Each table goes to `OUT/TABLE/recording=NAME/KEY.parquet`, the summary to `OUT/summary/KEY.json`; `[[export]]` is left out.
    `key` is the configuration key that takes the recording's path; `concurrency` limits the tasks at a time. A recording that fails does not stop
    the others. Ray repeats a task whose worker dies.
    """
    made = location if hasattr(location, "map") else recordings(location, suffix, storage)
    return _report(made, Task.of(pipeline, set, key, os.fspath(out), dict(storage or {})), concurrency, cpus_per_task)


def campaigns(
    scenario: Scenario,
    pipeline: Source,
    seeds: Iterable[int],
    out: str | os.PathLike[str],
    *,
    vary: Callable[[int], Mapping[str, Any]] | None = None,
    set: Mapping[str, Any] | None = None,
    key: str = "load.path",
    diagnose: bool = False,
    storage: Mapping[str, Any] | None = None,
    concurrency: int | None = None,
    cpus_per_task: float = 1,
) -> Report:
    """Simulates a campaign for each seed and runs the pipeline on it: a blind benchmark, one task a campaign, with the data set of `run`.

    `vary(seed)` gives overrides of the scenario, as the effects that a campaign has; `set` overrides keys of the pipeline. With `diagnose` the
    closed loop runs, and the summary of a campaign is its diagnosis. Recordings are named `seed-N`; `_done` holds the overrides of each. Simulated files are
    removed when their task ends.
    """
    import ray

    rows = [_campaign(int(seed), {} if vary is None else vary(int(seed))) for seed in seeds]
    if not rows:
        raise ValueError("expected at least one seed")
    task = Campaign.of(pipeline, set, key, os.fspath(out), dict(storage or {}))
    task = dataclasses.replace(task, scenario=_text(scenario), diagnose=diagnose)
    made = ray.data.from_items(rows, override_num_blocks=_blocks(len(rows), None))
    return _report(made, task, concurrency, cpus_per_task)


def _blocks(rows: int, per_task: int | None) -> int:
    """How many tasks take so many rows. Without a number of rows a task, each processor has at least eight tasks."""
    import ray

    if per_task is None:
        if not ray.is_initialized():
            ray.init()
        processors = max(1, int(ray.cluster_resources().get("CPU", 1)))  # type: ignore[no-untyped-call]
        per_task = min(MOST_PER_TASK, rows // (8 * processors))
    return -(-rows // max(1, per_task))


def _report(made: Any, task: Task, concurrency: int | None, cpus_per_task: float) -> Report:
    from ray.data import TaskPoolStrategy

    # Without a size, Ray Data takes as many tasks as there are processors.
    entries = made.map(task, num_cpus=cpus_per_task, compute=TaskPoolStrategy(size=concurrency)).take_all()
    return Report(sorted(entries, key=lambda entry: str(entry["recording"])))


@dataclasses.dataclass(frozen=True)
class Task:
    """What is done with each recording, as it travels to the workers."""

    text: str
    overrides: dict[str, Any]
    key: str
    out: str
    storage: dict[str, Any]

    @classmethod
    def of(cls, pipeline: Source, overrides: Mapping[str, Any] | None, key: str, out: str, storage: dict[str, Any]) -> Self:
        """A task that needs no file of the machine that it was made on."""
        text = pipeline.to_toml() if isinstance(pipeline, Pipeline) else _text(pipeline)
        return cls(text, dict(overrides or {}), key, _absolute(out), storage)

    def __call__(self, row: dict[str, Any]) -> dict[str, Any]:
        """Runs the pipeline on a recording, and writes what comes out."""
        address = str(row["recording"])
        entry = {"recording": address, "key": "", "status": "failed", "error": ""}
        with tempfile.TemporaryDirectory() as folder:
            try:
                entry["key"] = name = self.name(row, folder)
                target, root = _filesystem(self.out, self.storage)
                if target.exists(f"{root}/{DONE}/{name}.json"):
                    return entry | {"status": "skipped"}
                self.write(self.result(row, folder), row, name, target, root)
            except (Error, OSError, ValueError) as error:
                return entry | {"error": str(error)}
        return entry | {"status": "done"}

    def name(self, row: dict[str, Any], folder: str) -> str:
        """The checksum of recording, configuration and version."""
        digest = self.digest()
        with open(self.local(row, folder), "rb") as file:
            while block := file.read(BLOCK_BYTES):
                digest.update(block)
        return digest.hexdigest()

    def digest(self) -> hashlib.blake2b:
        """The checksum of configuration and version, to which what is a recording's own is added."""
        digest = hashlib.blake2b(digest_size=16)
        for text in (__version__, self.text, self.key, _canonical(self.overrides)):
            digest.update(hashlib.blake2b(text.encode()).digest())
        return digest

    def local(self, row: dict[str, Any], folder: str) -> str:
        """The recording's file on this machine, fetched once."""
        source, path = _filesystem(str(row["recording"]), self.storage)
        if _is_local(source):
            return path
        fetched = os.path.join(folder, "recording" + Path(path).suffix)
        if not os.path.exists(fetched):
            source.get_file(path, fetched)
        return fetched

    def result(self, row: dict[str, Any], folder: str) -> Result | Diagnosis:
        """The pipeline on the recording; nothing is exported."""
        found: Result = self.work(_run, self.local(row, folder), folder)
        return found

    def work(self, command: Callable[..., Any], local: str, folder: str) -> Any:
        """A command on the pipeline with this recording; nothing is exported."""
        file = os.path.join(folder, "pipeline.toml")
        Path(file).write_text(self.text, "utf-8")
        return command(file, set=self.overrides | {self.key: os.path.abspath(local), "export": []}, threads=1)

    def write(self, result: Result | Diagnosis, row: dict[str, Any], name: str, target: Any, root: str) -> None:
        """Writes the tables, the summary, and then that the recording is done."""
        import pyarrow
        import pyarrow.parquet

        partition = "recording=" + quote(Path(str(row["recording"])).stem, safe="")
        for table in result.tables.values():
            # In memory, for each file that is made on the way takes time.
            file = pyarrow.BufferOutputStream()
            pyarrow.parquet.write_table(pyarrow.table(table), file, compression="zstd")
            _put(target, file.getvalue().to_pybytes(), f"{root}/{table.name}/{partition}/{name}.parquet")
        _put(target, json.dumps(result.facts).encode(), f"{root}/summary/{name}.json")
        _put(target, json.dumps(row | {"key": name}).encode(), f"{root}/{DONE}/{name}.json")


@dataclasses.dataclass(frozen=True)
class Campaign(Task):
    """What is done with each seed: its campaign is simulated in the place of a recording."""

    scenario: str = ""
    diagnose: bool = False

    def name(self, row: dict[str, Any], folder: str) -> str:
        """The checksum of what it is simulated from, configuration and version."""
        digest = self.digest()
        for text in (self.scenario, str(row["overrides"]), str(self.diagnose)):
            digest.update(hashlib.blake2b(text.encode()).digest())
        return digest.hexdigest()

    def local(self, row: dict[str, Any], folder: str) -> str:
        """The campaign, simulated."""
        scenario, campaign = (os.path.join(folder, name) for name in ("scenario.toml", "campaign.h5"))
        Path(scenario).write_text(self.scenario, "utf-8")
        _simulate(scenario, campaign, set=json.loads(row["overrides"]))
        return campaign

    def result(self, row: dict[str, Any], folder: str) -> Result | Diagnosis:
        """The pipeline, or the closed loop, on the campaign."""
        found: Result | Diagnosis = self.work(_diagnose if self.diagnose else _run, self.local(row, folder), folder)
        return found


def _campaign(seed: int, varied: Mapping[str, Any]) -> dict[str, Any]:
    return {"recording": f"seed-{seed}", "overrides": json.dumps({"seed": seed} | dict(varied))}


def _text(source: Mapping[str, Any] | str | os.PathLike[str]) -> str:
    """A file's or a dictionary's TOML."""
    return _document(source) if isinstance(source, Mapping) else Path(source).read_text("utf-8")


def _canonical(overrides: Mapping[str, Any]) -> str:
    return json.dumps({name: _toml_value(of, name) for name, of in sorted(overrides.items())})


def _addresses(location: Any, suffix: str, storage: dict[str, Any]) -> list[str]:
    if not isinstance(location, (str, os.PathLike)):
        return [_absolute(os.fspath(one)) for one in location]
    source, root = _filesystem(_absolute(os.fspath(location)), storage)
    found = sorted(path for path in source.find(root) if path.endswith(suffix))
    return [path if _is_local(source) else str(source.unstrip_protocol(path)) for path in found]


def _absolute(address: str) -> str:
    return address if "://" in address else os.path.abspath(address)


def _filesystem(address: str, storage: dict[str, Any]) -> tuple[Any, str]:
    from fsspec.core import url_to_fs

    return url_to_fs(address, **(storage if "://" in address else {}))  # type: ignore[no-any-return]


def _is_local(filesystem: Any) -> bool:
    protocol = filesystem.protocol
    return "file" in ((protocol,) if isinstance(protocol, str) else protocol)


def _put(target: Any, data: bytes, path: str) -> None:
    """Writes a file whole or not at all: object storage shows an object when it is complete, a folder shows a name when it is given."""
    if not _is_local(target):
        target.pipe_file(path, data)
        return
    os.makedirs(os.path.dirname(path), exist_ok=True)
    partial = os.path.join(os.path.dirname(path), f".{os.path.basename(path)}.{uuid.uuid4().hex}.partial")
    try:
        Path(partial).write_bytes(data)
        os.replace(partial, path)
    finally:
        if os.path.exists(partial):
            os.remove(partial)
