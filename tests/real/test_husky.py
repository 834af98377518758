"""A robot with one IMU and an odometer through a minute without GNSS, from its bag."""

from __future__ import annotations

from pathlib import Path

import pytest

import polyins as pi

# the IMU lies on its side: its y is up and its -z points forward, as the filter's innovations of the odometer tell
CONFIG = """
imus: [{file: &bag HUSKY, stream: /imu/data, axes: [-z, x, -y], noise: consumer-mems}]
gnss: &fixes {file: *bag, stream: /fix}
reference: *fixes
outages: {length_s: 60, every_s: 90, first_after_s: 60}
"""
ODOMETER = """
odometer: {file: *bag, stream: /husky_velocity_controller/odom, std_m_s: 0.1, scale_std: 0.05}
"""
CONSTRAINT = "odometer: {constraint_interval_s: 0.5}\n"


@pytest.fixture(scope="module")
def husky(data_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    bag = data_folder / "logs" / "rosbag" / "husky.bag"
    if not bag.is_file():
        pytest.skip(f"no logs: {bag} is no file")
    folder = tmp_path_factory.mktemp("husky")
    (folder / "husky.yaml").write_text(CONFIG.replace("HUSKY", str(bag)))
    return folder


def outage_rms(folder: Path, extra: str) -> tuple[float, pi.Solution]:
    path = folder / "with.yaml"
    path.write_text((folder / "husky.yaml").read_text() + extra)
    recording = pi.load(path)
    solution = pi.run(recording, "single")
    document = pi.evaluate(solution, recording.reference, outages=recording.outages)
    return document["outages"]["horizontal_max_rms_m"], solution


def test_its_odometer_carries_it_through_outages(husky: Path) -> None:
    alone, _ = outage_rms(husky, "")
    assumed, _ = outage_rms(husky, CONSTRAINT)
    driven, solution = outage_rms(husky, ODOMETER)
    assert assumed < 0.3 * alone
    assert driven < 0.2 * assumed
    assert driven < 12.0
    scale = solution.offsets["speed_scale"]
    assert abs(scale.value[-1]) < 0.1
    assert scale.std[-1] < 0.01
    assert solution.measurements["odometer"].accepted.all()
