"""Builds softvox_gym._engine: the C engine as a Python extension (cffi, API mode, abi3)."""

from pathlib import Path

from cffi import FFI

HERE = Path(__file__).parent
SOURCES = (
    "body.c",
    "engine.c",
    "isa.c",
    "kernel_avx2.c",
    "kernel_avx512.c",
    "kernel_portable.c",
    "plan.c",
)

# The bits of every result hang on the first three: one rounding per operation, IEEE throughout.
# -fno-math-errno lets the compiler use the processor's square root, which is correctly rounded.
FLAGS = ("-ffp-contract=off", "-fno-fast-math", "-fno-math-errno", "-std=c11", "-O3")


def declarations() -> str:
    """Return the part of softvox.h that Python sees."""
    header = (HERE / "softvox.h").read_text(encoding="utf-8")
    return header.split("/* [binding */")[1].split("/* binding] */")[0]


builder = FFI()
builder.cdef(declarations())
builder.set_source(
    "softvox_gym._engine",
    '#include "softvox.h"',
    sources=[f"csrc/{name}" for name in SOURCES],
    include_dirs=["csrc"],
    define_macros=[("SV_FLAGS", '"' + " ".join(FLAGS) + '"')],
    extra_compile_args=list(FLAGS),
)
