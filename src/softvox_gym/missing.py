"""The error message for optional libraries that are not installed."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec

#: Packages whose names differ from those of their modules.
PACKAGES = {"PIL": "pillow", "imageio_ffmpeg": "imageio-ffmpeg", "sklearn": "scikit-learn"}


def missing(what: str, error: ImportError, modules: Iterable[str] = ()) -> str:
    """Return a line that names every missing package, and how to install them.

    `error` is the one that an import raised; `modules` are all needed modules, of which the missing
    ones are named too.

    Raises
    ------
    ImportError
        The error itself if it does not concern a third-party package.

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
