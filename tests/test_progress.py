import io

import pytest

import softvox_gym.progress
from softvox_gym.progress import Progress, progress_line


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_the_line_says_count_share_speed_and_time_left():
    line = progress_line(3000, 6000, 60.0, 80)
    assert line == "[############            ] 3000/6000  50%  50 designs/s  1:00 left"


def test_the_line_names_its_unit_and_says_slow_speeds_to_the_hundredth():
    line = progress_line(3, 6, 60.0, 80, unit="runs")
    assert line == "[############            ] 3/6  50%  0.05 runs/s  1:00 left"


def test_the_line_is_shorter_than_any_terminal():
    for width in range(1, 120):
        for done in (0, 1, 6560, 6561):
            for seconds in (0.0, 0.01, 1e6):
                assert len(progress_line(done, 6561, seconds, width)) < width


def test_the_line_takes_80_columns_at_most():
    assert len(progress_line(6560, 6561, 1e-6, 500)) <= 80
    assert len(progress_line(1, 6561, 1e9, 500)) <= 80


def test_an_empty_batch_is_done():
    assert "100%" in progress_line(0, 0, 0.0, 80)


def seen(drawn):
    """Return the line that a terminal shows in the end."""
    line = []
    for part in drawn.split("\r"):
        line[: len(part)] = part
    return "".join(line)


@pytest.mark.parametrize("lengths", [(30, 40), (40, 30), (30, 30)])
def test_the_bar_is_blanked_out_when_done_or_interrupted(monkeypatch, lengths):
    lines = {done: "#" * length for done, length in zip((1, 10), lengths, strict=True)}
    monkeypatch.setattr(softvox_gym.progress, "progress_line", lambda done, *_, unit: lines[done])
    terminal = Terminal()
    with Progress(terminal) as progress:
        for done, line in lines.items():
            progress(done, 10)
            assert seen(terminal.getvalue()).rstrip() == line
    assert seen(terminal.getvalue()).strip() == ""
    assert terminal.getvalue().endswith("\r")


def test_nothing_is_drawn_where_there_is_no_terminal_or_quiet_is_asked_for():
    for stream, quiet in ((io.StringIO(), False), (Terminal(), True)):
        with Progress(stream, quiet=quiet) as progress:
            progress(1, 10)
        assert stream.getvalue() == ""
    with Progress(None) as progress:
        progress(1, 10)


def test_a_terminal_that_goes_away_does_not_stop_the_work():
    class Gone(Terminal):
        def flush(self):
            raise OSError("gone")

    with Progress(Gone()) as progress:
        progress(1, 10)
        progress(2, 10)
