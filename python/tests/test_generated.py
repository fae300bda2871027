"""Files that are made from others, and types."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent.parent


def test_the_classes_of_stages_are_those_of_the_schemas() -> None:
    done = subprocess.run([sys.executable, str(HERE / "tools/generate.py"), "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_types_are_strict() -> None:
    pytest.importorskip("mypy")
    done = subprocess.run([sys.executable, "-m", "mypy", "--config-file", "pyproject.toml"], cwd=HERE, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
