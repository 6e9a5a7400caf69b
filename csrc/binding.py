"""Builds softvox_gym._engine: the C engine as a Python extension (cffi, API mode, abi3)."""

from pathlib import Path

from cffi import FFI

HERE = Path(__file__).parent

# The bits of every result depend on these: one rounding per operation, IEEE throughout, whatever
# CFLAGS says before. -fno-math-errno lets the compiler use the processor's square root, which is
# correctly rounded.
IEEE = ("-O3", "-fno-fast-math", "-fno-unsafe-math-optimizations", "-ffp-contract=off")
FLAGS = (*IEEE, "-fno-math-errno", "-std=c11")


def declarations() -> str:
    """Return the part of softvox.h that Python sees."""
    header = (HERE / "include" / "softvox.h").read_text(encoding="utf-8")
    return header.split("/* [binding */")[1].split("/* binding] */")[0]


builder = FFI()
builder.cdef(declarations())
builder.set_source(
    "softvox_gym._engine",
    '#include "softvox.h"',
    sources=sorted(str(Path("csrc") / path.relative_to(HERE)) for path in HERE.rglob("*.c")),
    include_dirs=["csrc", "csrc/include"],
    define_macros=[("SV_FLAGS", '"' + " ".join(FLAGS) + '"')],
    extra_compile_args=list(FLAGS),
    # Linked as fast, a compiler's start-up code makes the whole process flush subnormals to zero.
    extra_link_args=list(IEEE),
)
