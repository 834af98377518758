"""Which IMUs of a rig a method takes, and in which covariance block each of them navigates."""

from __future__ import annotations

from dataclasses import dataclass

from polyins.errors import InputError
from polyins.model.methods import METHODS, Method
from polyins.model.rig import Rig


@dataclass(frozen=True)
class Choice:
    """Indices of IMUs, by block."""

    blocks: tuple[tuple[int, ...], ...]
    """those that navigate: wheels first"""
    speed: tuple[tuple[int, ...], ...] = ()
    """the modules on wheels that give the speed"""

    @property
    def all(self) -> list[int]:
        """Indices of all IMUs that are needed, those that navigate first."""
        own = [i for block in self.blocks for i in block]
        return own + [i for module in self.speed for i in module if i not in own]

    def renumbered(self) -> Choice:
        """Return the same choice among just the IMUs of `all`, in that order."""
        place = {index: number for number, index in enumerate(self.all)}

        def of(groups: tuple[tuple[int, ...], ...]) -> tuple[tuple[int, ...], ...]:
            return tuple(tuple(place[i] for i in group) for group in groups)

        return Choice(of(self.blocks), of(self.speed))


def choose(row: Method, rig: Rig, imu: int = 0) -> Choice:
    """Choose the IMUs of a method; `imu` is the index of the one that `single` takes.

    Raises InputError where the rig lacks what the method needs.
    """
    if row.for_wheels:
        return _modules(row, rig)
    fixed = tuple(i for i, one in enumerate(rig.imus) if one.wheel is None)
    if not fixed:
        raise InputError(f"method: {row.name} needs an IMU on the body; expected one without `wheel` among the imus")
    wheels = tuple(tuple(indices) for indices in rig.modules().values() if _gives_speed(rig, indices))
    if row.bank == "one":
        if not 0 <= imu < len(rig.imus):
            raise InputError(f"imu: {imu} is not an index of {len(rig.imus)} IMUs; they count from 0")
        if imu not in fixed:
            raise InputError(f"imu: {rig.imus[imu].name} is on a wheel; {row.name} takes one on the body")
        return Choice(((imu,),), wheels)
    apart = row.bank == "all" and row.blocks == "each"
    return Choice(tuple((i,) for i in fixed) if apart else (fixed,), wheels)


def _gives_speed(rig: Rig, indices: list[int]) -> bool:
    wheel = rig.imus[indices[0]].wheel
    return wheel is not None and not wheel.steering


def _modules(row: Method, rig: Rig) -> Choice:
    """Choose the modules of a method: those that it names, then in the order of the rig."""
    if not rig.has_wheels:
        raise InputError(f"method: {row.name} needs an IMU on a wheel; expected `wheel` in one of the imus")
    modules = rig.modules()
    members = {name: tuple(indices) for name, indices in modules.items()}
    for name in row.chosen:
        if name not in modules and name not in [imu.name for imu in rig.imus]:
            raise InputError(f"method: {row.name}: {name!r} is no IMU or module; expected one of {', '.join(modules)}")
        for module, indices in modules.items():
            if name != module and name in [rig.imus[i].name for i in indices]:
                members[module] = tuple(i for i in indices if rig.imus[i].name in row.chosen)
    wheels_, bodies = [], []
    for name in sorted(modules, key=lambda name: _rank(name, members[name], row, rig)):
        first = rig.imus[modules[name][0]]
        if first.wheel is None:
            bodies.append(members[name])
        elif not first.wheel.steering or _is_named(name, members[name], row, rig):
            wheels_.append(members[name])
    speed = tuple(wheels_[: row.wheels])
    body = tuple(bodies[: row.bodies])
    _check_enough(row, len(wheels_), len(bodies))
    _check_taken(row, [i for module in (*speed, *body) for i in module], rig)
    return Choice((*speed, *body) if row.wheels_navigate else body, speed)


def _is_named(name: str, indices: tuple[int, ...], row: Method, rig: Rig) -> bool:
    return name in row.chosen or any(rig.imus[i].name in row.chosen for i in indices)


def _rank(name: str, indices: tuple[int, ...], row: Method, rig: Rig) -> int:
    return 0 if _is_named(name, indices, row, rig) else 1


def _check_enough(row: Method, wheels_: int, bodies: int) -> None:
    many = row.wheels > 2
    wanted_wheels, wanted_bodies = (1, 0) if many else (row.wheels, row.bodies)
    if many and wheels_ + bodies < 2:
        raise InputError(f"method: {row.name} needs two modules or more; this rig has {wheels_ + bodies}")
    if wheels_ < wanted_wheels:
        raise InputError(
            f"method: {row.name} needs {wanted_wheels} wheels that do not steer; this rig has {wheels_} with an IMU"
        )
    if bodies < wanted_bodies:
        raise InputError(f"method: {row.name} needs an IMU on the body; expected one without `wheel` among the imus")


def _check_taken(row: Method, taken: list[int], rig: Rig) -> None:
    """Raise InputError for a name that the method has no place for."""
    names = {name for i in taken for name in (rig.imus[i].name, rig.imus[i].module)}
    for word in row.chosen:
        if word not in names:
            wheels_, bodies = ("any" if count > 2 else str(count) for count in (row.wheels, row.bodies))
            raise InputError(
                f"method: {row.name} has no place for {word!r}; "
                f"expected modules on wheels: {wheels_}, on the body: {bodies}"
            )


def available(rig: Rig) -> list[str]:
    """Return the methods with wheels that a rig has the modules for."""
    names = []
    for row in METHODS.values():
        if row.for_wheels:
            try:
                choose(row, rig)
            except InputError:
                continue
            names.append(row.name)
    return names


def usual_method(rig: Rig) -> str:
    """Return the method for a rig unless one is named: the richest up to `triple-ins` with wheels."""
    if not rig.has_wheels:
        return "enav-fusion" if len(rig.imus) > 1 else "single"
    order = ("triple-ins", "body-wheel-ins", "dual-wheel-ins", "wheel-ins")
    known = available(rig)
    return next(name for name in order if name in known)
