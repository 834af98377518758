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
    from polyins.navigate.state import Navigators

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
    from polyins.kernels import covariance, dense, earth, fuse, strapdown
    from polyins.navigate.state import EARTH, Navigators

    prepared = prepare("enav-fusion", IMUS)
    for module in (earth, fuse, covariance, strapdown):
        setattr(module, "math", counting_math())  # noqa: B010
    plain = prepared.navigators
    state = plain.state._replace(
        **{name: counting(getattr(plain.state, name)) for name in ("rows", "blocks", "scalars")}
    )
    work = plain.work._replace(**{name: counting(getattr(plain.work, name)) for name in COUNTED_WORK})
    block, rows, dt = state.blocks[0], state.rows, Counted(1.0 / RATE_HZ)
    model, sums, reference = work.covariance[0], work.sums[0], state.scalars[EARTH : EARTH + 5]
    lanes, imus = 8, IMUS
    transition = count(covariance.error_model, block, model, dt, reference)
    squares, shaping = (counting(array) for array in dense.workspace())
    products = count(_propagate_covariance, squares)
    # all of the dense prediction but Phi P Phi' + Qd
    rest = _less(count(dense.predict, block, model, dt, squares, shaping), products)
    update = count_update(Navigators(state, plain.plan, work))
    common = {
        "mechanization": _per(count(_mechanize, rows[0], dt, reference, strapdown), lanes),
        "design": update["design"],
        "gain": update["gain"],
        "covariance_update": update["covariance_update"],
        "residual": _per(update["residual"], imus),
        "correction": _per(update["correction"], imus),
        "feedback": _per(update["feedback"], imus),
        "measurement_fusion": _per(count(_fuse_measurements, rows, sums, block, dt, fuse), imus),
        "solution_fusion": _per(count(fuse.fuse_states, rows, 0, imus, block, sums, dt), imus),
    }
    structured = count(covariance.predict, block, model, dt)
    return {
        "dense": {
            **common,
            "transition": transition,
            "noise": rest,
            "covariance": products,
            "prediction": _sum(transition, rest, products),
        },
        "structured": {
            **common,
            "transition": transition,
            "noise_and_covariance": structured,
            "prediction": _sum(transition, structured),
        },
    }


COUNTED_WORK = ("covariance", "sums", "updates", "measurement")


def prepare(method: str, imus: int) -> Prepared:
    """Return a run just before its first epoch."""
    from polyins.navigate import batch
    from polyins.simulation.run import simulate
    from polyins.simulation.scenario import Board, Scenario

    recording = simulate(
        Scenario(duration_s=12.0, static_s=5.0, imus=Board(count=imus), rate_hz=RATE_HZ)
    ).as_published()
    start = replace(recording.start, heading=0.0, heading_from="value")
    return batch.prepare(replace(recording, start=start, outages=()), method)


def _mechanize(w: NDArray[Any], dt: Counted, around: NDArray[Any], strapdown: Any) -> None:
    strapdown.compensate(w, Counted(1.0), dt)
    strapdown.mechanize(w, dt, Counted(1.0 / 12.0), around)


def _fuse_measurements(rows: NDArray[Any], sums: NDArray[Any], block: NDArray[Any], dt: Counted, fuse: Any) -> None:
    fuse.add_all(rows, 0, IMUS, sums)
    fuse.finish_measurements(sums, block, dt)


def _propagate_covariance(squares: NDArray[Any]) -> None:
    """Phi P Phi' + Qd as the dense prediction does it."""
    from polyins.kernels import dense

    phi, p, q = squares[dense.PHI], squares[dense.COVARIANCE], squares[dense.NOISE]
    phi @ p @ phi.T + q


def count_update(bank: Navigators) -> dict[str, Tally]:
    """Return what the parts of an update by a position do; residual, correction and feedback are for all IMUs."""
    from polyins.aiding import kinds, measurement, point, vehicle_attitude
    from polyins.kernels import covariance, earth, fuse, kalman, strapdown, vehicle
    from polyins.kernels.covariance import STRIDE
    from polyins.navigate import update

    state, _, work = bank
    block, rows, own, fix = state.blocks[0], state.rows, work.updates[0], work.measurement
    fix[measurement.KIND], fix[measurement.GEODETIC] = kinds.GNSS_POSITION, 1.0
    place = block[covariance.POSITION : covariance.POSITION + 3]
    fix[measurement.VALUE : measurement.VALUE + 3] = place
    fix[measurement.PLACE] = Counted(0.3)
    own[kalman.R : kalman.R + 3] = counting(np.full(3, 1e-4))
    metres = fix[measurement.METRIC : measurement.METRIC + 3]
    earth.metric(place, True, metres)
    vehicle.put_matrix(block, covariance.VEHICLE, vehicle.matrix_at(block, covariance.MATRIX))
    level = vehicle.lent_matrix(state.blocks, -1)

    def design() -> None:
        point.design(block, rows[0], 0, fix, own)
        vehicle_attitude.add_own(block, rows[0], 0, own)

    def residuals() -> None:
        for i in range(IMUS):
            point.residual(rows[i // 8], i % 8, level, fix)

    def corrections() -> None:
        for i in range(IMUS):
            update.member_correction(rows[i // 8], i % 8, own, STRIDE, False)

    def feedback() -> None:
        fuse.correct_members(rows, 0, IMUS, metres, STRIDE)
        for lanes in rows:
            strapdown.update_matrix(lanes)
            strapdown.update_sensitivity(lanes)

    return {
        "design": count(design),
        "residual": count(residuals),
        "gain": count(kalman.gain, block, own, STRIDE),
        "covariance_update": count(kalman.update_covariance, block, own, STRIDE),
        "correction": count(corrections),
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
    """Return how often the steps of Table II are done in one second with one fix, once for each IMU or block."""
    from polyins.kernels import bank, covariance, fuse, kalman, strapdown, vehicle
    from polyins.navigate.state import NEXT_EVENT, TIME

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
    watch(covariance, "predict", "prediction", lambda *_: 1)
    watch(kalman, "gain", "gain", lambda *_: 1)
    watch(fuse, "correct_members", "feedback", lambda _, first, last, *__: int(last - first))
    watch(fuse, "finish_measurements", "measurement_fusion", lambda *_: imus)
    watch(fuse, "finish_states", "solution_fusion", lambda *_: imus)
    watch(vehicle, "merge", "solution_fusion", lambda _, blocks, spans, *__: imus * (len(blocks) > len(spans)))
    time, due = prepared.inputs.time, prepared.inputs.event_time
    fix = float(due[due > time[0] + 0.01][0])
    first = int(np.searchsorted(time, fix)) - 1
    prepared.state.scalars[NEXT_EVENT] = int(np.searchsorted(due, fix))
    prepared.state.scalars[TIME] = time[first - 1]
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
