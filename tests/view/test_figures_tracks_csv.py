import numpy as np
import pytest

from softvox_view.tracks_csv import TracksError, read_tracks

HEADER = "design,trial,cycle,x_cm,y_cm\n"


@pytest.fixture
def read(tmp_path):
    def from_text(text):
        path = tmp_path / "real.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_tracks(path, most_cycles=23)

    return from_text


def test_trials_are_read_in_order_and_start_at_the_origin(read):
    made = read(HEADER + "6453,a,0,5,7\n573,a,0,0,0\n6453,a,0.5,6,9\n573,a,23,1,1\n")
    assert [(track.design, track.trial) for track in made] == [(6453, "a"), (573, "a")]
    assert made[0].cycle.tolist() == [0, 0.5]
    assert made[0].position.tolist() == [[0, 0], [1, 2]]


def test_digits_other_orders_blank_lines_and_windows_files_are_read(read):
    text = "y_cm, x_cm,note,cycle,trial,design\n1,2,x,0,1,00021222\n\n3,5,,1,1,6453\n"
    (track,) = read(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    assert track.design == 6453
    assert np.array_equal(track.position, [[0, 0], [3, 2]])


@pytest.mark.parametrize(
    ("text", "line", "mend"),
    [
        ("", 1, "must name the columns design,trial,cycle,x_cm,y_cm"),
        ("design;trial;cycle;x_cm;y_cm\n", 1, "separated by commas, got 'design;trial"),
        ("design,trial,cycle,x,y\n", 1, "lacks x_cm, y_cm"),
        ("design,trial,cycle,x_cm,y_cm,y_cm\n", 1, "names y_cm twice"),
        (HEADER + "6453,1,0,0\n", 2, "4 values, but the first line names 5"),
        (HEADER + "6561,1,0,0,0\n", 2, "give a number from 0 to 6560 or 8 digits"),
        (HEADER + "00021223,1,0,0,0\n", 2, "design '00021223' does not exist"),
        (HEADER + "6453,1,0,0,0\n6453,1,1,left,0\n", 3, "x_cm must be a finite number .* 'left'"),
        (HEADER + "6453,1,0,0,nan\n", 2, "y_cm must be a finite number"),
        (HEADER + "6453,1,0,0,1e300\n", 2, "more than 10000 cm .* give positions in cm"),
        (HEADER + "6453,1,0,0,1_0\n", 2, "y_cm must be a finite number"),
        (HEADER + "6453,1,0,0,\n", 2, "leave the line out where it was not measured"),
        (HEADER + "6453,1,1,0,0\n", 2, "a trial starts at cycle 0, got 1"),
        (HEADER + "6453,1,0,0,0\n6453,1,2,0,0\n6453,1,2,0,0\n", 4, "sort the lines"),
        (HEADER + "6453,1,0,0,0\n6453,1,24,0,0\n", 3, "not within 0 to 23"),
        (HEADER + "6453,1,0,0,0\n6453,2,0,0,0\n6453,2,1,0,0\n", 2, "a track needs two or more"),
        (HEADER + '6453,"1,0,0,0\n', 2, "save the file as CSV anew"),
        (HEADER + "6453,1,0,0,0\n6453,\0,1,0,0\n", 3, ""),
    ],
)
def test_a_malformed_file_is_refused_with_its_line_and_the_mend(read, text, line, mend):
    with pytest.raises(TracksError, match=rf"real\.csv, line {line}: .*{mend}"):
        read(text)


def test_a_file_without_tracks_is_refused(read):
    with pytest.raises(TracksError, match=r"real\.csv has no track"):
        read(HEADER)


def test_a_file_that_is_no_text_is_refused(read):
    with pytest.raises(TracksError, match=r"real\.csv is not text in UTF-8"):
        read(b"\xff\xfe\x00d")
