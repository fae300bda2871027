"""Writes a measurement file of the format before HDF5 1.10, and where its addresses lie: write_old_format.py FILE.h5 PLACES.txt.

PLACES.txt holds the byte at which each address of the file begins, one a line: those of the superblock, of groups and of data.
"""

import sys

import h5py
import numpy as np

SAMPLES, TURNS = 300, 6
path, places = sys.argv[1:]
extents = []


def note(_, found):
    if not isinstance(found, h5py.Dataset):
        return
    if found.chunks is None:
        extents.append((found.id.get_offset(), found.id.get_storage_size()))
    else:
        chunks = [found.id.get_chunk_info(index) for index in range(found.id.get_num_chunks())]
        extents.extend((chunk.byte_offset, chunk.size) for chunk in chunks)


with h5py.File(path, "w", libver="earliest") as file:
    file.attrs["format"] = "runout-measurement"
    file.attrs["version"] = 1
    file.attrs["length_unit"] = "um"
    for number, setup in enumerate(("initial", "reversed")):
        for station in range(4):
            group = file.create_group(f"{setup}/s{station}")
            group.attrs["z_mm"] = float(station)
            values = np.random.default_rng(10 * number + station).normal(size=(SAMPLES, 2))
            # Every second station in chunks, without a filter that would notice.
            chunks = (100, 2) if station % 2 else None
            group.create_dataset("samples", data=values, chunks=chunks)
            group["samples"].attrs["sensors"] = ["S1", "S2"]
            # No mark at 0: bytes of 0 look like those that belong to nothing.
            group["index"] = np.arange(0.3, SAMPLES, SAMPLES / TURNS)
with h5py.File(path) as file:
    file.visititems(note)

with open(path, "rb") as file:
    content = file.read()


def is_data(place):
    return any(start <= place < start + size for start, size in extents)


found = set(range(24, 56, 8)) | {64, 72, 88}
for start, _ in extents:
    address, place = start.to_bytes(8, "little"), -1
    while (place := content.find(address, place + 1)) >= 0:
        if not is_data(place):
            found.add(place)
# Children of trees and nodes, and the continuations of object headers, are aligned: words that lead to a structure.
for place in range(0, len(content) - 7, 8):
    to = int.from_bytes(content[place : place + 8], "little")
    signs = (b"TREE", b"SNOD", b"HEAP", b"GCOL", b"\x01\x00")
    if not is_data(place) and 0 < to < len(content) and to % 8 == 0 and not is_data(to) and content[to:].startswith(signs):
        found.add(place)
with open(places, "w") as file:
    file.writelines(f"{place}\n" for place in sorted(found))
