"""Golden numbers of two rotors of the Python package ross-rotordynamics, for src/against_ross.rs.

    python3 -m venv venv && venv/bin/pip install 'ross-rotordynamics==2.3.*' 'plotly<7'
    venv/bin/python golden.py ross.json

`rotor_example` is undamped on two springs; `rotor_example_with_damping` has damped bearings and material damping. The package
computes all six degrees of freedom of a node; only lateral modes are kept. Frequencies are damped ones, in Hz. Modes that the
package computes twice (its real eigenvalues) are left out.
"""

import json
import sys
import warnings

import numpy as np
import ross

warnings.filterwarnings("ignore")

MODES = 8
SPEEDS_RPM = [0.0, 1000.0, 2000.0, 4000.0, 8000.0, 12000.0]


def lateral(rotor, speed_rpm):
    """Lateral modes at a speed: frequency in Hz, damping ratio, whirl."""
    modal = rotor.run_modal(speed_rpm * np.pi / 30, num_modes=40)
    rows = []
    for frequency, ratio, shape in zip(modal.wd, modal.damping_ratio, modal.shapes):
        if shape.mode_type == "Lateral" and frequency > 1e-3:
            rows.append({"frequency_hz": frequency / (2 * np.pi), "damping_ratio": ratio, "whirl": shape.whirl.lower()})
    rows.sort(key=lambda row: row["frequency_hz"])
    return rows[:MODES]


def critical(rotor, count):
    """Speeds in rpm that are a lateral frequency, each by fixed-point iteration of the package's own modes to 1e-6."""
    found = []
    for index in range(count):
        speed_rpm = 60 * lateral(rotor, 0.0)[index]["frequency_hz"]
        for _ in range(60):
            next_rpm = 60 * lateral(rotor, speed_rpm)[index]["frequency_hz"]
            done = abs(next_rpm - speed_rpm) < 1e-6 * speed_rpm
            speed_rpm = next_rpm
            if done:
                break
        found.append(speed_rpm)
    return found


def main():
    rotors = {}
    for name in ["rotor_example", "rotor_example_with_damping"]:
        rotor = getattr(ross, name)()
        rotors[name] = {
            "campbell": [{"speed_rpm": speed, "modes": lateral(rotor, speed)} for speed in SPEEDS_RPM],
            "critical_rpm": critical(rotor, 4),
        }
    version = {"ross": ross.__version__, "numpy": np.__version__}
    # A library of the package prints to standard output, so the numbers go to a file.
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        json.dump({"version": version, "rotors": rotors}, file, indent=1)
        file.write("\n")


if __name__ == "__main__":
    main()
