"""Writes measurement files that lead out of themselves or declare more than they hold. Arguments: the folder."""

import sys
from pathlib import Path

import h5py
import numpy as np

SAMPLES, CHANNELS, TURNS = 600, 2, 6
folder = Path(sys.argv[1])
values = np.arange(SAMPLES * CHANNELS, dtype="f8").reshape(SAMPLES, CHANNELS) / 64


def head(file):
    file.attrs["format"] = "runout-measurement"
    file.attrs["version"] = 1
    file.attrs["length_unit"] = "um"


def station(group, samples=True):
    group.attrs["z_mm"] = 1.5
    group["index"] = np.arange(0.0, SAMPLES, SAMPLES / TURNS)
    if samples:
        group["samples"] = values
        group["samples"].attrs["sensors"] = ["S1", "S2"]


def measurement(name, write, samples=False, **options):
    with h5py.File(folder / f"{name}.h5", "w", **options) as file:
        head(file)
        group = file.create_group("initial/only")
        station(group, samples)
        write(file, group)


def described(group, dataset):
    dataset.attrs["sensors"] = ["S1", "S2"]


with h5py.File(folder / "other.h5", "w") as file:
    head(file)
    station(file.create_group("initial/only"))
(folder / "raw.bin").write_bytes(values.tobytes())


def external_link(file, group):
    group["samples"] = h5py.ExternalLink("other.h5", "/initial/only/samples")


def soft_through_external(file, group):
    file["elsewhere"] = h5py.ExternalLink("other.h5", "/initial/only")
    group["samples"] = h5py.SoftLink("/elsewhere/samples")


def soft_circle(file, group):
    group["samples"] = h5py.SoftLink("/initial/only/again")
    group["again"] = h5py.SoftLink("/initial/only/samples")


def virtual(file, group, source="other.h5", path="/initial/only/samples"):
    layout = h5py.VirtualLayout(shape=values.shape, dtype="f8")
    layout[:] = h5py.VirtualSource(source, path, shape=values.shape)
    described(group, group.create_virtual_dataset("samples", layout))


def external_storage(file, group, rows=SAMPLES):
    size = h5py.h5f.UNLIMITED if rows > SAMPLES else values.nbytes
    name = str(folder / "raw.bin")
    described(group, group.create_dataset("samples", (rows, CHANNELS), "f8", external=[(name, 0, size)]))


def one_chunk(file, group):
    shape = (200_000_000, CHANNELS)
    data = group.create_dataset("samples", shape, "f8", chunks=shape, compression="gzip")
    import zlib
    packed = zlib.compress(bytes(1 << 20))
    data.id.write_direct_chunk((0, 0), packed)
    described(group, data)


def circle(file, group):
    group["samples"] = values
    described(group, group["samples"])
    file["initial/only/up"] = file["initial"]
    file["pad"] = np.zeros(17 << 17)


measurement("external-link", external_link)
measurement("soft-through-external", soft_through_external)
measurement("soft-circle", soft_circle)
measurement("virtual", virtual)
measurement("virtual-itself", lambda file, group: virtual(file, group, ".", "/initial/only/samples"))
measurement("external-storage", external_storage)
measurement("external-storage-endless", lambda file, group: external_storage(file, group, 10**12))
measurement("one-chunk", one_chunk)
measurement("circle", circle)
measurement("longer", lambda file, group: described(group, group.create_dataset("samples", data=values)))
with open(folder / "longer.h5", "ab") as file:
    file.write(b"appended")
with h5py.File(folder / "pipe-link.h5", "w") as file:
    head(file)
    station(file.create_group("initial/only"), samples=False)
    file["initial/only/samples"] = h5py.ExternalLink("pipe.h5", "/x")
