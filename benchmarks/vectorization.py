"""Count vector and scalar arithmetic in the machine code of the loops over lanes and columns.

    python benchmarks/vectorization.py

Prints a JSON document; exits with 1 if a loop has more scalar than vector arithmetic: then it stopped vectorizing.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from polyins.kernels import bank, covariance, earth, fuse, strapdown

LANES, BLOCK = np.zeros(bank.SIZE), np.zeros(covariance.P + covariance.STRIDE**2)
WORK, SUMS, EARTH = np.zeros(covariance.WORK), np.zeros(fuse.SUMS), np.zeros(5)

LOOPS: dict[str, tuple[Callable[..., Any], tuple[Any, ...]]] = {
    "compensate": (strapdown.compensate, (LANES, 1.0, 0.01)),
    "correct_coning_and_sculling": (strapdown.correct_coning_and_sculling, (LANES, 0.1)),
    "rotate_at_own_state": (strapdown.rotate_at_own_state, (LANES,)),
    "evaluate": (earth.evaluate, (LANES, 0.0, 0.0, 1.0)),
    "advance": (strapdown.advance, (LANES, 0.01, EARTH)),
    "project_to_point": (fuse.project_to_point, (LANES, 0.01)),
    "add_to_means": (fuse.add_to_means, (LANES, SUMS)),
    "position_rows": (covariance._position_rows, (BLOCK, WORK, 0.01)),
    "velocity_rows": (covariance._velocity_rows, (BLOCK, WORK)),
    "phi_rows": (covariance._phi_rows, (BLOCK, WORK)),
    "through_sensors": (covariance._through_sensors, (BLOCK, WORK)),
    "felt_by_rows": (covariance._felt_by_rows, (WORK,)),
    "back_to_navigation": (covariance._back_to_navigation, (WORK,)),
}

VECTOR = re.compile(r"^\tv(?:add|sub|mul|div|sqrt|fn?m(?:add|sub)\w*)pd\t", re.MULTILINE)
SCALAR = re.compile(r"^\tv(?:add|sub|mul|div|sqrt|fn?m(?:add|sub)\w*)sd\t", re.MULTILINE)


def count(function: Callable[..., Any], arguments: tuple[Any, ...]) -> dict[str, int]:
    """Return how many instructions of each kind a kernel has, compiled as the kernels are."""
    source: Any = function
    compiled = numba.njit(error_model="numpy", fastmath={"contract"}, _nrt=False)(source.py_func)
    compiled(*arguments)
    code = compiled.inspect_asm(compiled.signatures[0])
    body = code[: code.index(".Lfunc_end0")]
    return {"vector": len(VECTOR.findall(body)), "scalar": len(SCALAR.findall(body))}


def main() -> int:
    """Print the counts; return 1 if a loop is scalar."""
    counts = {name: count(*loop) for name, loop in LOOPS.items()}
    scalar = [name for name, n in counts.items() if n["scalar"] >= n["vector"]]
    print(json.dumps({"instructions": counts, "not_vectorized": scalar}, indent=2))
    return 1 if scalar else 0


if __name__ == "__main__":
    sys.exit(main())
