"""What to say where an optional library is not installed."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec

#: Packages that are not called as their modules are.
PACKAGES = {"PIL": "pillow", "imageio_ffmpeg": "imageio-ffmpeg", "sklearn": "scikit-learn"}


def missing(what: str, error: ImportError, modules: Iterable[str] = ()) -> str:
    """Return a line that names every package that something lacks, and how to install them.

    The error is as the import raised it; of all the modules that are needed, those missing besides
    are named at once.

    Raises
    ------
    ImportError
        The error itself where it is not about a package of somebody else.

    Examples
    --------
    >>> missing("figures", ModuleNotFoundError(name="matplotlib"))
    'figures needs matplotlib: pip install matplotlib'
    """
    first = (error.name or "").partition(".")[0]
    if first in ("", "softvox_gym", "softvox_search", "softvox_view"):
        raise error
    others = [module for module in modules if find_spec(module) is None]
    packages = list(dict.fromkeys(PACKAGES.get(name, name) for name in [first, *others]))
    return f"{what} needs {' and '.join(packages)}: pip install {' '.join(packages)}"
