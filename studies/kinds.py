"""What a file is by its name and first bytes: a study given for a dataset, or the reverse, is told as such.

Not here: whether it is a good one (`study`, `files`).
"""

from studies.errors import StudyError

SIGNATURES = {
    b"\x89HDF": "dataset",
    b"CDF": "dataset",
    b"\x89PNG": "figure",
    b"%PDF": "figure",
    b"<svg": "figure",
    b"<?xml": "figure",
}
ENDINGS = {".toml": "study"}
MOST_NEEDED = 8
"""First bytes of a file that tell what it is."""
REMEDIES = {
    ("dataset", "study"): "compute it: elastica run {path}",
    ("study", "dataset"): "give its study; elastica check {path} says what is in this",
}


def kind_of(path, start):
    """What a file is.

    Parameters
    ----------
    path : Path
    start : bytes
        Of its content.

    Returns
    -------
    str
        "study", "dataset" or "figure"; empty if nothing tells.
    """
    found = (kind for signature, kind in SIGNATURES.items() if start.startswith(signature))
    return next(found, ENDINGS.get(path.suffix.lower(), ""))


def refuse_other(wanted, path, start):
    """Refuse a file that clearly is something else than the kind that is wanted.

    Raises
    ------
    StudyError
    """
    found = kind_of(path, start)
    if found not in ("", wanted):
        remedy = REMEDIES.get((wanted, found), "give the path of a {wanted}").format(path=path, wanted=wanted)
        raise StudyError(f"{path}: this is a {found}, not a {wanted}; {remedy}")
