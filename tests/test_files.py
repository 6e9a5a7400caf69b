import errno
import io
import os

import numpy as np
import pytest
from cli_process import snapshot

from softvox_gym import files
from softvox_gym.files import (
    OutputError,
    archive_of,
    check_file,
    check_folder,
    write_file,
    write_folder,
)

CONTENTS = {"table": b"1,2\n", "manifest": b"{}"}


def fail(*_args, **_kwargs):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def interrupt(*_args, **_kwargs):
    raise KeyboardInterrupt


def test_a_new_folder_appears_with_all_its_files_and_nothing_else(tmp_path):
    write_folder(tmp_path / "out", CONTENTS, force=False)
    assert snapshot(tmp_path) == {"out": None, "out/table": b"1,2\n", "out/manifest": b"{}"}


def test_an_archive_is_what_numpy_reads_and_the_same_each_time():
    arrays = {"b": np.array([0.1, -0.0, np.nan]), "a": np.zeros(2, [("x", "i8"), ("y", "f4")])}
    content = archive_of(arrays)
    assert content == archive_of(arrays)
    with np.load(io.BytesIO(content)) as read:
        assert read.files == list(arrays)
        assert all(read[name].dtype == values.dtype for name, values in arrays.items())
        assert all(read[name].tobytes() == values.tobytes() for name, values in arrays.items())


def test_an_empty_folder_is_filled(tmp_path):
    check_folder(tmp_path, CONTENTS, force=False)
    write_folder(tmp_path, CONTENTS, force=False)
    assert snapshot(tmp_path) == CONTENTS


def test_a_folder_that_is_not_empty_is_refused_without_force(tmp_path):
    (tmp_path / "other").write_bytes(b"mine")
    with pytest.raises(OutputError, match="is not empty; choose another, or replace it with --for"):
        check_folder(tmp_path, CONTENTS, force=False)
    assert snapshot(tmp_path) == {"other": b"mine"}


def test_force_replaces_files_of_the_same_name_and_leaves_others(tmp_path):
    (tmp_path / "other").write_bytes(b"mine")
    (tmp_path / "table").write_bytes(b"old")
    check_folder(tmp_path, CONTENTS, force=True)
    write_folder(tmp_path, CONTENTS, force=True)
    assert snapshot(tmp_path) == {**CONTENTS, "other": b"mine"}


@pytest.mark.parametrize("step", ["_write", "_put", "_sync_folder"])
@pytest.mark.parametrize("force", [False, True])
def test_a_full_disk_leaves_no_temporary_file_and_the_old_result(
    tmp_path, monkeypatch, step, force
):
    old = {}
    if force:
        write_file(tmp_path / "f", b"old", force=False)
        old = {"f": b"old"}
    monkeypatch.setattr(files, step, fail)
    with pytest.raises(OutputError, match=r"cannot write .*: No space left on device"):
        write_file(tmp_path / "f", b"new", force=force)
    if step != "_sync_folder":  # by then the file is in place
        assert snapshot(tmp_path) == old
    assert not [name for name in snapshot(tmp_path) if name.startswith(".")]


@pytest.mark.parametrize("step", ["_write", "_sync_folder"])
def test_an_interrupt_leaves_no_temporary_folder(tmp_path, monkeypatch, step):
    monkeypatch.setattr(files, step, interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_folder(tmp_path / "out", CONTENTS, force=False)
    assert snapshot(tmp_path) == {}


def test_a_file_that_appears_during_the_work_is_kept_and_so_are_the_results(tmp_path):
    path = tmp_path / "f"
    check_file(path, force=False)
    path.write_bytes(b"theirs")
    with pytest.raises(OutputError, match="the results are in ") as caught:
        write_file(path, b"ours", force=False)
    kept = str(caught.value).rpartition(" ")[2]
    assert path.read_bytes() == b"theirs"
    with open(kept, "rb") as file:
        assert file.read() == b"ours"


def test_a_folder_that_is_filled_during_the_work_is_kept_and_so_are_the_results(tmp_path):
    check_folder(tmp_path, CONTENTS, force=False)
    (tmp_path / "manifest").write_bytes(b"theirs")
    with pytest.raises(OutputError, match="the results are in "):
        write_folder(tmp_path, CONTENTS, force=False)
    after = snapshot(tmp_path)
    assert after["manifest"] == b"theirs"
    assert b"{}" in after.values()


def test_a_file_system_without_hard_links_still_refuses_to_overwrite(tmp_path, monkeypatch):
    def no_links(*_args):
        raise OSError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(os, "link", no_links)
    write_file(tmp_path / "f", b"first", force=False)
    with pytest.raises(OutputError, match="the results are in "):
        write_file(tmp_path / "f", b"second", force=False)
    assert (tmp_path / "f").read_bytes() == b"first"


def test_a_dangling_link_counts_as_something_that_exists(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(OutputError, match="exists"):
        check_file(tmp_path / "link", force=False)
    with pytest.raises(OutputError, match="is not a folder"):
        check_folder(tmp_path / "link", CONTENTS, force=True)


def test_checking_leaves_nothing_behind(tmp_path):
    check_file(tmp_path / "f", force=False)
    check_folder(tmp_path / "out", CONTENTS, force=False)
    assert snapshot(tmp_path) == {}


def test_a_pipe_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OutputError, match="is a device or pipe; name a file"):
        check_file(tmp_path / "pipe", force=True)


def test_what_cannot_be_written_is_told_of_and_any_name_that_can_be_is(tmp_path):
    (tmp_path / "file").touch()
    for write, content in ((write_file, b""), (write_folder, {"name": b""})):
        with pytest.raises(OutputError, match="Not a directory"):
            write(tmp_path / "file" / "within", content, force=True)
    longest = tmp_path / ("漢" * 85)  # 255 bytes
    write_file(longest, b"content", force=False)
    assert longest.read_bytes() == b"content"
