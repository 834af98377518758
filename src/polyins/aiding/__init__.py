"""Measurements that aid the bank, one file each: what they predict and how they depend on the error states.

`kinds` is their table.
"""
