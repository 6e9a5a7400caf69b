"""Files of tracks, good ones and what becomes of them by accident."""

import random
import re

CSV = b"""\
design,trial,cycle,x_cm,y_cm
6453,1,0,0.0,0.0
6453,1,0.5,-0.1,0.2
6453,1,1,0.3,0.4
6453,2,0,5.0,5.0
573,1,0,0,0
6453,2,1,5.2,5.1
573,1,1,0.1,0
"""
SECONDS = b"t_s,x_px,y_px\n0,100,300\n1,100,256.3\n2,100,212.6\n"
#: Of a locale with decimal commas, as physics courses show them; and of several tracks.
TRACKER = b"\tmasse A\t\t\nt\tx\ty\t\n0,000\t-0,4796\t1,351\n0,033\t-0,4786\t1,337\n2,0\t0,2\t1,3\n"
SEVERAL = b"""\
#multi:
,mass A,,cm B,,
t,x,y,frame,x,y,
0.000E0,1.245E1,-1.328E1,0,0.5,0.25,
3.200E-2,,,1,0.6,0.25,
1.000E0,1.2E1,-1.3E1,31,1.5,0.25,
"""
DEEPLABCUT = b"""\
scorer,DLC_resnet50_robot,DLC_resnet50_robot,DLC_resnet50_robot,DLC_resnet50_robot,net,net
bodyparts,top,top,top,leg,leg,leg
coords,x,y,likelihood,x,y,likelihood
0,100.0,300.0,0.99,3,4,0.1
1,100.5,299.5,0.5,3,4,1
2,101.0,299.0,0.98,,,
30,110.0,280.0,1,9,9,1.0
"""
INDIVIDUALS = b"""\
scorer,net,net,net,net,net,net
individuals,one,one,one,two,two,two
bodyparts,top,top,top,top,top,top
coords,x,y,likelihood,x,y,likelihood
0,100.0,300.0,0.99,3,4,1
1,100.5,299.5,0.95,4,4,1
"""

#: What `read_track_files` needs to read each, and whose tracks it then holds.
GOOD = (
    (CSV, {}, {"design": None}),
    (SECONDS, {"scale": "10/437", "picture": (640, 480), "start_s": 0}, {}),
    (TRACKER, {"scale": "cm"}, {}),
    (SEVERAL, {"scale": "mm", "point": "cm B"}, {}),
    (DEEPLABCUT, {"scale": "10/437", "fps": 30, "point": "top"}, {}),
    (INDIVIDUALS, {"scale": "10/437", "fps": 30, "point": "one/top"}, {}),
)

NUMBERS = (b"1e308", b"-1e308", b"1e999", b"nan", b"inf", b"-0", b"1_0", b"0x1p3", b"9" * 400, b"")


VALUES = (b"-3", b"0.05", b"1.5", b"1,5", b"7", b"40", b"900", b"0,1,2", b"2.", b"+1e0", b"x")


def malformed(n, seed):
    """Yield n contents of files, each a good one with one to three accidents, and the options.

    Half of the accidents happen below a random place, so that not all are found in the first line.
    """
    rng = random.Random(seed)
    for _ in range(n):
        content, film, options = rng.choice(GOOD)
        for _ in range(rng.choice((1, 1, 2, 3))):
            at = rng.choice((0, rng.randint(0, len(content))))
            content = content[:at] + rng.choice(ACCIDENTS)(rng, content[at:])
        yield content, film, options


def _flip(rng, content):
    changed = bytearray(content)
    for _ in range(rng.randint(1, 4) if changed else 0):
        changed[rng.randrange(len(changed))] = rng.randrange(rng.choice((128, 128, 256)))
    return bytes(changed)


def _cut(rng, content):
    return content[: rng.randint(0, len(content))]


def _behead(rng, content):
    return content[rng.randint(0, len(content)) :]


def _swap(rng, content):
    lines = content.splitlines(keepends=True)
    rng.shuffle(lines)
    return b"".join(lines)


def _double(rng, content):
    lines = content.splitlines(keepends=True)
    return b"".join(line * rng.randint(0, 2) for line in lines)


def _recode(rng, content):
    text = content.decode("latin-1").replace("m", rng.choice("mé\u03b8"), 1)
    return text.encode(
        rng.choice(("utf-16", "utf-16-le", "utf-32", "latin-1", "utf-8-sig")), "replace"
    )


def _number(rng, content):
    cells = content.split(rng.choice((b",", b"\t", b"\n")))
    cells[rng.randrange(len(cells))] = rng.choice(NUMBERS)
    return rng.choice((b",", b"\t", b";")).join(cells)


def _value(rng, content):
    """Put another number into a cell of the lower half of the lines."""
    lines = content.splitlines(keepends=True)
    at = rng.randrange(len(lines) // 2, len(lines)) if lines else 0
    cells = re.split(b"([,;\t\r\n])", b"".join(lines[at : at + 1]))
    cells[rng.randrange(0, len(cells), 2)] = rng.choice((*NUMBERS, *VALUES))
    return b"".join([*lines[:at], *cells, *lines[at + 1 :]])


def _word(rng, content):
    words = (
        *(b"t", b"x", b"y", b"cycle", b"x_px", b"coords", b"bodyparts"),
        *(b"scorer", b"design", b"1"),
    )
    return content.replace(rng.choice(words), rng.choice((*words, b"", b'"')), rng.randint(1, 3))


def _put(rng, content):
    what = rng.choice(
        (b"\0", b"\r", b"\r\n", b"\n\n", b'"', b";", b"\xff\xfe", b"\x89HDF", b"z" * 9999)
    )
    at = rng.choice((0, rng.randint(0, len(content))))
    return content[:at] + what + content[at:]


def _binary(rng, content):
    return rng.randbytes(rng.randint(0, 300))


def _field(rng, content):
    return content + b"1," * rng.choice((10, 1000)) + b"1" * rng.choice((1, 140_000))


def _decimal(rng, content):
    return content.replace(b",", b";").replace(b".", b",")


ACCIDENTS = (
    *(_behead, _double, _recode, _binary, _decimal, _field),
    *(2 * (_flip, _cut, _swap, _number, _word, _put)),
    *(6 * (_value,)),
)
