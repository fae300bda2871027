"""Makes shifted.csv: six simulated traces with axial shifts, one with a chip under the probe (flagged).

python make_shifted.py > shifted.csv

Part and slide are functions of z. Each trace samples them where the probe truly is, which is not where its z says.
"""

import math
import random

random.seed(4)

PART = [(0.8, 170.0), (0.3, 41.0)] + [(0.2, 2.2 + 0.5 * n) for n in range(12)]
SLIDE = [(0.15, 140.0), (0.06, 47.0)]
PART = [(a, length, random.uniform(0, 2 * math.pi)) for a, length in PART]
SLIDE = [(a, length, random.uniform(0, 2 * math.pi)) for a, length in SLIDE]
SHIFTS_MM = {
    "initial-1": 0.0, "initial-2": 0.14, "initial-3": 0.0,
    "reversed-1": 0.11, "reversed-2": 0.11, "reversed-3": 0.04,
}


def value(waves, z):
    return sum(a * math.sin(2 * math.pi * z / length + phase) for a, length, phase in waves)


print("trace,setup,z_mm,reading_um,flag")
for trace, shift in SHIFTS_MM.items():
    setup = trace.split("-")[0]
    sign = 1 if setup == "initial" else -1
    offset, slope = random.uniform(-20, 20), random.uniform(-0.05, 0.05)
    z = random.uniform(0, 0.25)
    while z < 60:
        truly = z + shift
        reading = value(PART, truly) + sign * value(SLIDE, truly) + offset + slope * z + random.gauss(0, 0.02)
        chip = trace == "reversed-2" and 21 < z < 23.5
        print(f"{trace},{setup},{z:.4f},{reading + 2 * chip:.4f},{int(chip)}")
        z += 0.25
