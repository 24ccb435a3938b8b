"""Python imports this at its start when the folder is on its path: then one point of every study is poisoned.

`POISON` says what happens at `POISON_POINT` (ends, H, P): crash, hang, leave or raise.
"""

import ctypes
import os
import time

import studies.running.evaluate

ENDS, H, P = os.environ["POISON_POINT"].split()
SEARCH, SOLVE = studies.running.evaluate.search, studies.running.evaluate.solve


def crash():
    ctypes.string_at(0)


def hang():
    while True:
        time.sleep(1)


def leave():
    os._exit(7)


def fail():
    raise ArithmeticError("poison")


DEATHS = {"crash": crash, "hang": hang, "leave": leave, "raise": fail}


def poisoned(names, scene, control, prescribed):
    if "U" in names:
        harm(scene.ends, prescribed, scene.H)
    return SEARCH(names, scene, control, prescribed)


def poisoned_alone(name, **point):
    if name == "U":
        harm(point["ends"], point["P"], point["H"])
    return SOLVE(name, **point)


def harm(ends, given, gaps):
    if str(ends) == ENDS and ((given == float(P)) & (gaps == float(H))).any():
        DEATHS[os.environ["POISON"]]()


studies.running.evaluate.search, studies.running.evaluate.solve = poisoned, poisoned_alone
