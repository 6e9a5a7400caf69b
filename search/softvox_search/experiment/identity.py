"""What results depend on: kept beside them, so that different ones are never mixed."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterable, Iterator
from functools import lru_cache
from importlib import metadata, util
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import softvox_gym
import softvox_search
from softvox_gym import ENV_ID
from softvox_gym.design import digits_of
from softvox_gym.landscapes.table import origin
from softvox_gym.manifest import digest
from softvox_gym.wrappers.vector import JakobiNoise
from softvox_search.experiment.config import Experiment

#: Libraries that draw for searchers, or compute for them; a version may change the bits.
LIBRARIES = (
    "cmaes", "deap", "gymnasium", "nevergrad", "numpy", "optuna", "pyarrow", "ribs", "scipy"
)  # fmt: skip

#: Parts of the packages that no run passes through.
_ASIDE = {"cli", "verify"}

#: What of the report a run does pass through: it finds out when the best value improved.
_OF_THE_REPORT = {"__init__.py", "improvements.py", "truth.py"}

#: Designs of which the engine's bits are looked at, nominally and disturbed.
_PROBED = np.arange(40, 6561, 163)


def identity(experiment: Experiment) -> dict[str, Any]:
    """Return what the results of an experiment depend on, ready for JSON.

    Its configuration; the digest of the landscape that ships, and of what the engine that is loaded
    makes of some designs, nominally and disturbed; the versions of Python and of the
    libraries; and a digest of the code: this package's own, and the modules of searchers and
    wrappers from elsewhere (but not what those import in turn).
    """
    return _plain(
        {
            "config": experiment.to_dict(),
            "engine_digest": origin()["engine_digest"],
            "engine_probe": engine_probe(),
            "versions": versions(),
            "code": _digest(_sources(experiment)),
        }
    )


@lru_cache(maxsize=1)
def engine_probe() -> str:
    """Return a digest of what the loaded engine makes of some designs."""
    env: Any = gym.make_vec(ENV_ID, num_envs=len(_PROBED))
    displacements = []
    for level in (0.0, 2.0):
        noisy = JakobiNoise(env, level)
        noisy.reset(seed=0)
        displacements.append(noisy.step(digits_of(_PROBED))[4]["displacement"])
        env.reset()
    return digest(np.concatenate(displacements))


def versions() -> dict[str, str | None]:
    """Return the versions of Python and of the libraries; None for one that is not installed."""
    found: dict[str, str | None] = {"python": ".".join(platform.python_version_tuple()[:2])}
    for library in LIBRARIES:
        try:
            found[library] = metadata.version(library)
        except metadata.PackageNotFoundError:
            found[library] = None
    return found


def difference(before: dict[str, Any], now: dict[str, Any]) -> str | None:
    """Return the first thing in which two identities differ, in words; None where they agree."""
    flat_before, flat_now = dict(_flat(before)), dict(_flat(now))
    for key in [*flat_now, *flat_before]:
        old, new = flat_before.get(key), flat_now.get(key)
        if old == new:
            continue
        if key == "code":
            return "the code of the searchers or of this package has changed since"
        if key in ("engine_digest", "engine_probe"):
            return f"the engine's digest was {str(old)[:12]}..., and is {str(new)[:12]}..."
        kind, _, name = key.partition(".")
        if kind == "versions":
            return f"{name} was {old or 'absent'}, and is {new or 'absent'}"
        return f"{name} was {_shown(old)}, and is {_shown(new)}"
    return None


def _sources(experiment: Experiment) -> Iterator[tuple[str, Path]]:
    for package in (softvox_gym, softvox_search):
        assert package.__file__ is not None
        folder = Path(package.__file__).parent
        for path in sorted(folder.rglob("*.py")):
            inner = path.relative_to(folder)
            is_aside = inner.parts[0] in _ASIDE or (
                inner.parts[0] == "report" and inner.name not in _OF_THE_REPORT
            )
            if not is_aside:
                yield f"{package.__name__}/{inner.as_posix()}", path
    names = [searcher.name for searcher in experiment.searchers]
    names += [wrapper.name for wrapper in experiment.wrappers]
    for module in sorted({name.partition(":")[0] for name in names if ":" in name}):
        spec = util.find_spec(module)
        if spec and spec.origin and Path(spec.origin).is_file():
            yield module, Path(spec.origin)


def _digest(sources: Iterable[tuple[str, Path]]) -> str:
    total = hashlib.sha256()
    for name, path in sources:
        content = path.read_bytes()
        total.update(f"{name} {len(content)}\n".encode() + content)
    return total.hexdigest()


def _flat(value: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _flat(inner, f"{key}.{name}" if key else name)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        yield f"{key}.length", len(value)
        for i, inner in enumerate(value):
            yield from _flat(inner, f"{key}[{inner.get('label', inner.get('name', i))}]")
    else:
        yield key, value


def _plain(value: dict[str, Any]) -> dict[str, Any]:
    """Return it as it reads back from JSON."""

    def number(odd: Any) -> Any:
        if isinstance(odd, np.generic):
            return odd.item()
        raise TypeError(f"{odd!r} is not of JSON")

    plain: dict[str, Any] = json.loads(json.dumps(value, default=number))
    return plain


def _shown(value: Any) -> str:
    return "absent" if value is None else json.dumps(value)
