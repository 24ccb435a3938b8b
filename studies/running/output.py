"""The output of a study: what stands there, and whether a dataset can be written there.

Not here: the shards beside it (`shards`), who may write them now (`lock`).
"""

import errno
import json
import os
import shutil
from pathlib import Path

from studies.design.study import Study
from studies.errors import StudyError
from studies.messages import note
from studies.schema import STATES_NOT_COMPUTED
from studies.store.datasets import identify
from studies.store.files import opened, refuse_path, why_unlockable
from studies.store.provenance import now, texts
from studies.store.shards import LONGEST_NAME, folder_of
from studies.system import refuse_windows_path
from studies.whole_files import temporary_beside, temporary_name, written_whole


def is_done(study, out):
    """Whether `out` already holds what this study computes, whatever its texts are there.

    Raises
    ------
    StudyError
        If something else is there, or nothing can be written there.
    """
    out = Path(out)
    folder = out.parent
    if os.path.isdir(out):
        raise StudyError(f"{out}: this is a folder; name a file")
    _refuse_names(out)
    if not folder.is_dir():
        raise StudyError(f"{folder}: there is no such folder; create it or choose another output")
    if out.exists():
        found = identify(out)
        if not _same_results(study, found):
            raise StudyError(f"{out}: this holds another study; choose another output or move it away")
        if {"points_not_computed", STATES_NOT_COMPUTED} & found.keys():
            raise StudyError(
                f"{out}: points of this study, or states there, are not computed here; choose another output "
                "and --reuse this one"
            )
        if found.get("numerics_id") != study.numerics_id:
            raise StudyError(
                f"{out}: this holds the same study by another version of the numerics; choose another "
                "output or move it away"
            )
        return True
    if not os.access(folder, os.W_OK):
        raise StudyError(f"{folder}: this folder cannot be written to; choose another output")
    return False


def _refuse_names(out):
    """Refuse an output beside which not all that a run writes can have a name."""
    refuse_path(out)
    refuse_windows_path(out)
    target = Path(os.path.realpath(out))
    for path in (temporary_name(target), folder_of(target) / LONGEST_NAME):
        try:
            os.lstat(path)
        except OSError as problem:
            if problem.errno == errno.ENAMETOOLONG:
                raise StudyError(
                    f"{out}: this is too long for what a run writes beside it, such as {path.name}; "
                    "choose a shorter output"
                ) from None


def refuse_unwritable(out):
    """Try in the beginning what would else fail in the end: to write a netCDF file beside the output.

    Raises
    ------
    StudyError
        With the reason.
    """
    _refuse_names(out)
    try:
        with temporary_beside(Path(os.path.realpath(out))) as temporary:
            try:
                with opened(temporary, "w"):
                    pass
            except OSError as problem:
                why = f"{problem.strerror or problem}{why_unlockable(temporary)}"
                raise StudyError(f"{out}: netCDF cannot write there ({why})") from None
    except OSError as problem:
        raise StudyError(
            f"{out}: nothing can be written there ({problem.strerror}); choose another output"
        ) from None


def is_settled(study, out):
    """Whether nothing remains to be done: the dataset is there, with its texts, and no shards beside it."""
    return is_done(study, out) and _has_texts(study, out) and not folder_of(out).exists()


def _same_results(study, found):
    """Whether the attributes of a dataset say that it has the results of a study."""
    if found["study_id"] == study.study_id:
        return True
    try:
        return Study.from_dict(json.loads(found["config_json"])).results_id == study.results_id
    except (KeyError, ValueError):
        return False


def _has_texts(study, out):
    return identify(out)["study_id"] == study.study_id


def settle(study, out):
    """Give a finished dataset the name and the texts that its study has now; no value changes."""
    if _has_texts(study, out):
        return
    with written_whole(out) as temporary:
        shutil.copyfile(out, temporary)
        with opened(temporary, "a") as dataset:
            before = texts(Study.from_dict(json.loads(dataset.config_json)))
            for name in before.keys() & set(dataset.ncattrs()) - texts(study).keys():
                dataset.delncattr(name)
            history = f"{getattr(dataset, 'history', '')}\n{now()} name and texts of the study changed"
            dataset.setncatts(texts(study) | {"history": history.lstrip()})
    note(f"{out}: its results are those of this study, whose name and texts it has now")
