"""How many floating-point operations the kernels do: their Python form, run once on numbers that count.

Run as a module in a process of its own, in which nothing is compiled; prints one JSON document. Additions count with
subtractions, multiplications with divisions, as in paper A; a square root, sine or cosine counts as a multiplication,
a change of sign as nothing. What is computed for the padding of vectors counts, but for idle lanes of the bank.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError

if TYPE_CHECKING:
    from polyins.navigate.batch import Prepared
    from polyins.navigate.engine import State

Tally = dict[str, int]
F = TypeVar("F", bound=Callable[..., Any])

IMUS = 16
RATE_HZ = 200.0


def measure(imus: int) -> dict[str, Any]:
    """Return {"steps": {"dense" | "structured": {step: {additions, multiplications, sum}}}, "executions": ...}.

    The executions are those of one second with `imus` IMUs at 200 Hz and one fix.
    """
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-m", __name__, str(imus)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"counting operations failed: {done.stderr.strip().splitlines()[-1]}")
    document: dict[str, Any] = json.loads(done.stdout)
    return document


class Counted(float):
    """A number that counts what is done with it."""

    additions = 0
    multiplications = 0

    def __add__(self, other: float) -> Counted:
        Counted.additions += 1
        return Counted(float.__add__(self, other))

    def __sub__(self, other: float) -> Counted:
        Counted.additions += 1
        return Counted(float.__sub__(self, other))

    def __rsub__(self, other: float) -> Counted:
        Counted.additions += 1
        return Counted(float.__rsub__(self, other))

    def __mul__(self, other: float) -> Counted:
        Counted.multiplications += 1
        return Counted(float.__mul__(self, other))

    def __truediv__(self, other: float) -> Counted:
        Counted.multiplications += 1
        return Counted(float.__truediv__(self, other))

    def __rtruediv__(self, other: float) -> Counted:
        Counted.multiplications += 1
        return Counted(float.__rtruediv__(self, other))

    def __neg__(self) -> Counted:
        return Counted(float.__neg__(self))

    __radd__ = __add__
    __rmul__ = __mul__


def count(function: Callable[..., object], *arguments: object) -> Tally:
    """Return what a call does; the arguments hold counting numbers."""
    before = Counted.additions, Counted.multiplications
    function(*arguments)
    additions, multiplications = Counted.additions - before[0], Counted.multiplications - before[1]
    return {"additions": additions, "multiplications": multiplications, "sum": additions + multiplications}


def counting_math() -> SimpleNamespace:
    """Return the functions of `math` that kernels use, on counting numbers."""

    def counted(function: Callable[[float], float]) -> Callable[[float], Counted]:
        def call(value: float) -> Counted:
            Counted.multiplications += 1
            return Counted(function(value))

        return call

    return SimpleNamespace(sqrt=counted(math.sqrt), sin=counted(math.sin), cos=counted(math.cos))


def counting(array: NDArray[np.float64]) -> NDArray[Any]:
    """Return the array with numbers that count."""
    numbers = np.empty(array.shape, dtype=object)
    numbers[...] = np.vectorize(Counted, otypes=[object])(array)
    return numbers


def count_steps() -> dict[str, dict[str, Tally]]:
    """Return what each step of Table I does in polyins, by the form of the covariance."""
    from polyins.kernels import dense, earth, fuse, share, strapdown

    prepared = prepare("enav-fusion", IMUS)
    for module in (earth, fuse, share, strapdown):
        setattr(module, "math", counting_math())  # noqa: B010
    plain = prepared.state
    state = plain._replace(**{name: counting(getattr(plain, name)) for name in COUNTED_ARRAYS})
    g, w, dt = state.groups[0], state.blocks[0], Counted(1.0 / RATE_HZ)
    lanes, imus = 8, IMUS
    model = count(share.error_model, g, dt, state.near)
    squares, shaping = (counting(array) for array in dense.workspace())
    covariance = count(_propagate_covariance, squares)
    # all of the dense prediction but Phi P Phi' + Qd
    rest = _less(count(dense.predict, g, dt, squares, shaping), covariance)
    update = count_update(state)
    common = {
        "mechanization": _per(count(_mechanize, w, dt, state.near, strapdown), lanes),
        "design": update["design"],
        "gain": update["gain"],
        "covariance_update": update["covariance_update"],
        "residual": _per(update["residual"], imus),
        "correction": _per(update["correction"], imus),
        "feedback": _per(update["feedback"], imus),
        "measurement_fusion": _per(count(fuse.fuse_measurements, state.blocks, 0, imus, g, dt), imus),
        "solution_fusion": _per(count(_fuse_solutions, state, fuse, dt), imus),
    }
    structured = count(share.predict, g, dt)
    return {
        "dense": {
            **common,
            "transition": model,
            "noise": rest,
            "covariance": covariance,
            "prediction": _sum(model, rest, covariance),
        },
        "structured": {
            **common,
            "transition": model,
            "noise_and_covariance": structured,
            "prediction": _sum(model, structured),
        },
    }


COUNTED_ARRAYS = ("blocks", "groups", "measurements", "near")


def prepare(method: str, imus: int) -> Prepared:
    """Return a run just before its first epoch."""
    from polyins.navigate import batch
    from polyins.simulation.run import simulate
    from polyins.simulation.scenario import Board, Scenario

    recording = simulate(Scenario(duration_s=12.0, static_s=5.0, imus=Board(count=imus), rate_hz=RATE_HZ))
    start = replace(recording.start, heading=0.0, heading_from="value")
    return batch.prepare(replace(recording, start=start, outages=()), method)


def _mechanize(w: NDArray[Any], dt: Counted, near: NDArray[Any], strapdown: Any) -> None:
    strapdown.compensate(w, Counted(1.0), dt)
    strapdown.mechanize(w, dt, Counted(1.0 / 12.0), near)


def _fuse_solutions(state: State, fuse: Any, dt: Counted) -> None:
    for block in state.blocks:
        fuse.project_to_origin(block, dt)
    fuse.fuse_states(state.blocks, 0, IMUS, state.groups[0])


def _propagate_covariance(squares: NDArray[Any]) -> None:
    """Phi P Phi' + Qd as the dense prediction does it."""
    from polyins.kernels import dense

    phi, p, q = squares[dense.PHI], squares[dense.COVARIANCE], squares[dense.NOISE]
    phi @ p @ phi.T + q


def count_update(state: State) -> dict[str, Tally]:
    """Return what the parts of an update by a position do; residual, correction and feedback are for all IMUs."""
    from polyins.aiding import gnss
    from polyins.kernels import earth, fuse, kalman, share, strapdown

    g, m, imus = state.groups[0], state.measurements[0], IMUS
    m[kalman.R : kalman.R + 3] = counting(np.full(3, 1e-4))
    metres = g[share.METRIC : share.METRIC + 3]
    fix = counting(np.array([*map(float, g[share.POSITION : share.POSITION + 3]), 1e-4, 1e-4, 1e-4]))
    earth.metric(g[share.POSITION : share.POSITION + 3], True, metres)

    def feedback() -> None:
        fuse.correct_members(state.blocks, 0, imus, metres)
        for w in state.blocks:
            strapdown.update_matrix(w)
            strapdown.update_sensitivity(w)

    return {
        "design": count(gnss.position_design, g, m),
        "residual": count(gnss.position_residuals, state.blocks, 0, imus, fix, metres, True, m),
        "gain": count(kalman.gain, g, m),
        "covariance_update": count(kalman.update_covariance, g, m),
        "correction": count(gnss.residuals_to_corrections, state.blocks, 0, imus, m),
        "feedback": count(feedback),
    }


def _per(tally: Tally, parts: int) -> Tally:
    return {key: round(value / parts) for key, value in tally.items()}


def _sum(*tallies: Tally) -> Tally:
    return {key: sum(tally[key] for tally in tallies) for key in tallies[0]}


def _less(whole: Tally, part: Tally) -> Tally:
    return {key: whole[key] - part[key] for key in whole}


EXECUTED = ("mechanization", "prediction", "gain", "feedback", "measurement_fusion", "solution_fusion")
"""The steps of Table II."""


def count_executions(method: str, imus: int) -> dict[str, int]:
    """Return how often the steps of Table II are done in one second with one fix, once for each IMU or share."""
    from polyins.kernels import bank, fuse, kalman, share, strapdown

    tally = dict.fromkeys(EXECUTED, 0)

    def watch(module: Any, name: str, step: str, times: Callable[..., int]) -> None:
        original = getattr(module, name)

        def call(*arguments: Any) -> object:
            tally[step] += times(*arguments)
            return original(*arguments)

        setattr(module, name, call)
        watched.append((module, name, original))

    prepared = prepare(method, imus)
    watched: list[tuple[Any, str, Any]] = []
    watch(strapdown, "mechanize", "mechanization", lambda w, *_: int((w[bank.WEIGHT : bank.WEIGHT + 8] > 0.0).sum()))
    watch(share, "predict", "prediction", lambda *_: 1)
    watch(kalman, "gain", "gain", lambda *_: 1)
    watch(fuse, "correct_members", "feedback", lambda _, first, last, __: int(last - first))
    watch(fuse, "finish_measurements", "measurement_fusion", lambda *_: imus)
    watch(fuse, "finish_states", "solution_fusion", lambda *_: imus)
    fix = float(prepared.inputs.fix_time[prepared.inputs.fix_time > prepared.inputs.time[0] + 0.01][0])
    first = int(np.searchsorted(prepared.inputs.time, fix)) - 1
    prepared.state.counters[0] = int(np.searchsorted(prepared.inputs.fix_time, fix))
    prepared.state.clock[0] = prepared.inputs.time[first - 1]
    prepared.advance(first, first + int(RATE_HZ))
    for module, name, original in watched:
        setattr(module, name, original)
    return tally


def main() -> None:
    """Print the counts for as many IMUs as the first argument says."""
    if os.environ.get("NUMBA_DISABLE_JIT") != "1":
        raise InputError("operations: NUMBA_DISABLE_JIT is not set; expected 1, so that the kernels run as Python")
    imus = int(sys.argv[1])
    executions = {method: count_executions(method, imus) for method in ("single", "nav-fusion", "enav-fusion")}
    print(json.dumps({"steps": count_steps(), "executions": executions}))


if __name__ == "__main__":
    main()
