"""Measurements in other people's files, as named columns: one module for each kind of file."""

from identify.recording.foreign.csv_dialect import CsvOptions
from identify.recording.foreign.kinds import read_foreign
from identify.recording.foreign.roles import ColumnMap, MeasuredSession, measure
from identify.recording.foreign.table import Clock, ForeignColumn, ForeignTable

__all__ = [
    "Clock",
    "ColumnMap",
    "CsvOptions",
    "ForeignColumn",
    "ForeignTable",
    "MeasuredSession",
    "measure",
    "read_foreign",
]
