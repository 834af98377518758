"""The files of a package in which every figure that a table rests on stands with its source."""

from __future__ import annotations

from importlib import resources
from typing import TypeVar

from polyins.config import Section, validated
from polyins.config.yaml_document import read_yaml
from polyins.simulation.scenario import Scenario

Said = TypeVar("Said", bound=Section)


def read(model: type[Said], package: str, name: str) -> Said:
    """Return what a file of a package says; paths in it are as they stand."""
    with resources.as_file(resources.files(package) / f"{name}.yaml") as file:
        return validated(model, read_yaml(file))


def scenarios(package: str, name: str) -> dict[str, Scenario]:
    """Return the scenarios of a file of a package, which names several."""
    with resources.as_file(resources.files(package) / f"{name}.yaml") as file:
        return {key: Scenario.model_validate(value) for key, value in read_yaml(file).values.items()}
