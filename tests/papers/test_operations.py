"""Operations are counted, not estimated: what is known of matrix products and of the paper's totals has to come out."""

import math
from pathlib import Path

import numpy as np
import pytest

from polyins_papers import a1, a2, operations
from polyins_papers.operations import Counted, count, counting


@pytest.fixture(scope="module")
def measured() -> dict[str, dict[str, dict[str, dict[str, int]]]]:
    return operations.measure(imus=3)


def test_every_operation_counts_once_on_either_side() -> None:
    x = Counted(3.0)
    tally = count(lambda: (1.0 + x) * 2.0 - 1.0 / x + (x - 1.0) * (2.0 - x) / 4.0)
    assert tally == {"additions": 5, "multiplications": 4, "sum": 9}
    assert (2.0 - x) / 4.0 == -0.25


def test_matrix_products_count_in_full() -> None:
    a, b = (counting(np.random.default_rng(k).normal(size=(4, 4))) for k in (0, 1))
    tally = count(lambda: a @ b)
    assert (tally["multiplications"], tally["additions"]) == (4**3, 4**2 * 3)
    np.testing.assert_allclose((a @ b).astype(float), a.astype(float) @ b.astype(float))


def test_functions_of_counting_numbers_go_on_counting() -> None:
    functions = operations.counting_math()
    tally = count(lambda: functions.sqrt(Counted(4.0)) * 2.0)
    assert tally == {"additions": 0, "multiplications": 2, "sum": 2}
    assert functions.sin(Counted(1.0)) == math.sin(1.0)


def test_the_totals_of_the_paper_come_out() -> None:
    paper = {name: {"sum": sum(row)} for name, row in a1.PAPER.items()}
    totals = a1.totals(paper)
    assert totals["single_per_s"] == 20_824_712
    assert totals["enav_fixed_per_s"] == 20_761_810
    assert totals["enav_per_imu_per_s"] == 209_442
    assert [round(totals["enav_ratio"][str(n)], 2) for n in (6, 16, 100)] == [1.06, 1.16, 2.00]


def test_the_dense_covariance_does_what_the_paper_counts(
    measured: dict[str, dict[str, dict[str, dict[str, int]]]],
) -> None:
    covariance = measured["steps"]["dense"]["covariance"]
    assert (covariance["additions"], covariance["multiplications"]) == a1.PAPER["covariance"]
    # the paper's H is C l; here the point stands in vehicle axes, which may be others than those of the IMU
    assert measured["steps"]["dense"]["design"]["sum"] < 0.001 * measured["steps"]["dense"]["prediction"]["sum"]


def test_the_structured_prediction_is_a_tenth_of_the_dense_one(
    measured: dict[str, dict[str, dict[str, dict[str, int]]]],
) -> None:
    steps = measured["steps"]
    assert steps["structured"]["prediction"]["sum"] < 0.1 * steps["dense"]["prediction"]["sum"]
    assert steps["structured"]["mechanization"] == steps["dense"]["mechanization"]


def test_the_engine_does_what_the_table_says_but_for_the_split_interval(
    measured: dict[str, dict[str, dict[str, dict[str, int]]]],
) -> None:
    imus, executions = 3, measured["executions"]
    for method, row in a2.table(imus).items():
        assert executions[method]["gain"] == row["gain"]
        assert executions[method]["feedback"] == row["feedback"]
        for step in ("mechanization", "prediction"):
            assert executions[method][step] == row[step] // 200 * 201
    assert executions["enav-fusion"]["measurement_fusion"] == 201 * imus
    assert executions["enav-fusion"]["solution_fusion"] == 202 * imus
    assert executions["nav-fusion"]["solution_fusion"] == 202 * imus


PAGE = Path(__file__).parents[2] / "docs" / "paper-a.md"
ROWS = {
    "mechanization, one IMU": "mechanization",
    r"$\Phi$, with the error model": "transition",
    r"$\Phi P \Phi^T + Q$": "covariance",
    "**prediction, sum**": "prediction",
    "$H$": "design",
    "$K$": "gain",
    "$P$ after the update": "covariance_update",
    r"$\delta z$, one IMU": "residual",
    r"$\delta \hat x$, one IMU": "correction",
    "feedback, one IMU": "feedback",
    "fusing measurements, one IMU": "measurement_fusion",
    "fusing solutions, one IMU": "solution_fusion",
}


def test_the_page_shows_what_is_counted(measured: dict[str, dict[str, dict[str, dict[str, int]]]]) -> None:
    steps = measured["steps"]
    cells = [[cell.strip() for cell in line.strip("| ").split("|")] for line in PAGE.read_text().splitlines()]
    table = {row[0]: row[1:] for row in cells if len(row) in {3, 4}}
    for label, name in ROWS.items():
        forms = [{"sum": sum(a1.PAPER[name])}, *(steps[form].get(name) for form in ("dense", "structured"))]
        assert table[label] == [f"{form['sum']:,}" for form in forms if form], label
    totals = [a1.totals(steps[form]) for form in ("dense", "structured")]
    assert table["**one second, one IMU**"][1:] == [f"{each['single_per_s']:,}" for each in totals]
    for n in a1.COUNTS:
        assert table[f"eNav-Fusion / one IMU, N = {n}"][1:] == [f"{each['enav_ratio'][str(n)]:.2f}" for each in totals]
