"""A study of four blocks, and how it is computed here."""

from studies import Study
from studies.running.session import Policy

STUDY = Study.from_dict(
    {
        "study": {"name": "tiny"},
        "grid": {"ends": ["clamped-clamped"], "H": [0.05, 0.1], "P": [1.5, 3.0]},
        "states": {"names": ["0", "U"]},
    }
)
PLAN = STUDY.plan(block_points=1)
HERE, PART = Policy(workers=0), Policy(workers=0, part=(1, 2))


def names(folder):
    return {path.name for path in folder.iterdir()}
