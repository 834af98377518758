"""GeoJSON, read by geojson."""

from datetime import datetime
from pathlib import Path

import geojson
import numpy as np
import pytest
from exported import BEGIN, exported, known

from polyins.errors import InputError
from polyins.tools.export.writing import export


def test_a_line_with_a_figure_for_each_position(tmp_path: Path) -> None:
    path, truth = exported(tmp_path, "geojson")
    feature = geojson.loads(path.read_text())
    assert feature.is_valid
    assert feature.geometry.type == "LineString"
    expected = np.degrees(truth.geodetic[:, [1, 0]])
    np.testing.assert_allclose(
        feature.geometry.coordinates, np.column_stack([expected, truth.geodetic[:, 2]]), atol=1e-4
    )
    np.testing.assert_allclose(np.array(feature.geometry.coordinates)[:, :2], expected, atol=1e-9)
    properties = feature.properties
    lengths = {len(values) for values in properties.values() if isinstance(values, list)}
    assert lengths == {truth.time.size}
    assert datetime.fromisoformat(properties["coordTimes"][0]).timestamp() == BEGIN
    assert (properties["std_north_m"][0], properties["std_down_m"][0]) == (0.1, 0.3)
    assert (properties["status"][0], properties["status"][-1]) == ("tracking", "coasting")


def test_heights_that_are_not_above_the_ellipsoid_are_no_coordinates(tmp_path: Path) -> None:
    path, _ = exported(tmp_path, "geojson", heights="sea-level", utc_of_zero=None)
    feature = geojson.loads(path.read_text())
    assert {len(place) for place in feature.geometry.coordinates} == {2}
    assert feature.properties["heights"] == "sea-level"
    assert feature.properties["height_m"][0] == 20.0
    assert "coordTimes" not in feature.properties


def test_one_row_is_no_line(tmp_path: Path) -> None:
    _, made = known(duration=0.0)
    with pytest.raises(InputError, match="1 row; expected at least two"):
        export(made, tmp_path / "a.geojson", "geojson")
    assert not list(tmp_path.iterdir())
