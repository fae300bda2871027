"""From profiles or points to form and motion.

Generated from schemas/ by python/tools/generate.py: every class has the keys of its table in TOML. A key that is None is left out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Union


@dataclasses.dataclass(frozen=True, kw_only=True)
class DonaldsonReversal:
    """One sensor a section, part and sensor reversed by 180°: half the sum, half the difference"""

    plugin: ClassVar[str] = "donaldson-reversal"

    max_noise_gain: Union[float, None] = None
    """An order is lost where form or motion would carry more than this many times the readings' noise, as near the zeros of a
    transfer function; without it, 30 for three-point, and no limit for the others."""

    second_order: Union[bool, None] = None
    """Whether readings follow exact geometry (a line meets the displaced profile) or the linear equations. Default: true."""

    sensors: Union[Sequence[str], None] = None
    """Sensors to use; without it, the first of the rig that the method can take."""

    setups: Union[Sequence[str], None] = None
    """Setups to use; without it, the first of the rig that the method can take."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class FourSensorReversal:
    """Two sensors at right angles in each of two sections, part reversed by 180°"""

    plugin: ClassVar[str] = "four-sensor-reversal"

    assume_odd_motion: Union[bool, None] = None
    """With sensors that were not reversed: assume, as the paper's equation (7) does, that motion after half a turn is the
    negative. That holds for odd orders only; without it, even orders are reported as lost. Default: false."""

    second_order: Union[bool, None] = None
    """Whether readings follow exact geometry (a line meets the displaced profile) or the paper's linear equations. Default: true."""

    sensors: Union[Sequence[str], None] = None
    """Sensors to use; without it, the first of the rig that the method can take."""

    setups: Union[Sequence[str], None] = None
    """Setups to use; without it, the first of the rig that the method can take."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ThreePoint:
    """Three sensors around each of one or two sections, one setup"""

    plugin: ClassVar[str] = "three-point"

    max_noise_gain: Union[float, None] = None
    """An order is lost where form or motion would carry more than this many times the readings' noise, as near the zeros of a
    transfer function; without it, 30 for three-point, and no limit for the others."""

    second_order: Union[bool, None] = None
    """Whether readings follow exact geometry (a line meets the displaced profile) or the linear equations. Default: true."""

    sensors: Union[Sequence[str], None] = None
    """Sensors to use; without it, the first of the rig that the method can take."""

    setups: Union[Sequence[str], None] = None
    """Setups to use; without it, the first of the rig that the method can take."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class MultiStep:
    """One sensor a section that stays, the part at any number of angles, equal steps or not"""

    plugin: ClassVar[str] = "multi-step"

    max_noise_gain: Union[float, None] = None
    """An order is lost where form or motion would carry more than this many times the readings' noise, as near the zeros of a
    transfer function; without it, 30 for three-point, and no limit for the others."""

    second_order: Union[bool, None] = None
    """Whether readings follow exact geometry (a line meets the displaced profile) or the linear equations. Default: true."""

    sensors: Union[Sequence[str], None] = None
    """Sensors to use; without it, the first of the rig that the method can take."""

    setups: Union[Sequence[str], None] = None
    """Setups to use; without it, the first of the rig that the method can take."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class HarmonicLeastSquares:
    """Any rig: least squares order by order, weighted by the scatter over the turns"""

    plugin: ClassVar[str] = "harmonic-least-squares"

    max_noise_gain: Union[float, None] = None
    """An order is lost where form or motion would carry more than this many times the readings' noise; without it, where it is not
    observable with the layout."""

    second_order: Union[bool, None] = None
    """Whether readings follow exact geometry (a line meets the displaced profile) or the linear equations. Default: true."""

    sensors: Union[Sequence[str], None] = None
    """Sensors to use; without it, all of the rig."""

    setups: Union[Sequence[str], None] = None
    """Setups to use; without it, all of the rig."""

    weighting: Union[Union[Literal['turn-covariance'], Literal['none']], None] = None
    """How readings are weighed."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class LeastSquaresCylinder:
    """Form of measured circles, from the least-squares cylinder"""

    plugin: ClassVar[str] = "least-squares-cylinder"

    hold_out: Union[Sequence[str], None] = None
    """Traces to hold out although `use` names them, by kind or id. The surface has to predict whatever is not used."""

    max_lobes: Union[int, None] = None
    """Highest order of lobes that `diagnose` may add. Default: 8."""

    max_order: Union[int, None] = None
    """Highest order (undulations per revolution) fitted to each circle. An arc without points, or few points, may limit it
    further. Default: 50."""

    outlier_mad: Union[float, None] = None
    """Leaves out points further than this many median absolute deviations from the fit of their circle, and counts them. Without
    it every point stays, and those that are not like the others are named."""

    outlier_order: Union[int, None] = None
    """Highest order of the fit that points are compared with where `outlier_mad` leaves some out, whatever `max_order` is.
    Default: 50."""

    radius_mm: float
    """Nominal radius that the deviations are measured from, in mm."""

    use: Union[Sequence[str], None] = None
    """Traces to use, by kind or id; each must go round the part. Without it those of the kinds circle and helix."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class AxialReversal:
    """Straightness of part and slide along z, part turned by 180° and probe reversed"""

    plugin: ClassVar[str] = "axial-reversal"

    initial: Union[str, None] = None
    """Setup in which the slide's displacement counts as it is: towards the part positive. Default: "initial"."""

    max_shift_mm: Union[float, None] = None
    """Largest axial shift of a trace that is looked for, in mm. Default: 1.0."""

    reading_std_um: Union[float, None] = None
    """Standard deviation of one reading, in µm, where it is known from elsewhere; `diagnose` can then say whether noise only is
    left."""

    reversed: Union[str, None] = None
    """Setup with the part turned by 180° about its axis, and the probe on the opposite side of it, at the same line. Default:
    "reversed"."""

    slide_cutoff_mm: Union[float, None] = None
    """The slide has no waves shorter than this, in mm. Declare it where the slide's guideway and bearings bear it out: shorter
    waves are then the part's, the setups can contradict each other, and `diagnose` finds a shift between them."""

    step_mm: Union[float, None] = None
    """Distance of the positions that straightness is given at, in mm, counted from where all traces have begun. Without it: the
    traces' own positions where they are the same in all, else about the median spacing of the coarsest trace, so that both ends
    of the common range have one."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Quadrature:
    """Offset, gain ratio, angle and harmonics of a quadrature signal, and its corrected angle"""

    plugin: ClassVar[str] = "quadrature"

    blocks: Union[int, None] = None
    """Blocks of samples next to each other in phase, as many in each: they are left out of the fit one after the other, and
    predicted. Default: 100."""

    max_order: Union[int, None] = None
    """Highest harmonic of the phase that may be in the radius. Default: 16."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RTest:
    """Installation and harmonics of a C axis by an R-test"""

    plugin: ClassVar[str] = "r-test"

    a_deg: float
    """Only points at this command of the A axis are used: the A axis stands otherwise at another."""

    max_order: Union[int, None] = None
    """Highest harmonic of C that may be in the error motion. Default: 3."""

    std_um: float
    """Standard uncertainty of one coordinate of one point, in µm."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RotaryAxis:
    """Location and component errors of a rotary axis from an R-test, by one weighted fit"""

    plugin: ClassVar[str] = "rotary-axis"

    axis: Union[Union[Literal['A'], Literal['B'], Literal['C']], None] = None
    """The rotary axis. Its command is the column `a_deg`, `b_deg` or `c_deg`. Default: "C"."""

    balls: Sequence[Mapping[str, Any]]
    """The balls, in the table's frame. The nominal axis runs through the origin."""

    component_errors: Union[bool, None] = None
    """Whether component errors are free at each command; `false` declares that there are none. Default: true."""

    curves: Union[Mapping[str, Any], None] = None
    """Component errors at evenly spaced nodes, and location errors, as tables."""

    std_um: Union[float, None] = None
    """Standard uncertainty of one coordinate of one row, in µm. A column `std_um` overrides it; without both the scatter of
    repeats is taken."""

    tool_points: Union[Sequence[Mapping[str, Any]], None] = None
    """Further points of the table for which the compensation is given."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RotaryAxisCircleFit:
    """Location errors of a rotary axis from one ball, by a circle and a plane"""

    plugin: ClassVar[str] = "rotary-axis-circle-fit"

    axis: Union[Union[Literal['A'], Literal['B'], Literal['C']], None] = None
    """The rotary axis. Its command is the column `a_deg`, `b_deg` or `c_deg`. Default: "C"."""

    ball: Union[str, None] = None
    """The ball whose track is taken; the first without it."""

    balls: Sequence[Mapping[str, Any]]
    """The balls, in the table's frame. The nominal axis runs through the origin."""

    std_um: Union[float, None] = None
    """Standard uncertainty of one coordinate of one row, in µm."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RotaryAxisThreePoint:
    """Location and component errors of a rotary axis from six readings of three balls a command"""

    plugin: ClassVar[str] = "rotary-axis-three-point"

    axis: Union[Union[Literal['A'], Literal['B'], Literal['C']], None] = None
    """The rotary axis. Its command is the column `a_deg`, `b_deg` or `c_deg`. Default: "C"."""

    balls: Sequence[Mapping[str, Any]]
    """The balls, in the table's frame, of which the first gives three readings at a command, the second two and the third one."""

    std_um: Union[float, None] = None
    """Standard uncertainty of one coordinate of one row, in µm."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class TouchProbe:
    """Pre-travel and lobing of a touch-trigger probe, from touches of a ring"""

    plugin: ClassVar[str] = "touch-probe"

    max_order: Union[int, None] = None
    """Highest order of lobing and of ring form, in undulations per revolution. Default: 15."""

    ring_form_um: Union[float, None] = None
    """Bound of the ring's form, peak-to-valley, in µm: of the orders that the setups cannot separate from lobing. Needed where
    they separate none. Lobing of these orders is then what is read, and its uncertainty includes the bound."""

    ring_radius_mm: float
    """Calibrated radius of the ring, in mm. Its error goes into the mean pre-travel one to one."""

    setups: Sequence[Mapping[str, Any]]
    """How the ring and the probe were turned, one entry a setup."""

    std_um: Union[float, None] = None
    """Standard uncertainty of one touch, in µm. Without it: of the column `std_um`, else from repeats, else from the residual."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Positioning:
    """Accuracy and repeatability of positioning of one axis by ISO 230-2: A, E, R, B, M"""

    plugin: ClassVar[str] = "positioning"

    axis: str
    """The axis, as the values name it: "X", "C"."""

    rotary: Union[bool, None] = None
    """Whether it is a rotary axis: its columns are then `target_deg` and `deviation_arcsec`. Default: false."""

    scale_std_ppm: Union[float, None] = None
    """Standard uncertainty of the scale, by the instrument's certificate and the temperatures: µm/m, of a rotary axis 10⁻⁶ of the
    angle. Default: 0.0."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Circular:
    """Circular deviation, radial deviation and hysteresis of a circular path by ISO 230-4: G, F, H, D"""

    plugin: ClassVar[str] = "circular"

    plane: str
    """The plane of the path, as the values name it: "XY"."""

    radius_mm: float
    """Nominal radius of the path, in mm."""

    radius_std_um: Union[float, None] = None
    """Standard uncertainty of the instrument's length, in µm: 0 where it was not calibrated, and D and F say nothing of the radius
    itself. Default: 0.0."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Drift:
    """Thermal drift over hours by ISO 230-3: range of each axis and combined, time to stability"""

    plugin: ClassVar[str] = "drift"

    stable_um: Union[float, None] = None
    """How far from its last position an axis is stable, in µm; without it a tenth of its own range."""

    window_s: Union[float, None] = None
    """Readings are averaged over so many seconds: vibration is no drift. Default: 60.0."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Diagonals:
    """Positioning along body and face diagonals by ISO 230-6: E, B, R, A, M of each, the largest of all"""

    plugin: ClassVar[str] = "diagonals"

    scale_std_ppm: Union[float, None] = None
    """Standard uncertainty of the scale, by the instrument's certificate and the temperatures, in µm/m. Default: 0.0."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Probing:
    """Performance of a probe on a machine tool by ISO 230-10: P_FTU of a sphere or a ring, repeatability R_SPT and R_PTL"""

    plugin: ClassVar[str] = "probing"

    object: Union[Literal['point'], Literal['ring'], Literal['sphere']]
    """What was touched."""

    tool_changed: Union[bool, None] = None
    """Whether the probe was changed in the spindle between sets (ring and sphere): the centre of each set is then evaluated too.
    Default: false."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RotaryPath:
    """Paths of a rotary axis and linear axes by ISO 10791-6, BK1 to BK4: radial, tangential and axial deviation of an R-test"""

    plugin: ClassVar[str] = "rotary-path"

    axis: Union[Literal['A'], Literal['B'], Literal['C']]
    """The axis whose command is the place on the path: "A", "B" or "C"."""

    balls: Sequence[Mapping[str, Any]]
    """Places of the balls at command 0 of the axis, which runs through the origin."""

    test: Union[Literal['BK1'], Literal['BK2'], Literal['BK3'], Literal['BK4']]
    """The test, as the standard names it."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class StructuralMotion:
    """Motion with the spindle still by ISO 230-7: peak to valley of each axis within a stated time"""

    plugin: ClassVar[str] = "structural-motion"

    window_s: float
    """Time over which a peak to valley is taken, in s."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RotorModes:
    """Natural frequencies, Campbell diagram and critical speeds of a rotor"""

    plugin: ClassVar[str] = "rotor-modes"

    avoid_orders: Union[Sequence[float], None] = None
    """Multiples of the speed that matter to a measurement: no mode may be near them."""

    avoid_within_percent: Union[float, None] = None
    """How near a mode may not be, in percent of order times speed. Default: 15.0."""

    campbell_rpm: Union[Sequence[float], None] = None
    """Speeds of the Campbell diagram, in rpm."""

    modes: Union[int, None] = None
    """How many modes are given, by ascending frequency. Default: 12."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class SpatialError:
    """Spatial error of a machine by kriging, and its compensation"""

    plugin: ClassVar[str] = "spatial-error"

    chain: Union[Sequence[Union[Literal['X'], Literal['Y'], Literal['Z']]], None] = None
    """Linear axes from the base to the tool."""

    compensate: Union[Mapping[str, Any], None] = None
    """How to compensate: by X, Y and Z without limits where nothing is said."""

    curves: Union[Mapping[str, Any], None] = None
    """Component errors of the axes at nodes, as tables: for a machine whose `chain` is known."""

    declared: Union[Sequence[Union[Literal['rigid'], Literal['translation']]], None] = None
    """What is always fitted: `rigid` (placement of the tracker: three displacements, three rotations), `translation` (ordinary
    kriging), nothing (a field of mean zero)."""

    kriging: Union[Mapping[str, Any], None] = None
    """The covariance of the field."""

    pitch_mm: Union[Sequence[float], None] = None
    """Periods of the ball screws or scales of X, Y and Z, in mm; 0 where one is not known: `diagnose` then looks for it."""

    query: Union[Mapping[str, Any], None] = None
    """Where to predict and to compensate; at the measured places without it."""

    std_um: Union[float, None] = None
    """Standard uncertainty of one coordinate of one row, in µm. Without it: of the column `std_um`, else from repeats, else the
    nugget is noise."""

    tool_mm: Union[Sequence[float], None] = None
    """Offset of the measured point from the last axis of the chain, in mm."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Flatness:
    """Flatness of a surface plate from slopes along lines that cross (Moody), by an autocollimator or a level"""

    plugin: ClassVar[str] = "flatness"

    std_urad: Union[float, None] = None
    """Standard uncertainty of one reading, in µrad; without it, what the lines leave where they cross shows it."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class FlyCutting:
    """What a fly-cut surface has beside its scallops, and the motion of the spindle in it"""

    plugin: ClassVar[str] = "fly-cutting"

    cutter_radius_mm: float
    """Distance of the tool from the spindle's axis, in mm."""

    feed_um_per_rev: float
    """Feed, in µm per revolution."""

    max_frequency_ratio: Union[int, None] = None
    """Highest frequency of a line, in periods per turn. A line at y = 0 looks the same at all ratios that differ by whole numbers.
    Default: 10."""

    nose_radius_mm: float
    """Radius of the tool's nose, in mm."""

    speed_rpm: float
    """Speed, in revolutions per minute: gives lines their frequency in Hz."""

    std_nm: Union[float, None] = None
    """Standard uncertainty of a height, in nm, where it is not that of the file."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class AsMeasured:
    """Nothing is separated: values of a height map, a profile, a circle or a cylinder as measured"""

    plugin: ClassVar[str] = "as-measured"

    crop: Union[Mapping[str, Any], None] = None
    """The part that is evaluated, of a height map or a profile; without it all of it."""

    degree: Union[int, None] = None
    """Degree of `form = "polynomial"`, 1 to 8; without it 2."""

    form: Union[Union[Literal['none'], Literal['plane'], Literal['polynomial'], Literal['cylinder'], Literal['sphere']], None] = None
    """Form that is removed by least squares, of a height map or a profile; without it the plane, or the line of a profile."""

    max_order: Union[int, None] = None
    """Highest order (undulations per revolution) that is fitted to each circle. Without it 500, or less: half a wave is as long as
    the arcs between points, and a tenth of the points, 10 at least, are left to show the noise."""

    object: Union[Union[Literal['height-map'], Literal['profile'], Literal['roundness'], Literal['cylinder']], None] = None
    """What the points are of; without it a height map."""

    outlier_mad: Union[float, None] = None
    """Leaves out points further than this many median absolute deviations from the median of their neighbours (of a circle: from
    its fit). Without it every point stays."""

    radius_mm: Union[float, None] = None
    """Nominal radius of a circle or a cylinder, in mm; without it the mean radius where the points have one."""

    voids: Union[Union[Literal['mask'], Literal['fill']], None] = None
    """What becomes of points of a height map that have no height, or whose height is left out; without it they are masked."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class External:
    """A program in any language: tables on stdin and stdout"""

    plugin: ClassVar[str] = "external"

    columns: Union[Sequence[str], None] = None
    """Columns of numbers that the program takes of measured points; without it, it takes the turns of a rig."""

    command: Sequence[str]
    """The program and its arguments. It runs in the folder of the pipeline; a program whose name has a `/` is a path from there."""

    config: Union[Mapping[str, Any], None] = None
    """What the program gets as `runout.config`: keys of its own."""

    labels: Union[Sequence[str], None] = None
    """Columns of texts that it takes of measured points."""

    memory_mb: Union[int, None] = None
    """Most memory that the program may write to, in MB, on Linux; without it, as much as there is."""

    output_mb: Union[int, None] = None
    """Largest answer, in MB. Default: 64."""

    symbols: Union[Sequence[Mapping[str, Any]], None] = None
    """Values that it gives of measured points, and no others: those that `[[limit]]` may name."""

    timeout_s: Union[float, None] = None
    """Longest time for one answer, in s; the first one includes the start of the program. Default: 60.0."""
