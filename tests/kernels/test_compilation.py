"""What is said of compilation, and what warm-up leaves behind."""

from __future__ import annotations

import subprocess
import sys

import numba
import pytest

from polyins.kernels.compilation import compilation_said, watched
from polyins.navigate import batch
from polyins.tools import bench
from polyins.tools.warmup import warm_up

pytestmark = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")


def compile_something() -> int:
    return int(numba.njit(lambda x: x + 1)(1))


def test_compiling_is_said_once_with_how_long_it_took(capsys: pytest.CaptureFixture[str]) -> None:
    with compilation_said():
        assert compile_something() + compile_something() == 4
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 2
    assert "compiling the kernels" in said[0]
    assert "compiled for" in said[1]


def test_without_compiling_nothing_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    compile_something()
    with compilation_said():
        pass
    assert capsys.readouterr().err == ""


def test_nested_compilations_count_once() -> None:
    with watched() as seconds:
        assert seconds() == 0.0
        inner = numba.njit(lambda x: x + 1)
        assert numba.njit(lambda x: inner(x))(1) == 2
        assert seconds() > 0.0


def test_after_a_warm_up_nothing_is_left_to_compile() -> None:
    families = warm_up()["families"]
    assert len(families) == len({family["name"] for family in families}) == 8
    array, vehicle = bench.array(2, 70.0), bench.vehicle(70.0)
    with watched() as seconds:
        for method in ("single", "nav-fusion", "imu-fusion"):
            batch.prepare(array, method).advance(1, 20)
        for method in ("wheel-ins", "dual-wheel-ins"):
            batch.prepare(vehicle, method).advance(1, 20)
        assert seconds() == 0.0


WITHOUT_PARTS = """
import numba.core.codegen
del numba.core.codegen.JITCodeLibrary
import numpy as np
from polyins.kernels import jit, kalman
assert jit.PARTS is None
update = np.zeros(kalman.SIZE)
update[kalman.S : kalman.S + 9 : 4] = 4.0
update[kalman.RESIDUAL : kalman.RESIDUAL + 3] = 2.0
kalman.invert(update)
print(float(kalman.normalized_innovation_squared(update)))
"""


def test_where_numba_has_changed_its_public_interface_does() -> None:
    done = subprocess.run([sys.executable, "-c", WITHOUT_PARTS], capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "3.0", done.stderr[-2000:]
