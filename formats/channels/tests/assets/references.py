"""What the scripts beside this one share: assets and what the reference library reads from them.

An asset NAME has NAME.expected beside it. Each channel is a line of path, unit, rate in Hz and number of samples, separated by tabs
(empty where there is none), and a line of its numbers as 64-bit floats in hexadecimal.
"""

import pathlib
import struct

FOLDER = pathlib.Path(__file__).parent


def expect(name, channels):
    """channels: (path, unit, rate_hz, numbers) of each."""
    lines = []
    for path, unit, rate_hz, numbers in channels:
        rate = "" if rate_hz is None else repr(float(rate_hz))
        lines.append(f"{path}\t{unit or ''}\t{rate}\t{len(numbers)}")
        lines.append(" ".join(struct.pack(">d", float(number)).hex() for number in numbers))
    (FOLDER / f"{name}.expected").write_text("\n".join(lines) + "\n", encoding="utf-8")
