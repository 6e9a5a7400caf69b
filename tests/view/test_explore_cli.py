import subprocess
import sys

import pytest
from cli_process import softvox

import softvox_gym

#: What stands in for a browser: it keeps the address.
BROWSER = f"{sys.executable} -c 'import sys; print(sys.argv[1], file=sys.stderr)' %s"


def test_the_page_is_written_and_opened_in_the_browser(tmp_path):
    state = "design=4295&gravity=-3"
    environment = {"BROWSER": BROWSER, "TMPDIR": str(tmp_path)}
    done = softvox("explore", "--state", f"#{state}", **environment)
    assert done.returncode == 0, done.stderr
    (path,) = tmp_path.glob("softvox-*/landscape.html")
    address = f"{path.as_uri()}#{state}"
    assert done.stdout == f"the landscape is at {address}\n"
    assert address in done.stderr


def test_one_file_holds_all_and_names_no_host(tmp_path):
    path = tmp_path / "landscape.html"
    done = softvox("explore", "--out", str(path))
    assert (done.returncode, done.stderr) == (0, "")
    text = path.read_text("utf-8")
    assert len(text.encode()) < 1_500_000
    assert softvox_gym.__version__ in text
    addresses = text.replace("http://www.w3.org/2000/svg", "")
    assert "http:" not in addresses
    assert "https:" not in addresses
    assert "\nimport " not in text
    again = softvox("explore", "--out", str(path))
    told = f"softvox: error: --out {path} exists; choose another, or replace it with --force\n"
    assert (again.returncode, again.stderr) == (2, told)
    assert softvox("explore", "--out", str(path), "--force").returncode == 0


@pytest.mark.parametrize("part", ["matplotlib", "pandas", "PIL", "imageio_ffmpeg"])
def test_the_page_needs_no_library_of_an_extra(tmp_path, part):
    code = (
        f"import sys; sys.modules[{part!r}] = None; from softvox_gym.cli import main; "
        f"sys.exit(main(['explore', '--out', {str(tmp_path / 'a.html')!r}]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
