"""The tables of a pipeline that name no plugin.

Generated from schemas/ by python/tools/generate.py: every class has the keys of its table in TOML. A key that is None is left out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Union


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rig:
    """`[rig]` as written in a file."""

    bearings: Union[Sequence[Mapping[str, Any]], None] = None
    """The spindle's rolling bearings: lines of asynchronous motion that fit one are named."""

    interruptions: Union[Sequence[Mapping[str, Any]], None] = None
    """Where the surface is interrupted: a keyway, a cross hole. Readings there are bridged, and no value is taken there."""

    part_radius_mm: float
    """Nominal radius of the part at the sensors, in mm."""

    rotation: Union[Union[Literal['ccw'], Literal['cw']], None] = None
    """Which way the part turns about +z. Default: "ccw"."""

    sensors: Sequence[Mapping[str, Any]]
    """The displacement sensors."""

    setups: Sequence[Mapping[str, Any]]
    """The setups: how the part was clamped and where the sensors stood, one recording each."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Surface:
    """`[surface]`: how sections become a surface."""

    angles: Union[int, None] = None
    """Equally spaced angles around the part. Orders from half of it upwards do not fit and are left out of the surface. Default:
    720."""

    step_mm: Union[float, None] = None
    """Distance of the surface's rings along z, in mm, counted from the first section; the last section is the last ring. Without
    it the sections themselves are the rings."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Evaluate:
    """`[evaluate]`: which of the standards' values a run gives, and how."""

    areal: Union[Mapping[str, Any], None] = None
    """How areal and twist values are made of the surface, besides λs and λc."""

    centres: Union[Sequence[Union[Literal['PC'], Literal['LSC'], Literal['MZC'], Literal['MIC'], Literal['MCC']]], None] = None
    """Centres of polar plots that error motion values are about; without it LSC."""

    datum: Union[Sequence[str], None] = None
    """Sections, or stations of sections, whose least-squares centres make the datum axis of eccentricity, coaxiality and run-out
    of the other sections (with `cylindricity`, where centres are known); one section makes an axis along z."""

    directions_deg: Union[Sequence[float], None] = None
    """Fixed sensitive directions of error motion besides x and y, in degrees from x towards y, above -360 and below 360: where the
    tool stands. A direction and its opposite are one, 0 to below 180°."""

    faces: Union[Sequence[Mapping[str, Any]], None] = None
    """Places of a face at which face error motion is evaluated, besides those of the rig's axial sensors off the axis: where a
    tool stands."""

    filter: Union[Union[Literal['gaussian'], Literal['spline'], Literal['2rc'], Literal['2rc-phase-correct']], None] = None
    """Kind of the filters of `filter_upr` and `high_pass_upr`; without it `gaussian`."""

    filter_upr: Union[Sequence[float], None] = None
    """Cut-offs of the Gaussian low-pass (ISO 16610-21) for roundness and cylindricity, in undulations per revolution, as 15, 50,
    150, 500, 1500. Unfiltered values are always there besides. Without it 50, where the orders reach it."""

    harmonics_upr: Union[int, None] = None
    """Highest order of `harmonics`, from 2 on; without it 15."""

    high_pass_upr: Union[float, None] = None
    """Cut-off of a high-pass in undulations per revolution, which makes a band of each filter of `filter_upr`; unfiltered values
    stay."""

    lambda_c_mm: Union[float, None] = None
    """λc, the longest wavelength of texture and areal values, in mm; it makes the values of the roughness profile besides the
    unfiltered Ra."""

    lambda_s_mm: Union[float, None] = None
    """λs, the shortest, in mm."""

    references: Union[Sequence[Union[Literal['LSCI'], Literal['MZCI'], Literal['MICI'], Literal['MCCI']]], None] = None
    """Reference circles of roundness; those of cylindricity follow them (LSCY, MZCY, MICY, MCCY), and the lines of straightness
    those two that there are (LSLI, MZLI). Without it LSCI and MZCI."""

    robust_filter_upr: Union[Sequence[float], None] = None
    """Cut-offs of robust Gaussian low-passes (ISO 16610-31) for roundness, in undulations per revolution, besides `filter_upr`."""

    slope_window_deg: Union[float, None] = None
    """Window, in degrees up to 180, over which `roundness` gives the largest change of the profile, `slope`."""

    texture: Union[Mapping[str, Any], None] = None
    """What texture values are of, besides λs and λc."""

    values: Union[Union[Literal['all'], Sequence[Union[Literal['roundness'], Literal['harmonics'], Literal['straightness'], Literal['texture'], Literal['cylindricity'], Literal['areal'], Literal['twist'], Literal['error-motion'], Literal['run-out']]]], None] = None
    """Groups of values, or "all"; without it `roundness`, `straightness`, `texture`, `cylindricity` and `error-motion`, as far as
    what the separator offers gives them; `run-out` where nothing is separated. Of "all", what a run cannot give (areal values
    and twist of a single section) is left out."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Limit:
    """`[[limit]]`: a limit of every value that it names. What it leaves open (section, reference, filter) it does not narrow: all
    values of the symbol have to keep it."""

    filter: Union[str, None] = None
    """The filter as values name it: "none", "Gaussian 50 UPR"; all without it."""

    lower: Union[float, None] = None
    """The smallest value that may be, in `unit`."""

    orders: Union[str, None] = None
    """Orders that it is of, both ends included: "2..50". Of `amplitude` alone, which is computed for these orders then."""

    reference: Union[str, None] = None
    """What the value is referred to: "LSCI", "MZCI", "LSCY"; all without it."""

    section: Union[str, None] = None
    """Id of a section; all without it."""

    symbol: str
    """The standard's symbol: "RONt", "CYLt", "Ra"."""

    unit: str
    """Unit of the limits, which is the value's: "um"."""

    upper: Union[float, None] = None
    """The largest value that may be, in `unit`."""

    upper_curve: Union[Union[str, Mapping[str, Any]], None] = None
    """The largest amplitude of each order, in `unit`, in place of `upper`: a formula in n, "2.4 / n^1.5", or amplitudes at orders,
    { 2 = 0.8, 50 = 0.02 }, between which it is a straight line of both logarithms."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Diagnose:
    """`[diagnose]`: what the closed loop may consider. `run` leaves it alone."""

    effects: Union[Union[Literal['all'], Sequence[str]], None] = None
    """"all", or a list of effect ids."""

    hold_out: Union[float, None] = None
    """Share of the turns, at the end of each recording, that no fit sees and that every effect must explain. Measured points are
    left out group by group instead (circle, block, point)."""

    known: Union[Sequence[Mapping[str, Any]], None] = None
    """Effects that are there and whose size is known: applied as they are, neither looked for nor fitted."""

    memory_gb: Union[float, None] = None
    """Memory that the loop may take, in GB: it keeps all stations of recorded turns at once, and refuses those that need more.
    Default: 4.0."""

    out: Union[str, None] = None
    """Folder for the exports of the final model: folders of exporters become this one, files go into it. Without it they go to
    `diagnosed/` in the folders of `run`'s exports."""

    path: Union[str, None] = None
    """Where `diagnosis.json` goes; beside the first export of the final model without it."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Report:
    """`[report]`: what the head of a report says. Everything may be left out."""

    calibrated: Union[str, None] = None
    """When the instrument was calibrated: 2026-03-01."""

    customer: Union[str, None] = None
    """For whom."""

    fields: Union[Mapping[str, Any], None] = None
    """Whatever else the head has to say, by name: { Order = "4711" }."""

    instrument: Union[str, None] = None
    """The instrument."""

    logo: Union[str, None] = None
    """An image file (PNG, JPEG, GIF, WebP or SVG, at most 256 KiB), relative to the TOML; in results the image itself as a data
    URI."""

    machine: Union[str, None] = None
    """The machine or spindle that was measured."""

    operator: Union[str, None] = None
    """Who measured."""

    serial_number: Union[str, None] = None
    """Its serial number."""
