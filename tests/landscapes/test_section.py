"""One description of a table, as text, Markdown, CSV and JSON."""

import json

from softvox_gym.landscapes.section import Column, Section

SECTION = Section(
    title="Things",
    note="What they are.",
    columns=(Column("name", "thing"), Column("share", "share", ".1%"), Column("hidden")),
    rows=[("one", 0.1234567, 1), ("another", None, 2), ("third", 1.0, 3)],
    facts={"n": 3, "mean": None},
    sentence="there are {n} of mean {mean:.2f}",
)


def test_as_text_columns_are_aligned_and_hidden_ones_left_out():
    assert SECTION.text().splitlines() == [
        "thing      share",
        "one       12.3 %",
        "another        -",
        "third    100.0 %",
        "there are 3 of mean -",
    ]


def test_what_rounds_to_zero_has_no_sign():
    columns = (Column("n", "n"), Column("a", "a", ".0f"), Column("b", "b", ".1%"))
    rows = [("-0", -0.3, -0.0001), ("-", -0.6, -0.01)]
    text = Section(columns=columns, rows=rows).text()
    assert [line.split() for line in text.splitlines()[1:]] == [
        ["-0", "0", "0.0", "%"],
        ["-", "-1", "-1.0", "%"],
    ]


def test_as_markdown_it_has_its_title_its_meaning_and_no_more_rows_than_asked_for():
    shown = Section(**{**vars(SECTION), "document": 1}).markdown().splitlines()
    assert shown == [
        "## Things", "", "What they are.", "",
        "| thing | share |", "| --- | ---: |", "| one | 12.3 % |", "", "There are 3 of mean -.",
    ]  # fmt: skip


def test_csv_and_json_have_every_column_with_all_its_digits():
    assert SECTION.csv() == "name,share,hidden\none,0.1234567,1\nanother,,2\nthird,1.0,3\n"
    data = json.loads(json.dumps(SECTION.to_dict()))
    assert data["rows"][0] == {"name": "one", "share": 0.1234567, "hidden": 1}
    assert (data["n"], data["mean"], data["meaning"]) == (3, None, "What they are.")


def test_people_may_see_columns_as_rows():
    turned = Section(**{**vars(SECTION), "is_transposed": True, "sentence": ""}).text()
    assert turned.splitlines() == [
        "thing     one  another    third",
        "share  12.3 %        -  100.0 %",
    ]
