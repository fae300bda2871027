"""Writes circle.xlsx with openpyxl: a sheet of notes and one of readings. pip install openpyxl"""

import math
import pathlib

import openpyxl

book = openpyxl.Workbook()
book.active.title = "Notes"
book.active["A1"] = "roundness of a ring"
sheet = book.create_sheet("Readings")
sheet.append([])
sheet.append(["angle [rad]", "deviation [nm]", "operator"])
for index in range(360):
    angle = math.radians(index)
    sheet.append([angle, 2500.0 * math.cos(2.0 * angle), "A"])
book.save(pathlib.Path(__file__).parent / "circle.xlsx")
