"""The three-point separator as a class: `runout.external` reads and writes the tables."""
import numpy as np

import runout.external


class ThreePoint:
    name = "three-point-in-numpy"

    def separate(self, station):
        sensors, setup = {sensor["id"]: sensor for sensor in station.rig["sensors"]}, station.rig["setups"][0]
        if len(station.sensors) != 3 or len(station.setups) != 1:
            raise ValueError(f"expected 3 sensors and 1 setup, found {len(station.sensors)} and {len(station.setups)}")
        theta = np.radians([sensors[name]["angle_deg"] + setup["sensors_deg"] for name in station.sensors])
        direction = 1 if station.rig["rotation"] == "ccw" else -1
        phase = np.exp(1j * direction * np.outer(station.orders, theta - np.radians(setup["part_deg"])))
        weights = np.sin(np.roll(theta, -2) - np.roll(theta, -1))
        with np.errstate(divide="ignore", invalid="ignore"):
            form = weights / (phase @ weights)[:, None]
            motion = np.linalg.pinv(np.stack([np.cos(theta), np.sin(theta)], 1)) @ (np.eye(3) - phase[:, :, None] * form[:, None, :])
        rows = np.concatenate([form[:, None, :], motion], 1)                                # [order, form x y, sensor]
        rows[~(np.linalg.norm(rows, axis=2) <= station.config.get("max_noise_gain", 30))] = np.nan
        rows[:2] = np.nan                                                                   # order 1 is eccentricity
        found = (rows @ station.readings[0][:, :, None])[:, :, 0]
        found[:, 0] = found[:, 0] if direction > 0 else found[:, 0].conj()
        keys = [("form", sensors[station.sensors[0]]["section"]), "x", "y"]
        values = dict(zip(keys, found.T))
        if station.covariance is None:
            return values
        std = np.sqrt(((rows @ station.covariance[0]) * rows.conj()).sum(2).real)
        return values, dict(zip(keys, std.T))


if __name__ == "__main__":
    runout.external.serve(ThreePoint())
