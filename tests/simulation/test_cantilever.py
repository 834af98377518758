"""Rulers against the closed formulas of Euler's and Bernoulli's beam."""

import numpy as np
import pytest

from polyins.simulation.cantilever import Cantilever
from polyins.simulation.flexible import FlexibleMount, flex
from polyins.simulation.shaking import Shaking

STEP = 1.0 / 2000.0
HEAVY = 5.0  # kg: the ruler's own 52 g hardly count


def beam(tip_mass=0.015, length=0.22):
    return Cantilever(length, 0.03, 0.001, tip_mass, 0.008, 0.02)


def test_stiffness_is_that_of_a_force_at_the_tip():
    # 200 GPa x 30 mm x (1 mm)^3 / 12 = 0.5 N m^2
    assert beam().stiffness == pytest.approx(3.0 * 0.5 / 0.22**3)


def test_with_a_heavy_tip_the_ruler_is_a_spring():
    ruler = beam(HEAVY)
    assert ruler.bending_rate == pytest.approx(np.sqrt(ruler.stiffness / HEAVY), rel=2e-3)
    # the shape of a force at the tip: 3 x^2 / 2 - x^3 / 2
    assert ruler.slope == pytest.approx(1.5, abs=1e-3)
    assert ruler.shortening == pytest.approx(0.6, abs=1e-3)
    assert ruler.gain == pytest.approx(1.0, abs=5e-3)


def test_without_a_tip_it_is_the_textbook_s_clamped_bar():
    ruler = beam(1e-9)
    # first root 1.8751, slope at the tip 1.3765, participation 1.566
    per_length = np.sqrt(0.5 / (7850.0 * 0.03 * 0.001))
    assert ruler.bending_rate == pytest.approx(1.8751041**2 * per_length / 0.22**2, rel=1e-6)
    assert ruler.slope == pytest.approx(1.3765, abs=1e-4)
    assert ruler.gain == pytest.approx(1.566, abs=1e-3)


def test_the_rulers_of_the_lawn_bend_at_11_13_and_16_hertz():
    rates = [beam(length=length).bending_rate / (2.0 * np.pi) for length in (0.22, 0.20, 0.18)]
    np.testing.assert_allclose(rates, [11.4, 13.45, 16.1], atol=0.05)


def test_torsion_is_fast_and_slows_with_the_module_s_inertia():
    light, heavy = beam(), beam(tip_mass=0.15)
    assert 100.0 < light.torsion_rate / (2.0 * np.pi) < 250.0
    assert heavy.torsion_rate < 0.6 * light.torsion_rate


def jolted(damping):
    """The deflection after the body was lifted by 1 mm within 10 ms, and its rate."""
    time = STEP * np.arange(8000)
    lift = np.clip(time / 0.01, 0.0, 1.0)
    heave = -1e-3 * lift**2 * (3.0 - 2.0 * lift)
    rise = np.gradient(heave, STEP)
    none = np.zeros_like(heave)
    shaking = Shaking(STEP, np.column_stack([heave, none, none]), np.column_stack([rise, none, none]))
    flexing = flex(FlexibleMount(beam(), np.array([0.0, 0.3, 0.0]), 1.0, damping=damping), shaking, 0.0)
    after = slice(100, None)
    return flexing[after, 0], flexing[after, 2]


def energy(damping):
    d, rate = jolted(damping)
    return 0.5 * (rate**2 + beam().bending_rate ** 2 * d**2)


def test_without_damping_energy_stays():
    kept = energy(1e-12)
    assert kept[0] > 0.0
    np.testing.assert_allclose(kept, kept[0], rtol=1e-6)


@pytest.mark.parametrize("damping", [0.01, 0.03])
def test_energy_decays_at_twice_damping_times_frequency(damping):
    left = energy(damping)
    time = STEP * np.arange(left.size)
    rate = -np.polyfit(time, np.log(left), 1)[0]
    assert rate == pytest.approx(2.0 * damping * beam().bending_rate, rel=0.01)


def test_the_tip_stays_behind_when_the_clamp_jumps():
    d, _ = jolted(1e-12)
    # the clamp went up by 1 mm: the tip swings about its place by as much as the mode takes part in that
    assert d.max() == pytest.approx(1e-3 * beam().gain, rel=0.05)
    assert d.min() == pytest.approx(-d.max(), rel=0.01)


def test_a_clamp_that_moves_slowly_bends_the_ruler_by_its_inertia():
    time, swing, place = STEP * np.arange(20000), 0.02, 0.3
    roll, rolling = swing * (1.0 - np.cos(time)), swing * np.sin(time)
    none = np.zeros_like(time)
    shaking = Shaking(STEP, np.column_stack([none, none, roll]), np.column_stack([none, none, rolling]))
    ruler = FlexibleMount(beam(HEAVY), np.array([0.0, place, 0.0]), 1.0, damping=0.5)
    d = flex(ruler, shaking, 0.0)[10000:, 0]
    # the heavy tip at the ruler's end takes force to be turned about the middle
    force = -HEAVY * place * swing * np.cos(time[10000:])
    assert np.abs(d - force / beam().stiffness).max() < 0.2 * np.abs(force / beam().stiffness).max()
