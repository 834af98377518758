"""What a table rests on stands in a file, and what the code says of it is so."""

from importlib import resources

import pytest

from polyins.config.yaml_document import read_yaml
from polyins.simulation.scenario import Scenario
from polyins.studies.scenario_files import read, scenarios
from polyins_papers import a3, a5, nonrigid
from polyins_papers.robot_experiments import EXPERIMENTS, SIZES
from polyins_papers.vehicles import CHIPS, GYRO_SCALE_PPM

ROW = {"single": 4.0, "enav-fusion": 1.0, "ratio": 4.0, "costs": 0.0}
EXAMPLE = {"before": ROW, "g-sensitivity": ROW}, {"g-sensitivity": {**ROW, "single": 8.0}}

STUDIES, PAPERS = "polyins.studies", "polyins_papers"
SINGLE = {"a3": STUDIES, "consistency": STUDIES, "lawn": PAPERS, "books": PAPERS, "robot": PAPERS, "car": PAPERS}
SEVERAL = {"array": STUDIES, "afig3": PAPERS, "laps": PAPERS}
OTHERS = {"chips": STUDIES, "flights": STUDIES, "upper": PAPERS, "experiments": PAPERS}
ALWAYS = {"rate_hz", "static_s", "noise", "gnss"}
OF_WAYS = {
    "shuttle": {"speed_m_s", "straight_m", "turn_radius_m", "speed_up_s", "steer_s"},
    "track": {"smoothing_m", "rest_s", "slope_deg", "slope_length_m", "slope_adapts_m"},
    "laps": {"length_m", "width_m", "corner_m", "count", "speed_m_s", "change_m_s", "change_every_s", "starting_s"},
    "drive": {"top_speed_m_s", "acceleration_m_s2", "turn_radius_m", "slope_deg", "camber_deg", "roll_deg_per_m_s2"},
    "replay": {"from_s", "to_s", "camber_deg", "camber_length_m", "roll_deg_per_m_s2", "pitch_deg_per_m_s2"},
    "gnss": {"antenna_position_m", "position_std_m"},
    "rulers": {"young_gpa", "shear_gpa", "density_kg_m3", "tip_mass_kg", "damping", "tuning_spread"},
    "road": {"roughness_mm", "wavelengths_m", "patch_length_m", "heave_hz", "damping", "envelope_m", "tyres_only_push"},
}


@pytest.mark.parametrize("name", SINGLE)
def test_a_table_rests_on_no_default(name: str) -> None:
    says_all(read(Scenario, SINGLE[name], name), ALWAYS)


@pytest.mark.parametrize("name", SEVERAL)
def test_nor_does_a_curve(name: str) -> None:
    for key, scenario in scenarios(SEVERAL[name], name).items():
        says_all(scenario, ALWAYS if key not in ("robot", "car", "six filters") else set())


def says_all(scenario: Scenario, keys: set[str]) -> None:
    assert keys <= scenario.model_fields_set
    for name, said in OF_WAYS.items():
        part = getattr(scenario, name)
        if name in scenario.model_fields_set and part is not None:
            assert said <= part.model_fields_set | ({"top_speed_m_s"} if name == "drive" else set()), name
    if scenario.wheels:
        assert set(type(scenario.rolling).model_fields) == scenario.rolling.model_fields_set
    for wheel in scenario.wheels:
        assert {"radius_m", "chips", "lever_arm_m"} <= wheel.model_fields_set


@pytest.mark.parametrize("package", [STUDIES, PAPERS])
def test_every_file_is_read(package: str) -> None:
    files = [file for file in resources.files(package).iterdir() if file.name.endswith(".yaml")]
    known = {name for name, home in (SINGLE | SEVERAL | OTHERS).items() if home == package}
    assert {file.name.removesuffix(".yaml") for file in files} == known
    for found in files:
        with resources.as_file(found) as file:
            assert read_yaml(file).values


@pytest.mark.parametrize("sweep", a5.SWEEPS.values(), ids=a5.SWEEPS)
def test_a_sweep_passes_through_its_scenario(sweep: a5.Sweep) -> None:
    scenario = nonrigid.scenario_of(sweep.test, quick=False)
    assert sweep.own in sweep.values
    assert sweep.change(scenario, sweep.own) == scenario
    assert all(sweep.change(scenario, value) != scenario for value in sweep.values if value != sweep.own)


def test_experiments_are_named_by_their_sizes() -> None:
    labels = " | ".join(f"{name}: {each.source}" for name, each in EXPERIMENTS.items())
    for said in (
        f"radius {100.0 * SIZES.radius_error:g} % too large",
        f"lever arm {1e3 * SIZES.lever_arm_error_m:g} mm off",
        f"start heading {SIZES.heading_error_deg:g} deg off",
        f"modules tilted {SIZES.tilt_deg:g} deg",
        f"clocks {1e3 * SIZES.clock_error_s:g} ms off",
        f"gyro scale {1e-6 * SIZES.printed_gyro_scale_ppm:g}: as Table III prints it",
        f"gyro scale {1e-6 * SIZES.low_gyro_scale_ppm:g}: half of the 1 %",
        f"base: Table III, gyro scale {1e-6 * GYRO_SCALE_PPM:g}",
        f"told {GYRO_SCALE_PPM:g} ppm",
        f"{SIZES.wandering_bias_deg_h:g} of the {CHIPS.gyro_bias_deg_h[0]:g} deg/h",
        f"within {SIZES.wandering_time_s:g} s",
        f"{SIZES.misalignment_deg:g} deg about each axis",
        f"up to {100.0 * SIZES.slip.size:g} % for {SIZES.slip.length_s:g} s, every {SIZES.slip.every_s:g} s",
    ):
        assert said in labels, said


def test_what_a3_says_of_its_files_is_so() -> None:
    assert f"told {read(Scenario, STUDIES, 'a3').noise.accel_bias_mgal[0]:g} mGal" in a3.UNAWARE
    upper = a3.UPPER.errors
    assert upper.model_fields_set == {key for name in a3.CANDIDATES for key in a3.SOURCES[name]}
    assert f"to {upper.g_sensitivity_deg_s_g:g})" in a3.statement(*EXAMPLE)
