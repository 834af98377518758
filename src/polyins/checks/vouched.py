"""What a user vouches for: judgements that would refuse data, and are noted instead."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager

from polyins.errors import ImplausibleError


@contextmanager
def vouched(accept: Collection[str], texts: list[str]) -> Iterator[None]:
    """Turn a refusal of one of the kinds in `accept` into a text; any other is raised."""
    try:
        yield
    except ImplausibleError as refusal:
        if refusal.kind not in accept:
            raise
        texts.append(f"{refusal} (accepted)")
