import os

import pytest

from softvox_search.experiment.journal import MAGIC, Journal, JournalError

IDENTITY = {"config": {"seeds": 3}}
RUNS = {5: b"five", 0: b"", 2: bytes(range(9))}


def filled(path):
    with Journal(path, IDENTITY) as journal:
        journal.load()
        for run, content in RUNS.items():
            journal.append(run, content)
    return path.read_bytes()


def opened(path):
    with Journal(path, IDENTITY) as journal:
        journal.load()
        return journal.identity, dict(zip(journal.runs, journal.contents(), strict=True)), journal


def test_runs_come_back_in_the_order_of_their_numbers(tmp_path):
    filled(tmp_path / "j")
    identity, runs, journal = opened(tmp_path / "j")
    assert identity == IDENTITY
    assert list(runs) == [0, 2, 5]
    assert runs == RUNS
    assert journal.dropped == 0


def test_cut_off_at_any_byte_the_whole_records_are_used_and_the_rest_is_done_again(tmp_path):
    path = tmp_path / "j"
    content = filled(path)
    kept_before = 0
    for size in range(len(content) + 1):
        path.write_bytes(content[:size])
        _, runs, journal = opened(path)
        assert runs == {run: RUNS[run] for run in sorted(list(RUNS)[: len(runs)])}
        assert len(runs) >= kept_before
        kept_before = len(runs)
        whole = path.stat().st_size
        if size > len(MAGIC) + 60 and runs:
            assert journal.dropped == size - whole
        with Journal(path, IDENTITY) as journal:
            journal.load()
            assert journal.dropped == 0
            for run in RUNS.keys() - runs.keys():
                journal.append(run, RUNS[run])
        assert opened(path)[1] == RUNS
    assert kept_before == len(RUNS)


def test_a_changed_byte_loses_its_record_and_those_behind_it_and_invents_none(tmp_path):
    path = tmp_path / "j"
    content = filled(path)
    for place in range(len(MAGIC), len(content)):
        changed = bytearray(content)
        changed[place] ^= 0xFF
        path.write_bytes(changed)
        _, runs, journal = opened(path)
        assert len(runs) < len(RUNS)
        assert runs.items() <= RUNS.items()
        assert journal.dropped > 0


def test_garbage_behind_the_last_record_is_dropped_and_counted(tmp_path):
    path = tmp_path / "j"
    content = filled(path)
    path.write_bytes(content + b"x" * 7)
    _, runs, journal = opened(path)
    assert (runs, journal.dropped) == (RUNS, 7)
    assert path.read_bytes() == content


def test_a_file_that_is_no_journal_is_refused_and_left_alone(tmp_path):
    path = tmp_path / "j"
    path.write_bytes(b"something else altogether")
    with pytest.raises(JournalError, match="is not a journal"):
        Journal(path, IDENTITY)
    assert path.read_bytes() == b"something else altogether"


def test_a_journal_of_something_else_is_not_touched_before_it_is_loaded(tmp_path):
    path = tmp_path / "j"
    content = filled(path) + b"half a record"
    path.write_bytes(content)
    with Journal(path, {"config": {"seeds": 4}}) as journal:
        assert journal.identity == IDENTITY
    assert path.read_bytes() == content


def test_an_append_that_is_interrupted_leaves_the_journal_as_it_was(tmp_path, monkeypatch):
    path = tmp_path / "j"
    content = filled(path)
    with Journal(path, IDENTITY) as journal:
        journal.load()

        def write(file, framed):
            os.write(file, framed[:20])
            raise KeyboardInterrupt

        monkeypatch.setattr("softvox_search.experiment.journal._write", write)
        with pytest.raises(KeyboardInterrupt):
            journal.append(7, b"seven" * 20)
    assert path.read_bytes() == content
