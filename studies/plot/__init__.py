"""Figures from a dataset: `chart`, `bifurcation`, `shapes`; `film` along a path; `save` as PNG, PDF or SVG.

>>> import studies
>>> dataset = studies.open("first-chart.nc")                          # doctest: +SKIP
>>> studies.plot.save(studies.plot.chart(dataset), "chart.pdf")       # doctest: +SKIP
"""

from studies.plot.bifurcation import bifurcation
from studies.plot.chart import chart
from studies.plot.drawing import save
from studies.plot.shapes import film, shapes

__all__ = ["bifurcation", "chart", "film", "save", "shapes"]
