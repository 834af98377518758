"""Where paper B's vehicles drive: on the lab's real tracks, or on laps of our own where a data set is not at hand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from polyins.errors import InputError
from polyins.reading import datasets
from polyins.screen import say
from polyins.simulation.scenario import Scenario
from polyins.simulation.wheel_scenario import Slip
from polyins_papers.vehicles import Earth, Vehicle

QUICK_S = 200.0


@dataclass(frozen=True)
class Site:
    """A vehicle and its track."""

    vehicle: Vehicle
    folder: Path | None
    """of the data set; None: the laps that stand in"""
    duration_s: float | None = None
    """None: the whole drive"""

    @property
    def source(self) -> str:
        """What the track is, in words."""
        drive = "the whole drive" if self.duration_s is None else f"the first {self.duration_s:g} s"
        if self.folder:
            return f"real, data set {self.vehicle.dataset}; {drive}"
        return f"synthetic laps stand in: the data set {self.vehicle.dataset} is not at hand; {drive}"

    def scenario(self, *, level: bool = False, earth: Earth | None = None, slip: Slip | None = None) -> Scenario:
        """Return the vehicle's scenario here."""
        return self.vehicle.scenario(self.folder, level=level, earth=earth, slip=slip, duration_s=self.duration_s)


def site(vehicle: Vehicle, quick: bool = False) -> Site:
    """Return where a vehicle drives, the first minutes of it if `quick`; say so if laps stand in."""
    try:
        folder = datasets.fetch(vehicle.dataset)
    except InputError:
        folder = None
    place = Site(vehicle, folder, QUICK_S if quick else None)
    if folder is None:
        say(f"{vehicle.name}: {place.source}")
    return place
