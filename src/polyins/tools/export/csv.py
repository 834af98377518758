"""CSV of chosen columns of `solution.parquet`, or of all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import IO, Any

from polyins.errors import InputError
from polyins.formats.solution_files import arrow_columns, status_to_arrow
from polyins.tools.export.trace import Trace

STATUS = "status"


def write(file: IO[bytes], trace: Trace, names: Sequence[str] = ()) -> None:
    """Write the columns in the order in which they are named; raises InputError for one that is not there."""
    import pyarrow as pa
    from pyarrow import csv

    known = (*trace.values, STATUS)
    for name in names:
        if name not in known:
            raise InputError(f"--columns {name}: is not in {trace.source}; expected of {', '.join(known)}")
    chosen = {name: trace[name] for name in names or trace.values if name != STATUS}
    arrays = arrow_columns({"time_s": trace["time_s"], **chosen})
    arrays[STATUS] = status_to_arrow(trace.status).dictionary_decode()
    arrays = {name: _without_nan(array) for name, array in arrays.items()}
    csv.write_csv(pa.table({name: arrays[name] for name in names or (*chosen, STATUS)}), file)


def _without_nan(array: Any) -> Any:
    """Return an Arrow array with empty cells where there is no number."""
    from pyarrow import compute, scalar, types

    if not types.is_floating(array.type):
        return array
    return compute.if_else(compute.is_nan(array), scalar(None, array.type), array)
