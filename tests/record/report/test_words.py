"""Numbers for people: short, with units, and never wrong by more than their digits."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.record.report.words import (
    MINUS,
    NOTHING,
    THIN,
    between,
    count,
    duration,
    number,
    quantity,
    share,
)


@given(st.floats(-1e300, 1e300), st.integers(2, 6))
def test_a_written_number_is_the_number_to_its_digits(value: float, digits: int) -> None:
    written = float(number(value, digits).replace(MINUS, "-"))
    assert written == pytest.approx(value, rel=10.0 ** (1 - digits))


@pytest.mark.parametrize(
    ("value", "written"),
    [(1234.5, "1234"), (0.00012345, "0.000123"), (1.2e-7, f"1.2e{MINUS}7"), (3e9, "3e9"), (0, "0")],
)
def test_powers_of_ten_stand_only_where_they_must(value: float, written: str) -> None:
    assert number(value) == written


@pytest.mark.parametrize("value", [None, math.nan, math.inf])
def test_what_is_no_number_is_a_dash(value: float | None) -> None:
    assert (number(value), quantity(value, "N"), share(value)) == (NOTHING,) * 3


def test_units_and_shares() -> None:
    assert quantity(2.5, "N m") == f"2.5{THIN}N m"
    assert quantity(2.5, "") == "2.5"
    assert share(0.954) == f"95{THIN}%"
    assert between(0.5, 1.0) == f"50 to 100{THIN}%"
    assert (count(1, "trial"), count(0, "trial")) == ("1 trial", "0 trials")


@pytest.mark.parametrize(
    ("time_s", "written"),
    [(0.05, "0.05 s"), (54.16, "54.2 s"), (250.0, "4 min 10 s"), (7500.0, "2 h 5 min")],
)
def test_durations_use_the_unit_that_fits(time_s: float, written: str) -> None:
    assert duration(time_s).replace(THIN, " ") == written
    assert duration(math.nan) == NOTHING
