"""Configurations for the trials of the data set WID: a car with IMUs on its wheels and body.

They are put together from the folder's `calibration.yaml`, whose comments say what its values mean.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from polyins.config.yaml_document import Document, read_yaml
from polyins.errors import InputError
from polyins.files import find
from polyins.formats.columns import read_columns

Values = dict[str, Any]

LATE_ROWS = 5
"""a new position is in all rows from that many after its epoch on"""
AFTER_MOTION_S = 1.0
MEAN_START_S = 3.0
"""the reference's zero is the median over so long before the start"""
POSITION_STD_M = 0.05
VELOCITY_STD_M_S = 0.05
GNSS_STD_M = 0.1
"""where the calibration does not say it"""
TURN_ON_STD_DEG_S = 3.0
"""of gyro biases that no standstill has shown; the data set's README: "constant turn-on biases up to 3.4 deg/s"."""
HOUR = 3600.0


def configuration(folder: Path, trial: str, gnss: bool = False) -> Values:
    """Return the polyins configuration of a trial, by its number such as `08`; file names count from the folder.

    Positions are on a local plane whose zero is the middle of the rear axle at the start. With `gnss` the receiver's
    positions aid the filter; without them it is dead reckoning. Raises InputError for a trial that the folder has not.
    """
    calibration = read_yaml(folder / "calibration.yaml")
    number = trial.removeprefix("trial")
    trials = calibration.values.get("trials", {})
    if number not in trials:
        known = ", ".join(f"trial{name}" for name in trials)
        raise InputError(f"{calibration.path}: no trial {trial!r}; expected one of {known}")
    try:
        return _Trial(folder, number, calibration).values(gnss)
    except KeyError as error:
        raise InputError(f"{calibration.path}: trial {number} needs the key {error}; expected it as in WID") from error


class _Trial:
    """One trial being described."""

    def __init__(self, folder: Path, number: str, calibration: Document) -> None:
        self.folder, self.number = folder, number
        self.constants = calibration.values
        self.trial: Values = self.constants["trials"][number]
        self.antenna = [float(value) for value in self.constants["vehicle"]["gnss_antenna_v"]]
        self.begin = float(self.trial["start_t_mru_s"])

    def values(self, gnss: bool) -> Values:
        body = self.constants["body"]
        imus = [self._wheel_imu(name) for name in self.constants["wheels"] if name.startswith("IMU")]
        imus.append(self._body_imu(body))
        kept = [imu for imu in imus if self._has(imu["file"])]
        values = {
            "name": f"WID, trial {self.number}",
            "dataset": "wid",
            "imus": kept,
            "reference": self._reference(),
            "start": self._start(),
            "filter": {"gravity_m_s2": self.constants["format"]["gravity_mps2"]},
        }
        return values | ({"gnss": self._gnss()} if gnss else {})

    def _has(self, file: str) -> bool:
        return any((self.folder / name).is_file() for name in (file, f"{file}.gz"))

    def _imu(self, name: str) -> Values:
        groups = {imu: group for group in (1, 2) for imu in self.constants["format"][f"clock_group{group}"]}
        return {
            "name": name,
            "file": f"trial{self.number}/{name}.csv",
            "format": "xsens-dot",
            "clock_offset_s": self.trial[f"t_mru_minus_t_group{groups[name]}_s"],
        }

    def _wheel_imu(self, name: str) -> Values:
        chip, wheel = self.constants["wheels"][name], self.constants["wheels"][name.removesuffix("_radial")]
        right = "right" in chip["place"]
        x, y = (round(1e-3 * value, 6) for value in chip["imu_pos_from_axle_mm"])
        return self._imu(name) | {
            "wheel": {
                "radius_m": round(self._radius(chip, wheel), 6),
                "side": "right" if right else "left",
                "spin_axis": "z" if right else "-z",
                "tilt_deg": chip["spin_tilt_deg"],
                # the module's y and z are the sensor's x and y on the right and the other way round on the left
                "lever_arm_m": [0.0, -x, -y] if right else [0.0, -y, -x],
                "steering": bool(wheel.get("steering", False)),
            },
            "position_m": chip.get("pos_v", wheel["pos_v"]),
            "noise": self._noise(spins=True),
            "initial_std": self._initial_std("init_ab_spin_axis", "init_ab_wheel", "init_gs_spin"),
        }

    def _radius(self, chip: Values, wheel: Values) -> float:
        """Return the radius that fits the chip's own gyro, from that of the wheel's other chip if need be."""
        if "radius_eff" in chip:
            return float(chip["radius_eff"])
        return float(wheel["radius_eff"] * (1.0 + chip["gyro_scale_spin"]) / (1.0 + wheel["gyro_scale_spin"]))

    def _body_imu(self, body: Values) -> Values:
        euler = body["C_b_v_euler_deg"]
        return self._imu(body["file"]) | {
            "axes": [sign + axis for sign, axis in re.findall(r"=\s*(-?)([xyz])s", body["perm_frd"])],
            "mount_deg": [euler[name] for name in ("roll", "pitch", "yaw")],
            "position_m": body["pos_v"],
            "noise": self._noise(spins=False),
            "initial_std": self._initial_std("init_ab_body", "init_ab_body", "init_gs"),
        }

    def _noise(self, spins: bool) -> Values:
        used = self.constants["noise"]["filter_used"]
        ppm = 1e6 * used["gs"]
        return {
            "angle_random_walk_deg_sqrt_h": used["arw_deg_sqrt_h"],
            "velocity_random_walk_m_s_sqrt_h": used["vrw_mps_sqrt_h"],
            "gyro_bias_deg_h": used["gb_deg_h"],
            "accel_bias_mgal": round(1e5 * used["ab_mps2"], 6),
            "gyro_scale_ppm": [round(1e6 * used["gs_spin"] if spins else ppm, 6), round(ppm, 6), round(ppm, 6)],
            "accel_scale_ppm": round(1e6 * used["as"], 6),
            "correlation_time_h": used["tau_s"] / HOUR,
        }

    def _initial_std(self, accel_x: str, accel_yz: str, scale_x: str) -> Values:
        used = self.constants["noise"]["filter_used"]
        scales = [1e6 * used[scale_x], 1e6 * used["init_gs"], 1e6 * used["init_gs"]]
        return {
            "gyro_bias_deg_s": TURN_ON_STD_DEG_S,
            "accel_bias_m_s2": [used[accel_x], used[accel_yz], used[accel_yz]],
            "gyro_scale_ppm": [round(scale, 6) for scale in scales],
        }

    def _reference(self) -> Values:
        return {
            "file": f"trial{self.number}/reference.csv",
            "format": "table",
            "columns": {
                "time": {"name": "time_s"},
                "position": {
                    "names": ["antenna_north_m", "antenna_east_m", "antenna_height_m"],
                    "frame": "north-east-up",
                },
                "heading": {"name": "heading_deg"},
                "valid": "usable",
            },
            "point_m": self.antenna,
        }

    def _start(self) -> Values:
        still = [window for window in self.trial["static_t_mru_s"] if window[1] <= self.begin + 1e-6]
        values = {
            "time_s": self.begin,
            "end_time_s": self._end(),
            "position": {"north_m": 0.0, "east_m": 0.0},
            "velocity_m_s": [0.0, 0.0, 0.0],
            "heading_deg": self.trial["start_heading_deg"],
            "heading_from": "value",
            "position_std_m": POSITION_STD_M,
            "velocity_std_m_s": VELOCITY_STD_M_S,
            "attitude_std_deg": self.constants["noise"]["filter_used"]["init_att_deg"],
        }
        return values | ({"static_interval_s": still[-1]} if still else {})

    def _end(self) -> float:
        """Return a second after the last motion, s."""
        last = float(self.trial["static_t_mru_s"][-1][0])
        covered = float(self.trial["imu_span_t_mru_s"][1])
        return min(last + AFTER_MOTION_S, covered) if last > self.begin else covered

    def _gnss(self) -> Values:
        """Take one row per epoch; the plane's zero is that of the reference."""
        phase, rate = int(self.trial["gnss_epoch_phase_rows"]), float(self.constants["format"]["gnss_rows_per_s"])
        every = round(rate / self.constants["format"]["gnss_position_rate_hz"])
        std = self._gnss_std()
        return {
            "file": f"trial{self.number}/GNSS.csv",
            "format": "table",
            "columns": {
                "rows": {"first": phase + LATE_ROWS + 1, "every": every, "rate_hz": rate},
                "position": {"names": ["Lat_GNSS", "Long_GNSS", "Height_GNSS"]},
            },
            "clock_offset_s": -LATE_ROWS / rate,
            "antenna_position_m": self.antenna,
            "position_std_m": [std, std, 2.0 * std],
            "plane_origin": self._plane_origin(phase, every, rate),
        }

    def _gnss_std(self) -> float:
        found = re.search(r"([\d.]+)(?:-([\d.]+))? (c?m) rms", self.trial.get("gnss_quality", ""))
        if not found:
            return GNSS_STD_M
        return float(found[2] or found[1]) * (0.01 if found[3] == "cm" else 1.0)

    def _plane_origin(self, phase: int, every: int, rate: float) -> Values:
        """Return where the middle of the rear axle is at the start: the antenna's median, less its lever arm."""
        from pymap3d import ned2geodetic

        path = find(self.folder / f"trial{self.number}" / "GNSS.csv")
        _, columns = read_columns(path, ["Lat_GNSS", "Long_GNSS", "Height_GNSS"])
        rows = np.column_stack(columns)[phase + LATE_ROWS :: every]
        time = (phase + every * np.arange(len(rows))) / rate
        antenna = np.median(rows[(time > self.begin - MEAN_START_S) & (time <= self.begin)], axis=0)
        heading = np.radians(self.trial["start_heading_deg"])
        forward, right, down = self.antenna
        north = forward * np.cos(heading) - right * np.sin(heading)
        east = forward * np.sin(heading) + right * np.cos(heading)
        latitude, longitude, _ = ned2geodetic(-north, -east, -down, *antenna)
        return {
            "latitude_deg": round(float(latitude), 9),
            "longitude_deg": round(float(longitude), 9),
            # heights of the reference count from the antenna's
            "height_m": round(float(antenna[2]), 3),
        }
