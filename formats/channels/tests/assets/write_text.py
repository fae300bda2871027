"""Writes tables as loggers, scopes and spreadsheets export them; the numbers are those that Python's float reads from their cells.

    python write_text.py
"""

import gzip

import numpy as np

from references import FOLDER, expect

RNG = np.random.default_rng(45)
ROWS = 12


def done(name, lines, channels, encoding="utf-8", end="\n", pack=lambda content: content):
    (FOLDER / name).write_bytes(pack((end.join(lines) + end).encode(encoding)))
    expect(name, channels)


def rows(columns, delimiter, comma=False, form="%.6f"):
    lines = [delimiter.join(form % value for value in row) for row in zip(*columns)]
    numbers = [[float(form % value) for value in column] for column in columns]
    return ([line.replace(".", ",") for line in lines] if comma else lines), numbers


time = np.arange(ROWS) / 500.0
a, b = RNG.normal(size=ROWS), RNG.normal(size=ROWS)
data, (t, x, y) = rows([time, a, b], ",")
done("names.csv", ["time_s,Displ X1 [µm],Displ X2 [µm]", *data],
     [("time_s", None, 500, t), ("Displ X1", "µm", 500, x), ("Displ X2", "µm", 500, y)])
data, (t, x, y) = rows([time * 1000, a, b], ";", comma=True)
done("excel.csv", ["sep=;", "Zeit;Weg 1;Weg 2", "(ms);(mm);(mm)", "", *data],
     [("Zeit", "ms", 500, t), ("Weg 1", "mm", 500, x), ("Weg 2", "mm", 500, y)], "utf-16", "\r\n")
data, (t, x, y) = rows([time - 0.004, a, b], ",", form="%+.5e")
done("scope.csv", ["Model,MSO-9", "Record Length,12", "Sample Interval,2.000000e-03", "Note,hand held", "", "TIME,CH1,CH2", "s,V,mV", *data, "", "end of data"],
     [("TIME", "s", 500, t), ("CH1", "V", 500, x), ("CH2", "mV", 500, y)], end="\r\n")
data, (x, y) = rows([a, b], " ")
done("blanks.txt", ["# fs = 5120", "# made by hand", *data], [("column 1", None, 5120, x), ("column 2", None, 5120, y)])
data, (x, y) = rows([a, b], "\t")
done("packed.txt", ["S1\tS2", *data], [("S1", None, None, x), ("S2", None, None, y)], pack=lambda content: gzip.compress(content, mtime=0))
data, (x,) = rows([a], ",", form="%.5e")
data = [f"2026-10-15T02:26:{6 + number * 0.125:09.6f}Z,{line.replace('-', chr(0x2212)).replace('e', 'D')},ok" for number, line in enumerate(data)]
data[3] = data[3].replace(data[3].split(",")[1], "∞")
x[3] = float("inf")
done("logger.csv", ["When,Weg / µm,State", *data],
     [("When", "s", 8, np.arange(ROWS) * 0.125), ("Weg", "µm", 8, x)])
counts = RNG.integers(0, 9, ROWS)
data = [f"{number},{value:.5e}," for number, value in enumerate(a)]
done("rigol.csv", ["X,CH1,Start,Increment,", "Sequence,Volt,-1.000000e-03,2.000000e-04,", *data],
     [("X", "Sequence", 5000, range(ROWS)), ("CH1", "Volt", 5000, [float(f"{value:.5e}") for value in a])], end="\r\n")

# LVM as LabVIEW writes it: several segments, each with its channels and their units.
head = ["LabVIEW Measurement\t", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t,", "Multi_Headings\tYes", "X_Columns\tOne",
        "***End_of_Header***\t", "\t"]
lines, channels = list(head), []
for run, (count, step) in enumerate([(5, 0.001), (4, 0.002)]):
    columns = [np.arange(count) * step, RNG.normal(size=count), RNG.normal(size=count)]
    data, numbers = rows(columns, "\t", comma=True)
    lines += ["Channels\t2\t\t\t", f"Samples\t{count}\t{count}\t\t", "Y_Unit_Label\tµm\tVolts\t", "X_Dimension\tTime\tTime\t",
              "X0\t0,0000000000000000E+0\t0,0000000000000000E+0\t", f"Delta_X\t{step:.6f}\t{step:.6f}\t".replace(".", ","),
              "***End_of_Header***\t\t\t", "X_Value\tX1\tX2\tComment", *data, ""]
    rate = 1 / step
    channels += [(f"Run {run}/X_Value", "s", rate, numbers[0]), (f"Run {run}/X1", "µm", rate, numbers[1]), (f"Run {run}/X2", "Volts", rate, numbers[2])]
done("runs.lvm", lines, channels, end="\r\n")
