"""Writes the WAV files of the tests with soundfile 0.14 (libsndfile) and, what it does not write, byte by byte.

    python write_wav.py
"""

import struct

import numpy as np
import soundfile

from references import FOLDER, expect

RNG = np.random.default_rng(45)


def done(name, rate_hz=None, numbers=None):
    if numbers is None:
        numbers, rate_hz = soundfile.read(FOLDER / name, dtype="float64", always_2d=True)
    expect(name, [(f"ch{column + 1}", None, rate_hz, numbers[:, column]) for column in range(numbers.shape[1])])


numbers = np.clip(RNG.normal(scale=0.3, size=(17, 3)), -1, 1 - 2**-30)
for kind in ("PCM_U8", "PCM_16", "PCM_24", "PCM_32", "FLOAT", "DOUBLE"):
    for container, order in (("WAV", "FILE"), ("WAVEX", "FILE"), ("RF64", "FILE"), ("WAV", "BIG")):
        if kind not in ("PCM_24", "DOUBLE") and container != "WAV":
            continue
        name = f"{container.lower()}-{kind.lower()}{'-big' if order == 'BIG' else ''}.wav"
        soundfile.write(FOLDER / name, numbers, 20480, subtype=kind, format=container, endian=order)
        done(name)

codes = RNG.integers(-32768, 32767, (9, 2)).astype("<i2")
head = b"fmt " + struct.pack("<IHHIIHH", 16, 1, 2, 1000, 4000, 4, 16)
junk = b"JUNK" + struct.pack("<I", 5) + b"12345\0" + b"LIST" + struct.pack("<I", 18) + b"INFOISFT" + struct.pack("<I", 6) + b"mine\0\0"
for name, length in (("streamed", 0xFFFFFFFF), ("streamed-zero", 0), ("odd-junk", codes.nbytes)):
    data = b"WAVE" + junk + head + b"data" + struct.pack("<I", length) + codes.tobytes()
    (FOLDER / f"{name}.wav").write_bytes(b"RIFF" + struct.pack("<I", len(data) if length == codes.nbytes else length) + data)
    done(f"{name}.wav", 1000, codes / 32768)
