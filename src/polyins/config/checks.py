"""What the user vouches for."""

from __future__ import annotations

from typing import Literal

from polyins.config.fields import Section

Judgement = Literal[
    "axes",
    "delay",
    "disagreement",
    "height datum",
    "jitter",
    "leap seconds",
    "lever arm",
    "mount",
    "noise",
    "sampling",
    "saturation",
    "stuck",
    "twice",
    "undersampled",
    "units",
    "wrap",
]
"""kinds of findings that are judged from data"""


class Checks(Section):
    """Which judgements of the data do not count."""

    accept: tuple[Judgement, ...] = ()
    """kinds of findings that the user vouches for: data are not refused for them, and what is found is a note"""
