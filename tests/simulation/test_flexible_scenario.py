"""Scenarios with rulers on a road, and those of the reproduction."""

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.simulation import flexible_scenario
from polyins.simulation.drive_scenario import Drive
from polyins.simulation.error_scenario import SensorErrors
from polyins.simulation.road import ground
from polyins.simulation.run import record, simulate, true_run
from polyins.simulation.scenario import read_scenario
from polyins_papers import nonrigid

TESTS = tuple(nonrigid.FILES)
SHORT = nonrigid.scenario_of("test A", quick=True).model_copy(
    update={"duration_s": 30.0, "static_s": 5.0, "outages": ()}
)


@pytest.mark.parametrize("test", TESTS)
def test_the_array_s_origin_is_the_centroid_and_lever_arms_are_the_paper_s(test):
    positions = np.array([imu.position for imu in nonrigid.scenario_of(test, quick=False).rig().imus])
    np.testing.assert_allclose(positions.mean(axis=0), 0.0, atol=1e-8)
    # the paper's longest lever arm is 0.46 m
    assert 0.40 < np.linalg.norm(positions, axis=1).max() < 0.48


def test_both_tests_have_the_same_robot_rulers_and_sensors():
    lawn, books = (nonrigid.scenario_of(test, quick=False) for test in ("test A", "test B"))
    for name in ("rulers", "noise", "errors", "gnss", "imus", "rate_hz", "filter_noise"):
        assert getattr(lawn, name) == getattr(books, name)
    terrain = {"roughness_mm": 0.0, "books": ()}
    assert lawn.road.model_copy(update=terrain) == books.road.model_copy(update=terrain)
    assert nonrigid.scenario_of("rigid", quick=False).rulers.stiff
    assert not lawn.rulers.stiff


def test_outages_begin_when_the_front_wheels_reach_the_first_book():
    scenario = nonrigid.scenario_of("test B", quick=False)
    begins, _ = scenario.shuttle.straights(scenario.duration_s, scenario.static_s)
    first = scenario.road.books[0].at_m - scenario.road.wheelbase_m / 2.0
    expected = begins[2::2] + first / scenario.shuttle.speed_m_s
    found = [outage[0] for outage in scenario.outage_intervals()]
    np.testing.assert_allclose(found, expected[: len(found)], atol=0.01)
    assert len(found) == 7


def test_the_seed_shuffles_the_books_if_it_is_asked_to(monkeypatch):
    laid, bare = [], []

    def noted(length, roughness, bumps, wheel, rng):
        laid.append(bumps)
        drawn = ground(length, roughness, bumps, wheel, rng)
        bare.append(drawn(np.linspace(0.0, min(bump.begin for bump in bumps) - 1.0, 50)))
        return drawn

    monkeypatch.setattr(flexible_scenario, "ground", noted)
    scenario = nonrigid.scenario_of("test B", quick=True).model_copy(update={"duration_s": 90.0, "outages": ()})
    for shuffled, seed in ((False, 1), (True, 1), (True, 1), (True, 2)):
        road = scenario.road.model_copy(update={"books_shuffled": shuffled})
        true_run(scenario.model_copy(update={"road": road, "seed": seed}))
    own, one, again, other = laid
    assert one == again
    # it is the same ground that they lie on
    np.testing.assert_array_equal(bare[0], bare[1])
    assert np.abs(bare[1] - bare[3]).max() > 1e-4
    for key in (("begin",), ("height", "length"), ("left", "right")):
        sets = [sorted(tuple(getattr(bump, name) for name in key) for bump in bumps) for bumps in laid]
        assert sets[0] == sets[1] == sets[3], key
    assert len({tuple(sorted((bump.begin, bump.height) for bump in bumps)) for bumps in (own, one, other)}) == 3


@pytest.mark.parametrize("test", TESTS)
def test_the_configuration_in_force_reads_back(test, tmp_path):
    scenario = nonrigid.scenario_of(test, quick=True).model_copy(
        update={"duration_s": 20.0, "static_s": 5.0, "outages": ()}
    )
    file = tmp_path / "scenario.yaml"
    file.write_text(simulate(scenario).config_text)
    assert read_scenario(file) == scenario


def test_perfect_imus_read_what_their_tips_feel():
    perfect = SHORT.model_copy(update={"errors": SensorErrors(noise=False, biases=False, scales=False)})
    run = true_run(perfect)
    recording = record(run, seed=0).recording
    for imu, stream in zip(recording.rig.imus, recording.imus, strict=True):
        np.testing.assert_array_equal(stream.dtheta, run.tips[imu.name][0])
        np.testing.assert_array_equal(stream.dvel, run.tips[imu.name][1])
    # the rulers on both sides sag away from the body
    still = [stream.dvel[:900].mean(axis=0) for stream in recording.imus]
    assert still[0][1] < 0.0 < still[1][1]


def test_stiff_rulers_shake_less():
    stiff = SHORT.model_copy(update={"rulers": SHORT.rulers.model_copy(update={"stiff": True})})
    flexing, rigid = (true_run(scenario).tips["imu1"][1][3000:, 2].std() for scenario in (SHORT, stiff))
    assert flexing > 2.0 * rigid


def test_a_seed_draws_another_lawn():
    first, again, other = (true_run(SHORT.model_copy(update={"seed": seed})).tips["imu3"][1] for seed in (0, 0, 1))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.01


def test_the_reference_shakes_with_the_body():
    recording = simulate(SHORT)
    roll = recording.reference.attitude[:, 0]
    assert np.ptp(roll[:40]) < 1e-12
    assert 1e-4 < np.abs(roll[100:]).max() < 0.05


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("road: {roughness_mm: 1}", "road: is given without rulers; expected both or none"),
        ("rulers: {arms: []}", "rulers.arms: "),
        ("shuttle: {steer_s: 9}", "shuttle.steer_s: is 9; expected at most the 3.9 s of a half turn"),
        ("rulers: {arms: [{tip_m: [0, 0.3, 0], free_length_m: 0}]}", "free_length_m: is 0; expected"),
        (
            "rulers: {arms: [{tip_m: [0, 0.3, 0], free_length_m: 0.2}]}\nroad: {books: [{at_m: 1, height_m: 0.01}]}",
            "road.books: lie on the straights of a shuttle",
        ),
        (
            "shuttle: {straight_m: 10}\nrulers: {arms: [{tip_m: [0, 0.3, 0], free_length_m: 0.2}]}\n"
            "road: {books: [{at_m: 9.9, height_m: 0.01}]}",
            "road.books: reach to 10.1 m; expected all within the 10 m",
        ),
        (
            "rulers: {arms: [{tip_m: [0, 0.3, 0], free_length_m: 0.2}]}\nroad: {wavelengths_m: [3, 1]}",
            "wavelengths_m: are .3.0, 1.0.; expected the shortest",
        ),
        (
            "rulers: {arms: [{tip_m: [0, 0.3, 0], free_length_m: 0.2}]}\nroad: {books_shuffled: true}",
            "road.books_shuffled: is true without books; expected some",
        ),
        (
            "rulers: {arms: [{tip_m: [0, 0.3, 0], free_length_m: 0.2}]}\nshuttle: {}\n"
            "road: {books: [{at_m: 1.1, height_m: 0.01, under: left}, {at_m: 1, height_m: 0.01}]}",
            "road.books: one begins at 1.1 m, where another lies until 1.2 m; expected gaps",
        ),
        ("errors: {g_sensitivity: 1}", "did you mean g_sensitivity_deg_s_g"),
    ],
)
def test_mistakes_are_named(tmp_path, text, message):
    file = tmp_path / "scenario.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=message):
        simulate(file)


def test_without_a_road_the_rulers_hang_still(tmp_path):
    file = tmp_path / "scenario.yaml"
    file.write_text("duration_s: 20\nstatic_s: 15\nrulers: {arms: [{tip_m: [0, 0.3, 0], free_length_m: 0.2}]}")
    force = true_run(read_scenario(file)).tips["imu1"][1][:2000] / 0.005
    np.testing.assert_allclose(force, force[:1].repeat(2000, axis=0), atol=1e-9)


def test_a_drive_beside_another_way_is_said_to_have_no_effect():
    (warning,) = simulate(SHORT.model_copy(update={"drive": Drive(top_speed_m_s=3.0)})).warnings
    assert warning == "drive: has no effect beside shuttle"
