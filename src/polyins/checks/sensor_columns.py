"""The columns of a sensor in another order and with other signs."""

from __future__ import annotations

import numpy as np

from polyins.checks.evidence import ImuEvidence
from polyins.config.yaml_document import Setting
from polyins.model.recording import Array


def renamed(one: ImuEvidence, sensor: str, axes: Array) -> tuple[Setting, ...]:
    """Return the settings that take for a sensor's x, y, z what `axes`, a signed permutation, makes of them.

    `sensor`: gyro or accel. Nothing where the configuration does not name columns.
    """
    if one.entry.columns is None:
        return ()
    columns = one.entry.columns.gyro if sensor == "gyro" else one.entry.columns.accel
    order = np.argmax(np.abs(axes), axis=1)
    signs = axes[np.arange(3), order]
    names = [columns.names[k] for k in order]
    scale = [float(signs[row] * columns.scale[k]) for row, k in enumerate(order)]
    found = [one.setting("columns", sensor, "names", value=names)]
    if tuple(scale) != columns.scale:
        found.append(one.setting("columns", sensor, "scale", value=scale))
    return tuple(found)
