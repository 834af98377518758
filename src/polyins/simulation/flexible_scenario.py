"""What a scenario may say of IMUs on steel rulers, and of the ground that shakes them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from polyins.config import NotNegative, Number, Pair, Positive, Section, Triple
from polyins.config.fields import blame
from polyins.model.rig import DEG
from polyins.simulation.cantilever import Cantilever
from polyins.simulation.flexible import FlexibleMount
from polyins.simulation.path import Path, World
from polyins.simulation.road import Bump, Ground, Roughness, WheelContact, ground
from polyins.simulation.shaking import way
from polyins.simulation.shuttle import Way, shuttle_path
from polyins.simulation.tyres import Suspension

Array = NDArray[np.float64]


class Shuttle(Section):
    """To and fro on level ground at one speed."""

    speed_m_s: Positive = 1.2
    """m/s"""
    straight_m: Positive = 36.0
    """length of each straight, m"""
    turn_radius_m: Positive = 1.5
    """of the half turns between them, m"""
    speed_up_s: Positive = 3.0
    """from rest to the speed, s"""
    steer_s: Positive = 1.0
    """from straight ahead to the full turn, and back, s"""
    heading_deg: Number = 0.0
    """of the first straight, deg"""

    @model_validator(mode="after")
    def _steers_within_the_turn(self) -> Self:
        longest = np.pi * self.turn_radius_m / self.speed_m_s
        if self.steer_s > longest:
            raise blame(
                "steer_s", f"is {self.steer_s:g}; expected at most the {longest:.2g} s of a half turn at speed_m_s"
            )
        return self

    def path(self, duration: float, static: float, start: ArrayLike, world: World) -> Path:
        """Return the path."""
        heading = self.heading_deg * DEG
        return shuttle_path(duration, self._way(), static=static, start=start, heading=heading, world=world)

    def straights(self, duration: float, static: float) -> tuple[Array, Array]:
        """Return when the straights begin, s, and after which way, m."""
        return self._way().straights(duration, static)

    def _way(self) -> Way:
        return Way(self.speed_m_s, self.straight_m, self.turn_radius_m, self.speed_up_s, self.steer_s)


class Arm(Section):
    """One ruler with an IMU at its tip. It lies across the robot."""

    tip_m: Triple
    """its tip if it were straight, from the array origin: forward, right, down, m; it points away from the middle"""
    free_length_m: Positive
    """from the clamp to the tip, m"""

    @property
    def side(self) -> float:
        """1: it points to the right; -1: to the left."""
        return -1.0 if self.tip_m[1] < 0.0 else 1.0


class FlexibleMounts(Section):
    """IMUs at the tips of steel rulers."""

    arms: Annotated[tuple[Arm, ...], Field(min_length=1)]
    """one for each IMU; those equally far ahead are the two ends of one ruler"""
    width_m: Positive = 0.03
    """of the rulers, m"""
    thickness_m: Positive = 0.001
    """of the rulers, m"""
    young_gpa: Positive = 200.0
    """Young's modulus, GPa; steel"""
    shear_gpa: Positive = 79.0
    """shear modulus, GPa; steel"""
    density_kg_m3: Positive = 7850.0
    """kg/m^3; steel"""
    tip_mass_kg: Positive = 0.015
    """of a module with its share of the cable, kg"""
    module_height_m: NotNegative = 0.008
    """of the module's mass above the ruler, m"""
    module_width_m: Positive = 0.02
    """m"""
    damping: Positive = 0.02
    """ratio, of bending and torsion"""
    damping_spread: Annotated[Number, Field(ge=0.0, lt=1.0)] = 0.3
    """by which share, at most, the damping of a ruler differs, drawn evenly"""
    tuning_spread: Annotated[Number, Field(ge=0.0, lt=1.0)] = 0.03
    """by which share one end of each ruler, drawn, is tuned higher, the other lower: clamps are off the middle"""
    stiff: bool = False
    """the rulers neither bend nor twist: a rigid array of the same geometry"""

    def mounts(self, rng: np.random.Generator | None = None) -> list[FlexibleMount]:
        """Return the rulers; without a generator as they are meant to be."""
        places = sorted({arm.tip_m[0] for arm in self.arms})
        shift = dict(zip(places, rng.choice([-1.0, 1.0], len(places)) if rng else np.zeros(len(places)), strict=True))
        drawn = rng.uniform(-1.0, 1.0, len(self.arms)) if rng else np.zeros(len(self.arms))
        return [
            FlexibleMount(
                self.beam(arm.free_length_m),
                np.array(arm.tip_m),
                arm.side,
                tuning=1.0 + self.tuning_spread * arm.side * float(shift[arm.tip_m[0]]),
                damping=self.damping * (1.0 + self.damping_spread * float(damping)),
                stiff=self.stiff,
            )
            for arm, damping in zip(self.arms, drawn, strict=True)
        ]

    def beam(self, length: float) -> Cantilever:
        """Return a ruler of a free length, m."""
        return Cantilever(
            length,
            self.width_m,
            self.thickness_m,
            self.tip_mass_kg,
            self.module_height_m,
            self.module_width_m,
            young=self.young_gpa * 1e9,
            shear=self.shear_gpa * 1e9,
            density=self.density_kg_m3,
        )


class Book(Section):
    """Something flat that lies in the way on every straight."""

    at_m: NotNegative
    """where it begins, m along the straight"""
    height_m: Positive
    """m"""
    length_m: Positive = 0.2
    """along the way, m"""
    under: Literal["left", "right", "both"] = "both"
    """which wheels roll over it"""


class Road(Section):
    """The ground, and the robot that rolls over it."""

    roughness_mm: NotNegative = 0.0
    """rms height of the ground in a patch of median roughness, mm"""
    wavelengths_m: Pair = (0.1, 3.0)
    """the shortest and the longest, m"""
    correlation: Annotated[Number, Field(ge=0.0, le=1.0)] = 0.5
    """of the ground under left and right wheels"""
    patch_length_m: Positive = 4.0
    """over which the roughness keeps its size, m"""
    patch_sigma: NotNegative = 0.4
    """std of the logarithm of that size, whose median is `roughness_mm`"""
    books: tuple[Book, ...] = ()
    """on every straight"""
    books_shuffled: bool = False
    """the seed lays them in another order, and draws which of them is under which wheels"""
    wheelbase_m: Positive = 0.45
    """m"""
    track_m: Positive = 0.40
    """from left to right wheels, m"""
    centre_m: Triple = (0.0, 0.0, 0.0)
    """between the four wheels, from the array origin, m"""
    heave_hz: Positive = 12.0
    """natural frequency of the body on its tyres, Hz"""
    pitch_hz: Positive = 13.0
    """Hz"""
    roll_hz: Positive = 12.5
    """Hz"""
    damping: Positive = 0.2
    """ratio, of the heave"""
    tyres_only_push: bool = False
    """a wheel may leave the ground; otherwise tyres are springs that also pull"""
    wheel_radius_m: NotNegative = 0.0
    """of a disc that rolls over the ground's edges, m; 0: every wheel touches the ground below it"""
    envelope_m: NotNegative = 0.08
    """length of a tyre's footprint, over which it levels the ground, m"""

    @model_validator(mode="after")
    def _wavelengths_are_in_order(self) -> Self:
        if not 0.0 < self.wavelengths_m[0] < self.wavelengths_m[1]:
            raise blame("wavelengths_m", f"are {list(self.wavelengths_m)}; expected the shortest, then the longest")
        return self

    @model_validator(mode="after")
    def _has_books_to_shuffle(self) -> Self:
        if self.books_shuffled and not self.books:
            raise blame("books_shuffled", "is true without books; expected some")
        return self

    @model_validator(mode="after")
    def _books_lie_side_by_side(self) -> Self:
        for side in ("left", "right"):
            spans = [
                (book.at_m, end)
                for book, end in zip(self.books, self.book_ends(), strict=True)
                if self.books_shuffled or book.under in (side, "both")
            ]
            for (_, end), (begin, _) in pairwise(sorted(spans)):
                if begin < end:
                    raise blame(
                        "books", f"one begins at {begin:g} m, where another lies until {end:g} m; expected gaps"
                    )
        return self

    def book_ends(self) -> tuple[float, ...]:
        """Return how far each book may reach along the straight, m: any may lie anywhere where they are shuffled."""
        longest = max((book.length_m for book in self.books), default=0.0)
        return tuple(book.at_m + (longest if self.books_shuffled else book.length_m) for book in self.books)

    def suspension(self) -> Suspension:
        """Return the robot's body on its wheels."""
        rates = 2.0 * np.pi * np.array([self.heave_hz, self.pitch_hz, self.roll_hz])
        return Suspension(
            self.wheelbase_m, self.track_m, np.array(self.centre_m), rates, self.damping, self.tyres_only_push
        )

    def ground(self, path: Path, straight_begins: Sequence[float] | Array, rng: np.random.Generator) -> Ground:
        """Draw the ground along a path whose straights begin after the given ways, m."""
        books = self._shuffled(rng) if self.books_shuffled else self.books
        shortest, longest = self.wavelengths_m
        roughness = Roughness(
            self.roughness_mm * 1e-3, shortest, longest, self.correlation, self.patch_length_m, self.patch_sigma
        )
        bumps = [
            Bump(begin + book.at_m, book.length_m, book.height_m, book.under != "right", book.under != "left")
            for begin in straight_begins
            for book in books
        ]
        length = float(way(path, np.linspace(0.0, path.duration, int(path.duration * 100.0) + 1))[-1])
        return ground(length, roughness, bumps, WheelContact(self.wheel_radius_m, self.envelope_m), rng)

    def _shuffled(self, rng: np.random.Generator) -> tuple[Book, ...]:
        """Return the books, each at the place of another one and under the wheels of a third one."""
        count, drawing = len(self.books), rng.spawn(1)[0]  # the ground stays as it is
        laid = zip(self.books, drawing.permutation(count), drawing.permutation(count), strict=True)
        return tuple(
            book.model_copy(update={"at_m": self.books[place].at_m, "under": self.books[side].under})
            for book, place, side in laid
        )
