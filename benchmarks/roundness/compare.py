"""Times the reference circles of runout and of the peers on the same points and prints a Markdown table.

usage: compare.py PROGRAM PEERS SCRATCH [N ...]

PROGRAM is core's example reference_circles. The peers' roundness_bench.py writes the points and times its own ways to a circle;
of those, the table shows the fastest in f64. Differences are of RONt (LSCI, MZCI) and of the radius (MICI, MCCI).
"""
import json
import subprocess
import sys
from pathlib import Path

program, peers, scratch = (Path(path).resolve() for path in sys.argv[1:4])
counts = sys.argv[4:] or ["2560", "36000"]
(scratch / "data").mkdir(parents=True, exist_ok=True)
TARGETS_MS = {("MZCI", 2560): 0.1, ("MICI", 2560): 0.2, ("MCCI", 2560): 0.1,
              ("MZCI", 36000): 0.5, ("MICI", 36000): 1.0, ("MCCI", 36000): 0.5}


def lines(command):
    output = subprocess.run(command, check=True, stdout=subprocess.PIPE, cwd=scratch, text=True).stdout
    # Python reads NaN, and Rust writes it.
    return [json.loads(line) for line in output.splitlines() if line.startswith("{")]


theirs = lines([sys.executable, "-B", str(peers / "roundness_bench.py"), "15", *counts])
ours = [line for count in counts for line in lines([str(program), str(scratch / f"data/profile_{count}.f64")])]
values = {(line["stage"].removesuffix("_value"), line["impl"], line["N"]): line["value_um"] + (0 if line["kind"] == "mz" else 30e3)
          for line in theirs if line["stage"].endswith("_value")}
timed = [line for line in theirs if "wall_min_s" in line and "float32" not in line["impl"]]
print("| circle | points | runout, ms: least, median | wanted | fastest peer, ms | peer / runout | which | value, peer less runout, µm |")
print("| --- | --- | --- | --- | --- | --- | --- | --- |")
for line in ours:
    stage, count = line["stage"], line["N"]
    least, median = 1e3 * line["wall_min_s"], 1e3 * line["wall_med_s"]
    wanted = TARGETS_MS.get((stage, count))
    cells = [stage, f"{count}", f"{least:.4f}, {median:.4f}", f"{wanted} ms" if wanted else ""]
    peer = min((peer for peer in timed if (peer["stage"], peer.get("N")) == (stage, count)), key=lambda peer: peer["wall_min_s"], default=None)
    if peer:
        theirs_ms = 1e3 * peer["wall_min_s"]
        off = values[stage, peer["impl"], count] - line["value_um"]
        cells += [f"{theirs_ms:.3f}", f"{theirs_ms / least:.0f}", peer["impl"], f"{off:+.1e}"]
    else:
        cells += [""] * 4
    print(f"| {' | '.join(cells)} |")
