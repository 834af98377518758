"""What a check looks at: the recording, and of each IMU what its file says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from polyins.config import Config, ImuEntry
from polyins.config.yaml_document import Document, Key, Setting
from polyins.formats.rows import ImuRows
from polyins.model.recording import ImuStream, Recording
from polyins.model.rig import Imu


@dataclass(frozen=True)
class ImuEvidence:
    """What there is of one IMU."""

    index: int
    """in the configuration"""
    entry: ImuEntry
    imu: Imu
    rows: ImuRows
    """in sensor axes, on its own clock, without those that are no data"""
    stream: ImuStream
    """the same in array axes, on a wheel in the module's, on the recording's clock"""

    @property
    def name(self) -> str:
        """Its name."""
        return self.entry.name

    def setting(self, *keys: Key, value: Any) -> Setting:
        """Return a setting of this IMU."""
        return Setting(("imus", self.index, *keys), value)


@dataclass(frozen=True)
class Evidence:
    """All that was read."""

    config: Config
    document: Document
    imus: tuple[ImuEvidence, ...]
    """that measure"""
    recording: Recording

    @property
    def body(self) -> tuple[ImuEvidence, ...]:
        """Those that do not turn with a wheel."""
        return tuple(one for one in self.imus if one.entry.wheel is None)
