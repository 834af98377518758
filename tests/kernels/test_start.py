"""Starting Numba without scipy.linalg: Numba is as before afterwards, and one that has changed inside starts too."""

import subprocess
import sys


def printed(script: str) -> str:
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout.strip()


def test_scipy_linalg_is_not_imported_and_numba_still_asks_for_blas_when_it_needs_it():
    script = """
import sys
import polyins.kernels.jit
from numba.np import linalg
print("scipy.linalg" in sys.modules)
linalg.ensure_blas()
print("scipy.linalg" in sys.modules)
"""
    assert printed(script).split() == ["False", "True"]


def test_a_numba_without_that_function_or_module_starts():
    gone = "import sys, numba; sys.modules['numba.np.linalg'] = None; import polyins.kernels.jit; print('started')"
    assert printed(gone) == "started"
    renamed = "from numba.np import linalg; del linalg.ensure_blas; import polyins.kernels.jit; print('started')"
    assert printed(renamed) == "started"
