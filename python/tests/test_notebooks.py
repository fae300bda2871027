"""The notebooks of examples/22-python run from beginning to end."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import runout

nbclient = pytest.importorskip("nbclient")
nbformat = pytest.importorskip("nbformat")

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "22-python"


@pytest.mark.parametrize("name", sorted(path.name for path in EXAMPLE.glob("*.ipynb")))
def test_a_notebook_runs(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if name == "batch-on-ray.ipynb":
        pytest.importorskip("ray.data")
    sources = str(Path(runout.__file__).resolve().parent.parent)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([sources, os.environ.get("PYTHONPATH", "")]))
    notebook = nbformat.read(EXAMPLE / name, as_version=4)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(EXAMPLE)}}).execute()
