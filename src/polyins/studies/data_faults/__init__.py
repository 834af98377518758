"""Faults injected into good recordings, and whether `check` names each one and puts it right."""
