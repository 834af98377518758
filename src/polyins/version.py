"""The version of polyins."""

__version__ = "0.1.0"
