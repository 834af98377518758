"""The pictures of `polyins allan`."""

from __future__ import annotations

import numpy as np
import pytest

from polyins.calibration.array_gain import array_gain
from polyins.calibration.imu_noise import ImuNoise, imu_noise
from polyins.calibration.noise_listing import NoiseFigures
from polyins.model.recording import ImuStream
from polyins.report.allan_curves import FEW, allan_figure, gain_figure
from polyins.report.figure import as_script


def at_rest(name: str, seed: int) -> ImuStream:
    time = np.arange(1, 2001) * 0.02
    white = np.random.default_rng(seed).standard_normal((2000, 6)) * np.repeat([1e-5, 2e-4], 3)
    return ImuStream(name, time, white[:, :3], white[:, 3:] + [0.0, 0.0, -0.196])


@pytest.fixture(scope="module")
def one() -> ImuNoise:
    return imu_noise(at_rest("<left>", 0))


def test_each_axis_has_a_panel_with_what_was_measured_and_fitted(one: ImuNoise) -> None:
    figure = allan_figure(NoiseFigures((one,), None, ()))
    assert all(axis["type"] == "log" for letter in "xy" for axis in figure.axes(letter))
    assert len(figure.axes("x")) == 6
    assert len(figure.data) == 6 * 3  # band, measured, fitted
    measured = [trace for trace in figure.data if trace.get("mode") == "lines+markers"]
    for trace, axis in zip(measured, (*one.axes["gyro"], *one.axes["accel"]), strict=True):
        np.testing.assert_array_equal(trace["x"], axis.curve.tau)
    degrees_an_hour = np.degrees(one.axes["gyro"][0].curve.deviation) * 3600.0
    np.testing.assert_allclose(measured[0]["y"], degrees_an_hour)
    assert [trace["showlegend"] for trace in measured] == [True, *[False] * 5]
    assert "<left>" not in as_script(figure.data)


def test_many_have_no_bands(one: ImuNoise) -> None:
    figure = allan_figure(NoiseFigures((one,) * (FEW + 1), None, ()))
    assert len(figure.data) == 6 * 2 * (FEW + 1)


def test_the_gain_is_drawn_beside_the_square_root() -> None:
    figure = gain_figure(array_gain(tuple(at_rest(f"imu{k}", k) for k in range(3))))
    named = {trace["name"]: trace for trace in figure.data if "name" in trace}
    assert set(named) == {"gyros", "accelerometers", "sqrt(N)"}
    np.testing.assert_allclose(named["sqrt(N)"]["y"], np.sqrt(3.0))
    assert np.median(named["gyros"]["y"]) == pytest.approx(np.sqrt(3.0), rel=0.3)
