"""What `polyins calibrate` makes of arrays: simulated ones, a quadrotor's, a board of eight, and what it is worth.

The simulated calibration recording is of an array that is laid down in 26 attitudes and shaken by hand, `hand.py`. Its
chips are those of paper A's Group 1, or drawn like them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from polyins.calibration import array
from polyins.calibration.array import fitting_rotation
from polyins.calibration.common_motion import common_motion
from polyins.calibration.configuration import calibrated
from polyins.calibration.estimates import Calibration, nearest_axes
from polyins.config import ImuEntry, parse
from polyins.config.yaml_document import Document, as_document
from polyins.errors import InputError
from polyins.model.recording import Array, ImuStream, Recording
from polyins.model.rig import DEG, Imu, NoiseGrade, Rig
from polyins.reading import datasets
from polyins.reading.imu_stream import as_mounted, mapped, mount_rotation, to_array_axes
from polyins.simulation.error_scenario import SensorErrors
from polyins.simulation.hand import turned_by_hand
from polyins.simulation.increments import increments
from polyins.simulation.run import Simulation, TrueRun, record, true_run
from polyins.simulation.scenario import Board, Scenario
from polyins.studies import flights, rigid_array
from polyins.studies.chips import Chips, draw_chips
from polyins.studies.progress import Steps

SEEDS = (1, 3, 5, 7, 9, 11, 13, 15)
QUICK_SEEDS = (1,)
RATE_HZ = 100.0
METHODS = ("imu-fusion", "enav-fusion")
SINGLES = (0, 4, 8, 12)
"""IMUs of 16 that stand for all"""
LAB = {"single": 6.98, "uncompensated": 4.25, "compensated": 1.92}
"""m: paper A's lab, Group 1, an IMU-level array before and after its turntable; see the data set's README"""
HAND_SEED = 101
"""of the recording by hand: on another day than the drive"""
OTHER_SIDE = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""from the axes of the chips below MIMU4444's board to those of the chips above"""
MIMU_INTERVAL = 0.016  # s
NEAR_DEG = 0.15
"""within which the mounts of a flight are those of the study of all flights"""

Figures = dict[str, Any]


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> Figures:
    """Calibrate them all and return the document; the real ones are null where the data sets are not at hand.

    `quick` takes one simulated array, every eighth flight, and the first eleven outages.
    """
    steps = Steps(progress, 10)
    simulated = {name: _inside(name, QUICK_SEEDS if quick else SEEDS) for name in ("as modelled", "all errors")}
    steps.next(3)(1.0)
    quadrotor = _at_hand(lambda: fly(8 if quick else 1))
    steps.next(2)(1.0)
    mimu = _at_hand(find_eight)
    steps.next(1)(1.0)
    worth = outages(quick, steps.next(4))
    return {
        "target": "calibration",
        "paper": {"outages_m": LAB},
        "polyins": {"simulated": simulated, "quadrotor": quadrotor, "mimu4444": mimu, "outages_m": worth},
        "settings": {
            "simulated": "16 chips drawn like Group 1's, 26 attitudes of 3 s and 40 s of shaking at 100 Hz",
            "seeds": list(QUICK_SEEDS if quick else SEEDS),
            "track": rigid_array.provenance(),
        },
    }


def _at_hand(study: Callable[[], Figures]) -> Figures | None:
    try:
        return study()
    except InputError:
        return None


def by_hand(seed: int, errors: SensorErrors, count: int = 16) -> Simulation:
    """Return a recording of an array that is turned by hand, and its truth; gravity is given."""
    path = turned_by_hand(np.random.default_rng(seed))
    scenario = Scenario(
        name="turned by hand",
        duration_s=path.duration,
        static_s=path.static,
        rate_hz=RATE_HZ,
        gnss=None,
        outages=(),
        imus=Board(count=count, pitch_m=0.01),
        errors=errors,
    )
    simulation = record(TrueRun(scenario, path, increments(path, RATE_HZ), (), ()), seed=seed)
    gravity = float(path.world.gravity(path.position(np.zeros(1)))[0])
    options = replace(simulation.recording.options, gravity=gravity)
    return replace(simulation, recording=replace(simulation.recording, options=options))


def settings_by_calibration(recording: Recording, calibration: Calibration) -> tuple[ImuEntry, ...]:
    """Return the IMUs as the configuration has them that `polyins calibrate` writes, from one that knows nothing."""
    values = {"imus": [{"name": imu.name, "file": f"{imu.name}.parquet"} for imu in recording.rig.imus]}
    place = Path("calibration.yaml")
    text = calibrated(values, parse(Document(place, values)), calibration)
    return parse(as_document(place, text)).imus


def without_knowledge(recording: Recording) -> tuple[Recording, tuple[ImuEntry, ...]]:
    """Return the recording with nothing known of places and mounts, and such a configuration's IMUs."""
    imus = tuple(replace(imu, position=np.zeros(3), rotation=np.eye(3)) for imu in recording.rig.imus)
    entries = tuple(ImuEntry(name=imu.name, file="none") for imu in imus)
    return replace(recording, rig=replace(recording.rig, imus=imus)), entries


def _inside(name: str, seeds: Sequence[int]) -> Figures:
    """Return which share of all settings is inside 1 and 3 std of the truth, by setting."""
    every: dict[str, list[Array]] = {}
    for seed in seeds:
        chips = draw_chips(16, np.random.default_rng([seed, 20602]))
        errors = SensorErrors(scales=False, chips=chips)
        if name == "all errors":
            errors = rigid_array.base_scenario(True).errors.model_copy(update={"chips": chips})
        for key, values in deviations(by_hand(seed, errors)).items():
            every.setdefault(key, []).append(values)
    pooled = {key: np.abs(np.concatenate(values)) for key, values in every.items()}
    whole = np.concatenate(list(pooled.values()))
    return {
        "inside_3_std": float(np.mean(whole < 3.0)),
        "inside_1_std": float(np.mean(whole < 1.0)),
        "settings": len(whole),
        "by_setting": {key: float(np.mean(values < 3.0)) for key, values in pooled.items()},
    }


def deviations(simulation: Simulation) -> dict[str, Array]:
    """Calibrate a simulated array of which nothing is known, and return what the settings are off, in std.

    The array's axes are the calibration's: the true ones turned by what all gyros have in common.
    """
    known, entries = without_knowledge(simulation.recording)
    calibration = array.calibrate(known, entries)
    found = {name: {one.key: one for one in estimates} for name, estimates in calibration.imus.items()}
    gyros = np.array([np.linalg.inv(errors.gyro_response) for errors in simulation.errors])
    accels = np.array([np.linalg.inv(errors.accel_response) for errors in simulation.errors])
    frame = _frame(found, gyros)
    moved = common_motion(known.imus)
    rates = moved.smoothed(np.einsum("nij,tnj->ti", gyros, moved.rate) / len(gyros), moved.instants)
    turning = frame @ np.cov(rates.T) @ frame.T
    places = np.array([imu.position for imu in simulation.recording.rig.imus])
    places = (places - places.mean(axis=0)) @ frame.T
    time = np.arange(0.0, simulation.path.duration, 0.5)
    result: dict[str, list[Array]] = {}
    for i, settings in enumerate(found.values()):
        gyro, accel = frame @ gyros[i], frame @ accels[i]
        rotation = fitting_rotation(gyro, turning)
        bias = simulation.errors[i].at(time).mean(axis=0)
        truth = {
            "mount_deg": array.euler_deg(rotation),
            "gyro_matrix": (rotation.T @ gyro).ravel(),
            "accel_matrix": (rotation.T @ accel).ravel(),
            "position_m": places[i],
            "clock_offset_s": np.zeros(1),
            "initial_errors.gyro_bias_deg_s": gyro @ bias[:3] / DEG,
            "initial_errors.accel_bias_m_s2": accel @ bias[3:6],
        }
        for key, true in truth.items():
            off = np.array(settings[key].value) - true
            result.setdefault(key, []).append(off / np.array(settings[key].std))
    return {key: np.concatenate(values) for key, values in result.items()}


def _frame(found: Mapping[str, Mapping[str, Any]], gyros: Array) -> Array:
    """Return the rotation from the true axes to the calibration's."""
    products = [
        mount_rotation(settings["mount_deg"].value)
        @ np.reshape(settings["gyro_matrix"].value, (3, 3))
        @ np.linalg.inv(true)
        for settings, true in zip(found.values(), gyros, strict=True)
    ]
    left, _, right = np.linalg.svd(np.mean(products, axis=0))
    return np.asarray(left @ right)


def fly(every: int) -> Figures:
    """Calibrate the quadrotor's array on each flight from nothing, and judge it on the next one.

    What is known of the array comes from a study of all flights: mounts to 0.1 deg, places to 1 mm.
    """
    folder = datasets.fetch("quadrotor")
    rows = flights.list_flights(folder)[::every]
    recordings = [flights.flight(folder, row) for row in rows]
    mounts, places, before, after = [], [], [], []
    for recording, judge in zip(recordings, [*recordings[1:], recordings[0]], strict=True):
        turned = _sensor_axes(recording)
        known, entries = without_knowledge(turned)
        calibration = array.calibrate(known, entries)
        found = {name: {one.key: one for one in estimates} for name, estimates in calibration.imus.items()}
        mounts.append(_off_mounts(found, recording.rig.imus))
        places.append(_off_places(found, recording.rig.imus))
        own = settings_by_calibration(known, calibration)
        entry_streams = [_applied(stream, entry) for stream, entry in zip(_sensor_axes(judge).imus, own, strict=True)]
        before.append(_disagreement(_sensor_axes(judge).imus))
        after.append(_disagreement(entry_streams))
    off_mounts, off_places = np.array(mounts), 1e3 * np.array(places)
    near = np.abs(off_mounts).max(axis=(1, 2)) < NEAR_DEG
    return {
        "flights": len(rows),
        "mounts_near": int(near.sum()),
        "mount_deg": _sizes(off_mounts),
        "position_mm": _sizes(off_places),
        "median_of_flights": {
            "mount_deg": float(np.abs(np.median(off_mounts, axis=0)).max()),
            "position_mm": float(np.abs(np.median(off_places, axis=0)).max()),
        },
        "next_flight_deg_s": {"raw": float(np.median(before)), "calibrated": float(np.median(after))},
    }


def _sizes(off: Array) -> dict[str, float]:
    """Return median over the flights of the largest value, and the largest of all; shape (F, N, 3)."""
    worst = np.abs(off).max(axis=(1, 2))
    return {"median": float(np.median(worst)), "largest": float(worst.max())}


def _sensor_axes(recording: Recording) -> Recording:
    """Return the recording with the streams in forward-right-down of each sensor: axes known, mounts not."""
    streams = []
    for imu, stream in zip(recording.rig.imus, recording.imus, strict=True):
        back = imu.rotation.T
        mount = nearest_axes(imu.rotation) @ back
        streams.append(replace(stream, dtheta=mapped(mount, stream.dtheta), dvel=mapped(mount, stream.dvel)))
    return replace(recording, imus=tuple(streams))


def _off_mounts(found: Mapping[str, Mapping[str, Any]], imus: Sequence[Imu]) -> Array:
    """Return by what mounts are off that are known up to their mean, deg, shape (N, 3)."""
    from scipy.spatial.transform import Rotation

    off = [
        Rotation.from_matrix(mount_rotation(found[imu.name]["mount_deg"].value) @ _mount(imu).T).as_rotvec(degrees=True)
        for imu in imus
    ]
    return np.asarray(np.array(off) - np.mean(off, axis=0))


def _mount(imu: Imu) -> Array:
    return np.asarray(imu.rotation @ nearest_axes(imu.rotation).T)


def _off_places(found: Mapping[str, Mapping[str, Any]], imus: Sequence[Imu]) -> Array:
    """Return by what places are off, m, shape (N, 3)."""
    off = np.array([np.array(found[imu.name]["position_m"].value) - imu.position for imu in imus])
    return np.asarray(off - off.mean(axis=0))


def _applied(stream: ImuStream, entry: ImuEntry) -> ImuStream:
    """Return a stream in the sensor's axes as a configuration has it read."""
    gyro, accel = to_array_axes(entry)
    time = stream.time + entry.clock_offset_s
    bias = np.array(entry.initial_errors.gyro_bias_deg_s) * DEG * np.median(np.diff(time))
    return ImuStream(stream.name, time, mapped(gyro, stream.dtheta) - bias, mapped(accel, stream.dvel))


def _disagreement(streams: Sequence[ImuStream]) -> float:
    """Return how far rates differ from their mean, rms, smoothed, median over time, deg/s."""
    moved = common_motion(streams)
    rate = moved.smoothed(moved.rate, moved.instants)
    off = rate - rate.mean(axis=1, keepdims=True)
    return float(np.sqrt(np.median(np.mean(np.sum(off**2, axis=2), axis=1))) / DEG)


def find_eight() -> Figures:
    """Find mounts and places of MIMU4444's chips, each in axes of its own; those below the board are turned over."""
    data = np.load(datasets.fetch("mimu4444") / "mimu4444_exp4.npz")
    recording = mimu4444(data, own_axes=True)
    calibration = array.calibrate(recording, [ImuEntry(name=imu.name, file="none") for imu in recording.rig.imus])
    entries = settings_by_calibration(recording, calibration)
    rotations = [as_mounted(entry).rotation for entry in entries]
    off = [rotation @ (np.eye(3), OTHER_SIDE)[k % 2].T for k, rotation in enumerate(rotations)]
    angles = [float(np.degrees(np.arccos(min(1.0, (np.trace(one) - 1.0) / 2.0)))) for one in off]
    places = np.array([entry.position_m for entry in entries])
    nominal = data["pos_nominal_m"].astype(float)
    places, nominal = (values - values[::2].mean(axis=0) for values in (places, nominal))
    return {
        "axes": {entry.name: list(entry.axes) for entry in entries},
        "mount_off_deg": angles,
        "position_off_mm": (1e3 * np.linalg.norm(places - nominal, axis=1)).tolist(),
        "poses": calibration.poses,
        "agreement": {
            name: {"gyro_deg_s": one.gyro / DEG, "accel_m_s2": one.accel} for name, one in calibration.agreement.items()
        },
    }


def mimu4444(data: Mapping[str, Array], own_axes: bool) -> Recording:
    """Return the recording without the saturated rows; `own_axes`: in each chip's axes, not in the board's."""
    time, grade = data["t"], ImuEntry(name="any", file="none")
    steps = np.diff(time, prepend=time[0] - MIMU_INTERVAL)[:, None]
    streams = []
    for k in range(8):
        turn = OTHER_SIDE if own_axes and k % 2 else np.eye(3)
        good = np.logical_not(data["saturated"][:, k])
        rates = [mapped(turn, data[name][:, k].astype(float)) * steps for name in ("gyro", "acc")]
        streams.append(ImuStream(f"imu{k + 1}", time[good], rates[0][good], rates[1][good]))
    noise: NoiseGrade = as_mounted(grade).noise
    return Recording(Rig(tuple(Imu(stream.name, noise) for stream in streams)), tuple(streams), geodetic=False)


def outages(quick: bool, progress: Callable[[float], None] | None = None) -> Figures:
    """Return the errors in outages of paper A's simulated array, raw, calibrated by hand and by known matrices, m.

    `raw` is told how far the chips may be off, `raw, told 250 mGal` what the lab's file says.
    """
    scenario = rigid_array.base_scenario(quick)
    chips = rigid_array.group_chips(1, scenario.imus.count)
    errors = scenario.errors.model_copy(update={"chips": chips})
    raw = rigid_array.recording_of(rigid_array.with_errors(true_run(scenario), errors), 1)
    known, entries = without_knowledge(by_hand(HAND_SEED, errors, scenario.imus.count).recording)
    entries = settings_by_calibration(known, array.calibrate(known, entries))
    recordings = variants(raw, entries, chips)
    steps = Steps(progress, len(recordings))
    return {name: _drift(one, steps.next()) for name, one in recordings.items()}


def _drift(recording: Recording, progress: Callable[[float], None]) -> dict[str, float]:
    """Return each method's rms of the maximum errors, m; of `single` over some of the IMUs."""
    singles = [rigid_array.maxima(recording, "single", imu=i) for i in SINGLES]
    progress(0.5)
    arrays = {method: rigid_array.rms(rigid_array.maxima(recording, method)) for method in METHODS}
    progress(1.0)
    return {"single": rigid_array.rms(np.array(singles)), **arrays}


def variants(raw: Recording, entries: Sequence[ImuEntry], chips: Chips) -> dict[str, Recording]:
    """Return a recording raw, as a configuration has it read, and corrected by the known calibrations."""
    imus = []
    streams = []
    for imu, stream, entry in zip(raw.rig.imus, raw.imus, entries, strict=True):
        gyro, accel = to_array_axes(entry)
        streams.append(replace(stream, dtheta=mapped(gyro, stream.dtheta), dvel=mapped(accel, stream.dvel)))
        found = as_mounted(entry)
        imus.append(replace(found, noise=imu.noise))
    return {
        "raw": raw,
        "raw, told 250 mGal": rigid_array.unaware(raw),
        "calibrated by hand": replace(raw, rig=replace(raw.rig, imus=tuple(imus)), imus=tuple(streams)),
        "known matrices": rigid_array.compensated(raw, chips),
    }
