"""Recordings whose truth is known: a drive, an array of IMUs with errors, a GNSS receiver."""
