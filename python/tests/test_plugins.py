"""Separators and effects written in Python: equal to those that come with the package, and what goes wrong in them."""

from __future__ import annotations

import gc
import traceback
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import runout
from runout.separators import HarmonicLeastSquares

from conftest import EXAMPLE, RIG, pipeline, small_pipeline, small_recording


class FourSensors:
    """Half the sum of both setups is form, half their difference motion (four-sensor-reversal)."""

    name = "four-sensors-in-numpy"

    def operator(self, layout: runout.Layout) -> np.ndarray:
        phase = np.exp(1j * layout.direction * np.outer(layout.orders, layout.part_angle_rad))
        sections = list(dict.fromkeys(layout.sections))
        of_section = {name: np.array(layout.sections) == name for name in sections}
        lever = {name: layout.lever_mm[of][0] for name, of in of_section.items()}
        rows = np.zeros((len(layout.orders), len(layout.unknowns), len(layout.sensors)), complex)
        at = {unknown: index for index, unknown in enumerate(layout.unknowns)}
        for name, of in of_section.items():
            rows[:, at["form", name], of] = np.conj(phase[:, of]) / 4
        # Half the difference along each sensor's own direction, which the reversal turns round.
        x, y = np.cos(layout.angle_rad) / 2, np.sin(layout.angle_rad) / 2
        near, far = sections
        length = lever[far] - lever[near]
        for name, other, sign in ((near, far, -1), (far, near, 1)):
            of, share = of_section[name], -sign * lever[other] / length
            rows[:, at["x", None], of] = (share * x)[of]
            rows[:, at["y", None], of] = (share * y)[of]
            rows[:, at["tilt_y", None], of] = (sign * x / (length * 1e-3))[of]
            rows[:, at["tilt_x", None], of] = (-sign * y / (length * 1e-3))[of]
        return rows


class Pseudoinverse:
    """Least squares of all readings."""

    name = "pseudoinverse"

    def operator(self, layout: runout.Layout) -> np.ndarray:
        return np.linalg.pinv(layout.matrix)


class FormOnly(FourSensors):
    """Form, and no motion."""

    name = "form-only"

    def operator(self, layout: runout.Layout) -> np.ndarray:
        rows = super().operator(layout)
        for index, (quantity, _) in enumerate(layout.unknowns):
            if quantity != "form":
                rows[:, index] = np.nan
        rows[layout.orders == 7] = np.nan
        return rows


def same(one: runout.Result, other: runout.Result, rtol: float = 1e-9) -> None:
    for name in ("form", "motion", "harmonics"):
        for column, _, _ in one.tables[name].columns:
            found, expected = one.tables[name][column], other.tables[name][column]
            if isinstance(expected, np.ndarray) and expected.dtype == np.float64:
                scale = np.nanmax(np.abs(expected), initial=0)
                assert np.allclose(found, expected, rtol=rtol, atol=rtol * scale, equal_nan=True), (name, column)
            else:
                assert list(found) == list(expected), (name, column)


def test_a_formula_in_numpy_gives_what_the_built_in_one_gives(arrays: runout.Recording) -> None:
    own = runout.run(pipeline(), arrays, plugins=[FourSensors()], set={"separate": {"plugin": "four-sensors-in-numpy"}})
    same(own, runout.run(pipeline(), arrays))
    assert own.summary["warnings"] == runout.run(pipeline(), arrays).summary["warnings"]


def test_least_squares_in_one_line(arrays: runout.Recording) -> None:
    expected = runout.run(pipeline(separate=HarmonicLeastSquares(weighting="none")), arrays)
    same(runout.run(pipeline(separate=Pseudoinverse()), arrays), expected)


def test_objects_stand_in_pipelines_overrides_and_comparisons(arrays: runout.Recording) -> None:
    expected = runout.run(pipeline(), arrays)
    same(runout.run(pipeline(separate=FourSensors()), arrays), expected)
    same(runout.run(pipeline(), arrays, set={"separate": FourSensors()}), expected)
    keys: dict[str, Any] = {key: of for key, of in pipeline().items() if key not in ("load", "title")}
    in_code = runout.Pipeline(load=arrays, **(keys | {"separate": FourSensors()}))
    same(runout.run(in_code), expected)
    assert "four-sensors-in-numpy" in in_code.to_toml()
    comparison = runout.compare(pipeline(), [FourSensors(), "harmonic-least-squares"], arrays)
    assert "four-sensors-in-numpy" in str(comparison["methods"])
    report = runout.check(pipeline(separate=FourSensors()), arrays)
    assert report["lost_orders"]["form"] == []


def test_what_a_formula_does_not_give_is_lost(arrays: runout.Recording) -> None:
    result = runout.run(pipeline(separate=FormOnly()), arrays)
    expected = runout.run(pipeline(), arrays)
    assert 7 in result.lost_orders["form"] and 8 in result.lost_orders["motion"] and 8 not in result.lost_orders["form"]
    own, std = result.coefficients("form", section="a", station="s001")
    theirs, _ = expected.coefficients("form", section="a", station="s001")
    assert np.isnan(own[7]) and np.isnan(std[7])
    kept = [order for order in range(2, 20) if order != 7]
    assert np.allclose(own[kept], theirs[kept], rtol=1e-6, atol=1e-6)
    assert np.isnan(result.coefficients("x", station="s001")[0][2:]).all()
    lost = runout.check(pipeline(separate=FormOnly()), arrays)["lost_orders"]
    assert 7 in lost["form"] and 2 in lost["motion"]


class Raises(FourSensors):
    name = "raises"

    def operator(self, layout: runout.Layout) -> np.ndarray:
        return self.deeper(layout)

    def deeper(self, layout: runout.Layout) -> np.ndarray:
        raise KeyError("the author's own mistake")


def test_an_exception_of_the_code_comes_back_with_its_traceback() -> None:
    for command in (runout.run, runout.check, runout.diagnose):
        with pytest.raises(KeyError, match="the author's own mistake") as raised:
            command(small_pipeline(separate=Raises()), small_recording())
        frames = [frame.name for frame in traceback.extract_tb(raised.value.__traceback__)]
        assert frames[-2:] == ["operator", "deeper"]


@pytest.mark.parametrize(
    ("returned", "kind", "words"),
    [
        (np.zeros((3, 3)), ValueError, "shape"),
        ("text", ValueError, "malformed|convert"),
        (None, (ValueError, TypeError), "."),
        ([[1, 2], [3]], ValueError, "."),
        (np.full((30, 6, 8), np.inf), ValueError, "infinity"),
        (object(), (TypeError, ValueError), "."),
    ],
)
def test_what_is_no_operator_is_refused(returned: Any, kind: Any, words: str) -> None:
    class Wrong:
        name = "wrong"

        def operator(self, layout: runout.Layout) -> Any:
            return returned

    with pytest.raises(kind, match=words):
        runout.run(small_pipeline(separate=Wrong()), small_recording())


def test_names_and_kinds_are_checked() -> None:
    class Nameless:
        def operator(self, layout: runout.Layout) -> np.ndarray:
            return np.linalg.pinv(layout.matrix)

    named = Nameless()
    with pytest.raises(ValueError, match="kebab-case"):
        runout.run(small_pipeline(separate=named), small_recording())
    for name in ("", "With Space", "\x00", 3, None, "a" * 10 + "_"):
        named.name = name  # type: ignore[attr-defined]
        with pytest.raises(ValueError, match="kebab-case"):
            runout.run(small_pipeline(), small_recording(), plugins=[named])  # type: ignore[list-item]
    named.name = "three-point"  # type: ignore[attr-defined]
    with pytest.raises(runout.CommandError, match="already"):
        runout.run(small_pipeline(), small_recording(), plugins=[named])  # type: ignore[list-item]
    with pytest.raises(ValueError, match="two plugins"):
        runout.run(small_pipeline(), small_recording(), plugins=[FourSensors(), FourSensors()])
    for odd in (FourSensors, 3, "x", {}, object()):
        with pytest.raises(TypeError):
            runout.run(small_pipeline(), small_recording(), plugins=[odd])  # type: ignore[list-item]
    with pytest.raises(TypeError, match=r"found the class FourSensors: write FourSensors\(…\)"):
        runout.run(small_pipeline(separate=FourSensors), small_recording())
    with pytest.raises(TypeError):
        runout.run(small_pipeline(), small_recording(), plugins=3)  # type: ignore[arg-type]


def test_a_plugin_may_go_while_its_result_stays() -> None:
    for _ in range(20):
        result = runout.run(small_pipeline(separate=FourSensors()), small_recording())
        gc.collect()
    assert np.isfinite(result.tables["form"]["form_um"]).all()


class LowPass:
    """A first-order low-pass in one channel, as the effect `filter-attenuation`."""

    name = "low-pass-in-numpy"
    parameters = [("inverse-cut-off", "rev", 1e-3)]

    def transfer(self, orders: np.ndarray, p: float) -> np.ndarray:
        return 1 / (1 - 1j * orders * p)


class LowPassWithPartials(LowPass):
    def partials(self, orders: np.ndarray, p: float) -> np.ndarray:
        return np.array([1j * orders / (1 - 1j * orders * p) ** 2])


@pytest.fixture(scope="module")
def attenuated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three sensors, the part at three angles, a low-pass in one channel that the rig does not declare."""
    file = tmp_path_factory.mktemp("attenuated") / "campaign.h5"
    example = EXAMPLE.parent / "06-closed-loop"
    effect = [{"plugin": "filter-attenuation", "targets": ["S2"], "cutoff_hz": 600}]
    runout.simulate(example / "scenario.toml", file, set={"effect": effect})
    return file


@pytest.mark.parametrize("plugin", [LowPass(), LowPassWithPartials()])
def test_an_effect_in_numpy_finds_what_the_built_in_one_finds(attenuated: Path, plugin: LowPass) -> None:
    stages = EXAMPLE.parent / "06-closed-loop" / "pipeline.toml"
    settings = {"load.path": str(attenuated), "export": []}
    expected = runout.diagnose(stages, set=settings | {"diagnose.effects": ["filter-attenuation"]})
    own = runout.diagnose(stages, plugins=[plugin], set=settings | {"diagnose.effects": [plugin.name]})
    (theirs,), (added,) = expected.added, own.added
    assert added.effect == plugin.name and added.targets == theirs.targets == ["S2"]
    # The built-in one says the cut-off, this one its reciprocal.
    assert np.isclose(1 / added.parameters[0].value, theirs.parameters[0].value, rtol=1e-6)
    assert np.isclose(own.after.residual_rms, expected.after.residual_rms, rtol=1e-6)
    assert np.allclose(own.tables["form"]["form_um"], expected.tables["form"]["form_um"], atol=1e-6)


def test_an_effect_that_fails_stops_the_diagnosis(attenuated: Path) -> None:
    class Fails(LowPass):
        name = "fails"

        def transfer(self, orders: np.ndarray, p: float) -> np.ndarray:
            if p != 0:
                raise ZeroDivisionError("the author's own mistake")
            return super().transfer(orders, p)

    class Infinite(LowPass):
        name = "infinite"

        def transfer(self, orders: np.ndarray, p: float) -> np.ndarray:
            return np.where((orders > 5) & (p != 0), np.inf, 1.0)

    stages = EXAMPLE.parent / "06-closed-loop" / "pipeline.toml"
    settings = {"load.path": str(attenuated), "export": []}
    with pytest.raises(ZeroDivisionError, match="own mistake"):
        runout.diagnose(stages, plugins=[Fails()], set=settings)
    with pytest.raises(ValueError, match="infinite.transfer"):
        runout.diagnose(stages, plugins=[Infinite()], set=settings)
    with pytest.raises(ValueError, match="1 at each order"):
        runout.diagnose(stages, plugins=[type("Two", (LowPass,), {"transfer": lambda self, orders, p: 2 + 0 * orders})()])
    with pytest.raises(ValueError, match="usual size"):
        runout.diagnose(stages, plugins=[type("None_", (LowPass,), {"parameters": []})()])
