"""MCAP, read by mcap and its decoder of ROS 2, and by the reader of bags."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported import BEGIN, exported, known
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from polyins.errors import InputError
from polyins.formats import ros_bag
from polyins.model.findings import Finding
from polyins.tools.export import mcap as written
from polyins.tools.export.writing import ExportOptions, export


def messages(path: Path) -> dict[str, list[tuple[int, Any]]]:
    found: dict[str, list[tuple[int, Any]]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        for _, channel, message, decoded in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message.log_time, decoded))
    return found


def test_poses_carry_their_covariance(tmp_path: Path) -> None:
    path, truth = exported(tmp_path, "mcap")
    found = messages(path)
    assert set(found) == set(written.TOPICS)
    assert len(found["/polyins/pose"]) == truth.time.size
    stamp, pose = found["/polyins/pose"][20]
    assert stamp == round((BEGIN + 1.0) * 1e9) == pose.header.stamp.sec * 10**9 + pose.header.stamp.nanosec
    assert pose.header.frame_id == "map"
    place = pose.pose.pose.position
    np.testing.assert_allclose([place.x, place.y, place.z], truth.local[20, [1, 0, 2]], atol=5e-3)
    covariance = np.array(pose.pose.covariance).reshape(6, 6)
    assert np.count_nonzero(covariance - np.diag(np.diag(covariance))) == 0
    np.testing.assert_allclose(np.diag(covariance)[:3], [0.04, 0.01, 0.09])  # east, north, up
    np.testing.assert_allclose(np.degrees(np.sqrt(np.diag(covariance)[3:])), [2.0, 1.0, 3.0])


def test_transforms_and_path_are_the_poses(tmp_path: Path) -> None:
    found = messages(exported(tmp_path, "mcap")[0])
    poses = [message.pose.pose for _, message in found["/polyins/pose"]]
    transforms = [message.transforms[0] for _, message in found["/tf"]]
    assert {(one.header.frame_id, one.child_frame_id) for one in transforms} == {("map", "base_link")}
    ((_, path),) = found["/polyins/path"]
    for pose, transform, on_path in zip(poses, transforms, path.poses, strict=True):
        assert pose.position.y == transform.transform.translation.y == on_path.pose.position.y
        assert pose.orientation.w == transform.transform.rotation.w == on_path.pose.orientation.w
    speed = found["/polyins/velocity"][0][1].vector
    np.testing.assert_allclose([speed.x, speed.y, speed.z], [0.0, 8.0, 0.0], atol=1e-6)


def test_the_reader_of_bags_gets_the_fixes(tmp_path: Path) -> None:
    path, truth = exported(tmp_path, "mcap")
    track = ros_bag.read(path).tracks["/polyins/fix"]
    np.testing.assert_allclose(track.position, truth.geodetic, atol=1e-12)
    np.testing.assert_allclose(track.time, BEGIN + truth.time - 1000.0, atol=1e-6)
    np.testing.assert_allclose(track.position_std[0], [0.1, 0.2, 0.3])


def test_diagnostics_say_status_and_findings(tmp_path: Path) -> None:
    _, made = known(findings=(Finding("gap", "an IMU is silent", "doubt", stream="imu1"),))
    export(made, tmp_path / "a.mcap", "mcap")
    statuses = [status for _, message in messages(tmp_path / "a.mcap")["/diagnostics"] for status in message.status]
    levels = {level if isinstance(level, int) else level[0] for level in (one.level for one in statuses)}
    assert levels == {written.OK, written.WARN}
    assert [one.message for one in statuses if one.name == "polyins: finding: gap"] == ["an IMU is silent"]
    assert {one.message for one in statuses if one.name == "polyins: navigation"} == {"tracking", "coasting"}
    # once a second, and at once when it changes
    assert len([one for one in statuses if one.name == "polyins: navigation"]) == 11 + 1


def test_a_height_that_is_not_above_the_ellipsoid_is_no_altitude(tmp_path: Path) -> None:
    found = messages(exported(tmp_path, "mcap", heights="sea-level")[0])
    assert np.isnan([fix.altitude for _, fix in found["/polyins/fix"]]).all()


def test_on_a_plane_without_utc(tmp_path: Path) -> None:
    truth, made = known(geodetic=False, utc_of_zero=None)
    (note,) = export(made, tmp_path / "a.mcap", "mcap")
    assert "nothing tells UTC" in note
    found = messages(tmp_path / "a.mcap")
    assert "/polyins/fix" not in found
    assert found["/polyins/pose"][0][0] == round(truth.time[0] * 1e9)


def test_stamps_below_zero_need_utc(tmp_path: Path) -> None:
    truth, made = known(utc_of_zero=None)
    early = type(made)(**{**vars(made), "time": truth.time - 2000.0})
    with pytest.raises(InputError, match="begin below zero"):
        export(early, tmp_path / "a.mcap", "mcap")
    export(early, tmp_path / "a.mcap", "mcap", ExportOptions(utc_of_zero="2024-05-01T12:00:00Z"))
