"""Which error ends in which exit code, and that bugs stay loud."""

import pytest

from shearline.deploy.exits import Exit, complain
from shearline.protocol import ConfigError, LinkError, RecordError, SpaceError


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (ConfigError("no such task"), Exit.USAGE),
        (SpaceError("bounds"), Exit.USAGE),
        (LinkError("nobody there"), Exit.NOT_CONNECTED),
        (RecordError("disk full"), Exit.RUN_FAILED),
        (FileNotFoundError(2, "No such file", "x.toml"), Exit.RUN_FAILED),
        (KeyboardInterrupt(), Exit.INTERRUPTED),
    ],
)
def test_an_expected_error_is_one_sentence_and_its_exit_code(
    error: BaseException, code: Exit, capsys: pytest.CaptureFixture[str]
) -> None:
    assert complain(error) == code
    said = capsys.readouterr().err
    assert said.startswith("shearline: ")
    assert said.count("\n") == 1


def test_a_programming_error_is_not_swallowed() -> None:
    with pytest.raises(ZeroDivisionError):
        complain(ZeroDivisionError())
