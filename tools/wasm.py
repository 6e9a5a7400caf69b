"""Compile the engine for browsers, view/softvox_view/explore/assets/engine.wasm.

Run by `make wasm`, after a change of the engine's sources. The same sources and flags as the
native engine has, so that the bits are the same; tests/view/test_wasm.py holds both to that.
"""

import subprocess
import sys
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "csrc"))

from binding import FLAGS  # noqa: E402

#: What is made, and beside it the digests of that and of its sources.
ENGINE = ROOT / "view/softvox_view/explore/assets/engine.wasm"
DIGESTS = ENGINE.with_suffix(".sha256")

#: WASI's libc has what the engine takes of C's; nothing of it asks the host for anything.
TARGET = ("-target", "wasm32-wasi", "-msimd128", "-mexec-model=reactor", "-s", "-Wl,--no-entry")


def sources() -> list[Path]:
    """Return all that the engine is made of, and what says how."""
    files = [path for path in (ROOT / "csrc").rglob("*") if path.suffix in (".c", ".h")]
    return sorted([*files, ROOT / "csrc/binding.py", Path(__file__).resolve()])


def digests() -> str:
    """Return the lines of DIGESTS as the files are now."""
    content = b"".join(path.read_bytes() for path in sources())
    made = {ENGINE.name: ENGINE.read_bytes(), "its sources": content}
    return "".join(f"{sha256(data).hexdigest()}  {name}\n" for name, data in made.items())


def compiled(path: Path) -> None:
    """Compile the engine into a file."""
    command = [sys.executable, "-m", "ziglang", "cc", *TARGET, *FLAGS]
    folders = ["-Icsrc", "-Icsrc/include"]
    files = [path.relative_to(ROOT) for path in sources() if path.suffix == ".c"]
    subprocess.run([*command, *folders, *files, "-o", path], cwd=ROOT, check=True)
    path.chmod(0o644)


if __name__ == "__main__":
    compiled(ENGINE)
    DIGESTS.write_text(digests(), encoding="utf-8")
