"""JavaScript without a browser, for tests of what the pages run; skipped where node is missing."""

import json
import shutil
import subprocess
from importlib.resources import files

import numpy as np
import pytest

needs_node = pytest.mark.skipif(
    shutil.which("node") is None, reason="node not found: apt-get install nodejs"
)

ASSETS = files("softvox_view.explore").joinpath("assets")


#: Of the page, those that a script can take from.
MODULES = ("engine", "physics", "recording", "panels", "search", "versus", "trials")


def answer(folder, script, given):
    """Return what the body of an async function of (given, wasm) returns, as JSON can carry it.

    It sees MODULES and what an instance of the engine exports; a Float64Array comes back as
    float64, with all its bits.
    """
    (folder / "package.json").write_text('{"type": "module"}', "utf-8")
    for path in ASSETS.iterdir():
        if path.name.endswith((".js", ".wasm")):
            (folder / path.name).write_bytes(path.read_bytes())
    (folder / "given.json").write_text(json.dumps(given), "utf-8")
    modules = "".join(f"import * as {name} from './{name}.js';\n" for name in MODULES)
    program = f"""import {{ readFileSync, writeFileSync }} from "node:fs";
{modules}
const given = JSON.parse(readFileSync("given.json"));
const made = await WebAssembly.instantiate(readFileSync("engine.wasm"));
const wasm = made.instance.exports;
const answer = await (async () => {{ {script} }})();
const numbers = [];
let count = 0;
const text = JSON.stringify(answer, (_, value) => {{
  if (!(value instanceof Float64Array)) return value;
  numbers.push(value);
  count += value.length;
  return {{ numbers: [count - value.length, count] }};
}});
writeFileSync("answer.json", text ?? "null");
writeFileSync("numbers", Buffer.concat(numbers.map((a) => Buffer.from(a.buffer))));
"""
    (folder / "program.js").write_text(program, "utf-8")
    done = subprocess.run(
        [shutil.which("node"), "program.js"], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    numbers = np.fromfile(folder / "numbers", "<f8")

    def restored(value):
        if set(value) == {"numbers"}:
            return numbers[slice(*value["numbers"])]
        return value

    return json.loads((folder / "answer.json").read_text("utf-8"), object_hook=restored)
