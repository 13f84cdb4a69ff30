from __future__ import annotations

from dataclasses import fields

import pytest

from shearline.learner.errors import SwitchError
from shearline.learner.psp.config import Covariance, Labels, MixtureData, PSPConfig


def test_the_paper_takes_every_success_at_its_word_and_fits_full_components_to_all() -> None:
    paper = PSPConfig.paper()
    assert paper.neighbours == 0
    assert paper.mixture_data is MixtureData.SUCCESSES
    assert paper.covariance is Covariance.FULL
    assert len(paper.gammas) > 1


def test_every_switch_is_documented() -> None:
    for field in fields(PSPConfig):
        assert f" {field.name}: " in (PSPConfig.__doc__ or "")


def test_words_stand_for_members() -> None:
    changed = PSPConfig().having(labels="previous", svm_c=10, gammas=[0.5, 2.0])
    assert changed.labels is Labels.PREVIOUS
    assert changed.svm_c == 10.0
    assert changed.gammas == (0.5, 2.0)
    assert changed.having() == changed


@pytest.mark.parametrize(
    ("switch", "value", "expected"),
    [
        ("labels", "newest", "one of new, previous"),
        ("labels", 3, "one of new, previous"),
        ("svm_c", "high", "a value like"),
        ("svm_c", 0.0, "above 0"),
        ("svm_c", True, "a value like"),
        ("proposal_min", 1.5, "a value like"),
        ("proposal_min", True, "a value like"),
        ("balanced", 1, "a value like"),
        ("filter_min", 0, "1 or more"),
        ("components_max", 0, "1 or more"),
        ("redraws_max", 0, "1 or more"),
        ("neighbours", -1, "0 or more"),
        ("covariance_floor", 0.0, "above 0"),
        ("spread", -1.0, "above 0"),
        ("gammas", (), "one or more factors above 0"),
        ("gammas", (1.0, -1.0), "one or more factors above 0"),
        ("fit_samples_max", 3, "10 or more"),
        ("sharpness", 1, "expected one of proposal_min, filter_min"),
    ],
)
def test_a_wrong_switch_is_refused_with_what_was_expected(
    switch: str, value: object, expected: str
) -> None:
    with pytest.raises(SwitchError, match=expected):
        PSPConfig().having(**{switch: value})
