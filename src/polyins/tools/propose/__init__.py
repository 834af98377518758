"""Configurations proposed for recordings that nobody has described: one file per part of them."""
