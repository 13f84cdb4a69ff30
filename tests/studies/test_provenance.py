import platform
from importlib.metadata import version

from shearline.learner.registry import LEARNERS
from shearline.studies.provenance import code_of, versions


def test_versions_are_those_that_are_installed() -> None:
    found = versions()
    assert found["python"] == platform.python_version()
    assert found["numpy"] == version("numpy")
    assert found["shearline"] == version("shearline")


def test_every_learner_has_a_digest_and_learners_of_one_package_share_it() -> None:
    codes = {name: code_of(name) for name in LEARNERS}
    assert all(len(code) == 12 for code in codes.values())
    assert codes["psp"] == codes["psp-paper"]
    assert len({codes["psp"], codes["lhs"], codes["random"]}) == 3
    assert code_of("best") in codes.values()
