"""The peers' whole campaign, once: prints JSON with its time, its memory and its error.

usage: peers.py PEERS FILE PROCESSES

The work is that of PEERS/pipeline_bench.py, section by section: load, low-pass forward and backward, resample linearly
between index marks, average, separate by reversal and by three points. The clock starts when everything is imported, the
operators are built and the processes run.
"""
import json
import multiprocessing
import os
import resource
import sys
import time

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[variable] = "1"

import h5py
import numpy as np
from scipy import signal

peers, path, processes = sys.argv[1], sys.argv[2], int(sys.argv[3])
sys.path.insert(0, peers)
import pipeline as P  # noqa: E402

from truth import form_errors_um  # noqa: E402

with h5py.File(path) as file:
    n, stations, scale = int(file.attrs["n"]), int(file.attrs["sections"]), float(file.attrs["scale"])
CUTOFF_UPR = 500.0
SOS = P.lowpass_sos(4, CUTOFF_UPR, n)
REVERSAL = P.reversal_operator(n)
THREE_POINT = P.three_point_operator(n)


def peak_mib():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def work(k):
    averages = []
    with h5py.File(path) as file:
        for s in (0, 1):
            x, index = file[f"setup{s}/section{k:03d}"][...], file[f"setup{s}/index{k:03d}"][...]
            if x.dtype != np.float64:
                x = x * scale
            y = P.resample_linear(signal.sosfiltfilt(SOS, x, axis=-1), index, n)
            averages.append(P.sync_average(y, n)[0])
    found = P.reversal(*averages, REVERSAL), P.three_point(averages[0], *THREE_POINT)
    return found, os.getpid(), peak_mib()


def timed(run):
    started = time.perf_counter()
    found = run(work, range(stations))
    return time.perf_counter() - started, found


if processes == 1:
    seconds, found = timed(lambda work, sections: [work(k) for k in sections])
else:
    with multiprocessing.get_context("fork").Pool(processes) as pool:
        seconds, found = timed(lambda work, sections: pool.map(work, sections, chunksize=1))
peaks = {}
for _, process, peak in found:
    peaks[process] = max(peak, peaks.get(process, 0.0))
forms = [np.fft.rfft(reversal[0]) * 2 / n for (reversal, _), _, _ in found]
print(json.dumps({"seconds": seconds, "peak_mib": sum(peaks.values()), "form_error_um": form_errors_um(forms)}))
