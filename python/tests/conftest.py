"""A small campaign, made once: three stations of example 1."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import runout

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "01-four-sensor"
RIG = {
    "part_radius_mm": 30,
    "sensors": [
        {"id": "S1", "angle_deg": 0, "z_mm": 200, "section": "a"},
        {"id": "S2", "angle_deg": 90, "z_mm": 200, "section": "a"},
        {"id": "S3", "angle_deg": 0, "z_mm": 230, "section": "b"},
        {"id": "S4", "angle_deg": 90, "z_mm": 230, "section": "b"},
    ],
    "setups": [{"id": "initial"}, {"id": "reversed", "part_deg": 180, "sensors_deg": 180}],
}


@pytest.fixture(scope="session")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The measurement file, with samples of 16 bits."""
    file = tmp_path_factory.mktemp("campaign") / "shaft.h5"
    few = {"recording.stations.count": 3, "recording.revolutions": 12}
    report = runout.simulate(EXAMPLE / "scenario.toml", file, set=few)
    assert report["stations"] == 3 and file.stat().st_size == report["bytes"]
    return file


@pytest.fixture(scope="session")
def arrays(campaign: Path) -> runout.Recording:
    """The same recording in memory."""
    h5py = pytest.importorskip("h5py")
    return from_file(h5py.File(campaign))


def from_file(file: Any) -> runout.Recording:
    """The recording of a measurement file."""
    setups = [name for name in file if name in ("initial", "reversed")]

    def capture(group: Any) -> runout.Capture:
        samples = group["samples"]
        scale, offset = samples.attrs["scale"], samples.attrs["offset"]
        um = samples[:].astype(np.float64) * scale + offset
        return runout.Capture(samples=um, marks=group["index"][:], speed_rpm=float(group.attrs["speed_rpm"]))

    rate = float(file["initial"][next(iter(file["initial"]))]["samples"].attrs["sample_rate_hz"])
    return runout.Recording.from_arrays(
        {setup: {name: capture(group) for name, group in file[setup].items()} for setup in setups},
        sample_rate_hz=rate,
        z_mm={name: float(group.attrs["z_mm"]) for name, group in file["initial"].items()},
    )


def pipeline(**more: Any) -> dict[str, Any]:
    """Example 1 without its exporters."""
    stages: dict[str, Any] = {
        "title": "Turned shaft",
        "rig": RIG,
        "load": {"plugin": "arrays"},
        "preprocess": [
            {"plugin": "trim"},
            {"plugin": "low-pass", "cutoff_hz": 500},
            {"plugin": "synchronous-average", "samples_per_rev": 512},
        ],
        "separate": {"plugin": "four-sensor-reversal"},
    }
    return stages | more


def turns(count: int = 12, per_rev: int = 128, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Four channels of a made-up shaft, and their marks."""
    draw = np.random.default_rng(seed)
    angle = np.arange(count * per_rev) * 2 * np.pi / per_rev
    channels = [3 * np.cos(2 * angle + phase) + np.cos(5 * angle) + draw.normal(0, 0.01, angle.size) for phase in range(4)]
    return np.ascontiguousarray(np.stack(channels, axis=1)), np.arange(count + 1) * float(per_rev)


def small_pipeline(**more: Any) -> dict[str, Any]:
    """The shortest way from `turns` to form."""
    average = {"plugin": "synchronous-average", "samples_per_rev": 64}
    return pipeline(preprocess=[average]) | more


def small_recording(**more: Any) -> runout.Recording:
    """`turns` in both setups."""
    captures = {"initial": {"s1": turns(seed=1)}, "reversed": {"s1": turns(seed=2)}}
    return runout.Recording.from_arrays(captures, **({"sample_rate_hz": 1280.0} | more))
