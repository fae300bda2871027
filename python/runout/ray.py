"""Many recordings on many machines, by Ray Data: one task a recording, a partitioned Parquet data set out.

    report = runout.ray.run("pipeline.toml", "s3://bucket/recordings", "s3://bucket/results")

A task is known by the checksum of its recording and of its configuration. Its files get their names when they are whole, and the last of
them says that the recording is done: a worker that is killed loses nothing and doubles nothing, and a later call does only
what is not done. Needs the extra `ray`: `pip install runout[ray]`.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import shutil
import tempfile
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ._commands import run as _run
from ._native import __version__
from ._toml import value as _toml_value
from .errors import Error
from .pipeline import Pipeline, Source
from .result import Result

DONE = "_done"
BLOCK_BYTES = 1 << 20


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
    location: str | os.PathLike[str] | Sequence[str], suffix: str = ".h5", storage: Mapping[str, Any] | None = None
) -> Any:
    """A Ray Data set with one row, and one block, a recording: `recording`, the address.

    `location` is a folder (also `s3://…`, or what else fsspec opens with the options of `storage`) or a list of addresses.
    """
    import ray

    addresses = _addresses(location, suffix, dict(storage or {}))
    if not addresses:
        raise FileNotFoundError(f"{location}: expected recordings that end in `{suffix}`, found none")
    return ray.data.from_items([{"recording": one} for one in addresses], override_num_blocks=len(addresses))


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
    retries: int = 3,
) -> Report:
    """Runs a pipeline on each recording of `location`: a folder, a list of addresses, or a data set of `recordings`.

    Each table goes to `OUT/TABLE/recording=NAME/KEY.parquet`, the summary to `OUT/summary/KEY.json`; `[[export]]` is left out.
    `key` is the configuration key that takes the recording's path. A recording that fails does not stop the others. A task whose
    worker dies is repeated up to `retries` times.
    """
    made = location if hasattr(location, "map") else recordings(location, suffix, storage)
    task = Task.of(pipeline, set, key, os.fspath(out), dict(storage or {}))
    options: dict[str, Any] = {"num_cpus": cpus_per_task, "max_retries": retries}
    if concurrency is not None:
        options["concurrency"] = concurrency
    return Report(sorted(made.map(task, **options).take_all(), key=lambda entry: str(entry["recording"])))


@dataclasses.dataclass(frozen=True)
class Task:
    """What is done with each recording, as it travels to the workers."""

    text: str
    overrides: dict[str, Any]
    key: str
    out: str
    storage: dict[str, Any]

    @classmethod
    def of(cls, pipeline: Source, overrides: Mapping[str, Any] | None, key: str, out: str, storage: dict[str, Any]) -> Task:
        """A task that needs no file of the machine that it was made on."""
        if isinstance(pipeline, Pipeline):
            text = pipeline.to_toml()
        elif isinstance(pipeline, Mapping):
            from ._toml import document

            text = document(pipeline)
        else:
            text = Path(pipeline).read_text("utf-8")
        found = _absolute(out)
        return cls(text, dict(overrides or {}), key, found, storage)

    def __call__(self, row: dict[str, Any]) -> dict[str, Any]:
        """Runs the pipeline on a recording, and writes what comes out."""
        address = str(row["recording"])
        entry = {"recording": address, "key": "", "status": "failed", "error": ""}
        with tempfile.TemporaryDirectory() as folder:
            try:
                source, path = _filesystem(address, self.storage)
                local = path if _is_local(source) else os.path.join(folder, "recording" + Path(path).suffix)
                if local != path:
                    source.get_file(path, local)
                entry["key"] = name = self.name(local)
                target, root = _filesystem(self.out, self.storage)
                if target.exists(f"{root}/{DONE}/{name}.json"):
                    return entry | {"status": "skipped"}
                self.write(self.result(local, folder), address, name, folder, target, root)
            except (Error, OSError, ValueError) as error:
                return entry | {"error": str(error)}
        return entry | {"status": "done"}

    def name(self, local: str) -> str:
        """The checksum of recording, configuration and version."""
        digest = hashlib.blake2b(digest_size=16)
        keys = {name: _toml_value(of, name) for name, of in sorted(self.overrides.items())}
        for text in (__version__, self.text, self.key, json.dumps(keys)):
            digest.update(hashlib.blake2b(text.encode()).digest())
        with open(local, "rb") as file:
            while block := file.read(BLOCK_BYTES):
                digest.update(block)
        return digest.hexdigest()

    def result(self, local: str, folder: str) -> Result:
        """The pipeline on the recording; nothing is exported."""
        file = os.path.join(folder, "pipeline.toml")
        Path(file).write_text(self.text, "utf-8")
        return _run(file, set=self.overrides | {self.key: os.path.abspath(local), "export": []}, threads=1)

    def write(self, result: Result, address: str, name: str, folder: str, target: Any, root: str) -> None:
        """Writes the tables, the summary, and then that the recording is done."""
        import pyarrow
        import pyarrow.parquet

        partition = "recording=" + quote(Path(address).stem, safe="")
        for table in result.tables.values():
            file = os.path.join(folder, f"{table.name}.parquet")
            pyarrow.parquet.write_table(pyarrow.table(table), file, compression="zstd")
            _put(target, file, f"{root}/{table.name}/{partition}/{name}.parquet")
        summary = os.path.join(folder, "summary.json")
        Path(summary).write_text(json.dumps(result.summary), "utf-8")
        _put(target, summary, f"{root}/summary/{name}.json")
        done = os.path.join(folder, "done.json")
        Path(done).write_text(json.dumps({"recording": address, "key": name}), "utf-8")
        _put(target, done, f"{root}/{DONE}/{name}.json")


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


def _put(target: Any, file: str, path: str) -> None:
    """Writes a file whole or not at all: object storage shows an object when it is complete, a folder shows a name when it is given."""
    if not _is_local(target):
        target.put_file(file, path)
        return
    os.makedirs(os.path.dirname(path), exist_ok=True)
    partial = os.path.join(os.path.dirname(path), f".{os.path.basename(path)}.{uuid.uuid4().hex}.partial")
    try:
        shutil.copyfile(file, partial)
        os.replace(partial, path)
    finally:
        if os.path.exists(partial):
            os.remove(partial)
