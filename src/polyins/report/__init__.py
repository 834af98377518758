"""What a run found, as one page that opens in any browser without a network."""

from polyins.report.page import write_report
from polyins.report.scene import Scene

__all__ = ["Scene", "write_report"]
