"""Measurements that aid the bank, one file each: what they predict, how they depend on the error states."""
