"""Compiled numerics on plain float64 arrays: earth, attitude, strapdown, error state, Kalman update.

A bank of IMUs lives in a float64 array of shape (blocks, `bank.SIZE`). One block holds eight IMUs, one per lane, so
that every formula is a loop of constant length over lanes that the compiler turns into vector instructions. Lanes
without an IMU hold an identity attitude and weight 0. A covariance block, what drives it and the fused state of the
IMUs that share it live in one row of an array of shape (groups, `share.SIZE`).
"""
