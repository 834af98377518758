"""What the targets of paper A's rigid arrays compute from their runs, and one small run of each kind."""

from pathlib import Path

import numpy as np
import pytest

from polyins.model.recording import ImuStream
from polyins.simulation.imu_errors import Imperfections, TrueIncrements, corrupt, draw_errors
from polyins.simulation.run import record, true_run
from polyins.simulation.scenario import Scenario
from polyins.studies import chips, rigid_array, split
from polyins.studies.progress import Steps
from polyins.studies.scenario_files import read
from polyins.tools import bench
from polyins_papers import a3, a4, afig3


@pytest.fixture
def without_data(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("POLYINS_DATA", raising=False)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> Scenario:
    scenario = rigid_array.base_scenario(quick=True)
    board = scenario.imus.model_copy(update={"count": 4})
    small = scenario.model_copy(update={"duration_s": 405.0, "rate_hz": 20.0, "imus": board})
    monkeypatch.setattr(rigid_array, "base_scenario", lambda quick: small)
    return small


def test_the_scenario_has_the_real_outages() -> None:
    scenario = read(Scenario, "polyins.studies", "a3")
    outages = scenario.outage_intervals()
    assert scenario.replay is not None
    first = scenario.replay.from_s
    assert first is not None
    assert len(outages) == 29
    assert outages[0][0] + first == 271130.0
    assert outages[-1] == (271130.0 + 90.0 * 28 - first, 271160.0 + 90.0 * 28 - first)


def test_the_replayed_outages_are_at_the_real_ones_times(data_folder: Path) -> None:
    assert data_folder
    scenario = rigid_array.base_scenario(quick=False)
    assert scenario.replay is not None
    assert scenario.replay.from_s is not None
    outages = true_run(scenario.model_copy(update={"rate_hz": 1.0})).scenario.outage_intervals()
    assert [begin + scenario.replay.from_s for begin, _ in outages] == [271130.0 + 90.0 * k for k in range(29)]


def test_a_calibration_takes_off_what_the_simulation_put_on() -> None:
    rng = np.random.default_rng(5)
    entry = chips.draw_chips(1, rng)
    time = np.arange(1, 201) / 100.0
    rate, force = rng.normal(0.0, 0.2, (200, 3)), rng.normal([0.0, 0.0, -9.8], 1.0, (200, 3))
    grade = rigid_array.base_scenario(quick=True).rig().imus[0].noise
    faults = Imperfections(noise=False, biases=False, scales=False, chips=tuple(chip.chip() for chip in entry))
    silent = faults.limit(grade)
    errors = draw_errors(2.0, silent, faults, rng)
    raw = corrupt(TrueIncrements(time, rate * 0.01, force * 0.01), errors, silent, rng, imperfections=faults)
    assert np.abs(raw[1] - force * 0.01).max() > 1e-4
    corrected = chips.compensate(ImuStream("chip", time, *raw), entry[0])
    np.testing.assert_allclose(corrected.dtheta, rate * 0.01, atol=1e-12)
    np.testing.assert_allclose(corrected.dvel, force * 0.01, atol=1e-12)


def test_drawn_chips_have_the_statistics_of_the_real_ones(data_folder: Path) -> None:
    real = chips.read_chips(data_folder / "whu-array")
    drawn = chips.draw_chips(400, np.random.default_rng(0))
    assert len(real) == 16
    for name in ("gyro_matrix", "accel_matrix"):
        of_real, of_drawn = (np.array([getattr(chip, name) for chip in some]) for some in (real, drawn))
        spread = of_real.std(axis=0)
        np.testing.assert_allclose(of_drawn.mean(axis=0), of_real.mean(axis=0), atol=1.5e-3)
        assert np.all(of_drawn.std(axis=0) < 3.0 * spread)
        assert np.all(of_drawn.std(axis=0) > spread / 3.0)
    offsets = np.array([chip.accel_offset_m_s2 for chip in drawn]).std(axis=0)
    np.testing.assert_allclose(offsets, np.array([chip.accel_offset_m_s2 for chip in real]).std(axis=0), rtol=0.25)


def test_the_parts_of_a_chip_add_up() -> None:
    whole = chips.draw_chips(2, np.random.default_rng(1))
    parts = chips.parts_of(whole)
    assert parts["axes"] == whole
    for bare, scaled, chip in zip(parts["offsets"], parts["scale factors"], whole, strict=True):
        assert bare.accel_offset_m_s2 == scaled.accel_offset_m_s2 == chip.accel_offset_m_s2
        np.testing.assert_array_equal(bare.gyro_matrix, np.eye(3))
        np.testing.assert_array_equal(scaled.gyro_matrix, np.diag(np.diag(chip.gyro_matrix)))


@pytest.mark.usefixtures("without_data")
def test_a3_without_the_data_set_says_so(small: Scenario, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(a3, "SOURCES", {"g-sensitivity": a3.SOURCES["g-sensitivity"]})
    shares: list[float] = []
    document = a3.reproduce(quick=True, progress=shares.append, out=tmp_path)
    assert "stand in" in document["settings"]["track"]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    ours, paper = document["polyins"], document["paper"]
    assert set(ours["uncompensated"]["rms"]) == set(paper["uncompensated"]["rms"])
    sources = ours["sources"]
    assert sum(row["costs"] for row in sources.values()) == pytest.approx(2.0 - sources["g-sensitivity"]["ratio"])
    assert ours["largest_difference_of_methods"] < 0.05
    assert (tmp_path / "a3-sources.html").stat().st_size > 10_000
    assert rigid_array.figures(
        rigid_array.recording_of(a3.with_chips(true_run(small), small.errors, rigid_array.group_chips(1, 4)), seed=1),
        a3.METHODS,
    ) == {key: value for key, value in ours["uncompensated"]["group1"].items() if key != "ratio"}


@pytest.mark.parametrize("rate_hz", [25.0, 100.0])
def test_exact_sensors_and_exact_fixes_leave_no_error(data_folder: Path, small: Scenario, rate_hz: float) -> None:
    """The replayed track, its increments and the filter agree: what remains is far below any error of Table III."""
    assert data_folder
    nothing = small.errors.model_copy(update={key: 0.0 for key in small.errors.model_dump() if "_" in key})
    nothing = nothing.model_copy(update={"noise": False, "biases": False, "chips": ()})
    assert small.gnss is not None
    fine, nothing_slow = (1e-4, 1e-4, 1e-4), (0.0, 0.0, 0.0)
    exact = small.gnss.model_copy(update={"position_std_m": fine, "slow_std_m": nothing_slow, "stated_std_m": fine})
    run = true_run(small.model_copy(update={"errors": nothing, "gnss": exact, "rate_hz": rate_hz}))
    assert rigid_array.maxima(record(run, seed=0).recording, "single").max() < 0.1


def test_ratios_are_those_of_the_figures() -> None:
    rows = {
        "group1": {"single": 4.0, "imu-fusion": 2.0, "nav-fusion": 1.0, "enav-fusion": 1.6},
        "group2": {"single": 3.0, "imu-fusion": 1.0, "nav-fusion": 1.0, "enav-fusion": 1.2},
    }
    assert a3.table(rows)["group1"]["ratio"] == {"imu-fusion": 2.0, "nav-fusion": 4.0, "enav-fusion": 2.5}
    assert a3.pooled(rows)["single"] == pytest.approx(np.sqrt(12.5))
    assert a3.largest_difference(rows) == 1.0


def test_the_split_is_found_again() -> None:
    figures = {n: float(np.sqrt(1.2**2 + 2.4**2 / n)) for n in (1, 2, 3, 4)}
    found = split.split(figures)
    assert (found["common_m"], found["independent_m"]) == pytest.approx((1.2, 2.4))
    assert found["common_share"] == pytest.approx(0.2)
    # a gain of more than sqrt(N) has nothing in common, not less than nothing
    assert split.split({1: 2.0, 2: 1.0})["common_m"] == 0.0


def test_what_is_shared_bounds_the_gain() -> None:
    assert afig3.expected(16, 0.0) == 4.0
    assert afig3.expected(16, 1.0) == 1.0
    assert afig3.expected(10**9, 0.04) == pytest.approx(5.0, rel=1e-6)


def test_six_filters_differ_little_once_a_fix_has_come() -> None:
    time, std = afig3.six_filters("test A")
    assert std.shape == (6, len(time), 3)
    figures = afig3.around_first_fix(time, std)
    assert 0.12 < figures["before_fix_m"][0] <= figures["before_fix_m"][1] < 0.21
    assert figures["after_fix_m"][1] < 0.05
    assert np.ptp(figures["after_fix_m"]) < 0.02


def test_times_are_those_of_200_000_epochs(monkeypatch: pytest.MonkeyPatch) -> None:
    def measure(cases: tuple[bench.Case, ...], rounds: int, seconds: float, progress: object) -> object:
        cost = np.array([[4.0, 5.0, 60.0, 6.0, 0.5, 0.6, 6.0, 1.5], [8.0, 10.0, 120.0, 12.0, 1.0, 1.2, 12.0, 3.0]])
        return cost[:, : len(cases)]

    monkeypatch.setattr(bench, "measure", measure)
    document = a4.reproduce(quick=True)
    ours = document["polyins"]
    assert ours["time_s"]["single"] == pytest.approx(1.2)
    assert ours["ratio"] == {"single": 1.0, "imu-fusion": 1.25, "nav-fusion": 15.0, "enav-fusion": 1.5}
    assert ours["structured"]["ratio"]["enav-fusion"] == 3.0
    assert ours["structured"]["times_faster"]["nav-fusion"] == 10.0
    assert ours["six_imus"]["ratio"]["enav-fusion"] == 1.5
    assert set(document["paper"]) <= set(ours)


def test_steps_add_up_to_one() -> None:
    shares: list[float] = []
    steps = Steps(shares.append, 2)
    first, second = steps.next(), steps.next()
    first(0.5)
    second(0.5)
    second(1.0)
    first(1.0)
    assert shares == [0.25, 0.5, 0.75, 1.0]
    long, short = (Steps(shares.append, 4.0).next(weight) for weight in (3.0, 1.0))
    long(1.0)
    short(1.0)
    assert shares[-2:] == [0.75, 0.25]
    Steps(None, 1).next()(1.0)
