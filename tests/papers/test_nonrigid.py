"""The flexible array of paper A: what is compared is compared fairly, and what is shared is what is said."""

from dataclasses import replace

import numpy as np
import pytest

from polyins.evaluation.errors import compare_to_reference
from polyins.model.recording import ImuStream, Recording
from polyins.navigate import batch
from polyins.simulation.flexible import flex
from polyins.simulation.flexible_scenario import Book
from polyins.simulation.scenario import Scenario
from polyins.simulation.shaking import shake
from polyins.studies.progress import Steps
from polyins.studies.rigid_array import Array, maxima
from polyins_papers import a5, a6, nonrigid
from polyins_papers.feedback import outage_maxima

SECONDS = 150.0


def shortened(test: str) -> Scenario:
    scenario = nonrigid.scenario_of(test, quick=True)
    return scenario.model_copy(update={"duration_s": SECONDS, "static_s": 30.0, "outages": ((90.0, 120.0),)})


@pytest.fixture(scope="module")
def lawn() -> Recording:
    return nonrigid.recording_of(shortened("test A"), 0)


@pytest.fixture(scope="module")
def rigid() -> Recording:
    return nonrigid.recording_of(shortened("rigid"), 0)


def test_feeding_nothing_back_is_enav_fusion(lawn: Recording) -> None:
    nothing = outage_maxima(lawn, velocity=False, attitude=False)
    np.testing.assert_allclose(nothing, maxima(lawn, "enav-fusion"), rtol=1e-6)


def test_feeding_attitude_and_velocity_back_is_nearly_imu_fusion(lawn: Recording, rigid: Recording) -> None:
    for recording in (lawn, rigid):
        both = outage_maxima(recording, velocity=True, attitude=True)
        np.testing.assert_allclose(both, maxima(recording, "imu-fusion"), rtol=0.1)
        np.testing.assert_allclose(both, maxima(recording, "enav-fusion-shared-mechanization"), rtol=1e-2)


def test_flexing_troubles_imu_fusion_and_spares_nav_fusion(lawn: Recording, rigid: Recording) -> None:
    # the same sensors, errors, path and ground: what differs at the outage's end is what flexing does
    moved = {
        name: float(np.hypot(*(miss(lawn, name) - miss(rigid, name))[:2])) for name in ("imu-fusion", "nav-fusion")
    }
    assert moved["imu-fusion"] > 0.5
    assert moved["nav-fusion"] < 0.2


def miss(recording: Recording, method: str) -> Array:
    assert recording.reference is not None
    errors = compare_to_reference(batch.run(recording, method), recording.reference)
    return np.asarray(errors.position[np.searchsorted(errors.time, recording.outages[0][1] - 1e-6)])


def test_forces_moved_to_the_origin_are_what_the_origin_senses(rigid: Recording) -> None:
    # turning about z through the origin, ever faster: the origin senses nothing
    time, dt = 0.005 * np.arange(1, 400), 0.005
    rate = 2.0 * (time - 0.5 * dt)
    turning = np.column_stack([0.0 * rate, 0.0 * rate, rate]) * dt
    places = [imu.position for imu in rigid.rig.imus]
    forces = [np.cross(turning, np.cross(turning, r)) / dt + np.cross([0.0, 0.0, 2.0], r) * dt for r in places]
    streams = tuple(ImuStream("any", time, turning, force) for force in forces)
    moved = nonrigid.with_forces_at_origin(replace(rigid, imus=streams))
    assert max(np.abs(force).max() for force in forces) > 0.01
    for stream in moved.imus:
        np.testing.assert_allclose(stream.dvel[1:], 0.0, atol=1e-12)
    assert not any(imu.position.any() for imu in moved.rig.imus)


def test_on_a_rigid_array_it_does_not_matter_whose_rate_moves_the_forces(rigid: Recording) -> None:
    np.testing.assert_allclose(a5.errors(rigid, a5.OWN_RATES), a5.errors(rigid, "imu-fusion"), rtol=0.02)


def test_own_rates_trouble_imu_fusion_more(lawn: Recording) -> None:
    own, one = (a5.errors(lawn, name) for name in (a5.OWN_RATES, "imu-fusion"))
    np.testing.assert_array_equal(own, maxima(nonrigid.with_forces_at_origin(lawn), "imu-fusion"))
    np.testing.assert_array_equal(one, maxima(lawn, "imu-fusion"))
    assert abs(own[0] - one[0]) > 0.1


def test_figures_are_pooled_over_all_outages_of_all_seeds() -> None:
    maxima_by_seed = {"single": [np.array([3.0, 4.0]), np.array([0.0, 5.0])]}
    assert nonrigid.pooled(maxima_by_seed)["single"] == pytest.approx(np.sqrt(50.0 / 4.0))


def test_the_interval_of_a_ratio_holds_it_and_is_nothing_where_all_seeds_agree() -> None:
    rng = np.random.default_rng(0)
    same = {"single": np.full(5, 4.0), "imu-fusion": np.full(5, 3.0), "nav-fusion": np.full(5, 2.0)}
    runs = [{**same, a5.OWN_RATES: np.abs(rng.normal(0.0, 3.0, 5))} for _ in range(60)]
    found = a5.interval(runs)
    assert found["imu_fusion_over_single"] == pytest.approx([0.75, 0.75])
    assert found["imu_fusion_over_nav_fusion"] == pytest.approx([1.5, 1.5])
    own = a5.row(runs)[a5.OWN_RATES] / 4.0
    low, high = found["own_rates_over_single"]
    # of 300 values of which the square's std is sqrt(2) of its mean: 1.64 sqrt(2 / 300) / 2
    assert low < own < high
    assert (high - low) / own == pytest.approx(0.134, rel=0.2)


def test_the_documents_name_the_paper_s_figures_and_ours_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    errors = {"single": 6.0, "imu-fusion": 5.0, a5.OWN_RATES: 5.5, "nav-fusion": 2.5, "enav-fusion": 2.0}
    runs = [{name: np.array([error]) for name, error in errors.items()}]

    monkeypatch.setattr(a5, "run", lambda *_: runs)
    document = a5.reproduce(quick=True)
    assert set(document["paper"]) <= set(document["polyins"])
    assert document["polyins"]["test A"]["imu_fusion_over_nav_fusion"] == pytest.approx(2.0)
    assert document["polyins"]["test B"]["ratio"]["enav-fusion"] == pytest.approx(3.0)
    # Table V divides the rigid array's 4.87 m
    assert document["paper"]["test A"]["ratio_to_rigid_single"]["nav-fusion"] == pytest.approx(1.56, abs=0.005)
    assert document["paper"]["test B"]["ratio_to_rigid_single"]["imu-fusion"] == pytest.approx(1.16, abs=0.005)
    assert sorted(document["polyins"]["roughness_mm"]) == ["1.2", "1.6", "2"]
    assert document["polyins"]["book_mm"]["15"]["excess"] == pytest.approx(2.5)
    assert document["polyins"]["length_mm"]["148"]["imu_fusion_over_single"] == pytest.approx(5.0 / 6.0)
    variants = document["polyins"]["variants"]
    assert set(variants["test B"]) == set(a5.VARIANTS)
    assert "thickest book first" not in variants["test A"]
    assert variants["test A"]["round wheels"]["imu_fusion_over_nav_fusion"] == pytest.approx(2.0)


def test_what_is_swept_is_all_that_changes() -> None:
    lawn, books = (nonrigid.scenario_of(test, quick=True) for test in ("test A", "test B"))
    assert lawn.rulers is not None
    assert books.road is not None
    thin = nonrigid.with_books(books, 7.5)
    assert thin.road is not None
    assert [book.height_m for book in thin.road.books] == [0.5 * book.height_m for book in books.road.books]
    assert nonrigid.with_books(thin, 15.0) == books
    assert nonrigid.with_lengths(nonrigid.with_lengths(books, 150.0), 210.0) == books
    stiff = nonrigid.with_thickness(lawn, 2.0)
    assert stiff.rulers is not None
    # of the ruler alone; the module's mass at its tip makes it more
    assert stiff.rulers.mounts()[0].bending_rate > 2.0 * lawn.rulers.mounts()[0].bending_rate
    assert nonrigid.with_thickness(stiff, 1.0) == lawn
    for variant in a5.VARIANTS.values():
        for test in variant.tests:
            own = nonrigid.scenario_of(test, quick=True)
            other = variant.change(own)
            assert other != own
            assert other.model_copy(update={"road": own.road, "rulers": own.rulers}) == own
    for sweep in a5.SWEEPS.values():
        assert sweep.own in sweep.values
        scenario = nonrigid.scenario_of(sweep.test, quick=True)
        assert sweep.change(scenario, sweep.own) == scenario


def test_books_are_laid_in_another_order_and_stay_the_same_books() -> None:
    own = nonrigid.scenario_of("test B", quick=True)
    back, left = nonrigid.with_books_reversed(own).road, nonrigid.with_books_on_the_left(own).road
    assert own.road is not None
    assert back is not None
    assert left is not None
    books = own.road.books
    assert [(book.height_m, book.under) for book in back.books] == [(book.height_m, book.under) for book in books[::-1]]
    assert [book.at_m for book in back.books] == [book.at_m for book in books]
    assert left.books == tuple(book.model_copy(update={"under": "left"}) for book in books)
    assert sorted(book.height_m for book in books) == [book.height_m for book in books]


def test_the_two_edges_of_a_book_cancel_or_add_up_in_the_slackest_ruler() -> None:
    slackest = ringing(1.5), ringing(2.0), ringing(2.5)
    # left, under which the book lies: most of what the edges set going
    assert min(slackest[0][1], slackest[2][1]) > 5.0 * slackest[1][1]
    for rulers in (slackest[0], slackest[2]):
        assert rulers.argmax() == 1
        assert max(rulers[2:]) < 0.4 * rulers[1]


def ringing(periods: float) -> Array:
    """Return the std of the rulers' deflections after a book whose edges are some periods of the slackest apart."""
    scenario = nonrigid.with_roughness(nonrigid.scenario_of("test B", quick=True), 0.0)
    assert scenario.rulers is not None
    assert scenario.road is not None
    assert scenario.shuttle is not None
    rulers, speed, at, static = scenario.rulers.mounts(), scenario.shuttle.speed_m_s, 4.0, 1.0
    length = periods * speed * 2.0 * np.pi / rulers[0].bending_rate
    assert length == pytest.approx(0.21, abs=0.002) or periods != 2.0
    book = Book(at_m=at, height_m=0.01, length_m=length, under="left")
    road = scenario.road.model_copy(update={"books": (book,)})
    path = scenario.shuttle.path(15.0, static, scenario.start_position(), scenario.world())
    begins, ways = scenario.shuttle.straights(15.0, static)
    shaking = shake(path, road.ground(path, ways[:1], np.random.default_rng(0)), road.suspension(), 5e-4)
    left = begins[0] + (at + length + road.wheelbase_m / 2.0) / speed + 0.3
    rows = slice(int(left / 5e-4), int((left + 1.0) / 5e-4))
    return np.array([flex(ruler, shaking, 9.8)[rows, 0].std() for ruler in rulers])


def test_what_diverges_beyond_all_numbers_has_no_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    errors = {"enav-fusion": 2.0, "attitude shared": np.nan}
    variants = {name: lambda _, error=error: np.array([error]) for name, error in errors.items()}
    monkeypatch.setattr(a6, "VARIANTS", variants)
    monkeypatch.setattr(nonrigid, "recording_of", lambda *_: None)
    assert a6.table("test A", 2, True, Steps(None, 2)) == {"enav-fusion": 2.0, "attitude shared": None}


def test_costs_of_sharing_are_relative_to_enav_fusion() -> None:
    costs = a6.with_costs(a6.PAPER["test A"])["cost"]
    assert costs == {"attitude and velocity shared": pytest.approx(0.552, abs=0.001)}
    assert a6.with_costs({"enav-fusion": 2.0, "attitude shared": None})["cost"] == {"attitude shared": None}
    shares: list[float] = []
    Steps(shares.append, 2).next()(1.0)
    assert shares == [0.5]
