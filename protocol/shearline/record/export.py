"""Hands the trials of a run to other programs: JSON lines, CSV or Parquet.

JSON has one object per trial with its nested tuple; CSV and Parquet have the columns of
:class:`shearline.record.table.Table`. Nothing here chooses or judges trials.
"""

from __future__ import annotations

import csv
import enum
import json
import math
from io import StringIO
from typing import Any

from shearline.record.reader import Run
from shearline.record.table import Column, Table


class Format(enum.StrEnum):
    """What trials can be written as."""

    JSON = "json"  # one object per line
    CSV = "csv"  # units in brackets behind the names, nothing where there is no value
    PARQUET = "parquet"  # units as metadata of the columns, null where there is no value


def exported(run: Run, form: Format) -> bytes:
    """Return the trials of a run in one format, text as UTF-8."""
    match form:
        case Format.JSON:
            return "".join(json.dumps(row) + "\n" for row in run.trials()).encode()
        case Format.CSV:
            return to_csv(run.table()).encode()
        case Format.PARQUET:
            return to_parquet(run.table(), {"run": run.name, "run.toml": _head(run)})


def to_csv(table: Table) -> str:
    """Return a table as CSV (RFC 4180), numbers with all their digits."""
    out = StringIO(newline="")
    writer = csv.writer(out)
    writer.writerow(
        f"{name} [{table.units[name]}]" if table.units[name] else name for name in table
    )
    writer.writerows(zip(*(map(_cell, table[name].tolist()) for name in table), strict=True))
    return out.getvalue()


def to_parquet(table: Table, about: dict[str, str]) -> bytes:
    """Return a table as a Parquet file, compressed.

    Args:
        table: Its columns; ``unit`` is each column's metadata where it has one.
        about: Metadata of the whole.
    """
    import pyarrow as pa  # noqa: PLC0415 - heavy, for this format alone
    from pyarrow import parquet  # noqa: PLC0415

    arrays = [_arrow(pa, table[name]) for name in table]
    fields = [
        pa.field(
            name, array.type, metadata={"unit": table.units[name]} if table.units[name] else {}
        )
        for name, array in zip(table, arrays, strict=True)
    ]
    sink = pa.BufferOutputStream()
    parquet.write_table(pa.table(arrays, schema=pa.schema(fields, metadata=about)), sink)
    return bytes(sink.getvalue().to_pybytes())


def _arrow(pa: Any, values: Column) -> Any:
    # numpy's text is of fixed width, which Arrow does not know
    if values.dtype.kind == "U":
        return pa.array(values.tolist(), type=pa.string())
    return pa.array(values, from_pandas=True)


def _cell(value: object) -> object:
    return "" if isinstance(value, float) and math.isnan(value) else value


def _head(run: Run) -> str:
    return run.config.text if run.config else ""
