"""``shearline trials`` and ``shearline report``: a run handed on to people and programs."""

import csv
import io
import json
from pathlib import Path

import pytest
from pyarrow import parquet

from shearline.deploy.cli import main
from shearline.deploy.exits import Exit
from shearline.protocol.messages import Counted, OutcomeKind
from shearline.record.head import config_of
from shearline.record.writer import RecordWriter

RUN_TOML = """\
learner = "psp"
seed = 3

[task]
name = "press"

[task.space]
push = ["N", 0.0, 20.0]
"""


def counted(trial: int) -> Counted:
    return Counted(
        trial=trial,
        episode=trial // 5,
        theta=[float(trial)],
        kind=OutcomeKind.SUCCESS if trial % 3 else OutcomeKind.FAILURE,
        cost=1.0 / (1 + trial),
        seed=trial,
        evaluator="sim-0",
        attempts=1,
        late=False,
        engine="engine 1",
        digest="",
        wall_s=0.25,
        why="" if trial % 3 else "slipped",
        extras={},
        at_s=1_700_000_000.0 + trial,
    )


@pytest.fixture
def run(tmp_path: Path) -> Path:
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "run.toml").write_text(RUN_TOML)
    with RecordWriter(folder, config_of("run", folder)) as writer:
        for trial in range(10):
            writer.write(counted(trial), log_ns=trial)
    return folder


def test_json_is_one_object_a_line_under_both_its_names(
    run: Path, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    assert main(["trials", str(run), "--json"]) == Exit.OK
    one = capsysbinary.readouterr().out
    assert main(["trials", str(run), "--format", "json"]) == Exit.OK
    assert capsysbinary.readouterr().out == one
    rows = [json.loads(line) for line in one.splitlines()]
    assert [row["trial"] for row in rows] == list(range(10))
    assert rows[4]["theta"] == {"push": 4.0}


def test_csv_can_be_piped(run: Path, capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    assert main(["trials", str(run), "--format", "csv"]) == Exit.OK
    text = capsysbinary.readouterr().out.decode()
    rows = list(csv.DictReader(io.StringIO(text, newline="")))
    assert [float(row["theta.push [N]"]) for row in rows] == list(range(10))
    assert [row["why"] for row in rows[:2]] == ["slipped", ""]


def test_parquet_goes_into_a_file(
    run: Path, tmp_path: Path, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    path = tmp_path / "trials.parquet"
    assert main(["trials", str(run), "--format", "parquet", "--out", str(path)]) == Exit.OK
    table = parquet.read_table(path)
    assert table.num_rows == 10
    assert table.schema.field("theta.push").metadata == {b"unit": b"N"}
    assert capsysbinary.readouterr().out == b""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--out", "trials.csv"], "which format?"),
        (["--format", "parquet"], "not for a terminal"),
    ],
)
def test_what_cannot_be_meant_is_wrong_usage(
    run: Path,
    words: list[str],
    said: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert main(["trials", str(run), *words]) == Exit.USAGE
    assert said in capsys.readouterr().err


def test_people_get_a_table(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["trials", str(run)]) == Exit.OK
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 11
    assert "slipped" in lines[1]


def test_a_damaged_record_is_read_with_one_sentence_on_standard_error(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record = run / "record.mcap"
    record.write_bytes(record.read_bytes()[:-300])
    assert main(["trials", str(run)]) == Exit.OK
    heard = capsys.readouterr()
    (sentence,) = heard.err.splitlines()
    assert sentence.startswith("shearline: record.mcap: it breaks off at byte")
    assert main(["report", str(run)]) == Exit.OK
    assert "The record is damaged." in (run / "report.html").read_text()


def test_a_report_says_where_it_is(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(run)]) == Exit.OK
    assert str(run / "report.html") in capsys.readouterr().out
    assert "press" in (run / "report.html").read_text()


def test_a_comparison_can_be_asked_for_by_programs(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "two.html"
    assert main(["report", str(run), str(run), "--out", str(out), "--json"]) == Exit.OK
    said = json.loads(capsys.readouterr().out)
    assert said == {"report": str(out), "bytes": out.stat().st_size}


def test_a_run_that_is_not_there_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in ("trials", "report"):
        assert main([command, str(tmp_path / "nowhere")]) == Exit.RUN_FAILED
        assert "expected a run folder, found nothing at" in capsys.readouterr().err


def test_a_run_without_a_record_has_its_trials_in_the_journal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "run"
    words = "--learner random --evaluators 1 --episodes 2 --trials 4 --no-record --json"
    assert main(["up", "--task", "sphere", *words.split(), "--out", str(folder)]) == Exit.OK
    capsys.readouterr()
    assert not list(folder.glob("*.mcap"))
    assert main(["trials", str(folder), "--json"]) == Exit.OK
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [row["trial"] for row in rows] == list(range(8))
    assert all(name in (folder / "run.toml").read_text() for name in rows[0]["theta"])


def test_a_folder_with_neither_record_nor_journal_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["trials", str(tmp_path)]) == Exit.RUN_FAILED
    assert "found neither a record nor a journal" in capsys.readouterr().err
