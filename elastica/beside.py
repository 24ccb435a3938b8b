"""PyElastica, whose import name is `elastica` too: whether it is installed where this package can be found.

`pip` puts both into one folder in silence. Then the files of either may be hidden or overwritten.
"""

import os
import sys
import warnings

MARK = "rod"
"""A folder of PyElastica that this package does not have; looking for it takes microseconds."""


def warn_of_pyelastica(own: str) -> None:
    """Say so if PyElastica lies in `own`, the folder of this package, or in another folder of the path."""
    for place in (own, *(os.path.join(folder, "elastica") for folder in sys.path)):
        if os.path.isdir(os.path.join(place, MARK)):
            warnings.warn(
                f"PyElastica lies in {place}, and its import name is elastica too, so that either hides or "
                "overwrites files of the other; install each into an environment of its own",
                stacklevel=3,
            )
            return
