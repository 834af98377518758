"""The tables and figures of both papers as targets, which the command line finds by entry point."""

from __future__ import annotations

from polyins.studies.target import Target

ARRAY, ROBOT, CAR = "whu-array", "whu-robot", "whu-car"

TARGETS = (
    Target("a1", "polyins_papers.a1:reproduce", "paper A, Table I and II"),
    Target("a2", "polyins_papers.a2:reproduce", "paper A, Table II"),
    Target(
        "a3", "polyins_papers.a3:reproduce", "paper A, Table III", datasets=(ARRAY,), pictures=True, seconds=(13, 240)
    ),
    Target("a4", "polyins_papers.a4:reproduce", "paper A, Table IV", alone=True),
    Target("a5", "polyins_papers.a5:reproduce", "paper A, Table V", pictures=True, seconds=(28, 2600)),
    Target("a6", "polyins_papers.a6:reproduce", "paper A, Table VI", seconds=(7, 180)),
    Target("afig3", "polyins_papers.afig3:reproduce", "paper A, Fig. 3", pictures=True, seconds=(9, 120)),
    Target("afig6", "polyins_papers.afig6:reproduce", "paper A, Fig. 6", pictures=True),
    Target("afig7", "polyins_papers.afig7:reproduce", "paper A, Fig. 7", pictures=True),
    Target("afig8", "polyins_papers.afig8:reproduce", "paper A, Fig. 8", datasets=(ARRAY,), pictures=True),
    Target("b4", "polyins_papers.b4:reproduce", "paper B, Table IV", datasets=(ROBOT,)),
    Target("b5", "polyins_papers.b5:reproduce", "paper B, Table V", datasets=(ROBOT,)),
    Target("b6", "polyins_papers.b6:reproduce", "paper B, Table VI", datasets=(ROBOT, CAR), seconds=(23, 700)),
    Target("b7", "polyins_papers.b7:reproduce", "paper B, Table VII", datasets=(ROBOT,), seconds=(38, 180)),
    Target("b8", "polyins_papers.b8:reproduce", "paper B, Table VIII", seconds=(5, 40), alone=True),
    Target("bfig7", "polyins_papers.subsystems:bfig7", "paper B, Fig. 7", datasets=(ROBOT,), pictures=True),
    Target("bfig8", "polyins_papers.subsystems:bfig8", "paper B, Fig. 8", datasets=(ROBOT,), pictures=True),
    Target("bfig9", "polyins_papers.subsystems:bfig9", "paper B, Fig. 9", datasets=(ROBOT,), pictures=True),
    Target("bfig10", "polyins_papers.bfig10:reproduce", "paper B, Fig. 10", datasets=(ROBOT,), pictures=True),
)
