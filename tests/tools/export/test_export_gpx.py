"""GPX, read by gpxpy."""

from pathlib import Path

import gpxpy
import numpy as np
from exported import BEGIN, exported, known
from synthetic_solutions import drive

from polyins.tools.export.writing import ExportOptions, export


def test_gpxpy_reads_places_elevations_and_times(tmp_path: Path) -> None:
    path, truth = exported(tmp_path, "gpx", ExportOptions(geoid_height_m=-12.0))
    read = gpxpy.parse(path.read_text(), version="1.1")
    (segment,) = read.tracks[0].segments
    rows = np.array([(p.latitude, p.longitude, p.elevation, p.geoid_height) for p in segment.points])
    np.testing.assert_allclose(rows[:, :2], np.degrees(truth.geodetic[:, :2]), atol=1e-9)
    np.testing.assert_allclose(rows[:, 2], truth.geodetic[:, 2] + 12.0, atol=1e-3)
    assert set(rows[:, 3]) == {-12.0}
    np.testing.assert_allclose([p.time.timestamp() for p in segment.points], BEGIN + truth.time - 1000.0, atol=1e-6)


def test_without_a_geoid_there_are_no_elevations_and_it_is_said(tmp_path: Path) -> None:
    _, made = known()
    (note,) = export(made, tmp_path / "a.gpx", "gpx")
    assert "elevations are left out" in note
    assert not gpxpy.parse((tmp_path / "a.gpx").read_text()).has_elevations()


def test_heights_above_the_sea_are_elevations_as_they_are(tmp_path: Path) -> None:
    _, made = known(heights="sea-level")
    assert export(made, tmp_path / "a.gpx", "gpx") == ()
    (point, *_) = gpxpy.parse((tmp_path / "a.gpx").read_text()).tracks[0].segments[0].points
    assert point.elevation == 20.0


def test_a_pause_begins_a_segment(tmp_path: Path) -> None:
    time = drive(duration=10.0).time
    path, _ = exported(tmp_path, "gpx", time=np.where(time > 1004.0, time + 3.0, time))
    segments = gpxpy.parse(path.read_text()).tracks[0].segments
    assert [len(segment.points) for segment in segments] == [81, 120]


def test_a_longitude_of_180_is_one_that_the_schema_allows(tmp_path: Path) -> None:
    truth = drive(duration=10.0)
    path, _ = exported(tmp_path, "gpx", position=truth.geodetic * [1.0, 0.0, 1.0] + [0.0, np.pi, 0.0])
    (segment,) = gpxpy.parse(path.read_text()).tracks[0].segments
    assert {point.longitude for point in segment.points} == {-180.0}
