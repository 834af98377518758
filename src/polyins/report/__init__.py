"""What a run found, as one page that opens in any browser without a network."""

from polyins.report.page import write_report

__all__ = ["write_report"]
