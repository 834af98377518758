"""KML, read by fastkml and held against the schemas of OGC and Google that it brings."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from exported import BEGIN, exported
from fastkml import KML
from fastkml.enums import AltitudeMode
from fastkml.gx import Track
from fastkml.utils import find
from fastkml.validator import validate
from lxml import etree

from polyins.tools.export.writing import ExportOptions

GX = "{http://www.google.com/kml/ext/2.2}"


def track_of(path: Path) -> Track:
    assert validate(file_to_validate=path)
    return find(KML.parse(path, strict=True), of_type=Track)


def test_a_track_with_times_places_and_headings(tmp_path: Path) -> None:
    path, truth = exported(tmp_path, "kml", ExportOptions(geoid_height_m=-12.0))
    items = track_of(path).track_items
    assert [item.when.dt for item in items[:2]] == [
        datetime.fromtimestamp(BEGIN, UTC),
        datetime.fromtimestamp(BEGIN + 0.05, UTC),
    ]
    places = np.array([(item.coord.y, item.coord.x) for item in items])
    np.testing.assert_allclose(places, np.degrees(truth.geodetic[:, :2]), atol=1e-9)
    np.testing.assert_allclose([item.coord.z for item in items], truth.geodetic[:, 2] + 12.0, atol=1e-3)
    np.testing.assert_allclose([item.angle.heading for item in items], np.degrees(truth.euler[:, 2]), atol=1e-3)
    assert track_of(path).altitude_mode == AltitudeMode.absolute


def test_standard_deviations_are_extended_data(tmp_path: Path) -> None:
    path, truth = exported(tmp_path, "kml")
    arrays = {one.get("name"): one for one in etree.parse(path).iter(f"{GX}SimpleArrayData")}
    for name, std in (("std_north_m", 0.1), ("std_down_m", 0.3), ("std_east_velocity_m_s", 0.02)):
        np.testing.assert_allclose([float(value.text) for value in arrays[name]], std, atol=1e-4)
        assert len(arrays[name]) == truth.time.size


@pytest.mark.parametrize("heights", ["ellipsoidal", "unknown"])
def test_a_track_of_unknown_altitude_lies_on_the_ground(heights: str, tmp_path: Path) -> None:
    path, _ = exported(tmp_path, "kml", heights=heights)
    track = track_of(path)
    assert track.altitude_mode == AltitudeMode.clamp_to_ground
    assert {item.coord.z for item in track.track_items} == {0.0}
