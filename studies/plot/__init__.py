"""Figures from a dataset."""

from studies.plot.chart import chart

__all__ = ["chart"]
