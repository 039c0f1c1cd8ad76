"""Default seeds of the unseen trajectories of the benchmarks that measure other things than the
validation does.

Each has its own, so that no figure depends on motions by which another one was chosen:
``slide-fmu validate`` and ``run`` draw with 20260000 and, beyond the range, 20260001; so do
``seed_study.py`` and ``paper_protocol.py``, to compare with the released FMUs. The splits
of the recipes' data have the seeds 20261 to 20264, and other streams of them too. A benchmark
that draws beyond the range does so with the next seed, so seeds are a hundred apart.

``UNPREPARED`` is the seed with which these kinds and models came, before any figure was known.

``decay_times.py``, ``robot_accuracy.py``, ``slider_crank_accuracy.py`` and
``socket_mesh_study.py`` draw motions of their own, from plain generators and no recipe;
``wiener_hammerstein.py`` has a record.
"""

from __future__ import annotations

PAPER_SEGMENTS = 20_260_100
ESTIMATE_SPANS = 20_260_300
STRUCTURES = 20_260_500
SPEED_UP = 20_260_600
COMPARE_FMUS = 20_260_700
WHOLE_RECORDS = 20_260_900
CHOSEN_MOTIONS = 20_261_000
CORRECTED_PATHS = 20_261_100
FURTHER_KINDS = 20_261_200
USER_KINDS = 20_261_300
HELD_BETWEEN = 20_261_400
HELD_ANYTIME = 20_261_500
DERIVATIVE_CHECK = 20_261_600
UNPREPARED = 11
