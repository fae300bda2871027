"""Times runout and the peers in turns on the same campaign and prints a Markdown table.

usage: compare.py RUNOUT PEERS SCRATCH ROUNDS NAME STATIONS [PROGRAM ...]

NAME is f64 or i16, as write_record.py wrote them. Each PROGRAM is another runout, such as an earlier one, timed in the same turns. Standard library
only: a process starts with its parent's peak memory to its name, and this one is small.
"""
import json
import os
import statistics
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

runout, peers, scratch, rounds, name, stations, *others = sys.argv[1:]
here = Path(__file__).parent
runout, peers, scratch = (Path(path).resolve() for path in (runout, peers, scratch))
out = scratch / "out"
WORKERS = (1, 2)


def python(script, *arguments):
    return [sys.executable, "-B", str(here / script), *map(str, arguments)]


def answer(command):
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


def run_runout(threads, *settings, program=runout):
    """Wall and processor seconds of the whole process, and its peak memory in MiB."""
    command = [program, "run", str(here / "pipeline.toml"), "--threads", str(threads), *settings]
    for key, value in (
        ("load.path", f"{scratch}/record-{name}-{stations}.h5"),
        ("export.0.path", out),
        ("export.1.path", out / "result.h5"),
    ):
        command += ["--set", f"{key}={value}"]
    started = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - started
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{' '.join(command)} failed ({process.returncode})")
    return {"seconds": seconds, "busy": usage.ru_utime + usage.ru_stime, "peak_mib": usage.ru_maxrss / 1024}


def run_values(threads, program=runout):
    """The same, and the standards' values with their uncertainty, as a run gives them by default."""
    everything = 'evaluate.values=["roundness", "cylindricity", "texture", "error-motion"]'
    return run_runout(threads, "--set", everything, program=program)


def run_peers(processes):
    return answer(python("peers.py", peers, f"{scratch}/peers-{name}-{stations}.h5", processes))


def busy():
    """Processor seconds that everybody used so far: user, nice, system, interrupts, stolen."""
    fields = Path("/proc/stat").read_text().split(maxsplit=9)[1:9]
    return sum(int(fields[i]) for i in (0, 1, 2, 5, 6, 7)) / os.sysconf("SC_CLK_TCK")


def own():
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


beside = [(partial(run_runout, program=path), partial(run_values, program=path)) for path in others]
# This program is the last to write what is checked below.
timed = [*(run for both in beside for run in both), run_runout, run_values, run_peers]
found = {(who, workers): [] for who in timed for workers in WORKERS}
for who, workers in found:
    who(workers)  # files into the page cache, programs into memory
began, elsewhere = time.perf_counter(), busy() - own()
for round in range(int(rounds)):
    for (who, workers), runs in found.items():
        runs.append(who(workers))
elsewhere = max(0.0, busy() - own() - elsewhere) / (time.perf_counter() - began)


def median(who, workers, value):
    return statistics.median(run[value] for run in found[who, workers])


rows = []
for workers in WORKERS:
    own_s, theirs = median(run_runout, workers, "seconds"), median(run_peers, workers, "seconds")
    cells = [
        name,
        f"{workers}",
        f"{own_s:.2f}",
        f"{median(run_runout, workers, 'busy'):.2f}",
        f"{theirs:.2f}",
        f"{theirs / own_s:.2f}",
        f"{median(run_values, workers, 'seconds'):.2f}",
        f"{median(run_runout, workers, 'peak_mib'):.0f}",
        f"{median(run_values, workers, 'peak_mib'):.0f}",
        f"{median(run_peers, workers, 'peak_mib'):.0f}",
    ]
    rows.append(f"| {' | '.join(cells)} |")
crowd = f"others kept {elsewhere:.1f} processors busy" if elsewhere > 0.3 else "nothing else ran"
said = f"{stations} stations, {os.cpu_count()} processors, median of {rounds} rounds in turns; {crowd}"
head = (
    "| samples | workers | runout, s | its CPU, s | peers, s | peers / runout | runout with values, s "
    "| runout, peak MiB | with values, peak MiB | peers, peak MiB |"
)
print("\n".join(["", said, "", head, "| --- " * 10 + "|", *rows]))
# For `cargo xtask bench-peers`, which joins the tables.
(scratch / f"table-{name}.md").write_text("\n".join([said, head, *rows]) + "\n")
checked = answer(python("check.py", out / "result.h5"))
theirs = found[run_peers, 1][-1]["form_error_um"]
print(f"\nForm against the record's own, rms µm, median and worst station: runout {checked['form_error_um'][0]:.5f} "
      f"{checked['form_error_um'][1]:.5f}, peers {theirs[0]:.5f} {theirs[1]:.5f}.")
print(f"Motion, worst station: runout x {checked['motion_error_um'][0]:.5f}, y {checked['motion_error_um'][1]:.5f}.")
if others:
    columns = [f"{workers} worker{'s' * (workers > 1)}{values}" for values in ("", ", with values") for workers in WORKERS]
    print(f"\n| program | {' | '.join(f'{column}, s' for column in columns)} |\n| --- {'| --- ' * len(columns)}|")
    for program, both in zip(["this one", *others], [(run_runout, run_values), *beside]):
        seconds = [f"{median(who, workers, 'seconds'):.3f}" for who in both for workers in WORKERS]
        print(f"| {program} | {' | '.join(seconds)} |")
if elsewhere > 0.3:
    print("\nOther programs kept the machine busy meanwhile: do not trust these times.")
