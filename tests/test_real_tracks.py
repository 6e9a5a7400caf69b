import numpy as np
import pytest

from softvox_gym.real_tracks import CsvError, read_tracks

HEADER = "design,trial,cycle,x_cm,y_cm\n"


@pytest.fixture
def read(tmp_path):
    def from_text(text):
        path = tmp_path / "real.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_tracks([path], most_cycles=23)

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
        ("", 1, "must name each of the columns design,trial,cycle,x_cm,y_cm"),
        ("design;trial;cycle;x_cm;y_cm\n", 1, "separated by commas, got 'design;trial"),
        ("design,trial,cycle,x,y\n", 1, "got 'design,trial,cycle,x,y'"),
        ("design,trial,cycle,x_cm,y_cm,y_cm\n", 1, "each of the columns .* once"),
        (HEADER + "6453,1,0,0\n", 2, "4 values, but the first line names 5"),
        (HEADER + "6561,1,0,0,0\n", 2, "neither a number from 0 to 6560 nor 8 digits"),
        (HEADER + "00021223,1,0,0,0\n", 2, "design '00021223' is neither"),
        (HEADER + "6453,1,0,0,0\n6453,1,1,left,0\n", 3, "x_cm must be a finite number .* 'left'"),
        (HEADER + "6453,1,0,0,nan\n", 2, "y_cm must be a finite number"),
        (HEADER + "0,1,0,0,0\n", 2, "design '0' has no voxels"),
        (HEADER + "00000000,1,0,0,0\n", 2, "design '00000000' has no voxels"),
        (
            HEADER + "6453,1,0,300,0\n6453,1,1,300,101\n",
            3,
            "more than 100 cm from the start .* in cm",
        ),
        (HEADER + "6453,1,0,0,1_0\n", 2, "y_cm must be a finite number"),
        (HEADER + "6453,1,0,0,\n", 2, "leave out the line if it was not measured"),
        (HEADER + "6453,1,1,0,0\n", 2, "a trial must start at cycle 0, got 1"),
        (HEADER + "6453,1,0,0,0\n6453,1,2,0,0\n6453,1,2,0,0\n", 4, "sort the lines"),
        (HEADER + "6453,1,0,0,0\n6453,1,24,0,0\n", 3, "cycle 24 is not within 0 to 23"),
        (HEADER + "6453,1,0,0,0\n6453,1,23.0000001,0,0\n", 3, "cycle 23.0000001 is not within"),
        (HEADER + '6453,"1,0,0,0\n', 2, "correct the quotes there"),
        (HEADER + '6453,"1,0,0,0\n6453,1,1,0,0\n6453,1,2,0,0\n', 2, "correct the quotes"),
        (HEADER + '6453,"1"a,0,0,0\n', 2, "save the file again"),
        (HEADER + '6453,"1\n",0,0,0\n6453,"1\n",1,0\n', 4, "4 values"),
        (
            HEADER.encode() + b"6453,1,0,0,0\r\n6453,\xff,1,0,0\r\n",
            3,
            "save the file as CSV in UTF",
        ),
        (b"\xff\xfed\0e\0", 1, "not text in UTF-8; save"),
    ],
)
def test_a_malformed_file_is_refused_with_its_line_and_the_mend(read, text, line, mend):
    with pytest.raises(CsvError, match=rf"real\.csv, line {line}: .*{mend}"):
        read(text)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (HEADER, "has no track; add lines"),
        (HEADER + "6453,1,0,0,0\n6453,2,0,0,0\n6453,2,1,0,0\n", "a track needs at least two"),
    ],
)
def test_a_file_without_tracks_is_refused(read, text, fault):
    with pytest.raises(CsvError, match=rf"real\.csv.* {fault}"):
        read(text)


def test_a_file_that_is_not_there_or_is_a_folder_is_refused(tmp_path):
    with pytest.raises(
        CsvError, match=r"no\.csv can't be read \(No such file or directory\); name"
    ):
        read_tracks([tmp_path / "no.csv"], most_cycles=23)
    with pytest.raises(CsvError, match=r"can't be read \(Is a directory\); name a readable CSV"):
        read_tracks([tmp_path], most_cycles=23)


def test_several_files_are_read_one_after_the_other(tmp_path):
    for name, design, trial in (("a", 6453, 1), ("b", 6453, 2), ("c", 573, 1)):
        text = f"{HEADER}{design},{trial},0,0,0\n{design},{trial},1,1,1\n"
        (tmp_path / name).write_text(text)
    made = read_tracks([tmp_path / name for name in "abc"], most_cycles=23)
    assert [(track.design, track.trial) for track in made] == [
        (6453, "1"),
        (6453, "2"),
        (573, "1"),
    ]


def test_a_trial_that_two_files_have_is_refused_with_both(tmp_path):
    for name in "ab":
        (tmp_path / name).write_text(HEADER + "6453,one,0,0,0\n6453,one,1,1,1\n")
    fault = r"b, line 2: design 6453 also has a trial 'one' in .*a; rename one of the two trials"
    with pytest.raises(CsvError, match=fault):
        read_tracks([tmp_path / "a", tmp_path / "b"], most_cycles=23)
